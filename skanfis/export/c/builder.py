"""Rules as a part of a larger C function: for code that writes C around them, as skanfis.gyro does.

What surrounds the rules is written in the same :class:`Dialect`, under the same status word, with
the same header and self-test; :func:`skanfis.export.export_c` is made of the same parts.
"""

from .._numbers import Numbers
from ._arguments import LONGEST_NAME, check_arguments, read_limits, write_files
from ._cost import CCost
from ._dialect import Dialect, comment, index_type, literals
from ._header import cost_lines, header_of, input_lines, policy_line
from ._self_test import ROWS, TOLERANCE, self_test, size_of_sum
from ._source import Source
from ._templates import FINITE_INPUT, rejection
from .status import STATUS

__all__ = [
    "FINITE_INPUT",
    "LONGEST_NAME",
    "ROWS",
    "STATUS",
    "TOLERANCE",
    "CCost",
    "Dialect",
    "RulesPart",
    "check_arguments",
    "comment",
    "cost_lines",
    "header_of",
    "index_type",
    "input_lines",
    "literals",
    "policy_line",
    "rejection",
    "self_test",
    "size_of_sum",
    "write_files",
]


class RulesPart:
    """The rules of a model as static functions of a larger C file, which share its status word.

    The file calls ``int NAME_predict(const REAL x[], REAL y[])``, where NAME is :attr:`name`.

    Parameters
    ----------
    model : TSKModel
        What :func:`skanfis.export.fold` gives.
    dialect : Dialect
        Of the file.
    suffix : str
        What the identifiers of the rules have after the prefix of the file, such as "_r".
    min_coverage : float or None
        Rows are uncovered where the coverage is below this. None leaves coverage out; it is left
        out too where the rules have never seen data.
    saturate : Bounds or array-like of shape (n_outputs, 2), default=None
        Limits between which the outputs of the rules are held.

    Attributes
    ----------
    name : str
        What the identifiers of the rules start with.
    model : TSKModel
        The model as its rounded numbers hold it, for answers to compare the C code with.
    low, high : ndarray of shape (n_inputs,)
        The box of the training data, in the type of the file.
    min_coverage : float or None
    limits : ndarray of shape (n_outputs, 2) or None
        ``saturate`` in the type of the file.
    cost : CCost
        Of the rules alone.

    Raises
    ------
    ValueError
        If the type cannot hold the numbers of the model.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import fold
    >>> from skanfis.export.c.builder import Dialect, RulesPart
    >>> model = fold(ANFISRegressor(n_mfs=4).fit(*make_jang_sinc()))
    >>> part = RulesPart(model, Dialect("plant", "double", "c99"), "_r", None)
    >>> "static int plant_r_predict(" in part.text()
    True
    """

    def __init__(self, model, dialect: Dialect, suffix: str, min_coverage, saturate=None) -> None:
        numbers = Numbers.of(model, dialect.dtype)
        self.name = dialect.name + suffix
        self.min_coverage = None if model.support is None else min_coverage
        self.limits = read_limits(saturate, numbers)
        self.model, self.low, self.high = numbers.model, numbers.low, numbers.high
        own = Dialect(self.name, dialect.real, dialect.std)
        given = (numbers, own, model.out_of_bounds, self.min_coverage, self.limits)
        self._source = Source(*given, is_part=True)
        self._outer = dialect.name.upper()
        self.cost = self._source.cost

    def text(self) -> str:
        """The C code, for after the lines that include other files."""
        prefix = self.name.upper()
        sizes = {"N_INPUTS": self.model.n_inputs, "N_OUTPUTS": self.model.n_outputs}
        macros = [f"#define {prefix}_{key} {value}\n" for key, value in sizes.items()]
        macros += [f"#define {prefix}_{key} {self._outer}_{key}\n" for key in STATUS]
        return f"\n/* Of the rules. */\n{''.join(macros)}\n{self._source.body()}"
