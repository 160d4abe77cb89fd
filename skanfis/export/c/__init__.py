"""Write a trained model as one C function over constant tables.

``fold`` folds scalers in; ``_numbers`` rounds and shifts the numbers. ``source`` selects lines of
``templates`` by facts of the model; ``dialect`` fills in names, types and numbers. Helpers,
memberships and tables are written before the functions that use them, if any does. ``self_test``
and ``header`` complete the files.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

from ..folding import fold
from .dialect import Dialect, check_arguments, write_files
from .header import header
from .self_test import known_answers, self_test
from .source import CCost, Source

__all__ = ["CCode", "CCost", "export_c"]


@dataclass(frozen=True)
class CCode:
    """A header and a source file, and the cost of the function in them.

    Parameters
    ----------
    name : str
        Prefix of all identifiers.
    header, source : str
        The text of the two files, in ASCII.
    cost : CCost

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
    header: str = field(repr=False)
    source: str = field(repr=False)
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
    units: Mapping[str, str] | None = None,
    notes: Sequence[str] = (),
) -> CCode:
    """Write a trained model as C: one header and one source file.

    ``int NAME_predict(const double x[], double y[])`` evaluates the model at one row of raw inputs
    and returns a status. It reads constant tables: no heap, no state, no recursion, bounded loops.
    :doc:`/c_export` explains the status, the self-test and rows outside the training data.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`fold` takes it; scalers are folded in.
    path : str or path-like, default=None
        Where to write, without a suffix: "out/gyro" makes out/gyro.h and out/gyro.c. None writes
        nothing.
    name : str, default=None
        Prefix of all identifiers, at most 16 letters, digits and underscores. None takes the last
        part of ``path``.
    dtype : {"double", "float"}, default="double"
        Type of inputs, outputs, tables and arithmetic.
    std : {"c99", "c89"}, default="c99"
        The oldest standard that a compiler must know.
    min_coverage : float or None, default=0.1
        Rows are flagged as uncovered if ``estimator.coverage`` is below this, above 0 and at most
        1. None leaves this flag out, as do rules that have never seen data.
    saturate : Bounds or array-like of shape (n_outputs, 2), default=None
        Limits between which every output is held, such as :func:`skanfis.bounds.bounds` proves.
    units : mapping of str to str, default=None
        Units of inputs and outputs by name, such as {"temperature": "degC"}, for the header.
    notes : sequence of str, default=()
        Paragraphs for the first comment of the header: how an input is made, what the output is.

    Returns
    -------
    code : CCode
        The text of both files, and the largest cost of an evaluation.

    Raises
    ------
    ValueError, TypeError
        As :func:`fold`; if a parameter is none of the above, or "float" is too narrow.

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
    (26, 419)
    """
    stem, name = check_arguments(path, name, dtype, std, min_coverage)
    source = Source(fold(estimator), Dialect(name, dtype, std), min_coverage, saturate)
    included = f'#include "{stem}.h"\n\n#include <float.h>\n#include <math.h>\n\n'
    text = included + source.body() + self_test(known_answers(source), source.dialect)
    code = CCode(name, header(source, units, notes), text, source.cost)
    write_files(code, path)
    return code
