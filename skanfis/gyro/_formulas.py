"""Rules, laws and polynomials as text: what to compute, to the last digit that counts."""

from ..export import fold
from ..inspection import export_text
from ._headline import readability_of
from ._simpler import LAW_AND_LINE
from .compose import FrozenRules
from .physics import past_phase


def formula_of(calibration, name):
    """The formula of a simpler compensation, as lines of text."""
    simple = next(each for each in calibration.simpler if each.name == name)
    recipe, estimator = calibration.recipe, simple.estimator
    law = getattr(estimator, "base_", None)
    if name == LAW_AND_LINE:
        line = _line("line", estimator.residual_, recipe.inputs)
        return f"{law_text(law, recipe)}\n\nTo this rate is added the line:\n{line}"
    if simple.predicts == "rate":
        return law_text(law, recipe)
    text = _line("error", estimator, recipe.inputs) if law is None else _cubic(law, recipe.inputs)
    return f"rate = output / {calibration.compensator.scale_factor:.9g} - error\n{text}"


def rules_text(calibration, found=None):
    """What is written, as text: a formula, or the rules as sentences.

    Before these stand what speaks against reading them, and the law's formula.
    """
    if not calibration.writes_model:
        return f"{formula_of(calibration, calibration.written)}\n"
    found = readability_of(calibration) if found is None else found
    caution = ""
    if found.findings:
        head = "What speaks against reading the rules one by one:"
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
        f"rate [deg/s] = arcsin({names[0]} [{recipe.output_unit}] "
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


def _line(what, estimator, inputs):
    """What a single rule gives: a constant or a line."""
    model = FrozenRules.of(estimator, len(inputs)).model
    constant, *slopes = model.coefficients.ravel()
    lines = [f"{what} = {constant:.9g}"]
    for name, slope, reference in zip(inputs, slopes, model.reference, strict=False):
        lines.append(f"    {slope:+.9g} * ({name} - ({reference:.9g}))")
    return "\n".join(lines)


def _cubic(cubic, inputs):
    """In standardised inputs, which keep the digits that count."""
    names = [f"z{j + 1}" for j in range(len(inputs))]
    lines = [
        f"{name} = ({column} - ({center:.9g})) / {scale:.9g}"
        for name, column, center, scale in zip(
            names, inputs, cubic.center, cubic.scale, strict=True
        )
    ]
    for value, row in zip(cubic.coefficients, cubic.powers, strict=True):
        powers = zip(names, row, strict=True)
        factors = [f"{name}^{k}" if k > 1 else name for name, k in powers if k]
        term = "    {:+.9g} * {}" if factors else "error = {:.9g}"
        lines.append(term.format(value, " * ".join(factors)))
    return "\n".join(lines)
