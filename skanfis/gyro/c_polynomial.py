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

_PRODUCT = """
/* The product of powers of z; of a derivative one power is less by one. */
static $real $name_product(const $real *z, const unsigned char *power, int lowered)
{
    $real product = 1.0R;
    int i, k;
    for (i = 0; i < $NAME_N_INPUTS; ++i) {
        for (k = (i == lowered) ? 1 : 0; k < (int)power[i]; ++k) {
            product *= z[i];
        }
    }
    return product;
}

int $name_predict(const $real x[$NAME_N_INPUTS], $real y[$NAME_N_OUTPUTS])
{
    $real z[$NAME_N_INPUTS], way[$NAME_N_INPUTS], left[1], sum = 0.0R;
    int i, k, status;

"""
_PREDICT = """    }
    status = $rules_predict(x, left);
    if ((status & $NAME_NO_OUTPUT) != 0) {
        return $NAME_REJECT(y, status);
    }

    /* The nearest point of the box, and the way beyond it that the tangent is followed. */
    for (i = 0; i < $NAME_N_INPUTS; ++i) {
        $real nearest = x[i];
        if (nearest < $name_low[i]) {
            nearest = $name_low[i];
        }
        if (nearest > $name_high[i]) {
            nearest = $name_high[i];
        }
        way[i] = x[i] - nearest;
        if (way[i] < -$name_reach[i]) {
            way[i] = -$name_reach[i];
        }
        if (way[i] > $name_reach[i]) {
            way[i] = $name_reach[i];
        }
        way[i] /= $name_scale[i];
        z[i] = (nearest - $name_center[i]) / $name_scale[i];
    }

    for (k = 0; k < $n_terms; ++k) {
        $real term = $name_product(z, $name_powers[k], -1);
        for (i = 0; i < $NAME_N_INPUTS; ++i) {
            if ($name_powers[k][i] > 0 && (way[i] < 0.0R || way[i] > 0.0R)) {
                term += way[i] * ($real)$name_powers[k][i]
                    * $name_product(z, $name_powers[k], i);
            }
        }
        sum += $name_coefficients[k] * term;
    }
$limits    y[0] = sum;
    return status;
}
"""
_LIMITS = """    if (sum < $least) {
        sum = $least;
    }
    if (sum > $most) {
        sum = $most;
    }
"""


def export_c_polynomial(
    polynomial,
    path=None,
    *,
    name=None,
    dtype="double",
    std="c99",
    min_coverage=0.1,
    saturate=None,
    units=None,
    notes=(),
):
    """The C code of a FrozenPolynomial; arguments as of :func:`skanfis.export.export_c`.

    ``units`` of the inputs by name, and ``notes``, sentences, are for the header.
    """
    longest = LONGEST_NAME - len(_SUFFIX)
    stem, name = check_arguments(path, name, dtype, std, min_coverage, longest)
    dialect = Dialect(name, dtype, std)
    part = RulesPart(polynomial.rule.model, dialect, _SUFFIX, min_coverage)
    model, kind = part.model, dialect.dtype
    reach = model.max_extrapolation * model.spread * (model.out_of_bounds == "linear")
    tables = {"low": part.low, "high": part.high, "reach": reach, "center": polynomial.center}
    tables |= {"scale": polynomial.scale, "coefficients": polynomial.coefficients}
    tables = {key: np.asarray(values, dtype=kind) for key, values in tables.items()}
    n_terms, n_inputs = polynomial.powers.shape
    limits = None if saturate is None else np.ravel(saturate).astype(kind)
    words = {"rules": name + _SUFFIX, "n_terms": n_terms}
    if limits is not None:
        words |= dict(zip(("least", "most"), map(dialect.number, limits), strict=True))
    body = _PRODUCT + FINITE_INPUT.strip("\n") + "\n" + _PREDICT
    body = body.replace("$limits", "" if limits is None else _LIMITS)
    silent = model.out_of_bounds if model.out_of_bounds in SILENT else None
    code = "".join(
        [
            f'#include "{stem}.h"\n\n#include <float.h>\n#include <math.h>\n',
            part.text(),
            "\n/* Of the polynomial: coefficients times powers of (x - center) / scale. */\n",
            *(f"{dialect.table(key, values)}\n" for key, values in tables.items()),
            dialect.table("powers", polynomial.powers.astype(int), "unsigned char"),
            dialect.write(rejection(silent, std)),
            dialect.write(body, **words),
            self_test(_known_answers(polynomial, part, kind, limits), dialect),
        ]
    )
    powers = polynomial.powers
    price = replace(
        part.cost,
        multiply_adds=part.cost.multiply_adds + int(polynomial.powers.sum()) + n_terms,
        divisions=part.cost.divisions + 2 * n_inputs,
        table_bytes=part.cost.table_bytes
        + sum(values.nbytes for values in tables.values())
        + polynomial.powers.size,
        stack_bytes=part.cost.stack_bytes + (2 * n_inputs + 1) * kind.itemsize,
    )
    lines = [
        *map(remark, notes),
        f"A polynomial of degree {polynomial.powers.sum(axis=1).max()} with {n_terms} terms; "
        f"{std.upper()}, {dtype}.",
        *cost_lines(price),
        "",
        *input_lines(model.input_names, part.low, part.high, units),
        "",
        policy_line(model, "Outside this range"),
        "A row that is not finite gets no output either way.",
    ]
    if part.min_coverage is not None:
        lines.append(f"A row is uncovered where its coverage is below {part.min_coverage:g}.")
    if limits is not None:
        lines.append(f"The output is held between {limits[0]:.9g} and {limits[1]:.9g}.")
    header = header_of("A polynomial", lines, dialect, n_inputs, 1)
    written = CCode(name, header, code, price)
    write_files(written, path)
    return written


def _known_answers(polynomial, part, kind, limits):
    """Rows, outputs, status and tolerance: rows and status of the rule alone."""
    model = polynomial.rule.model
    numbers = SimpleNamespace(
        model=part.model, dtype=kind, low=part.low, high=part.high, reference=model.reference
    )
    X, _, status, _ = known_answers(numbers, part.min_coverage)
    policy = "clip" if model.out_of_bounds in SILENT else model.out_of_bounds
    rule = replace(polynomial.rule, model=part.model.with_out_of_bounds(policy))
    y = replace(polynomial, rule=rule).predict(X)
    y = y if limits is None else np.clip(y, *limits.astype(float))
    y[status & STATUS["NO_OUTPUT"] != 0] = 0.0
    # What is summed, at most; rounding of an input far from zero moves it too.
    ends = np.stack([model.minimum, model.maximum])
    widest = 2.0 + np.abs(ends - polynomial.center).max(axis=0) / polynomial.scale
    size = np.prod(widest**polynomial.powers, axis=1) @ np.abs(polynomial.coefficients)
    far = 1.0 + (np.abs(ends) / polynomial.scale).max()
    tolerance = np.array([TOLERANCE[kind] * far * size])
    return X, y[:, None].astype(kind), status, tolerance.astype(kind)
