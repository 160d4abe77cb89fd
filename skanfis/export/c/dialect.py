"""C syntax for a standard and a number type: constants, tables, names and the status word."""

import re
import textwrap
from dataclasses import dataclass
from numbers import Real
from pathlib import Path

import numpy as np

from ..._validation import check_choice
from .._numbers import rounded_within

_DTYPES = {"double": np.dtype(np.float64), "float": np.dtype(np.float32)}
_INTEGERS = {"int_least16_t": np.dtype(np.int16), "int_least32_t": np.dtype(np.int32)}
_STANDARDS = ("c99", "c89")
# C99 tells identifiers apart by 31 characters, of which our longest suffix takes some.
LONGEST_NAME = 31 - len("_SELF_TEST_MAIN")
_FUNCTIONS = ("exp", "log", "sqrt", "asin")
_NUMBER_IN_TEMPLATE = re.compile(r"(\d+\.\d+)R\b")
# Decimal digits that give back the very same float or double.
_DIGITS = {np.dtype(np.float32): 9, np.dtype(np.float64): 17}
# Unsigned types for positions, and their sizes in bytes on nearly all machines.
_INDEX_BYTES = {"unsigned char": 1, "unsigned short": 2, "unsigned long": 8}
_BITS = {
    "IN_RANGE": (0, ""),
    "OUT_OF_RANGE": (1, " /* an input lies outside the range of the training data */"),
    "NOT_FINITE": (2, " /* an input is infinite or not a number */"),
    "UNCOVERED": (4, " /* hardly any training data lie near the inputs */"),
    "NO_OUTPUT": (8, " /* y holds no answer */"),
}
# Bits of the status word, also for Python code that flags rows as generated C does.
STATUS = {name: bit for name, (bit, _) in _BITS.items()}


def status_word(is_out, is_silent, is_uncovered):
    """The status of finite rows; a row without an answer is not flagged as uncovered."""
    return (
        STATUS["OUT_OF_RANGE"] * is_out
        | STATUS["UNCOVERED"] * (~is_silent & is_uncovered)
        | STATUS["NO_OUTPUT"] * is_silent
    )


@dataclass(frozen=True)
class Dialect:
    """Fills templates with names, types and constants of C.

    A number that ends in R becomes a constant of the type. ``$name`` is the prefix of identifiers,
    ``$NAME`` of macros; ``$real`` the type, ``$EXP`` a function, ``$MAX`` the largest number of it.
    """

    name: str
    real: str
    std: str

    @property
    def dtype(self):
        """The NumPy dtype of the type."""
        return (_DTYPES | _INTEGERS)[self.real]

    def number(self, value):
        """A constant of the type."""
        number = self.dtype.type(value)
        return _literal(number) if self.dtype.kind == "f" else str(number)

    def write(self, template, **words):
        """The template with everything filled in."""
        prefix = self.name.upper()
        words = {
            "name": self.name,
            "NAME": prefix,
            "real": self.real,
            "MAX": "FLT_MAX" if self.real == "float" else "DBL_MAX",
            **{name.upper(): f"{prefix}_{name.upper()}" for name in _FUNCTIONS},
            **words,
        }
        longest_first = "|".join(sorted(words, key=len, reverse=True))
        text = _NUMBER_IN_TEMPLATE.sub(lambda found: self.number(float(found[1])), template)
        return re.sub(rf"\$({longest_first})", lambda found: str(words[found[1]]), text)

    def functions(self):
        """Macros for the functions of <math.h>, one a line; C89 has them only for double."""
        calls = {"double": "{}(u)", "float": "{}f(u)" if self.std == "c99" else "((float){}(u))"}
        return "\n".join(
            f"#define {self.name.upper()}_{name.upper()}(u) {calls[self.real].format(name)}"
            for name in _FUNCTIONS
        )

    def table(self, name, values, kind=None):
        """A constant array of type ``kind``, by default the dialect's or one for positions."""
        kind = kind or (self.real if values.dtype == self.dtype else index_type(values))
        shape = "".join(f"[{n}]" for n in values.shape)
        head = self.write(f"static const {kind} $name_{name}{shape} =\n")
        return f"{head}{literals(values)};\n"


def status_lines() -> str:
    """Macros of a header, one for each bit; ``$NAME`` is the prefix."""
    return "\n".join(f"#define $NAME_{name} {bit}{says}" for name, (bit, says) in _BITS.items())


def kept_lines(template, facts):
    """The lines of a template whose words before the first "|" are all among ``facts``."""
    lines = [line.split("|", 1) for line in template.strip("\n").splitlines()]
    return "\n".join(text for words, text in lines if facts.issuperset(words.split()))


def index_type(values):
    """The smallest unsigned type that holds these positions on every machine."""
    largest = max(map(int, np.ravel(values)), default=0)
    return next(kind for kind, n_bytes in _INDEX_BYTES.items() if largest < 256**n_bytes)


def table_bytes(values):
    """Memory of a table, in bytes."""
    of_each = values.itemsize if values.dtype.kind == "f" else _INDEX_BYTES[index_type(values)]
    return values.size * of_each


def _literal(value):
    """A NumPy floating-point number as a C constant that reads back as the same number."""
    if not np.isfinite(value):
        raise ValueError(f"The model holds {value}, which has no C constant.")
    text = f"{value:.{_DIGITS[value.dtype]}g}"
    if not set(text) & set(".e"):
        text += ".0"
    return text + ("f" if value.dtype == np.float32 else "")


def literals(values, indent=""):
    """Nested braces for an array of numbers of any kind and dimension."""
    if values.ndim == 2 and len(values) == 1:
        return f"{indent}{{ {literals(values[0])} }}"
    if values.ndim > 1:
        inner = ",\n".join(literals(part, indent + "    ") for part in values)
        return f"{indent}{{\n{inner}\n{indent}}}"
    write = _literal if values.dtype.kind == "f" else str
    text = f"{{ {', '.join(map(write, values))} }}"
    return textwrap.fill(
        text, 95, initial_indent=indent, subsequent_indent=f"{indent}  ", break_on_hyphens=False
    )


def remark(text):
    """A text for a comment that cannot end it, continue a line or make a trigraph."""
    unsafe = r"[^ -~]|\\|\?(?=\?)|\*(?=/)|(?<=/)\*"
    return re.sub(unsafe, lambda found: f"<U+{ord(found[0]):04X}>", str(text))


def check_arguments(path, name, dtype, std, min_coverage, longest_name=LONGEST_NAME):
    """Check the arguments; return the files' name without suffix, and the identifiers' prefix."""
    check_choice("dtype", dtype, _DTYPES)
    check_choice("std", std, _STANDARDS)
    if min_coverage is not None and not (
        isinstance(min_coverage, Real) and 0.0 < float(min_coverage) <= 1.0
    ):
        raise ValueError(
            f"min_coverage={min_coverage!r} must be a number above 0 and at most 1, or None."
        )
    if name is None and path is None:
        raise ValueError("name=None takes the name from path, and path is None too: give either.")
    stem = None if path is None else Path(path).name
    if stem is not None and not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", stem):
        raise ValueError(
            f"path ends in {stem!r}; C can include files of letters, digits, '_', '.' and '-'."
        )
    taken = " It is from path: leave out a suffix, or give name too." if name is None else ""
    name = stem if name is None else name
    # C++ reserves names with two underscores in a row.
    is_identifier = isinstance(name, str) and re.fullmatch(r"[A-Za-z](_?[A-Za-z0-9])*", name)
    if not is_identifier or len(name) > longest_name:
        raise ValueError(
            f"name={name!r} must be a letter, then letters, digits and single underscores, at most "
            f"{longest_name} in all: a C compiler may look at 31 characters of an identifier only."
            f"{taken}"
        )
    return stem or name, name


def read_limits(saturate, numbers):
    """Limits (n_outputs, 2) in the type of the code, rounded inwards; or None."""
    if saturate is None:
        return None
    if hasattr(saturate, "lower"):
        saturate = np.stack([saturate.lower, saturate.upper], axis=-1).tolist()
    try:
        given = np.array(saturate, dtype=float)
    except (TypeError, ValueError):
        given = np.empty(0)
    n_outputs = numbers.model.n_outputs
    if given.shape == (n_outputs, 2) and (given[:, 0] < given[:, 1]).all():
        limits = rounded_within(given.T, numbers.dtype).T
        if np.isfinite([given, limits]).all() and (limits[:, 0] <= limits[:, 1]).all():
            return limits
    raise ValueError(
        f"saturate={saturate!r} must have finite (low, high), with low below high and with a "
        f"number of {numbers.dtype} between them, for each of the {n_outputs} outputs; or be what "
        "skanfis.bounds.bounds returns for this model."
    )


def write_files(code, path):
    """Write a CCode as .h and .c files; nothing if ``path`` is None."""
    if path is None:
        return
    folder, stem = Path(path).parent, Path(path).name
    (folder / f"{stem}.h").write_text(code.header, encoding="ascii", newline="\n")
    (folder / f"{stem}.c").write_text(code.source, encoding="ascii", newline="\n")
