"""Rules, laws and polynomials as text: what to compute, to the last digit that counts."""

from ..export import fold
from ..inspection import export_text
from ._headline import readability_of
from ._simpler import LAW_AND_LINE, NOTHING
from .physics import past_phase


def formula_of(calibration, name):
    """The formula of a simpler compensation, as lines of text."""
    simple = next(each for each in calibration.simpler if each.name == name)
    recipe = calibration.recipe
    if name == LAW_AND_LINE:
        line = _polynomial("line", simple.model.residual_, recipe.inputs)
        return f"{law_text(simple.model.base_, recipe)}\n\nTo this rate is added the line:\n{line}"
    if simple.predicts == "rate":
        return law_text(simple.model, recipe)
    rate = f"rate = output / {calibration.compensator.scale_factor:.9g} - error\n"
    if name in (NOTHING, "constant"):
        return f"{rate}error = {simple.model:.9g}"
    return rate + _polynomial("error", simple.model, recipe.inputs)


def rules_text(calibration, found=None):
    """What is written, as text: a formula, or the rules as sentences.

    Before these stand what speaks against reading them, and the law's formula.
    """
    if not calibration.writes_model:
        return f"{formula_of(calibration, calibration.written)}\n"
    found = readability_of(calibration) if found is None else found
    caution = ""
    if found.findings:
        head = "The rules are not fit to be read one by one:"
        caution = "\n".join([head, *found.findings, "", ""])
    estimator = calibration.model
    # Folded, a model knows of no readability in training, and the text has the caution once.
    if calibration.recipe.physics:
        rules = export_text(fold(estimator.residual_), output_names=["rate beyond the law"])
        law = law_text(estimator.base_, calibration.recipe)
        return f"{law}\nTo this rate is added what the rules give.\n\n{caution}{rules}\n"
    return f"{caution}{export_text(fold(estimator), output_names=['error'])}\n"


def law_text(law, recipe):
    """The fitted law as a formula with its units, and what happens past the arcsine."""
    names = [recipe.inputs[j] for j in law.columns_]
    amplitude, sagnac, bias = map(_in_powers, (law.amplitude_, law.sagnac_factor_, law.bias_))
    formula = (
        f"rate [deg/s] = arcsin(({names[0]} [{recipe.output_unit}]{_term(-law.offset_)}) "
        f"/ ({amplitude})) / ({sagnac}) - ({bias})"
    )
    if len(names) > 1:
        lag = _term(law.thermometer_lag_, f" s * {names[2]} [degC/s]") if len(names) > 2 else ""
        formula += f", t = {names[1]} [degC]{lag}{_term(-law.reference_temperature_)}"
    policy = past_phase(law.out_of_bounds, "rate")
    return f"{formula}\nBeyond a phase (the arcsin) of {law.max_phase:g} rad {policy}."


def _in_powers(coefficients):
    """Of t, the lowest first."""
    text = f"{coefficients[0]:.8g}"
    for power, value in enumerate(coefficients[1:], start=1):
        text += _term(value, " t" if power == 1 else f" t^{power}")
    return text


def _term(value, factor=""):
    """What is to be added, with its sign; nothing for zero."""
    return f" {'-' if value < 0 else '+'} {abs(value):.8g}{factor}" if value else ""


def _polynomial(what, pipeline, inputs):
    """In standardised inputs, which keep the digits that count in a cubic."""
    scaler, powers, line = (step for _, step in pipeline.steps)
    names = [f"z{j + 1}" for j in range(len(inputs))]
    lines = [
        f"{name} = ({column} - {mean:.9g}) / {scale:.9g}"
        for name, column, mean, scale in zip(
            names, inputs, scaler.mean_, scaler.scale_, strict=True
        )
    ]
    lines.append(f"{what} = {float(line.intercept_):.9g}")
    for value, row in zip(line.coef_, powers.powers_, strict=True):
        factors = [
            f"{name}^{k}" if k > 1 else name for name, k in zip(names, row, strict=True) if k
        ]
        lines.append(f"    {value:+.9g} * {' * '.join(factors)}")
    return "\n".join(lines)
