r"""The uncertainty of one compensated row, in parts: noise, what is not repeatable, the model.

Of n rows in G groups (runs, devices) the final model leaves residuals e, whose sum of squares about
the means of the groups is W. The rules' own estimate s of the noise (``noise_std_``) has paid for
the effective number of parameters, but takes what groups differ by for noise of rows; without that,

    noise^2 = s^2  (W / (n - G)) / (sum e^2 / n) .

Held-out residuals have the mean m_g and n_g rows in group g, and the mean square w^2 within groups.
What is not repeatable is the deviation of what the m_g would be without noise (one-way analysis of
variance, random effects),

    scatter^2 = var(m_g) - w^2 mean(1 / n_g) ,

with the interval of chi^2 for a variance of G - 1 degrees of freedom. It is that of a compensator
which has not seen the group, so that what groups do to the model is in it. The model's own part is
the root mean square over the rows of the posterior's deviation without its noise.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from ._columns import evenly_chosen

__all__ = ["Budget", "budget_of", "noise_within", "scatter_between"]

# The level of every interval in the report.
_CONFIDENCE = 0.95
# Evenly chosen rows, for the noise and the model.
_MOST_ROWS = 100_000


@dataclass(frozen=True)
class Budget:
    """Standard deviations [deg/s]; NaN where the log or the model does not tell one.

    ``scatter_low`` and ``scatter_high`` are the ends of a 95 % interval. ``n_groups`` is how many
    held-out groups have rows in range.
    """

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


def budget_of(calibration):
    """The budget of a calibration."""
    rules = calibration.rules[-1]
    rows = evenly_chosen(len(calibration.X), _MOST_ROWS)
    X, estimator = calibration.X.iloc[rows], calibration.compensator.estimator
    rate, before = calibration.rate[rows], calibration.before[rows]
    residual = calibration.compensator.compensate(before, estimator.predict(X)) - rate
    answered = np.isfinite(residual)
    groups = calibration.split.labels.astype(str)
    noise = noise_within(residual[answered], groups[rows][answered], rules.noise_std_)
    in_range = calibration.in_range
    errors = (calibration.after - calibration.rate)[in_range]
    scatter, low, high = scatter_between(errors, groups[in_range])
    model = np.nan
    if rules.noise_std_ is not None:
        deviation = calibration.rules.predict(X[answered], return_std=True)[1]
        # Of the difference of two squares rounding may leave less than nothing.
        beyond = np.maximum(deviation**2 - rules.noise_std_**2, 0.0)
        model = float(np.sqrt(np.mean(beyond)))
    return Budget(noise, scatter, low, high, model, np.unique(groups[in_range]).size)


def noise_within(residual, groups, noise_of_fit=None):
    """Deviation of residuals about the means of their groups.

    ``noise_of_fit`` is the deviation that the fit has found of all residuals, its parameters paid
    for; None takes no account of them.
    """
    codes = np.unique(groups, return_inverse=True)[1]
    means = np.bincount(codes, residual) / np.bincount(codes)
    n_rows, freedom = residual.size, residual.size - means.size
    within = np.sum((residual - means[codes]) ** 2)
    if freedom < 1:
        return np.nan
    if noise_of_fit is None:
        return float(np.sqrt(within / freedom))
    every = np.sum(residual**2) / n_rows
    return float(noise_of_fit * np.sqrt(within / freedom / every)) if every else 0.0


def scatter_between(errors, groups):
    """Deviation between groups of what the means of errors would be without noise, and its ends."""
    codes = np.unique(groups, return_inverse=True)[1]
    sizes = np.bincount(codes)
    n_groups = sizes.size
    if n_groups < 2:
        return np.nan, np.nan, np.nan
    means = np.bincount(codes, errors) / sizes
    within = np.sum((errors - means[codes]) ** 2) / max(errors.size - n_groups, 1)
    of_noise = within * np.mean(1.0 / sizes)
    between = np.var(means, ddof=1)
    tails = chi2.ppf(0.5 + np.array([0.5, -0.5]) * _CONFIDENCE, n_groups - 1)
    ends = (n_groups - 1) * between / tails
    return tuple(float(np.sqrt(max(end - of_noise, 0.0))) for end in (between, *ends))
