"""Options of ANFISRegressor with settings of their own: a loss, early stopping, extrapolation.

They are scikit-learn objects: ``clone`` copies them, and a grid search can vary their settings:
``GridSearchCV(ANFISRegressor(loss=Huber()), {"loss__epsilon": [1.1, 1.35, 2.0]})``.
"""

import math
from numbers import Integral, Real
from typing import ClassVar, Literal

from sklearn.base import BaseEstimator

from ._sklearn import Interval, StrOptions

__all__ = ["EarlyStopping", "Huber", "LinearExtrapolation"]


class Huber(BaseEstimator):
    """Huber's loss (1964): rows far from the model count by their residual, not by its square.

    If more than half of the targets are one value without noise, such as zero, all other rows count
    as outliers, because the robust scale is a median. Use squared errors for such targets.

    Parameters
    ----------
    epsilon : float, default=1.35
        Residual from which the loss is linear, in robust standard deviations; 0.1 or more. Smaller
        is more robust; 1.35 loses 5 % of the efficiency if there are no outliers.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.options import Huber
    >>> model = ANFISRegressor(n_mfs=1, loss=Huber(epsilon=1.1))
    >>> model = model.fit([[0.0], [1.0], [2.0], [3.0], [4.0]], [0.0, 1.0, 2.0, 99.0, 4.0])
    >>> bool(abs(model.predict([[1.0]])[0] - 1.0) < 0.1)
    True
    """

    _parameter_constraints: ClassVar[dict] = {
        "epsilon": [Interval(Real, 0.1, None, closed="left")],
    }

    def __init__(self, epsilon: float = 1.35) -> None:
        self.epsilon = epsilon


class EarlyStopping(BaseEstimator):
    """Hold out rows, follow the error on them, and keep the parameters at its minimum.

    Parameters
    ----------
    validation_fraction : float, default=0.1
        Fraction of the rows, those with equal inputs as one, or of the groups, that is held out;
        between 0 and 1.
    n_iter_no_change : int, default=10
        Training ends after this many iterations in a row in which the held-out error has not fallen
        by ``tol``; 1 or more.
    tol : float, default=1e-3
        Smallest relative fall of the error that counts; zero or positive.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.options import EarlyStopping
    >>> model = ANFISRegressor(n_mfs=4, early_stopping=EarlyStopping(validation_fraction=0.3))
    >>> model = model.fit(*make_jang_sinc())
    >>> model.validation_loss_curve_.size == model.n_iter_
    True
    """

    _parameter_constraints: ClassVar[dict] = {
        "validation_fraction": [Interval(Real, 0, 1, closed="neither")],
        "n_iter_no_change": [Interval(Integral, 1, None, closed="left")],
        "tol": [Interval(Real, 0, None, closed="left")],
    }

    def __init__(
        self, validation_fraction: float = 0.1, n_iter_no_change: int = 10, tol: float = 1e-3
    ) -> None:
        self.validation_fraction = validation_fraction
        self.n_iter_no_change = n_iter_no_change
        self.tol = tol


class LinearExtrapolation(BaseEstimator):
    """Follow the tangent at the edge beyond the training data, for a limited distance.

    Parameters
    ----------
    max_extrapolation : float or "auto", default="auto"
        How far the tangent is followed beyond the range of an input, in standard deviations of that
        input; the value reached is held. 0 is "clip"; ``math.inf`` is the tangent without end.
        "auto": the target's standard deviation divided by that of the noise, at most 100; 0.5 if
        the noise is not known. See :doc:`/mathematics`.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.options import LinearExtrapolation
    >>> model = ANFISRegressor(n_mfs=1, out_of_bounds=LinearExtrapolation(1.5))
    >>> model.fit([[0.0], [1.0], [2.0]], [0.0, 3.0, 6.0]).predict([[0.5]]).round(6)
    array([1.5])
    """

    _parameter_constraints: ClassVar[dict] = {
        "max_extrapolation": [Interval(Real, 0, math.inf, closed="both"), StrOptions({"auto"})],
    }

    def __init__(self, max_extrapolation: float | Literal["auto"] = "auto") -> None:
        self.max_extrapolation = max_extrapolation


def policy_of(out_of_bounds: "str | LinearExtrapolation") -> tuple[str, float | str]:
    """A model's ``out_of_bounds`` and ``max_extrapolation``, from the estimator's parameter."""
    if isinstance(out_of_bounds, LinearExtrapolation):
        return "linear", out_of_bounds.max_extrapolation
    return out_of_bounds, "auto"
