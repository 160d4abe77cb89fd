"""Options of ANFISRegressor that have settings of their own: each with a word for its defaults.

They are scikit-learn objects: ``clone`` copies them, and a search reaches into them, as in
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

    Where more than half of a target is one value without noise, such as zero, all other rows are
    taken for outliers, as by any scale that is a median: such targets take squares.

    Parameters
    ----------
    epsilon : float, default=1.35
        Where the loss turns, in robust standard deviations of the residual; 0.1 or more. The
        smaller, the more robust; 1.35 loses 5 % of the efficiency where there are no outliers.

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
    """Rows held out, the error on them followed, the parameters of its minimum kept.

    Parameters
    ----------
    validation_fraction : float, default=0.1
        Part of the rows, or of the groups, that is held out; between 0 and 1.
    n_iter_no_change : int, default=10
        Training ends after so many iterations in which the error on the rows held out has not
        fallen by ``tol``; 1 or more.
    tol : float, default=1e-3
        The relative fall that counts as one; zero or positive.

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
    """Beyond the training data the tangent at their edge, so far and no further.

    Parameters
    ----------
    max_extrapolation : float or "auto", default="auto"
        How far the tangent is followed beyond the range of an input, in standard deviations of that
        input; the value reached is held. 0 is "clip"; ``math.inf`` is the tangent without end.
        "auto": so many of them as the target's deviation is times that of the noise, a hundred at
        most; half a one where the noise is not known. See :doc:`/mathematics`.

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
    """``out_of_bounds`` and ``max_extrapolation`` of a model, for the parameter of that name."""
    if isinstance(out_of_bounds, LinearExtrapolation):
        return "linear", out_of_bounds.max_extrapolation
    return out_of_bounds, "auto"
