"""How sure the rules of a calibration are: the uncertainty of one compensated row, proven bounds.

Noise: W is the sum of squares of the final model's n residuals e about the means of their G groups
(runs, devices). The rules' own estimate s of the noise has paid for the effective number of
parameters, but takes what groups differ by for noise of rows; without that,
noise^2 = s^2 (W / (n - G)) / (sum e^2 / n).

Scatter: held-out residuals have the mean m_g and n_g rows in group g, and the mean square w^2
within groups. What is not repeatable is scatter^2 = var(m_g) - w^2 mean(1 / n_g), the random
effects of a one-way analysis of variance, with the chi^2 interval of G - 1 degrees of freedom.

Model: the root mean square over the rows of the posterior's deviation without its noise.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import chi2

from ..bounds import bounds, gradient_bounds
from ._columns import evenly_chosen

__all__ = [
    "Budget",
    "ProvenBounds",
    "budget_of",
    "noise_within",
    "proven_bounds",
    "scatter_between",
]

# The level of every interval in the report.
_CONFIDENCE = 0.95
# Evenly chosen rows, for the noise and the model.
_MOST_ROWS = 100_000
# For each bound; what is reached with them holds, and is told to be no tighter.
_MOST_BOXES = 20_000


@dataclass(frozen=True)
class Budget:
    """Standard deviations [deg/s], NaN where unknown; ends of a 95 % interval; groups in range."""

    noise: float
    scatter: float
    scatter_low: float
    scatter_high: float
    model: float
    n_groups: int

    @property
    def combined(self):
        """Of all parts that are known."""
        return float(np.sqrt(np.nansum(np.square([self.noise, self.scatter, self.model]))))


@dataclass(frozen=True)
class ProvenBounds:
    """What is proven over a box.

    ``found`` are :class:`~skanfis.bounds.Bounds` of what the rules give [deg/s]. ``rate_rises`` is
    whether the compensated rate is proven to go with the output, in the sense of the scale factor;
    None where the output is no input, or a law beside the rules is not bounded.
    """

    found: Any
    rate_rises: bool | None

    @property
    def largest(self):
        """What no compensation in the box exceeds in size [deg/s]."""
        return float(self.found.magnitude[0])

    @property
    def attained(self):
        """The largest size that was met in the box [deg/s], and the inputs where it was."""
        found = self.found
        sides = [(abs(found.lowest[0]), found.at_lowest[0])]
        sides.append((abs(found.highest[0]), found.at_highest[0]))
        size, place = max(sides, key=lambda side: side[0])
        return float(size), place


def budget_of(calibration):
    """The budget of a calibration."""
    rules = calibration.rules[-1]
    rows = evenly_chosen(len(calibration.X), _MOST_ROWS)
    X, estimator = calibration.X.iloc[rows], calibration.compensator.estimator
    rate, before = calibration.rate[rows], calibration.before[rows]
    residual = calibration.compensator.compensate(before, estimator.predict(X)) - rate
    answered = np.isfinite(residual)
    groups, in_range = calibration.split.labels.astype(str), calibration.in_range
    noise = noise_within(residual[answered], groups[rows][answered], rules.noise_std_)
    errors = (calibration.after - calibration.rate)[in_range]
    model = np.nan
    if rules.noise_std_ is not None:
        deviation = calibration.rules.predict(X[answered], return_std=True)[1]
        # Of the difference of two squares rounding may leave less than nothing.
        beyond = np.maximum(deviation**2 - rules.noise_std_**2, 0.0)
        model = float(np.sqrt(np.mean(beyond)))
    scatter, low, high = scatter_between(errors, groups[in_range])
    return Budget(noise, scatter, low, high, model, np.unique(groups[in_range]).size)


def noise_within(residual, groups, noise_of_fit=None):
    """Deviation of residuals about the means of their groups; ``noise_of_fit`` is that of all."""
    codes = np.unique(groups, return_inverse=True)[1]
    means = np.bincount(codes, residual) / np.bincount(codes)
    freedom = residual.size - means.size
    if freedom < 1:
        return np.nan
    within = np.sum((residual - means[codes]) ** 2) / freedom
    if noise_of_fit is None:
        return float(np.sqrt(within))
    every = np.mean(residual**2)
    return float(noise_of_fit * np.sqrt(within / every)) if every else 0.0


def scatter_between(errors, groups):
    """Deviation between groups of what the means of errors would be without noise, and its ends."""
    codes = np.unique(groups, return_inverse=True)[1]
    sizes = np.bincount(codes)
    n_groups = sizes.size
    if n_groups < 2:
        return np.nan, np.nan, np.nan
    means = np.bincount(codes, errors) / sizes
    within = np.sum((errors - means[codes]) ** 2) / max(errors.size - n_groups, 1)
    of_noise, between = within * np.mean(1.0 / sizes), np.var(means, ddof=1)
    tails = chi2.ppf(0.5 + np.array([0.5, -0.5]) * _CONFIDENCE, n_groups - 1)
    squares = np.array([between, *((n_groups - 1) * between / tails)]) - of_noise
    return tuple(np.sqrt(np.maximum(squares, 0.0)).tolist())


def proven_bounds(calibration):
    """Bounds over the box of the recipe, other inputs in the range of the calibration."""
    recipe, compensator = calibration.recipe, calibration.compensator
    box = {name: (low, high) for name, low, high in recipe.box} or None
    found = bounds(calibration.rules, box, max_boxes=_MOST_BOXES)
    if recipe.physics or "output" not in recipe.inputs:
        return ProvenBounds(found, None)
    # rate = output / factor - error: its slope has the factor's sign where the error's is less.
    slope = gradient_bounds(calibration.rules, "output", box, max_boxes=_MOST_BOXES)
    own = 1.0 / compensator.scale_factor
    rises = slope.upper[0] < own if own > 0.0 else slope.lower[0] > own
    return ProvenBounds(found, bool(np.all(rises)))
