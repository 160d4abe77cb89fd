"""Names from files and tables, as pictures and terminals may show them."""

import unicodedata
from textwrap import fill, wrap

from .text import counted

# Categories of what no reader sees; and joiners, without which some scripts are not written.
_HIDDEN = ("Cc", "Cf", "Cn", "Co", "Cs", "Zl", "Zp")
_JOINERS = "\u200c\u200d"
# Inputs that a title names; letters in a line of a title, and of a label along an axis.
_MOST_HELD, _LETTERS, _LETTERS_ON_AXIS = 4, 60, 20


def printable(text):
    """The text with escapes for what no reader sees: control signs, lone surrogates, line ends."""
    return "".join(
        sign.encode("unicode_escape").decode("ascii")
        if unicodedata.category(sign) in _HIDDEN and sign not in _JOINERS
        else sign
        for sign in str(text)
    )


def as_label(name):
    """A name for matplotlib, which takes what stands between dollars for mathematics."""
    return printable(name).replace("$", r"\$")


def on_axis(name):
    """The same along an axis, in lines that a small panel has room for."""
    return "\n".join(map(as_label, wrap(printable(name), _LETTERS_ON_AXIS)))


def title_of(held, *notes):
    """The title of a picture: the first inputs that are held with their values, then notes."""
    told = {k: as_label(v) if isinstance(v, str) else f"{v:.12g}" for k, v in held.items()}
    values = [f"{as_label(name)} = {value}" for name, value in told.items()]
    more = len(values) - _MOST_HELD
    others = [f"{counted(more, 'more input')} held"] if more > 0 else []
    return fill("; ".join([*values[:_MOST_HELD], *others, *notes]), _LETTERS)
