"""Write the arcsine law, or a cubic, and the rules for its residual as one C function.

The rules are written by ``skanfis.export`` under the name NAME_r as a static function of the same
file; the law is written here. The requirements on exported functions hold: constant tables, no
heap, no state, the status word.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np
from scipy.stats import qmc

from .._threads import without
from ..exceptions import OutOfBoundsWarning
from ..export.c import CCode
from ..export.c.dialect import (
    LONGEST_NAME,
    Dialect,
    check_arguments,
    kept_lines,
    status_word,
    table_bytes,
    write_files,
)
from ..export.c.header import cost_lines, header_of, input_lines, policy_line
from ..export.c.self_test import ROWS, TOLERANCE, self_test, size_of_sum
from ..export.c.source import RulesPart
from ..export.c.templates import FINITE_INPUT, rejection
from ..policies import SILENT
from .compose import Polynomial, law_and_rules
from .physics import past_phase, phase_of

_SUFFIX = "_r"
LAW_GOES_ON = "the law goes on as it is"

_CODE = """
law   |static $real $name_polynomial(const $real *c, int n, $real t)
law   |{
law   |    $real sum = c[n - 1];
law   |    int i;
law   |    for (i = n - 2; i >= 0; --i) {
law   |        sum = sum * t + c[i];
law   |    }
law   |    return sum;
law   |}
law   |
      |int $name_predict(const $real x[$NAME_N_INPUTS], $real y[$NAME_N_OUTPUTS])
      |{
law   |    $real z[$n_rules_inputs], left[1], t, amplitude, sagnac, sine, phase, rate;
law   |    int i, sign = 1, status = $NAME_IN_RANGE;
cubic |    $real z[$n_rules_inputs], left[1], u[$NAME_N_INPUTS], term, rate = 0.0R;
cubic |    int i, j, k, status = $NAME_IN_RANGE;
      |
      |$finite_input
      |    }
law   |    for (i = 0; i < $n_law; ++i) {
law   |        const $real v = x[$name_law_input[i]];
law   |        if (v < $name_law_low[i] || v > $name_law_high[i]) {
law   |            status = $NAME_OUT_OF_RANGE;
law   |        }
law   |    }
law   |
law   |    /* The coil's temperature minus the reference, and the coefficients at it. */
law   |    t = $temperature;
law   |    amplitude = $name_polynomial($name_amplitude, $n_amplitude, t);
law   |    sagnac = $name_polynomial($name_sagnac, $n_sagnac, t);
law   |    if (sagnac == 0.0R) {
law   |        return $NAME_REJECT(y, $NAME_OUT_OF_RANGE);
law   |    }
law   |
law   |    /* The size of the sine and its sign; without an amplitude there is no phase. */
law   |    sine = x[$output];
law   |    sine = amplitude != 0.0R ? sine / amplitude : (sine < 0.0R ? -$MAX : $MAX);
law   |    if (sine < 0.0R) {
law   |        sine = -sine;
law   |        sign = -1;
law   |    }
law   |    if (sine > $limit) {
law   |        status = $NAME_OUT_OF_RANGE;
silent|        return $NAME_REJECT(y, status);
silent|    }
silent|    phase = $ASIN(sine);
clip  |        phase = $max_phase;
linear|        phase = $max_phase + (sine - $limit) * $slope;
answer|    } else {
answer|        phase = $ASIN(sine);
answer|    }
law   |    rate = (sign < 0 ? -phase : phase) / sagnac - $name_polynomial($name_bias, $n_bias, t);
law   |
cubic |    for (i = 0; i < $NAME_N_INPUTS; ++i) {
cubic |        /* The input, held in its range, in standard deviations from its mean. */
cubic |        u[i] = x[i] < $name_law_low[i] ? $name_law_low[i] : x[i];
cubic |        u[i] = u[i] > $name_law_high[i] ? $name_law_high[i] : u[i];
cubic |        u[i] = (u[i] - $name_center[i]) / $name_scale[i];
cubic |    }
cubic |    for (k = 0; k < $n_terms; ++k) {
cubic |        term = $name_coefficients[k];
cubic |        for (i = 0; i < $NAME_N_INPUTS; ++i) {
cubic |            for (j = 0; j < (int)$name_powers[k][i]; ++j) {
cubic |                term *= u[i];
cubic |            }
cubic |        }
cubic |        rate += term;
cubic |    }
      |    for (i = 0; i < $n_rules_inputs; ++i) {
      |        z[i] = x[$name_rules_input[i]];
      |    }
      |    status |= $rules_predict(z, left);
      |    if ((status & $NAME_NO_OUTPUT) != 0) {
      |        return $NAME_REJECT(y, status);
      |    }
      |    rate += left[0];
      |    /* Also true for NaN, which fails every comparison. */
      |    if (!(rate >= -$MAX && rate <= $MAX)) {
      |        return $NAME_REJECT(y, $NAME_OUT_OF_RANGE);
      |    }
      |    y[0] = rate;
      |    return status;
      |}
"""


def export_c_physics(
    estimator: Any,
    path: str | PathLike[str] | None = None,
    *,
    name: str | None = None,
    dtype: str = "double",
    std: str = "c99",
    min_coverage: float | None = 0.1,
    units: Mapping[str, str] | None = None,
    notes: Sequence[str] = (),
) -> CCode:
    """Write the arcsine law and the rules for its residual as C: one header, one source file.

    The function ``int NAME_predict(const double x[], double y[])`` gives the compensated rate from
    one row of raw inputs, and a status, as :func:`skanfis.export.export_c` does for rules alone.
    For rows outside the range of either part see :doc:`/gyro_physics`.

    Parameters
    ----------
    estimator : fitted ResidualRegressor
        With an :class:`OpenLoopArcsineRegressor` as base, and an ANFIS, or a Pipeline of scalers,
        column selections and an ANFIS, as residual; or a search over such. The inputs of the
        function are the columns that either part takes, in the order of X; the header names them.
    path, name, dtype, std, min_coverage
        As of :func:`skanfis.export.export_c`; ``name`` has at most 14 characters.
    units, notes
        As of :func:`skanfis.export.export_c`; the output is called "rate".

    Returns
    -------
    code : CCode
        The text of both files, and the largest cost of an evaluation, apart from one arcsine.

    Raises
    ------
    ValueError
        If a parameter is none of the above, if the residual model has a step that cannot be folded
        in, or if the numbers go beyond what "float" holds.
    TypeError
        If ``estimator`` is no such composition.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_ofog
    >>> from skanfis.gyro import OpenLoopArcsineRegressor, ResidualRegressor, export_c_physics
    >>> log = make_ofog(n_devices=1, n_runs=4, random_state=0)
    >>> law = OpenLoopArcsineRegressor("output", "temperature")
    >>> model = ResidualRegressor(law, ANFISRegressor(n_mfs=2))
    >>> model = model.fit(log[["output", "temperature", "time"]], log["rate"])
    >>> code = export_c_physics(model, name="gyro", dtype="float")
    >>> "int gyro_predict(const float x[GYRO_N_INPUTS], float y[GYRO_N_OUTPUTS]);" in code.header
    True
    """
    longest = LONGEST_NAME - len(_SUFFIX)
    stem, name = check_arguments(path, name, dtype, std, min_coverage, longest)
    law, rules = law_and_rules(estimator)
    dialect = Dialect(name, dtype, std)
    part = RulesPart(rules.model, dialect, _SUFFIX, min_coverage)
    whole = _Composition(law, rules, part, dialect.dtype)
    policies = rules.model.out_of_bounds, law.out_of_bounds
    silent = next((policy for policy in policies if policy in SILENT), None)
    code = f'#include "{stem}.h"\n\n#include <float.h>\n#include <math.h>\n{part.text()}\n'
    code += _source_of(dialect, whole, silent) + self_test(_known_answers(whole), dialect)
    price = _cost(whole)
    written = CCode(name, _header(whole, dialect, price, units, notes), code, price)
    write_files(written, path)
    return written


class _Composition:
    """Law and rules on the inputs of the C function, ``names``; the law may be a Polynomial.

    Rounded to the C type are the law's range, the model of the rules, ``reference`` and ``tables``;
    the law's own coefficients are not. ``arrays`` are all arrays of the law in C.
    """

    def __init__(self, law, rules, part, dtype):
        self.part, self.dtype = part, dtype
        columns = np.union1d(law.columns_, rules.positions)
        given = getattr(law, "feature_names_in_", None)
        self.names = [f"x{j}" if given is None else given[j] for j in columns]
        positions = np.searchsorted(columns, rules.positions)
        self.rules = replace(rules, model=part.model, positions=positions)
        self.law, self.is_cubic = copy(law), isinstance(law, Polynomial)
        own = vars(self.law)
        # The copy takes rows of these columns without names, and gives NaN for no answer.
        own.pop("feature_names_in_", None)
        own |= {key: self.rounded(own[key]) for key in ("minimum_", "maximum_")}
        keys = {key: key for key in ("center", "scale", "coefficients")}
        if not self.is_cubic:
            own |= {"columns_": np.searchsorted(columns, law.columns_)}
            own |= {"n_features_in_": columns.size, "out_of_bounds": _said(law)}
            self.reference = self.rounded(law.reference_temperature_)
            keys = {"amplitude": "amplitude_", "sagnac": "sagnac_factor_", "bias": "bias_"}
        self.tables = {key: self.rounded(own[name]) for key, name in keys.items()}
        self.arrays = {"law_low": own["minimum_"], "law_high": own["maximum_"], **self.tables}
        self.arrays |= {"powers": law.powers} if self.is_cubic else {"law_input": own["columns_"]}
        self.arrays |= {"rules_input": positions}

    def rounded(self, values):
        values = np.asarray(values, dtype=float)
        largest = np.abs(values).max()
        if not largest <= float(np.finfo(self.dtype).max):
            raise ValueError(
                f"Single precision cannot hold {largest:g}, a constant of what the rules are added "
                "to. Scale the output, or export in double precision."
            )
        return values.astype(self.dtype)

    @property
    def box(self):
        """The range of every input that both parts know."""
        low, high = np.full((2, len(self.names)), [[-np.inf], [np.inf]])
        for places, least, most in (
            (self.law.columns_, self.law.minimum_, self.law.maximum_),
            (self.rules.positions, self.part.low, self.part.high),
        ):
            low[places] = np.maximum(low[places], least)
            high[places] = np.minimum(high[places], most)
        return low, high


def _source_of(dialect, whole, silent):
    """Tables and functions of the law; ``silent`` is the policy of rows without an answer."""
    law, n_rules_inputs = whole.law, whole.rules.positions.size
    words: dict[str, Any] = {"rules": dialect.name + _SUFFIX, "n_rules_inputs": n_rules_inputs}
    if whole.is_cubic:
        facts, asin = {"cubic"}, ""
        words |= {"n_terms": len(law.powers)}
    else:
        policy, inputs, number = law.out_of_bounds, law.columns_, dialect.number
        facts = {"law", *(["silent"] if policy in SILENT else ["answer", policy])}
        words |= {f"n_{key}": values.size for key, values in whole.tables.items()}
        words |= {"n_law": inputs.size, "output": inputs[0], "temperature": number(0.0)}
        if inputs.size > 1:
            lag = f" + {number(law.thermometer_lag_)} * x[{inputs[2]}]" if inputs.size > 2 else ""
            words["temperature"] = f"x[{inputs[1]}]{lag} - {number(whole.reference)}"
        words |= {"limit": number(np.sin(law.max_phase)), "max_phase": number(law.max_phase)}
        words |= {"slope": number(1.0 / np.cos(law.max_phase))}
        called = dialect.write("$ASIN(")
        asin = next(line for line in dialect.functions().splitlines() if called in line) + "\n\n"
    code = kept_lines(_CODE, facts).replace("$finite_input", FINITE_INPUT.strip("\n"))
    parts = [
        "/* The law, or the cubic: its range, coefficients, and columns of x. */\n",
        *(f"{dialect.table(key, values)}\n" for key, values in whole.arrays.items()),
        asin,
        dialect.write(rejection(silent, dialect.std)).lstrip(),
        f"\n{dialect.write(code, **words)}\n",
    ]
    return "".join(parts)


def _header(whole, dialect, price, units, notes):
    law, part, model = whole.law, whole.part, whole.rules.model
    units, (low, high) = units or {}, whole.box
    rules = f", and {model.n_rules} rules of order {model.order}"
    if model.n_rules == 1:
        rules = ", and a line" if model.order else ", and a constant"
    what, output = "The rate of an open-loop gyro: arcsine law", "rate"
    beyond, policies = policy_line(model, "Outside this range"), []
    if whole.is_cubic:
        what, output = f"A polynomial of the third degree with {len(law.powers)} terms", "error"
    else:
        past = past_phase(law.out_of_bounds, "output")
        policies = [f"Beyond a phase of {law.max_phase:g} rad {past}."]
        if model.coefficients.any():
            of_law = "" if model.out_of_bounds in SILENT else f" {LAW_GOES_ON}; in what is added,"
            beyond = policy_line(model, f"Outside this range{of_law}")
        elif model.out_of_bounds not in SILENT:
            beyond = f"Outside this range {LAW_GOES_ON}."
    what += rules if model.coefficients.any() else ""
    lines = [
        f"{what}; {dialect.std.upper()}, {dialect.real}.",
        *cost_lines(price, "" if whole.is_cubic else "an arcsine, "),
        "",
        *input_lines(whole.names, low, high, units),
        "Outputs y:",
        f"  [0] {output}, in {units.get('rate', 'the unit of the training data')}",
        "",
        *policies,
        beyond,
        "A row gets no output if one of its inputs, or the result, is not finite.",
    ]
    if part.min_coverage is not None:
        lines.append(f"A row is flagged as uncovered below a coverage of {part.min_coverage:g}.")
    title = "A cubic" if whole.is_cubic else "An arcsine law"
    title += " and Takagi-Sugeno-Kang fuzzy rules" if model.n_rules > 1 else ""
    return header_of(title, notes, lines, dialect, len(whole.names), 1)


def _cost(whole):
    of_rules = whole.part.cost
    sizes = [values.size for values in whole.tables.values()]
    n_inputs, n_rules_inputs = whole.law.columns_.size, whole.rules.positions.size
    # One product per degree of each polynomial, for the thermometer lag, and the slope beyond.
    products, divisions = sum(sizes) - len(sizes) + (n_inputs > 2), 2
    products += whole.law.out_of_bounds == "linear"
    if whole.is_cubic:
        products, divisions = int(whole.law.powers.sum()), n_inputs
    n_held = n_rules_inputs + 1 + n_inputs * whole.is_cubic
    return replace(
        of_rules,
        multiply_adds=of_rules.multiply_adds + products,
        divisions=of_rules.divisions + divisions,
        table_bytes=of_rules.table_bytes + sum(map(table_bytes, whole.arrays.values())),
        stack_bytes=of_rules.stack_bytes + whole.dtype.itemsize * n_held,
    )


def _known_answers(whole):
    """Rows, rates, status and tolerance, as for rules alone; some rows have large phases.

    Rows so close to the largest phase or the least coverage that rounding decides are left out.
    """
    law, rules, part = whole.law, whole.rules, whole.part
    low, high = whole.box
    points = qmc.Halton(low.size, scramble=False).random(4 * ROWS)
    reach = np.where(np.arange(len(points)) % 2, 1.0, 2.0)[:, None]
    X = low + (high - low) * (0.5 + reach * (points - 0.5))
    if not whole.is_cubic:
        output = law.columns_[0]
        X[3::4, output] = 3.0 * law.amplitude_[0] * (points[3::4, output] - 0.5)
    X = np.vstack([low, high, X]).astype(whole.dtype).astype(float)
    # The phase is NaN where the output exceeds the amplitude.
    phase, limit = (0.0 * X[:, 0], 1.0) if whole.is_cubic else (phase_of(law, X), law.max_phase)
    phase, coverage = np.abs(phase), rules.coverage(X)
    # Without a least coverage, every row is covered.
    asked = -1.0 if part.min_coverage is None else part.min_coverage
    sure = ~(np.abs(phase - limit) < 1e-3) & (np.abs(coverage - asked) > 1e-3 * asked)
    chosen = np.flatnonzero(sure)[:ROWS]
    X, coverage, beyond = X[chosen], coverage[chosen], ~(phase <= limit)[chosen]
    # The status replaces the warning, row by row.
    with without(OutOfBoundsWarning):
        of_law = law.predict(X)
    model, z = rules.model.with_out_of_bounds(_said(rules.model)), X[:, rules.positions]
    of_rules = model.predict(z)
    y = (of_law + of_rules[:, 0])[:, None]
    silent = ~np.isfinite(y.astype(whole.dtype))[:, 0]
    inside = ((low <= X) & (high >= X)).all(axis=1) & ~beyond
    status = status_word(~inside, silent, coverage < asked)
    y[silent], of_rules[silent] = 0.0, 0.0
    tolerance = TOLERANCE[whole.dtype] * (size_of_sum(model, z, of_rules) + _steepest(whole, y))
    return X.astype(whole.dtype), y.astype(whole.dtype), status, tolerance.astype(whole.dtype)


def _steepest(whole, y):
    """Factor that magnifies rounding errors of the sine, or of an input far from zero."""
    law = whole.law
    if not whole.is_cubic:
        return max(np.abs(y).max(), np.tan(law.max_phase) / np.abs(law.sagnac_factor_[0]))
    ends = np.stack([law.minimum_, law.maximum_])
    widest = 2.0 + np.abs(ends - law.center).max(axis=0) / law.scale
    size = np.prod(widest**law.powers, axis=1) @ np.abs(law.coefficients)
    return size * (1.0 + (np.abs(ends) / law.scale).max())


def _said(part):
    """The policy of a part, but "nan" in place of "raise", to know the rows one by one."""
    return "nan" if part.out_of_bounds in SILENT else part.out_of_bounds
