"""A frozen polynomial as one C function, with the flags of the single rule that goes with it.

The rule is written by ``skanfis.export`` as a static function of the same file, as beside the law.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from ..export.c import CCode
from ..export.c.builder import RulesPart, cost_lines, header_of, input_lines, policy_line
from ..export.c.dialect import (
    LONGEST_NAME,
    STATUS,
    Dialect,
    check_arguments,
    remark,
    write_files,
)
from ..export.c.self_test import TOLERANCE, known_answers, self_test
from ..export.c.templates import FINITE_INPUT, rejection
from ..policies import SILENT

_SUFFIX = "_r"

_PREDICT = """
int $name_predict(const $real x[$NAME_N_INPUTS], $real y[$NAME_N_OUTPUTS])
{
    $real z[$NAME_N_INPUTS], sum = 0.0R;
    int i, j, k, status;

$finite_input
    }
    status = $rules_predict(x, y);
    if ((status & $NAME_NO_OUTPUT) != 0) {
        return $NAME_REJECT(y, status);
    }
    for (i = 0; i < $NAME_N_INPUTS; ++i) {
        /* Of the nearest point of the box. */
        z[i] = x[i] < $name_low[i] ? $name_low[i] : x[i];
        z[i] = z[i] > $name_high[i] ? $name_high[i] : z[i];
        z[i] = (z[i] - $name_center[i]) / $name_scale[i];
    }
    for (k = 0; k < $n_terms; ++k) {
        $real term = $name_coefficients[k];
        for (i = 0; i < $NAME_N_INPUTS; ++i) {
            for (j = 0; j < (int)$name_powers[k][i]; ++j) {
                term *= z[i];
            }
        }
        sum += term;
    }
    y[0] = sum < $least ? $least : sum;
    y[0] = y[0] > $most ? $most : y[0];
    return status;
}
"""


def export_c_polynomial(
    polynomial, path, *, std, dtype="double", min_coverage=0.1, saturate=None, units=None, notes=()
):
    """The C code of a FrozenPolynomial; arguments as of :func:`skanfis.export.export_c`."""
    longest = LONGEST_NAME - len(_SUFFIX)
    stem, name = check_arguments(path, None, dtype, std, min_coverage, longest)
    dialect = Dialect(name, dtype, std)
    part = RulesPart(polynomial.model, dialect, _SUFFIX, min_coverage)
    model, kind, powers = part.model, dialect.dtype, polynomial.powers
    tables = {key: getattr(polynomial, key) for key in ("center", "scale", "coefficients")}
    tables = {"low": part.low, "high": part.high} | tables
    tables = {key: np.asarray(values, dtype=kind) for key, values in tables.items()}
    largest = np.finfo(kind).max
    limits = np.ravel([-largest, largest] if saturate is None else saturate).astype(kind)
    words = dict(zip(("least", "most"), map(dialect.number, limits), strict=True))
    words |= {"rules": name + _SUFFIX, "n_terms": len(powers)}
    silent = model.out_of_bounds if model.out_of_bounds in SILENT else None
    code = [
        f'#include "{stem}.h"\n\n#include <float.h>\n#include <math.h>\n',
        part.text(),
        "\n/* Of the polynomial: coefficients times powers of (x - center) / scale. */\n",
        *(f"{dialect.table(key, values)}\n" for key, values in tables.items()),
        dialect.table("powers", powers.astype(int), "unsigned char"),
        dialect.write(rejection(silent, std)),
        dialect.write(_PREDICT.replace("$finite_input", FINITE_INPUT.strip("\n")), **words),
        self_test(_known_answers(polynomial, part, kind, limits), dialect),
    ]
    n_bytes = sum(values.nbytes for values in tables.values()) + powers.size
    price = replace(
        part.cost,
        multiply_adds=part.cost.multiply_adds + int(powers.sum()) + len(powers),
        divisions=part.cost.divisions + model.n_inputs,
        table_bytes=part.cost.table_bytes + n_bytes,
        stack_bytes=part.cost.stack_bytes + model.n_inputs * kind.itemsize,
    )
    lines = [
        *map(remark, notes),
        f"A polynomial of degree {powers.sum(axis=1).max()} with {len(powers)} terms; "
        f"{std.upper()}, {dtype}.",
        *cost_lines(price),
        "",
        *input_lines(model.input_names, part.low, part.high, units),
        "",
        policy_line(model, "Outside this range"),
        "A row that is not finite gets no output either way.",
        f"A row is uncovered where its coverage is below {min_coverage:g}.",
    ]
    if saturate is not None:
        lines.append(f"The output is held between {limits[0]:.9g} and {limits[1]:.9g}.")
    header = header_of("A polynomial", lines, dialect, model.n_inputs, 1)
    written = CCode(name, header, "".join(code), price)
    write_files(written, path)
    return written


def _known_answers(polynomial, part, kind, limits):
    """Rows, outputs, status and tolerance: rows and status of the rule alone."""
    model = polynomial.model
    numbers = SimpleNamespace(
        model=part.model, dtype=kind, low=part.low, high=part.high, reference=model.reference
    )
    X, _, status, _ = known_answers(numbers, part.min_coverage)
    held = replace(polynomial, model=part.model.with_out_of_bounds("clip"))
    y = np.clip(held.predict(X), *limits.astype(float))
    y[status & STATUS["NO_OUTPUT"] != 0] = 0.0
    # What is summed, at most; rounding of an input far from zero moves it too.
    ends = np.stack([model.minimum, model.maximum])
    widest = 2.0 + np.abs(ends - polynomial.center).max(axis=0) / polynomial.scale
    size = np.prod(widest**polynomial.powers, axis=1) @ np.abs(polynomial.coefficients)
    far = 1.0 + (np.abs(ends) / polynomial.scale).max()
    tolerance = np.array([TOLERANCE[kind] * far * size])
    return X, y[:, None].astype(kind), status, tolerance.astype(kind)
