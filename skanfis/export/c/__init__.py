"""A trained model as one C function over constant tables."""

from dataclasses import dataclass
from os import PathLike
from typing import Any

from .._numbers import Numbers
from ..folding import fold
from ._arguments import check_arguments, read_limits, write_files
from ._cost import CCost
from ._dialect import Dialect
from ._header import header
from ._self_test import known_answers, self_test
from ._source import Source

__all__ = ["CCode", "CCost", "export_c"]


@dataclass(frozen=True)
class CCode:
    """A header and a source file, and what the function in them costs.

    Parameters
    ----------
    name : str
        What all identifiers start with.
    header, source : str
        The text of the two files, in ASCII.
    cost : CCost
        Arithmetic per evaluation, and memory.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import export_c
    >>> code = export_c(ANFISRegressor(n_mfs=4).fit(*make_jang_sinc()), name="sinc")
    >>> '#include "sinc.h"' in code.source
    True
    """

    name: str
    header: str
    source: str
    cost: CCost


def export_c(
    estimator: Any,
    path: str | PathLike[str] | None = None,
    *,
    name: str | None = None,
    dtype: str = "double",
    std: str = "c99",
    min_coverage: float | None = 0.1,
    saturate: Any = None,
) -> CCode:
    """Write a trained model as C: one header and one source file.

    The function ``int NAME_predict(const double x[], double y[])`` evaluates the model at one row
    of raw inputs and returns a status. It uses constant tables and the functions ``exp`` and
    ``log``, and for the coverage ``sqrt``: no heap, no state, no recursion, loops of bounded
    length. Scalers of a pipeline are folded in.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        An ANFIS estimator, or a Pipeline of scalers that ends in one, a TransformedTargetRegressor
        or a search over these. What it does with rows outside the training data is what the
        function does: see Notes.
    path : str or path-like, default=None
        Where to write, without a suffix: "out/gyro" makes out/gyro.h and out/gyro.c. None writes
        nothing.
    name : str, default=None
        What all identifiers start with, at most 16 letters, digits and underscores. None takes the
        last part of ``path``.
    dtype : {"double", "float"}, default="double"
        Type of inputs, outputs, tables and arithmetic.
    std : {"c99", "c89"}, default="c99"
        The oldest standard that a compiler must know. "c89" is for compilers of old signal
        processors; it does without ``expf``.
    min_coverage : float or None, default=0.1
        Rows are uncovered where ``estimator.coverage`` is below this, above 0 and at most 1. None
        leaves that out of status, code and tables, most of which it may take: the support of a rule
        is 2 + n + n (n + 1) / 2 numbers for n inputs. It is left out too where the rules have never
        seen data, as those read from a .fis file.
    saturate : Bounds or array-like of shape (n_outputs, 2), default=None
        Limits between which every output is held, low and high: those that
        :func:`skanfis.bounds.bounds` has proven for the box that is specified, or others. Within
        proven limits nothing changes, until an input beyond the box, or a fault of the hardware,
        would give more. None holds nothing.

    Returns
    -------
    code : CCode
        The text of both files, and the cost of an evaluation.

    Raises
    ------
    ValueError
        If a parameter is none of the above, if ``estimator`` has a step that cannot be folded in,
        or if the model's numbers go beyond what "float" holds.

    Notes
    -----
    The status is a sum of bits: ``NAME_OUT_OF_RANGE`` (1), ``NAME_NOT_FINITE`` (2),
    ``NAME_UNCOVERED`` (4), ``NAME_NO_OUTPUT`` (8); zero says that all is well. A row outside the
    range of the training data is answered by ``out_of_bounds`` of the estimator. "clip" and
    "linear" give an answer, the latter within ``max_extrapolation`` of the estimator. "raise"
    leaves y as it is, so that a controller which keeps y holds its last value. "nan" writes NaN, or
    in C89, which has none, leaves y as it is. A row that is not finite gets no answer under any
    policy.

    With the macro ``NAME_SELF_TEST`` defined, ``int NAME_self_test(void)`` compares the function
    with what Python predicts, and returns zero if all is well; with ``NAME_SELF_TEST_MAIN`` too,
    the file is a program that exits with zero then.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import export_c
    >>> model = ANFISRegressor(n_mfs=4).fit(*make_jang_sinc())
    >>> code = export_c(model, name="sinc", dtype="float", std="c89")
    >>> "int sinc_predict(const float x[SINC_N_INPUTS], float y[SINC_N_OUTPUTS]);" in code.header
    True
    >>> code.cost.exponentials, code.cost.multiply_adds
    (8, 88)
    """
    stem, name = check_arguments(path, name, dtype, std, min_coverage)
    model = fold(estimator)
    if model.support is None:
        # Rules that come from elsewhere: no data to be near to or far from.
        min_coverage = None
    dialect = Dialect(name, dtype, std)
    numbers = Numbers.of(model, dialect.dtype)
    limits = read_limits(saturate, numbers)
    source = Source(numbers, dialect, model.out_of_bounds, min_coverage, limits)
    test = self_test(known_answers(numbers, min_coverage, limits), dialect)
    code = CCode(
        name,
        header(model, numbers, dialect, source.cost, min_coverage, limits),
        source.text(f"{stem}.h") + test,
        source.cost,
    )
    write_files(code, path)
    return code
