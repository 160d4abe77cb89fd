"""Names from files and tables, made safe for pictures and terminals."""

import re
from textwrap import TextWrapper, fill

from ..digits import counted

# A sentence names this many things at most, and counts the others.
MOST_NAMED = 5
# Joiners, which some scripts need, and blanks between numbers and units.
_SHOWN = "\u200c\u200d\u00a0\u202f"
# Inputs that a title names; letters in a line of a title, which is also the most that a picture
# shows of a name, and of a label along an axis.
_MOST_HELD, _LETTERS, _LETTERS_ON_AXIS = 4, 60, 20


class _OfColumns(TextWrapper):
    """Breaks the lines of a column's name after its underscores too."""

    wordsep_re = re.compile(r"(\s+|\S*?(?:_+|\w-))")


def printable(text):
    """The text with invisible signs escaped: control signs, lone surrogates, line ends."""
    return "".join(
        sign if sign.isprintable() or sign in _SHOWN else ascii(sign)[1:-1] for sign in str(text)
    )


def in_one_line(text):
    """The text in one line: line ends become blanks, other invisible signs are escaped."""
    return printable(" ".join(text.splitlines()))


def _short(name):
    """The beginning and the end of a long name: either may tell it from others."""
    text, half = printable(name), _LETTERS // 2
    return text if len(text) <= _LETTERS else f"{text[: half - 1]}…{text[-half:]}"


def as_label(name):
    """A name for matplotlib, which would read text between dollars as mathematics."""
    return _short(name).replace("$", r"\$")


def on_axis(name):
    """A name for an axis, in lines that fit a small panel."""
    return "\n".join(map(as_label, _OfColumns(_LETTERS_ON_AXIS).wrap(_short(name))))


def title_of(held, *notes):
    """The title of a picture: the first inputs that are held with their values, then notes."""
    told = {k: as_label(v) if isinstance(v, str) else f"{v + 0.0:.12g}" for k, v in held.items()}
    values = [f"{as_label(name)} = {value}" for name, value in told.items()]
    more = len(values) - _MOST_HELD
    others = [f"{counted(more, 'more input')} held"] if more > 0 else []
    return fill("; ".join([*values[:_MOST_HELD], *others, *notes]), _LETTERS)
