"""How far off a row may be: the budget of its uncertainty, and what is proven."""

import numpy as np

from .._headline import held_out_groups
from ..metrics import rms
from .words import unit_of, words

__all__ = ["sure"]


def sure(page, results):
    """The uncertainty budget, and the bounds over a box of inputs."""
    page.section("How sure")
    _budget(page, results)
    _certain(page, results)


def _budget(page, results):
    budget, groups = results.budget, held_out_groups(results.calibration)
    unknown = "not known: fewer than two held-out groups have rows in range"
    between = f"between the means of the {groups}" if np.isfinite(budget.scatter) else unknown
    ends = ""
    if np.isfinite(budget.scatter):
        ends = f"[{results.shown(budget.scatter_low)}, {results.shown(budget.scatter_high)}]"
    posterior = "posterior of the rules, RMS over the rows"
    if np.isnan(budget.model):
        posterior = "not known: the rules have too many parameters"
    lines = [
        ("noise", _shown(results, budget.noise), "of a row, within its group"),
        ("not repeatable", (_shown(results, budget.scatter), ends), between),
        ("model", _shown(results, budget.model), posterior),
        ("combined", _shown(results, budget.combined), "root of the sum of squares"),
        ("for comparison", results.shown(rms(results.error_after)), "RMS error, held-out rows"),
    ]
    page.table(
        ("part", f"standard deviation [{results.symbol}]", "what it is"),
        lines,
        "Of one compensated row in range, in a group that the model has not seen; 95 % interval in "
        "brackets",
    )
    page.paragraph(
        "Combined and RMS error are two ways to one figure: where the error is clearly larger, the "
        "rules cannot follow the gyro between the groups, and no part of the budget knows of it. "
        "Slow drift within a group is in the noise, what groups do to the model in what is not "
        "repeatable.",
        kind="soft",
    )


def _certain(page, results):
    calibration, certain = results.calibration, results.certain
    page.heading("What is proven")
    has_law = calibration.recipe.physics
    what = "addition of the rules to the arcsine law" if has_law else "compensation"
    size, place = certain.attained
    box = certain.found.box
    # What rounding leaves of zero, where the box is in the units before a scaler, is zero.
    box, place = (np.round(ends, 9) + 0.0 for ends in (box, place))
    at = ", ".join(
        f"{words(name)} {value:.5g} {unit_of(calibration, name)}"
        for name, value in zip(certain.found.input_names, place, strict=True)
    )
    lines: list[tuple] = [
        (f"largest {what}, proven", f"{results.shown(certain.largest)} {results.symbol}"),
        ("largest that was met", (f"{results.shown(size)} {results.symbol}", f"at {at}")),
    ]
    if certain.rate_rises is not None:
        told = "proven" if certain.rate_rises else "not proven"
        lines.append(("the compensated rate follows the output, never against it", told))
    page.table(("over the box below", "result"), lines)
    sides = [
        (words(name), f"{low:.5g} to {high:.5g}", unit_of(calibration, name))
        for name, (low, high) in zip(certain.found.input_names, box, strict=True)
    ]
    page.table(("input", "box", "unit"), sides)
    page.paragraph(
        "Proven by interval arithmetic over every point of the box, beyond the range of the "
        "calibration too, by the policy there: whatever the inputs, the compensator does no more. "
        "It says nothing of how far the gyro is from the compensator.",
        kind="soft",
    )


def _shown(results, value):
    return results.shown(value) if np.isfinite(value) else "–"
