"""The arcsine law and the rules for what it leaves, as one C function.

The rules are written by ``skanfis.export`` under the name NAME_r as a static function of the same
file; the law is written here. What is asked of an exported function stays: constant tables, no
heap, no state, the status word.
"""

from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np

from ..export.c import CCode
from ..export.c.builder import (
    DECLARATION,
    FINITE_INPUT,
    LONGEST_NAME,
    Dialect,
    RulesPart,
    check_arguments,
    cost_lines,
    header_of,
    index_type,
    input_lines,
    literals,
    policy_line,
    rejection,
    self_test,
    write_files,
)
from ..policies import SILENT
from ._c_composition import Composition, known_answers
from ._law_text import past_phase
from .compose import law_and_rules

__all__ = ["export_c_physics"]

_SUFFIX = "_r"

_POLYNOMIAL = """
static $real $name_polynomial(const $real *c, int n, $real t)
{
    $real sum = c[n - 1];
    int i;
    for (i = n - 2; i >= 0; --i) {
        sum = sum * t + c[i];
    }
    return sum;
}

"""

_PREDICT = """
int $name_predict(const $real x[$NAME_N_INPUTS], $real y[$NAME_N_OUTPUTS])
{
    $real z[$n_rules_inputs], left[1], t, amplitude, sagnac, sine, phase, rate;
    int i, sign = 1, status = $NAME_IN_RANGE;

$finite_input
    }
    for (i = 0; i < $n_law; ++i) {
        const $real v = x[$name_law_input[i]];
        if (v < $name_law_low[i] || v > $name_law_high[i]) {
            status = $NAME_OUT_OF_RANGE;
        }
    }

    /* Temperature of the coil from the reference, and the coefficients there. */
    t = $temperature;
    amplitude = $name_polynomial($name_amplitude, $n_amplitude, t);
    sagnac = $name_polynomial($name_sagnac, $n_sagnac, t);
    sine = x[$output] - $offset;
    if (sagnac == 0.0R) {
        return $NAME_REJECT(y, $NAME_OUT_OF_RANGE);
    }

    /* The size of the sine, and its sign apart; no amplitude, no phase. */
    if (sine < 0.0R) {
        sine = -sine;
        sign = -sign;
    }
    if (amplitude < 0.0R) {
        amplitude = -amplitude;
        sign = -sign;
    }
    sine = amplitude > 0.0R ? sine / amplitude : $MAX;
    if (sine > $limit) {
        status = $NAME_OUT_OF_RANGE;
        $beyond
    }$otherwise
    rate = (sign < 0 ? -phase : phase) / sagnac - $name_polynomial($name_bias, $n_bias, t);

    for (i = 0; i < $n_rules_inputs; ++i) {
        z[i] = x[$name_rules_input[i]];
    }
    status |= $rules_predict(z, left);
    if (status & $NAME_NO_OUTPUT) {
        return $NAME_REJECT(y, status);
    }
    rate += left[0];
    /* Not (a and b): NaN fails every comparison. */
    if (!(rate >= -$MAX && rate <= $MAX)) {
        return $NAME_REJECT(y, $NAME_OUT_OF_RANGE);
    }
    y[0] = rate;
    return status;
}
"""
_DEVIATION = """
int $name_deviation(const $real x[$NAME_N_INPUTS], $real deviation[$NAME_N_OUTPUTS])
{
    $real z[$n_rules_inputs], rate[1];
    int i;
    const int status = $name_predict(x, rate) & ~$NAME_UNCOVERED;
    if (status & $NAME_NO_OUTPUT) {
        return $NAME_REJECT(deviation, status);
    }
    for (i = 0; i < $n_rules_inputs; ++i) {
        z[i] = x[$name_rules_input[i]];
    }
    (void)$rules_deviation(z, deviation);
    return status;
}
"""
_BEYOND = {
    "clip": "phase = $max_phase;",
    "linear": "phase = $max_phase + (sine - $limit) * $slope;",
}
_REFUSED = "return $NAME_REJECT(y, status);"
_WITHIN = "phase = $ASIN(sine);"


def export_c_physics(
    estimator: Any,
    path: str | PathLike[str] | None = None,
    *,
    name: str | None = None,
    dtype: str = "double",
    std: str = "c99",
    min_coverage: float | None = 0.1,
    saturate: Any = None,
    deviation: bool = False,
) -> CCode:
    """Write the arcsine law and the rules for what it leaves as C: one header, one source file.

    The function ``int NAME_predict(const double x[], double y[])`` gives the compensated rate from
    one row of raw inputs, and a status, as :func:`skanfis.export.export_c` does it for rules alone:
    constant tables, no heap, no state, no recursion. It takes ``asin`` besides ``exp``,
    ``log`` and, for the coverage, ``sqrt``.

    Parameters
    ----------
    estimator : fitted ResidualRegressor
        Of an :class:`OpenLoopArcsineRegressor`, and an ANFIS or a Pipeline of scalers, selections
        of columns and an ANFIS; or a search over such. The inputs of the function are the columns
        that either part takes, in the order of X; the header names them.
    path : str or path-like, default=None
        Where to write, without a suffix: "out/gyro" makes out/gyro.h and out/gyro.c. None writes
        nothing.
    name : str, default=None
        What all identifiers start with, at most 14 letters, digits and underscores. None takes the
        last part of ``path``.
    dtype : {"double", "float"}, default="double"
        Type of inputs, outputs, tables and arithmetic.
    std : {"c99", "c89"}, default="c99"
        The oldest standard that a compiler must know.
    min_coverage : float or None, default=0.1
        Rows are uncovered where ``estimator.coverage`` is below this, above 0 and at most 1. None
        leaves that out.
    saturate : Bounds or array-like of shape (1, 2), default=None
        Limits between which what the rules add to the law is held: what
        :func:`skanfis.bounds.bounds` has proven of them, or others. None holds nothing.
    deviation : bool, default=False
        Whether to write ``int NAME_deviation(const double x[], double deviation[])`` too: the
        standard deviation of a new rate by the rules; the law, which is fitted before them, is
        taken for known.

    Returns
    -------
    code : CCode
        The text of both files, and the cost of an evaluation; the one arcsine is not counted.

    Raises
    ------
    ValueError
        If a parameter is none of the above, if the residual model has a step that cannot be folded
        in, if one part asks for "nan" out of bounds and the other for "raise", or if the numbers
        go beyond what "float" holds.
    TypeError
        If ``estimator`` is no such composition.

    Notes
    -----
    The status is that of :func:`skanfis.export.export_c`. ``NAME_OUT_OF_RANGE`` says that an input
    lies outside the range of either part's training data, or that the phase lies beyond
    ``max_phase``: where ``estimator.in_bounds`` is False. Either part then follows its own
    ``out_of_bounds``; where one of them has no answer, there is none. A rate that is not finite is
    no answer either.

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
    policies = {law.out_of_bounds, rules.model.out_of_bounds}
    if policies >= set(SILENT):
        raise ValueError(
            "One of base and residual has out_of_bounds='nan', the other 'raise': one C function "
            "leaves y as it is or writes NaN. Set both to one of the two."
        )
    dialect = Dialect(name, dtype, std)
    if not isinstance(deviation, bool | np.bool_):
        raise ValueError(f"deviation={deviation!r} must be True or False.")
    part = RulesPart(rules.model, dialect, _SUFFIX, min_coverage, saturate, bool(deviation))
    columns = np.union1d(law.columns_, rules.positions)
    composition = Composition(law, rules, columns, dialect.dtype)
    of_law = _law(dialect, composition, policies)
    answers, test = known_answers(composition, part), ""
    if deviation:
        test = part.deviation_test(dialect, answers[0][:, composition.rules_inputs])
    source = "".join(
        [
            f'#include "{stem}.h"\n\n#include <float.h>\n#include <math.h>\n',
            part.text(),
            "\n",
            of_law,
            _write(dialect, _DEVIATION, composition) if deviation else "",
            self_test(answers, dialect, test, "deviation_test"),
        ]
    )
    price = _cost(part.cost, composition)
    code = CCode(name, _header(composition, dialect, price, part, deviation), source, price)
    write_files(code, path)
    return code


def _write(dialect, template, composition, **words):
    name = dialect.name + _SUFFIX
    words |= {"rules": name, "RULES": name.upper(), "n_rules_inputs": composition.rules_inputs.size}
    return dialect.write(template, **words)


def _law(dialect, composition, policies):
    """Tables and functions of the law."""
    law, real = composition.law, dialect.real
    inputs = composition.law_inputs
    tables = {"law_low": (real, composition.low), "law_high": (real, composition.high)}
    tables |= {key: (real, values) for key, values in composition.polynomials.items()}
    for key, places in (("law_input", inputs), ("rules_input", composition.rules_inputs)):
        tables[key] = (index_type(places), places)
    parts = ["/* Of the law: where it was fitted, powers of the temperature, columns of x. */\n"]
    parts += [
        dialect.write(f"static const {kind} $name_{key}[{values.size}] =\n{literals(values)};\n\n")
        for key, (kind, values) in tables.items()
    ]
    asin = dialect.write("$ASIN(")
    parts += [f"{line}\n\n" for line in dialect.functions().splitlines() if asin in line]
    silent = next(iter(policies & set(SILENT)), None)
    parts.append(dialect.write(rejection(silent, dialect.std)).lstrip() + "\n")
    parts.append(dialect.write(_POLYNOMIAL).lstrip())

    number = dialect.number
    temperature = "0.0R"
    if inputs.size > 1:
        lag = f" + {number(law.thermometer_lag_)} * x[{inputs[2]}]" if inputs.size > 2 else ""
        temperature = f"x[{inputs[1]}]{lag} - {number(composition.reference)}"
    refuses = law.out_of_bounds in SILENT
    template = _PREDICT.replace("$finite_input", FINITE_INPUT.strip("\n"))
    template = template.replace("$temperature", temperature)
    template = template.replace("$beyond", _REFUSED if refuses else _BEYOND[law.out_of_bounds])
    otherwise = f"\n    {_WITHIN}" if refuses else f" else {{\n        {_WITHIN}\n    }}"
    return "".join(parts) + _write(
        dialect,
        template.replace("$otherwise", otherwise).lstrip(),
        composition,
        n_law=inputs.size,
        output=inputs[0],
        offset=number(law.offset_),
        limit=number(np.sin(law.max_phase)),
        max_phase=number(law.max_phase),
        slope=number(1.0 / np.cos(law.max_phase)),
        **{f"n_{key}": values.size for key, values in composition.polynomials.items()},
    )


def _header(composition, dialect, price, part, deviation):
    law, model = composition.law, composition.rules.model
    lines = [
        f"The rate of an open-loop gyro: arcsine law, and {model.n_rules} rules of order "
        f"{model.order}; {dialect.std.upper()}, {dialect.real}.",
        *cost_lines(price, "an arcsine, "),
        "",
        *input_lines(composition.names, *composition.box),
        "Outputs y:",
        "  [0] rate, in the unit of the training data",
        "",
        f"Beyond a phase of {law.max_phase:g} rad {past_phase(law.out_of_bounds, 'output')}.",
        policy_line(model, "Of the rules alone: outside their range"),
        "A row that is not finite gets no output either way, nor does one whose rate is not.",
    ]
    if part.min_coverage is not None:
        lines.append(f"A row is uncovered where its coverage is below {part.min_coverage:g}.")
    if part.limits is not None:
        low, high = part.limits[0]
        lines.append(f"What the rules add to the law is held between {low:.9g} and {high:.9g}.")
    if deviation:
        lines.append("The deviation is that of the rules: the law is taken for known.")
    title = "An arcsine law and Takagi-Sugeno-Kang fuzzy rules"
    declarations = dialect.write(DECLARATION) if deviation else ""
    return header_of(title, lines, dialect, composition.columns.size, 1, declarations)


def _cost(of_rules, composition):
    sizes = [values.size for values in composition.polynomials.values()]
    itemsize = composition.dtype.itemsize
    n_numbers = sum(sizes) + 2 * composition.law_inputs.size
    n_bytes = itemsize * n_numbers + composition.law_inputs.size + composition.rules_inputs.size
    return replace(
        of_rules,
        multiply_adds=of_rules.multiply_adds + sum(sizes) - len(sizes) + 1,
        divisions=of_rules.divisions + 2,
        table_bytes=of_rules.table_bytes + n_bytes,
        stack_bytes=of_rules.stack_bytes + itemsize * (composition.rules_inputs.size + 1),
    )
