"""The rules: their terms, their text, and whether they can be read one by one."""

import numpy as np

from ...export import fold
from ...inspection import export_text
from .._pictures import draw_memberships
from .._reading import readability_of
from ..displays._style import figures
from .words import law_formula, law_table

__all__ = ["reading", "rules", "rules_text"]

_FIGURES_OF_READING = {
    "strongest_alone": "strongest rule alone, off the model, RMS [sd]",
    "disagreement": "disagreement of the rules, RMS [sd]",
    "greatest_sum": "greatest sum of the sizes of contributions [ranges]",
    "rules_beyond": "rules whose value at their own center lies far beyond the range",
    "least_truth": "truth of the least true term",
    "greatest_crossing": "highest crossing of neighbouring terms",
    "wordless": "part of the rows on which no term of an input is true",
}

_NOT_FIT = "The rules are not fit to be read one by one"


def rules(page, results):
    """The rules in pictures and as text."""
    calibration = results.calibration
    page.section("The rules")
    if calibration.recipe.physics:
        page.paragraph(
            "The rules give what the arcsine law leaves of the rate; the law's prediction is added."
        )
        law = calibration.compensator.estimator.base_
        page.preformatted(law_table(law, calibration.recipe), "The arcsine law")
    if (picture := draw_memberships(calibration)) is not None:
        page.figures([picture])
    page.preformatted(rules_text(calibration, results.readability), "All rules as text")
    page.preformatted(_on_board(calibration.compensator), "What to compute on board")


def reading(page, results):
    """Whether the rules can be read one by one."""
    found = results.readability
    page.section("Can the rules be read?")
    page.paragraph(
        "The model is the mean of its rules by their strengths. Whether each rule holds by itself "
        "is measured on the rows of the log; standard deviation (sd) and range are those of what "
        'the rules were taught. The page "What to believe of a rule" of the documentation of '
        "skanfis says more."
    )
    for sentence in found.findings:
        page.paragraph(sentence, kind="warn")
    if not found.findings:
        page.paragraph("Nothing measured here speaks against reading the rules one by one.")
    lines = [
        (
            _FIGURES_OF_READING[name],
            f"{value:.3g}" if name == "rules_beyond" else figures(value),
            f"{found.limits[name]:g}" if name in found.limits else "–",
        )
        for name, value in found.summary.items()
        if np.isfinite(value)
    ]
    page.table(("figure", "value", "limit"), lines)


def rules_text(calibration, found=None):
    """The rules as sentences, after the formula of the law where there is one.

    In front of them stands what speaks against reading them one by one; ``found`` is their
    readability where it has been measured already.
    """
    found = readability_of(calibration) if found is None else found
    caution = ""
    if found.findings:
        caution = "\n".join([f"{_NOT_FIT}:", *found.findings, "", ""])
    estimator = calibration.compensator.estimator
    # Folded, a model knows of no readability in training, and the text has the caution once.
    if calibration.recipe.physics:
        rules = export_text(fold(estimator.residual_), output_names=["rate beyond the law"])
        law = law_formula(estimator.base_, calibration.recipe)
        return f"{law}\nTo this rate is added what the rules give.\n\n{caution}{rules}\n"
    return f"{caution}{export_text(fold(estimator), output_names=['error'])}\n"


def _on_board(compensator):
    """The steps around the model, as they run on the gyro's processor."""
    arguments = ", ".join(compensator.inputs)
    lines = []
    if "temperature_rate" in compensator.inputs:
        lines += [
            "/* at power-on temperature_rate = 0, previous = temperature; then every h seconds */",
            f"temperature_rate += (1 - exp(-h / {compensator.time_constant:g}))",
            "    * ((temperature - previous) / h - temperature_rate);",
            "previous = temperature;",
        ]
    if compensator.predicts == "error":
        lines.append(f"rate = output / {compensator.scale_factor:.9g} - error({arguments});")
    else:
        lines.append(f"rate = law({arguments}) + rules({arguments});")
    return "\n".join(lines)
