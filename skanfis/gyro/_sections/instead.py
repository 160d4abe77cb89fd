"""The simpler compensation, where that is the one to use: what to compute, to the last digit."""

from .._headline import ARTICLES
from .._simpler import LAW_AND_LINE, NOTHING, options_for
from .words import law_table

__all__ = ["formula_of", "instead"]

_DIGITS = ".9g"


def instead(page, results):
    """Nothing where the rules are worth it."""
    calibration = results.calibration
    verdict = calibration.verdict
    if verdict.model_is_worth_it:
        return
    page.section("What to use instead")
    name = verdict.recommended
    if name == NOTHING:
        factor = calibration.compensator.scale_factor
        page.paragraph(f"The indicated rate as it is: rate = output / {factor:{_DIGITS}} [deg/s].")
        return
    page.paragraph(
        f"{ARTICLES[name].capitalize()}, fitted to the same rows as the final model; rates in "
        "deg/s, inputs in the units of the range of the calibration below."
    )
    page.preformatted(formula_of(calibration, name), "What to compute", is_open=True)
    if wanted := options_for(name, calibration.X.shape[1]):
        why = "a single rule is a straight line"
        if name == "arcsine law":
            why = "to the law it adds a single rule, which is a straight line"
        page.paragraph(f"The command writes its files, C code included, with {wanted}: {why}.")


def formula_of(calibration, name):
    """The formula of a simpler compensation, as lines of text."""
    simple = next(each for each in calibration.simpler if each.name == name)
    recipe, compensator = calibration.recipe, calibration.compensator
    if name == LAW_AND_LINE:
        line = _polynomial("line", simple.model.residual_, recipe.inputs)
        law = law_table(simple.model.base_, recipe)
        return "\n".join([law, "", "To this rate is added the line:", *line])
    if simple.predicts == "rate":
        return law_table(simple.model, recipe)
    lines = [f"rate = output / {compensator.scale_factor:{_DIGITS}} - error"]
    if name == "constant":
        return "\n".join([*lines, f"error = {float(simple.model.constant_.item()):{_DIGITS}}"])
    return "\n".join([*lines, *_polynomial("error", simple.model, recipe.inputs)])


def _polynomial(what, pipeline, inputs):
    """In standardised inputs, which keep the digits that count in a cubic."""
    scaler, powers, line = (step for _, step in pipeline.steps)
    names = [f"z{j + 1}" for j in range(len(inputs))]
    scales = [
        f"{name} = ({column} - {mean:{_DIGITS}}) / {scale:{_DIGITS}}"
        for name, column, mean, scale in zip(
            names, inputs, scaler.mean_, scaler.scale_, strict=True
        )
    ]
    terms = [
        " * ".join(
            name if power == 1 else f"{name}^{power}"
            for name, power in zip(names, row, strict=True)
            if power
        )
        for row in powers.powers_
    ]
    parts = [
        f"    {value:+{_DIGITS}} * {term}" for value, term in zip(line.coef_, terms, strict=True)
    ]
    return [*scales, f"{what} = {float(line.intercept_):{_DIGITS}}", *parts]
