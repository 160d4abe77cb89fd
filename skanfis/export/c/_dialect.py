"""The dialect of C that a file is written in: its type, its standard, its functions."""

import re
from dataclasses import dataclass

import numpy as np

from .._constants import FLOOR, SMALLEST_LOG_SQUARE
from ._text import literal

__all__ = ["DTYPES", "STANDARDS", "Dialect"]

DTYPES = {"double": np.dtype(np.float64), "float": np.dtype(np.float32)}
STANDARDS = ("c99", "c89")
_NUMBER_IN_TEMPLATE = re.compile(r"(\d+\.\d+)R\b")


@dataclass(frozen=True)
class Dialect:
    """Turns templates into C.

    A number that ends in R becomes a constant of the type, ``$name`` the prefix of identifiers,
    ``$NAME`` that of macros, ``$real`` the type, ``$EXP``, ``$LOG``, ``$SQRT`` and ``$ASIN`` its
    functions, ``$MAX`` its largest number; further words are given to :meth:`write`.
    """

    name: str
    real: str
    std: str

    @property
    def dtype(self):
        """NumPy's name of the type."""
        return DTYPES[self.real]

    def number(self, value):
        """A constant of the type."""
        return literal(self.dtype.type(value))

    def write(self, template, **words):
        """The template with everything filled in."""
        words = {
            "floor": self.number(FLOOR),
            "log_floor": self.number(np.log(FLOOR)),
            "smallest_log_square": self.number(SMALLEST_LOG_SQUARE),
            "name": self.name,
            "NAME": self.name.upper(),
            "real": self.real,
            "EXP": f"{self.name.upper()}_EXP",
            "LOG": f"{self.name.upper()}_LOG",
            "SQRT": f"{self.name.upper()}_SQRT",
            "ASIN": f"{self.name.upper()}_ASIN",
            "MAX": "FLT_MAX" if self.real == "float" else "DBL_MAX",
            **words,
        }
        longest_first = "|".join(sorted(words, key=len, reverse=True))
        text = _NUMBER_IN_TEMPLATE.sub(lambda found: self.number(float(found[1])), template)
        return re.sub(rf"\$({longest_first})", lambda found: str(words[found[1]]), text)

    def functions(self):
        """Macros for the functions of <math.h>; C89 has them for double alone."""
        lines = []
        for function in ("exp", "log", "sqrt", "asin"):
            macro = f"#define {self.name.upper()}_{function.upper()}(u)"
            if self.real == "double":
                lines.append(f"{macro} {function}(u)")
            elif self.std == "c99":
                lines.append(f"{macro} {function}f(u)")
            else:
                lines.append(f"{macro} ((float){function}((double)(u)))")
        return "\n".join(lines)
