"""Names from files and tables, as pictures and terminals may show them."""

import unicodedata

# Some scripts are not written without them.
_JOINERS = "\u200c\u200d"


def printable(text):
    """The text with escapes for what no reader sees: control signs, lone surrogates, line ends."""
    return "".join(
        sign.encode("unicode_escape").decode("ascii") if _is_hidden(sign) else sign
        for sign in str(text)
    )


def as_label(name):
    """A name for matplotlib, which takes what stands between dollars for mathematics."""
    return printable(name).replace("$", r"\$")


def _is_hidden(sign):
    """Whether it is no sign that a reader sees."""
    category = unicodedata.category(sign)
    return (category[0] == "C" or category in ("Zl", "Zp")) and sign not in _JOINERS
