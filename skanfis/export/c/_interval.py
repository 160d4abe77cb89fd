"""What is asked of deviations and intervals in C, and whose intervals they are."""

import numpy as np
from sklearn.frozen import FrozenEstimator

__all__ = ["check_deviation", "read_interval"]


def check_deviation(deviation, forgetting):
    """Whether the deviation is asked for."""
    if not isinstance(deviation, bool | np.bool_):
        raise ValueError(f"deviation={deviation!r} must be True or False.")
    if deviation and forgetting is not None:
        raise ValueError(
            "deviation=True is the deviation of the model as it was exported, and forgetting lets "
            "it learn on: give one of them."
        )
    return bool(deviation)


def read_interval(estimator, coverage):
    """The estimator that predicts, and how many deviations an interval reaches, (n_outputs,).

    None where no ``coverage`` is asked for.
    """
    if coverage is None:
        return estimator, None
    if not hasattr(estimator, "half_width"):
        raise ValueError(
            f"coverage={coverage!r} asks for an interval, which takes a fitted ConformalRegressor; "
            f"got {type(estimator).__name__}."
        )
    if not estimator.scaled:
        raise ValueError(
            "coverage asks for intervals by the deviation, and scaled=False has one width for all "
            "rows: add half_width(coverage) to the answer, or fit with scaled=True."
        )
    reach = np.atleast_1d(estimator.half_width(coverage)).astype(float)
    if not np.isfinite(reach).all():
        raise ValueError(f"coverage={coverage!r} takes an infinite interval, which C has not.")
    found = estimator.estimator_
    return (found.estimator if isinstance(found, FrozenEstimator) else found), reach
