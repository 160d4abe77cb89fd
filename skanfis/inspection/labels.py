"""Names from files and tables, made safe for pictures and terminals."""

from textwrap import fill, wrap

from ..digits import counted

# Joiners, which some scripts need, and blanks between numbers and units.
_SHOWN = "\u200c\u200d\u00a0\u202f"
# Inputs that a title names; letters in a line of a title, and of a label along an axis.
_MOST_HELD, _LETTERS, _LETTERS_ON_AXIS = 4, 60, 20


def printable(text):
    """The text with invisible signs escaped: control signs, lone surrogates, line ends."""
    return "".join(
        sign if sign.isprintable() or sign in _SHOWN else ascii(sign)[1:-1] for sign in str(text)
    )


def as_label(name):
    """A name for matplotlib, which would read text between dollars as mathematics."""
    return printable(name).replace("$", r"\$")


def on_axis(name):
    """A name for an axis, in lines that fit a small panel."""
    return "\n".join(map(as_label, wrap(printable(name), _LETTERS_ON_AXIS)))


def title_of(held, *notes):
    """The title of a picture: the first inputs that are held with their values, then notes."""
    told = {k: as_label(v) if isinstance(v, str) else f"{v:.12g}" for k, v in held.items()}
    values = [f"{as_label(name)} = {value}" for name, value in told.items()]
    more = len(values) - _MOST_HELD
    others = [f"{counted(more, 'more input')} held"] if more > 0 else []
    return fill("; ".join([*values[:_MOST_HELD], *others, *notes]), _LETTERS)
