"""What a ConformalRegressor is given, checked, and the rows that its models do not see."""

from numbers import Integral

import numpy as np
from sklearn import get_config
from sklearn.base import clone
from sklearn.frozen import FrozenEstimator
from sklearn.model_selection import GroupKFold, GroupShuffleSplit, KFold, ShuffleSplit, check_cv
from sklearn.utils import check_array
from sklearn.utils.metadata_routing import process_routing
from sklearn.utils.validation import has_fit_parameter

from .._sklearn import check_sample_weight, safe_indexing
from .._validation import check_finite, group_numbers, named_refusals, positive_weights

__all__ = ["TrainingSet", "checked_targets", "fit_params", "folds", "one_part"]


class TrainingSet:
    """What a regressor is trained on, in the user's own tables."""

    def __init__(self, X, y, targets, params):
        self.X, self.y, self.targets, self.params = X, y, targets, params

    def part(self, rows):
        """Some of the rows."""
        params = {name: safe_indexing(value, rows) for name, value in self.params.items()}
        X, y = safe_indexing(self.X, rows), safe_indexing(self.y, rows)
        return TrainingSet(X, y, self.targets[rows], params)

    def fitted(self, regressor, rows=None):
        """A clone of the regressor, trained on some rows, or on all of None."""
        data = self if rows is None else self.part(rows)
        return clone(regressor).fit(data.X, data.y, **data.params)


def checked_targets(caller, y, sample_weight, groups):
    """Targets as an array, positive weights or None, numbers of groups or None."""
    if y is None:
        raise ValueError(f"{caller} requires y to be passed, but the target y is None.")
    with named_refusals(y=y):
        targets = check_array(
            y, ensure_2d=False, dtype=np.float64, ensure_all_finite=False, input_name="y"
        )
    names = [f"y{k}" for k in range(targets.reshape(len(targets), -1).shape[1])]
    check_finite(targets.reshape(len(targets), -1), "y", names)
    if sample_weight is not None:
        sample_weight = check_sample_weight(sample_weight, targets, dtype=np.float64)
        positive_weights(sample_weight, len(targets))
    if groups is None:
        return targets, sample_weight, None
    numbers = group_numbers(groups)
    if numbers.max() == 0:
        raise ValueError("groups has a single group; at least 2 are needed to hold one out.")
    return targets, sample_weight, numbers


def fit_params(router, regressor, sample_weight, groups):
    """What of weights and groups goes to the regressor's ``fit``; ``router`` routes metadata."""
    given = {"sample_weight": sample_weight, "groups": groups}
    given = {name: value for name, value in given.items() if value is not None}
    if get_config()["enable_metadata_routing"]:
        return dict(process_routing(router, "fit", **given).estimator.fit)
    if "sample_weight" in given and not has_fit_parameter(regressor, "sample_weight"):
        raise ValueError(
            f"sample_weight was given, but the fit of {type(regressor).__name__} does not take "
            "it. For a Pipeline turn on sklearn.set_config(enable_metadata_routing=True), and "
            "call set_fit_request(sample_weight=True) on the step that is to have it."
        )
    if "groups" in given and not has_fit_parameter(regressor, "groups"):
        del given["groups"]
    return given


def one_part(regressor, n_rows, groups, fraction, seed):
    """Rows to train on and rows held out, or groups; ``fraction`` of 1 trains on none."""
    every = np.arange(n_rows)
    if fraction == 1.0:
        if not isinstance(regressor, FrozenEstimator):
            raise ValueError(
                "calibration_fraction=1 leaves no row to train on: give the fitted model as "
                "sklearn.frozen.FrozenEstimator(model), or a smaller fraction."
            )
        return every, every
    kind = ShuffleSplit if groups is None else GroupShuffleSplit
    splitter = kind(1, test_size=fraction, random_state=seed)
    try:
        training, held_out = next(splitter.split(every, groups=groups))
    except ValueError as error:
        raise ValueError(
            f"method='split' with calibration_fraction={fraction:g} leaves nothing to train on "
            f"of {n_rows} rows: use a smaller fraction, or method='folds'."
        ) from error
    return np.sort(training), np.sort(held_out)


def folds(cv, targets, groups, seed):
    """Pairs of rows to train on and rows held out, every row held out once."""
    n_rows = len(targets)
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
    return found
