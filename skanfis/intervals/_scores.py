r"""Conformal scores, the scaled errors on rows that a model has not seen, and their quantiles.

Each of K units (rows, or groups of rows), and a new one, has the mass 1 / (K + 1). The rows of a
group share its mass; the new unit's score counts as infinite. Intervals of the width of a score
cover with probability c if the rows with this score or less have the mass c.
"""

import inspect
from bisect import bisect_left
from dataclasses import dataclass
from numbers import Integral
from typing import Any

import numpy as np
from sklearn import get_config
from sklearn.base import clone
from sklearn.frozen import FrozenEstimator
from sklearn.model_selection import GroupKFold, GroupShuffleSplit, KFold, ShuffleSplit, check_cv
from sklearn.utils.metadata_routing import process_routing
from sklearn.utils.validation import has_fit_parameter

from .._sklearn import safe_indexing
from .._threads import without
from .._validation import (
    as_numbers,
    check_finite,
    group_numbers,
    positive_weights,
    row_weights,
)
from ..exceptions import OutOfBoundsWarning
from ..export.folding import final_step
from ..learning.objective import SMALLEST_FREEDOM
from ..naming import target_names

# Least deviation, relative to the target's range: that of an exact fit is zero.
_LEAST_DEVIATION = 1e-12
# Rounding error of a sum of masses.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class TrainingSet:
    """The training data, in the user's own tables."""

    X: Any
    y: Any
    targets: np.ndarray
    params: dict

    def fitted(self, regressor, rows=None):
        """A clone of the regressor, trained on some rows; None: on all."""
        if rows is None:
            return clone(regressor).fit(self.X, self.y, **self.params)
        params = {name: safe_indexing(value, rows) for name, value in self.params.items()}
        X, y = safe_indexing(self.X, rows), safe_indexing(self.y, rows)
        return clone(regressor).fit(X, y, **params)


def checked_targets(y, sample_weight, groups):
    """Targets as an array, positive weights or None, numbers of groups or None."""
    if y is None:
        raise ValueError("ConformalRegressor requires y to be passed, but the target y is None.")
    targets = as_numbers(y, "y")
    if not targets.size:
        raise ValueError("y has no rows: at least 2 are needed, one of them to be held out.")
    by_output = targets.reshape(len(targets), -1)
    check_finite(by_output, "y", target_names(y, by_output.shape[1]))
    if sample_weight is not None:
        sample_weight = row_weights(sample_weight, len(targets))
        positive_weights(sample_weight, len(targets))
    numbers = None if groups is None else group_numbers(groups, len(targets))
    has_weight = slice(None) if sample_weight is None else sample_weight > 0.0
    if numbers is not None and np.ptp(numbers[has_weight]) == 0:
        raise ValueError("groups has a single group; at least 2 are needed to hold one out.")
    return targets, sample_weight, numbers


def fit_params(router, regressor, sample_weight, groups):
    """The weights and groups that the regressor's ``fit`` takes; ``router`` routes metadata."""
    given = {"sample_weight": sample_weight, "groups": groups}
    given = {name: value for name, value in given.items() if value is not None}
    if get_config()["enable_metadata_routing"]:
        return dict(process_routing(router, "fit", **given).estimator.fit)
    takes_weights = has_fit_parameter(regressor, "sample_weight")
    if "sample_weight" in given and not (takes_weights or isinstance(regressor, FrozenEstimator)):
        raise ValueError(
            f"sample_weight was given, but the fit of {type(regressor).__name__} does not take "
            "it. For a Pipeline turn on sklearn.set_config(enable_metadata_routing=True), and "
            "call set_fit_request(sample_weight=True) on the step that is to have it."
        )
    if "groups" in given and not has_fit_parameter(regressor, "groups"):
        del given["groups"]
    return given


def one_part(regressor, n_rows, weight, groups, fraction, seed):
    """Rows to train on and rows held out, or groups; ``fraction`` of 1 trains on none."""
    every = np.arange(n_rows)
    if fraction == 1.0 and isinstance(regressor, FrozenEstimator):
        return every, every
    n_units = n_rows if groups is None else np.unique(groups).size
    if np.ceil(fraction * n_units) >= n_units:
        raise ValueError(
            f"calibration_fraction={fraction:g} leaves no row to train on: give a smaller one, or "
            "the fitted model as sklearn.frozen.FrozenEstimator(model), with a fraction of 1."
        )
    kind = ShuffleSplit if groups is None else GroupShuffleSplit
    splitter = kind(1, test_size=fraction, random_state=seed)
    training, held_out = (np.sort(part) for part in next(splitter.split(every, groups=groups)))
    if weight is not None and not weight[held_out].any():
        raise ValueError(
            f"None of the {held_out.size} rows held out has a positive weight: leave out rows "
            "without weight, or give a larger calibration_fraction or another random_state."
        )
    return training, held_out


def folds(cv, targets, groups, seed):
    """Pairs of rows to train on and rows held out, every row held out once, groups as a whole."""
    n_rows = len(targets)
    if n_rows == 1:
        raise ValueError("X has one sample; at least 2 are needed to hold one out.")
    if not isinstance(cv, Integral):
        splitter = check_cv(cv)
    elif groups is None:
        splitter = KFold(min(int(cv), n_rows), shuffle=True, random_state=seed)
    else:
        splitter = GroupKFold(min(int(cv), int(groups.max()) + 1))
    found = list(splitter.split(np.empty((n_rows, 0)), targets, groups))
    if not found:
        raise ValueError(
            f"cv={cv!r} gives no splits. An iterator can be used once only: give list(...) of it, "
            "or a number of folds."
        )
    counts = np.bincount(np.concatenate([held_out for _, held_out in found]), minlength=n_rows)
    if not (counts == 1).all():
        row = int(np.argmax(counts != 1))
        raise ValueError(
            f"cv={splitter!r} holds out row {row} {counts[row]} times; every row must be held "
            "out once, as KFold, GroupKFold and LeaveOneGroupOut do."
        )
    own, what = (np.arange(n_rows), "it") if groups is None else (groups, "its group")
    for training, held_out in found:
        seen = held_out[np.isin(own[held_out], own[training])]
        if seen.size:
            raise ValueError(
                f"cv={splitter!r} holds out row {seen[0]} and trains on {what}; a model may not "
                "have seen what it is judged on. Whole groups are held out by GroupKFold."
            )
    return found


def least_deviations(targets):
    """The least deviation to divide by, for targets (n_rows,) or (n_rows, n_outputs)."""
    least = _LEAST_DEVIATION * np.atleast_1d(np.ptp(targets, axis=0))
    return np.where(least > 0.0, least, np.finfo(float).tiny)


def predicted(estimator, X, least):
    """Predictions and deviations, (n_rows, n_outputs); with ``least`` None, deviations are one."""
    if least is None:
        mean = np.asarray(estimator.predict(X), dtype=float)
        centers = mean.reshape(len(mean), -1)
        return centers, np.ones(centers.shape)
    # The last step itself: with metadata routing a Pipeline would have to be told of return_std.
    final, X = final_step(estimator, X)
    if "return_std" not in inspect.signature(final.predict).parameters:
        raise ValueError(
            f"scaled=True needs predict(X, return_std=True), which {type(final).__name__} does not "
            "have: use scaled=False, for intervals of one width."
        )
    mean, deviation = (np.asarray(one, float) for one in final.predict(X, return_std=True))
    centers = mean.reshape(len(mean), -1)
    return centers, np.maximum(deviation.reshape(centers.shape), least)


def held_out_scores(estimator, data, rows, least):
    """Scores of rows that an estimator has not seen, (n_rows, n_outputs)."""
    is_frozen = isinstance(estimator, FrozenEstimator)
    if not is_frozen and getattr(final_step(estimator)[0], "out_of_bounds", None) == "raise":
        raise ValueError(
            "out_of_bounds='raise' refuses rows held out beyond the range of the others. Use "
            "'clip' or 'linear', or a fitted FrozenEstimator(model) with method='split'."
        )
    # Errors on held-out rows out of range are to be measured, not warned of.
    with without(OutOfBoundsWarning):
        centers, deviations = predicted(estimator, safe_indexing(data.X, rows), least)
    return np.abs(data.targets[rows].reshape(centers.shape) - centers) / deviations


def leave_one_out_scores(estimator, data, weight, least):
    """Studentised residuals: |y - y_(-i)| over the deviation of y_(-i)."""
    if isinstance(estimator, FrozenEstimator):
        raise ValueError(
            "method='loo' takes these rows out of the fit again, and a FrozenEstimator was not "
            "fitted to them here: use method='split' with calibration_fraction=1 and fresh rows."
        )
    final = final_step(estimator)[0]
    noise = getattr(final, "noise_std_", None)
    if noise is None:
        raise ValueError(
            f"method='loo' needs a fitted ANFISRegressor, alone or at the end of a Pipeline; "
            f"{type(final).__name__} tells nothing of its noise (noise_std_). Use another method."
        )
    floor = least_deviations(data.targets)
    centers, deviations = predicted(estimator, data.X, floor)
    noise = np.maximum(np.atleast_1d(noise), floor)
    # The noise of a constant target is nothing to divide by.
    leverage = np.minimum(deviations / noise, 1.0 / _LEAST_DEVIATION) ** 2 - 1.0
    own = np.ones((1, 1))
    if weight is not None:
        # How many rows a row of this weight counts as in the fit.
        own = weight[:, None] * max(1.0, weight.sum() / np.sum(weight**2))
    freedom = np.clip(1.0 - own * leverage, SMALLEST_FREEDOM, 1.0)
    residual = np.abs(data.targets.reshape(centers.shape) - centers) / freedom
    # The leverage of the row in the model without it is h / (1 - w h).
    return residual if least is None else residual / (np.sqrt(1.0 + leverage / freedom) * noise)


def row_masses(n_rows, sample_weight=None, groups=None):
    """The mass of every row, (n_rows,), and the number of units.

    Weighted rows have the effective sample size (sum s)^2 / sum s^2, s the weights (Kish 1965).
    """
    weight = np.ones(n_rows) if sample_weight is None else sample_weight / np.max(sample_weight)
    if groups is None:
        total = np.sum(weight)
        n_units = float(total**2 / np.sum(weight**2))
        return weight * (n_units / (total * (n_units + 1.0))), n_units
    totals = np.bincount(groups, weights=weight)
    n_units = float(np.count_nonzero(totals))
    share = weight / np.where(totals > 0.0, totals, 1.0)[groups]
    return share / (n_units + 1.0), n_units


def score_quantile(scores, masses, coverage):
    """The smallest score with the mass ``coverage`` at or below it; NaN counts as infinite."""
    scores = np.where(np.isnan(scores), np.inf, scores)
    order = np.argsort(scores)
    place = np.searchsorted(np.cumsum(masses[order]), coverage - ROUNDING)
    return scores[order[place]] if place < scores.size else np.inf


def group_scores(scores, masses, groups, coverage):
    """For every group, the score that ``coverage`` of its rows do not exceed, and its mass."""
    found = []
    for number in np.unique(groups[masses > 0.0]):
        part = groups == number
        mass = masses[part].sum()
        found.append((score_quantile(scores[part], masses[part] / mass, coverage), mass))
    return tuple(np.transpose(found))


def one_row_per_group(scores, masses, groups, coverage):
    """The median, over draws of one row from every group, of the quantile of the drawn rows.

    It is the smallest score q with P(N(q) >= ceil((K + 1) c)) >= 1 / 2, for N(q) drawn rows with
    scores up to q, a sum of independent indicators (Dunn, Wasserman and Ramdas 2023).
    """
    scores = np.where(np.isnan(scores), np.inf, scores)
    numbers, place = np.unique(groups, return_inverse=True)
    kept = masses > 0.0
    share = np.where(kept, masses, 0.0) / np.where(kept, np.bincount(place, masses)[place], 1.0)
    present = np.unique(place[kept])
    needed = int(np.ceil((present.size + 1) * coverage - ROUNDING))
    values = np.unique(scores[kept])

    def is_reached(q):
        below = np.bincount(place, share * (scores <= q), minlength=numbers.size)[present]
        return _at_least(below, needed) >= 0.5 - ROUNDING

    first = bisect_left(values, True, key=is_reached)
    return values[first] if first < values.size else np.inf


def _at_least(probabilities, needed):
    """The probability that ``needed`` or more of independent events happen."""
    counts = np.zeros(probabilities.size + 1)
    counts[0] = 1.0
    for p in np.clip(probabilities, 0.0, 1.0):
        counts[1:] = counts[1:] * (1.0 - p) + counts[:-1] * p
        counts[0] *= 1.0 - p
    return counts[needed:].sum()
