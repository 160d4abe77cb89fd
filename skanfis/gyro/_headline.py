"""What report and command tell of a calibration: which compensation to use, and how sure it is.

The uncertainty of one compensated row has three parts.

Noise: W is the sum of squares of the final model's n residuals e about the means of their G groups
(runs, devices). The rules' own estimate s of the noise has paid for the effective number of
parameters, but takes what groups differ by for noise of rows; without that,
noise^2 = s^2 (W / (n - G)) / (sum e^2 / n).

Scatter: held-out residuals have the mean m_g and n_g rows in group g, and the mean square w^2
within groups. What is not repeatable is scatter^2 = var(m_g) - w^2 mean(1 / n_g), the random
effects of a one-way analysis of variance, with the chi^2 interval of G - 1 degrees of freedom.

Model: the root mean square over the rows of the posterior's deviation without its noise.
"""

from operator import itemgetter
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import chi2

from ..bounds import bounds, gradient_bounds
from ..inspection import readability
from ._columns import RATE_UNITS, evenly_chosen
from ._simpler import NAMES, NOTHING
from .compose import FrozenRules, Polynomial
from .displays import figures
from .metrics import rms

ARTICLES = {name: f"{'the' if 'law' in name else 'a'} {name}" for name in NAMES.values()}
ARTICLES[NOTHING] = NOTHING
_MOST_ROWS = 20_000  # evenly chosen, for the rules, the noise and the model
_CONFIDENCE = 0.95  # of every interval in the report
_MANY_FLAGGED = 0.2  # of the rows
_MOST_BOXES = 20_000  # for each bound; what is reached with them holds, and could be tighter


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
    if verdict.is_one_cycle:
        safe = "leave the gyro as it is" if name == NOTHING else "a constant is safe"
        title = f"One cycle cannot tell whether this repeats; until then {safe}"
    what = {
        NOTHING: "Without any compensation the error is",
        "constant": "Subtracting a constant leaves",
    }.get(name, f"{ARTICLES[name].capitalize()} leaves")
    why = (
        "Nothing more elaborate that was tried is better by more than the scatter over the "
        f"{groups} can explain (95 %)."
    )
    if verdict.is_one_cycle:
        why = (
            "Whatever follows the temperature was learnt and judged on the same cycle: record two "
            "more, then calibrate again from all."
        )
    elif verdict.n_groups == 1:
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
    n_all = np.unique(calibration.split.labels.astype(str)).size
    of_all = "" if n_all == n_groups else f" (of {n_all})"
    return f"{n_groups}{of_all} held-out {kind}{'s' if n_groups > 1 or of_all else ''}"


def flagged_text(calibration):
    """How many held-out rows were flagged, and what that means."""
    n_rows, n_flagged = calibration.inside.size, np.count_nonzero(~calibration.inside)
    if not n_flagged:
        return f"None of the {n_rows:,} held-out rows was flagged."
    share = n_flagged / n_rows
    advice = "They are the ends of the range, which no other group reaches."
    if share > _MANY_FLAGGED:
        advice = (
            "That is much: the figures say nothing of these rows. Log groups that overlap more, "
            "above all at both ends of the range."
        )
    return f"{n_flagged:,} of {n_rows:,} held-out rows ({share:.1%}) were flagged. {advice}"


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
    lines.append(f"flagged        {flagged_text(calibration)}")
    title, reason = headline(calibration, "deg/s")
    lines.append(f"VERDICT        {title}. {reason}")
    what = ARTICLES.get(calibration.written, "the fuzzy rules")
    asked = calibration.recipe.write != "recommended"
    others = "as --write asks" if asked else "as recommended; --write names another"
    lines.append(f"written is     {what}, {others}")
    if calibration.writes_model and (findings := readability_of(calibration).findings):
        lines.append(f"rules          not fit to be read one by one. {findings[0]}")
    return lines


def readability_of(calibration):
    """Whether the rules can be read: against what the law leaves of the rate, or the error."""
    places = evenly_chosen(len(calibration.X), _MOST_ROWS)
    X, estimator = calibration.X.iloc[places], calibration.model
    if not calibration.recipe.physics:
        return readability(estimator, X, (calibration.before - calibration.rate)[places])
    left = calibration.rate[places] - estimator.base_.predict(X)
    # Rows that the law refuses are no business of the rules.
    known = np.isfinite(left)
    return readability(calibration.rules, X[known], left[known])


class Budget(NamedTuple):
    """Standard deviations [deg/s], NaN where unknown; ends of a 95 % interval."""

    noise: float
    scatter: float
    scatter_low: float
    scatter_high: float
    model: float

    @property
    def combined(self):
        """Of all parts that are known."""
        return float(np.sqrt(np.nansum(np.square([self.noise, self.scatter, self.model]))))


def budget_of(calibration):
    """The budget of a calibration."""
    rules = calibration.rules[-1]
    rows = evenly_chosen(len(calibration.X), _MOST_ROWS)
    X, estimator = calibration.X.iloc[rows], calibration.compensator.estimator
    rate, before = calibration.rate[rows], calibration.before[rows]
    residual = calibration.compensator.compensate(before, estimator.predict(X)) - rate
    answered = np.isfinite(residual)
    groups, in_range = calibration.split.labels.astype(str), calibration.in_range
    of_fit = rules.noise_std_ if calibration.writes_model else None
    noise = noise_within(residual[answered], groups[rows][answered], of_fit)
    errors = (calibration.after - calibration.rate)[in_range]
    model = np.nan
    if of_fit is not None:
        deviation = calibration.rules.predict(X[answered], return_std=True)[1]
        # Of the difference of two squares rounding may leave less than nothing.
        beyond = np.maximum(deviation**2 - of_fit**2, 0.0)
        model = float(np.sqrt(np.mean(beyond)))
    scatter, low, high = scatter_between(errors, groups[in_range])
    return Budget(noise, scatter, low, high, model)


def noise_within(residual, groups, noise_of_fit=None):
    """Deviation of residuals about the means of their groups; ``noise_of_fit`` is that of all."""
    off = residual - pd.Series(residual).groupby(groups).transform("mean").to_numpy()
    freedom = residual.size - np.unique(groups).size
    if freedom < 1:
        return np.nan
    within = np.sum(off**2) / freedom
    share = 1.0 if noise_of_fit is None else noise_of_fit**2 / (np.mean(residual**2) or np.inf)
    return float(np.sqrt(within * share))


def scatter_between(errors, groups):
    """Deviation between groups of what the means of errors would be without noise, and its ends."""
    table = pd.Series(errors).groupby(groups).agg(["size", "mean", "var"])
    n_groups = len(table)
    if n_groups < 2:
        return np.nan, np.nan, np.nan
    squares = (table["var"].fillna(0.0) * (table["size"] - 1)).sum()
    of_noise = squares / max(len(errors) - n_groups, 1) * np.mean(1.0 / table["size"])
    between = table["mean"].var()
    tails = chi2.ppf(0.5 + np.array([0.5, -0.5]) * _CONFIDENCE, n_groups - 1)
    found = np.array([between, *((n_groups - 1) * between / tails)]) - of_noise
    return tuple(np.sqrt(np.maximum(found, 0.0)).tolist())


class Proven(NamedTuple):
    """What is proven over a box, of what the rules give [deg/s].

    It lies between ``limits``; ``met`` is the largest size that was met, and the inputs where it
    was. ``rate_rises`` is whether the compensated rate is proven to go with the output, in the
    sense of the scale factor; None where the output is no input, or what is beside the rules is not
    bounded. ``box`` is by ``names``.
    """

    limits: np.ndarray
    met: tuple
    rate_rises: bool | None
    names: tuple
    box: np.ndarray

    @property
    def largest(self):
        """No compensation in the box exceeds it in size."""
        return float(np.abs(self.limits).max())


def proven_bounds(calibration):
    """Bounds over the box of the recipe, other inputs in the range of the calibration."""
    recipe, compensator = calibration.recipe, calibration.compensator
    own, given = 1.0 / compensator.scale_factor, {name: ends for name, *ends in recipe.box} or None
    rules, rises = compensator.estimator, None
    if isinstance(cubic := getattr(rules, "base_", None), Polynomial):
        X = calibration.X
        box = np.array([(given or {}).get(name, [X[name].min(), X[name].max()]) for name in X])
        rows = X.to_numpy()[((box[:, 0] <= X) & (box[:, 1] >= X)).all(axis=1)]
        sizes = np.abs(cubic.predict(rows))
        met = max(zip(sizes, rows, strict=True), key=itemgetter(0), default=(np.nan, None))
        return Proven(cubic.bounds(box), met, None, recipe.inputs, box)
    rules = getattr(rules, "residual_", rules)
    rules = rules.model if isinstance(rules, FrozenRules) else rules
    found = bounds(rules, given, max_boxes=_MOST_BOXES)
    ends = (found.lowest[0], found.at_lowest[0]), (found.highest[0], found.at_highest[0])
    size, place = max(((abs(value), at) for value, at in ends), key=itemgetter(0))
    if compensator.predicts == "error" and "output" in recipe.inputs:
        # rate = output / factor - error: its slope has the factor's sign where the error's is less.
        slope = gradient_bounds(rules, "output", given, max_boxes=_MOST_BOXES)
        rises = bool(np.all(slope.upper[0] < own if own > 0.0 else slope.lower[0] > own))
    limits = np.array([found.lower[0], found.upper[0]])
    return Proven(limits, (float(size), place), rises, found.input_names, found.box)
