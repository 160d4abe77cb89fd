"""Where the compensator may be used."""

from ...policies import policy_in_words
from .._pictures import draw_coverage
from .words import unit_of, words

__all__ = ["limits_of_use"]


def limits_of_use(page, results):
    """The box of the calibration, and what lies beyond."""
    calibration = results.calibration
    compensator, recipe = calibration.compensator, calibration.recipe
    page.section("Where it may be used")
    policy = "no rate is given"
    if recipe.outside != "nan":
        found = calibration.rules[-1].model_.max_extrapolation
        policy = policy_in_words(recipe.outside, found)
    page.paragraph(
        f"Outside the ranges below, input by input, a row is flagged (status 1) and {policy}. "
        "Inside them, rows near which there are hardly any data "
        f"(coverage below {compensator.min_coverage:g}) are flagged too (status 4)."
    )
    page.paragraph("The C code that --c writes flags the same rows with the same numbers.")
    low, high = calibration.X.min(), calibration.X.max()
    page.table(
        ("input", "from", "to", "unit"),
        [
            (words(name), f"{low[name]:.5g}", f"{high[name]:.5g}", unit_of(calibration, name))
            for name in calibration.X
        ],
        "Range of the calibration",
    )
    if (picture := draw_coverage(calibration)) is not None:
        page.figures([picture])
