"""Options of ANFISRegressor that have settings of their own: each with a word for its defaults.

They are scikit-learn objects without data: ``clone`` copies them, and a search reaches into them,
as in ``GridSearchCV(ANFISRegressor(loss=Huber()), {"loss__epsilon": [1.1, 1.35, 2.0]})``; not into
the word ``"huber"``, which has no settings.
"""

import math
from numbers import Integral, Real
from typing import ClassVar, Literal

from sklearn.base import BaseEstimator

from ._sklearn import Interval, StrOptions

__all__ = ["EarlyStopping", "Huber", "LinearExtrapolation", "policy_of"]


class Huber(BaseEstimator):
    """Huber's loss: rows far from the model count by the size of their residual, not its square.

    ``loss="huber"`` stands for its default.

    Parameters
    ----------
    epsilon : float, default=1.35
        Where the loss turns, in robust standard deviations of the residual; positive. The smaller,
        the more robust; 1.35 loses 5 % of the efficiency where there are no outliers.

    See Also
    --------
    skanfis.ANFISRegressor : Takes it as ``loss``.

    References
    ----------
    .. [1] P. J. Huber, "Robust estimation of a location parameter", Annals of Mathematical
       Statistics 35 (1964) 73-101.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.options import Huber
    >>> X = np.linspace(0.0, 1.0, 50).reshape(-1, 1)
    >>> y = X[:, 0] + np.where(np.arange(50) == 7, 100.0, 0.0)
    >>> model = ANFISRegressor(n_mfs=1, loss=Huber(epsilon=1.1)).fit(X, y)
    >>> bool(abs(model.predict(X[-1:])[0] - 1.0) < 1e-3)
    True
    """

    _parameter_constraints: ClassVar[dict] = {
        "epsilon": [Interval(Real, 0, None, closed="neither")],
    }

    def __init__(self, epsilon: float = 1.35) -> None:
        self.epsilon = epsilon


class EarlyStopping(BaseEstimator):
    """Rows held out, the error on them followed, the parameters of its minimum kept.

    ``early_stopping=True`` stands for its defaults.

    Parameters
    ----------
    validation_fraction : float, default=0.1
        Part of the rows, or of the groups, that is held out; between 0 and 1.
    n_iter_no_change : int, default=10
        Training ends after so many iterations in which the error on the rows held out has not
        fallen by ``tol``, relatively; 1 or more.
    tol : float, default=1e-3
        The relative fall that counts as one; zero or positive.

    See Also
    --------
    skanfis.ANFISRegressor : Takes it as ``early_stopping``.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.options import EarlyStopping
    >>> X, y = make_jang_sinc()
    >>> stopped = ANFISRegressor(n_mfs=4, early_stopping=EarlyStopping(validation_fraction=0.3))
    >>> stopped = stopped.fit(X, y)
    >>> stopped.validation_loss_curve_.size == stopped.n_iter_
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

    ``out_of_bounds="linear"`` stands for its default.

    Parameters
    ----------
    max_extrapolation : float or "auto", default="auto"
        How far the tangent is followed beyond the range of an input, in standard deviations of that
        input in the training data: zero or positive. The value reached there is held. 0 holds the
        value at the edge, as "clip" does; ``math.inf`` is the tangent without end. Outputs are
        held as many standard deviations of the target, or half a one where that is more, beyond
        its range, those of several rules a quarter of that range at most.

        "auto" asks the outermost training rows. Had the data ended at the quartiles of every
        input, most rows would have been beyond them; where following the tangent would have
        halved the error of these, the new rows' noise included, it is followed for the distance
        that does best, and for half a one otherwise. A line, a single rule that is followed so, is
        followed for as many standard deviations as those of the target are of the noise
        (``noise_std_``) where that is more, a hundred at most, of several outputs the least of
        all. A model that was read from a file goes as far as the file says.

    See Also
    --------
    skanfis.ANFISRegressor : Takes it as ``out_of_bounds``.

    Examples
    --------
    >>> import math
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.options import LinearExtrapolation
    >>> t = np.linspace(0.0, 1.0, 11)
    >>> model = ANFISRegressor(n_mfs=1, out_of_bounds=LinearExtrapolation(math.inf))
    >>> model = model.fit(t.reshape(-1, 1), 3.0 * t)
    >>> model.predict([[0.5]]).round(6)
    array([1.5])
    """

    _parameter_constraints: ClassVar[dict] = {
        "max_extrapolation": [Interval(Real, 0, math.inf, closed="both"), StrOptions({"auto"})],
    }

    def __init__(self, max_extrapolation: float | Literal["auto"] = "auto") -> None:
        self.max_extrapolation = max_extrapolation


def policy_of(out_of_bounds: "str | LinearExtrapolation") -> tuple[str, float | str]:
    """Give ``out_of_bounds`` and ``max_extrapolation`` of a model for the parameter of that name.

    Parameters
    ----------
    out_of_bounds : str or LinearExtrapolation
        The parameter of ANFISRegressor.

    Returns
    -------
    policy : tuple of str and float or "auto"
        What ``with_out_of_bounds`` of a TSKModel takes.

    Examples
    --------
    >>> from skanfis.options import LinearExtrapolation, policy_of
    >>> policy_of(LinearExtrapolation(1.5)), policy_of("clip")
    (('linear', 1.5), ('clip', 'auto'))
    """
    if isinstance(out_of_bounds, LinearExtrapolation):
        return "linear", out_of_bounds.max_extrapolation
    return out_of_bounds, "auto"
