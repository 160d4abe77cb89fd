"""Rules as a part of a larger C function: for code that writes C around them, as skanfis.gyro does.

What surrounds the rules is written in the same :class:`Dialect`, under the same status word.
"""

from .._numbers import Numbers
from ._dialect import (
    LONGEST_NAME,
    Dialect,
    check_arguments,
    comment,
    index_type,
    literals,
    read_limits,
    write_files,
)
from ._header import cost_lines, header_of, input_lines, policy_line
from ._self_test import ROWS, TOLERANCE, self_test, size_of_sum
from ._source import CCost, Source
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

    The file calls ``int NAME_predict(const REAL x[], REAL y[])``, where NAME is :attr:`name`: the
    prefix of the file and ``suffix``. ``min_coverage`` and ``saturate`` are those of
    :func:`skanfis.export.export_c`. ``model``, ``low``, ``high`` and ``limits`` are the model, its
    box and ``saturate`` in the type of the file.
    """

    def __init__(self, model, dialect: Dialect, suffix: str, min_coverage, saturate=None) -> None:
        numbers = Numbers.of(model, dialect.dtype)
        self.name = dialect.name + suffix
        self.min_coverage = None if model.support is None else min_coverage
        self.limits = read_limits(saturate, numbers)
        self.model, self.low, self.high = numbers.model, numbers.low, numbers.high
        own = Dialect(self.name, dialect.real, dialect.std)
        given = (numbers, own, model.out_of_bounds, self.min_coverage, self.limits)
        self._source, self._outer = Source(*given, is_part=True), dialect.name.upper()
        self.cost = self._source.cost()

    def text(self) -> str:
        """The C code, for after the lines that include other files."""
        prefix = self.name.upper()
        sizes = {"N_INPUTS": self.model.n_inputs, "N_OUTPUTS": self.model.n_outputs}
        macros = [f"#define {prefix}_{key} {value}\n" for key, value in sizes.items()]
        macros += [f"#define {prefix}_{key} {self._outer}_{key}\n" for key in STATUS]
        return f"\n/* Of the rules. */\n{''.join(macros)}\n{self._source.body()}"
