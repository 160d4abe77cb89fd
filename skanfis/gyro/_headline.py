"""Which compensation to use, in words that report and command share."""

import numpy as np

from ..inspection import readability
from ._columns import RATE_UNITS, evenly_chosen
from ._simpler import LAW_AND_LINE, NOTHING, options_for
from .displays import figures
from .metrics import rms

__all__ = ["ARTICLES", "errors_and_verdict", "headline", "held_out_groups", "readability_of"]

ARTICLES = {
    NOTHING: "no compensation",
    "constant": "a constant",
    "straight line": "a straight line",
    "arcsine law": "the arcsine law",
    LAW_AND_LINE: "the arcsine law and a line",
    "cubic polynomial": "a cubic polynomial",
}
# Evenly chosen; what is greatest on a row hardly grows with more of them.
_MOST_ROWS = 100_000


def headline(calibration, unit):
    """A title, and a sentence that gives its reason; errors in ``unit``."""
    verdict, groups = calibration.verdict, held_out_groups(calibration)
    left = {
        name: f"{figures(RATE_UNITS[unit] * error)} {unit}" for name, error in verdict.rms.items()
    }
    if verdict.model_is_worth_it:
        simpler = [name for name in verdict.rms if name not in (NOTHING, verdict.model)]
        best = min(simpler, key=verdict.rms.get)
        gain = verdict.gains[best]
        return "The fuzzy rules are worth it", (
            f"They leave {left[verdict.model]} RMS of {left[NOTHING]} on the held-out rows in "
            f"range; the best of what is simpler, {ARTICLES[best]}, leaves {left[best]} on the "
            f"same rows. Over the {groups} that is {figures(gain.factor)} times as much in the "
            f"geometric mean (95 % interval {figures(gain.low)} to {figures(gain.high)})."
        )
    name = verdict.recommended
    title = f"Use {ARTICLES[name]} instead of the fuzzy rules"
    if name == NOTHING:
        title = "Leave the gyro as it is: no compensation that was tried is better"
    what = {
        NOTHING: "Without any compensation the error is",
        "constant": "Subtracting a constant leaves",
    }.get(name, f"{ARTICLES[name].capitalize()} leaves")
    why = (
        "Nothing more elaborate that was tried is better by more than the scatter over the "
        f"{groups} can explain (95 %)."
    )
    if verdict.n_groups == 1:
        why = (
            "Only one held-out group has rows in range: how far errors scatter is not known, and "
            "nothing can be shown to be better. Log more groups that overlap."
        )
    return title, (
        f"{what} {left[name]} RMS on the held-out rows in range; the fuzzy rules leave "
        f"{left[verdict.model]} on the same rows. {why}"
    )


def held_out_groups(calibration):
    """Such as "12 held-out runs"."""
    kind, n_groups = calibration.split.kind.split("+")[0], calibration.verdict.n_groups
    if kind == "level":
        kind = "rate level"
    return f"{n_groups} held-out {kind}{'s' if n_groups > 1 else ''}"


def errors_and_verdict(calibration):
    """Lines of the command: errors before and after, which compensation to use."""
    before, after = (rates - calibration.rate for rates in (calibration.before, calibration.after))
    inside = calibration.in_range
    outside = ~calibration.inside & np.isfinite(after)
    peak = np.abs(after[inside]).max()
    lines = [
        f"error before   {rms(before[inside]):.4g} deg/s RMS, on {inside.sum():,} held-out rows "
        "in range",
        f"error after    {rms(after[inside]):.4g} deg/s RMS, peak {peak:.4g}, on the same rows",
    ]
    if outside.any():
        lines.append(
            f"out of range   {rms(before[outside]):.4g} deg/s RMS before, "
            f"{rms(after[outside]):.4g} after, on {outside.sum():,} held-out rows, all of them "
            "flagged"
        )
    title, reason = headline(calibration, "deg/s")
    lines.append(f"VERDICT        {title}. {reason}")
    if wanted := options_for(calibration.verdict.recommended, len(calibration.recipe.inputs)):
        lines.append(f"instead        {wanted} writes the files of it; the report has its formula")
    if findings := readability_of(calibration).findings:
        lines.append(f"rules          not fit to be read one by one. {findings[0]}")
    return lines


def readability_of(calibration):
    """Whether the rules can be read: against what the law leaves of the rate, or the error."""
    places = evenly_chosen(len(calibration.X), _MOST_ROWS)
    X, estimator = calibration.X.iloc[places], calibration.compensator.estimator
    if not calibration.recipe.physics:
        return readability(estimator, X, (calibration.before - calibration.rate)[places])
    left = calibration.rate[places] - estimator.base_.predict(X)
    # Rows that the law refuses are no business of the rules.
    known = np.isfinite(left)
    return readability(calibration.rules, X[known], left[known])
