r"""Back-propagation: steepest descent on premises and consequents together.

An epoch takes one step of all parameters, natural premises n (see ``hybrid``) and consequents beta
on [1, z], down the gradient of the cost over all rows,

    (n, beta) -> (n, beta) - kappa g / |g| ,    g = (dE / dn, dE / dbeta) ,

with E the cost of ``objective``, half the mean of (t - o)^2 (Liu et al. 2009) and the penalty.
It ends when the root mean square error meets a goal; the length kappa follows Jang's rule.

The consequents start as the solution of least squares, once, and are never solved for again (the
second of the four methods in Jang 1993, section III). From there this is slow: one epoch is one
cheap pass, but curvatures of so many parameters differ by orders of magnitude, and no single length
of step suits all of them. It is here for comparison with what it is the ancestor of.
"""

from dataclasses import dataclass

import numpy as np

from .hybrid import DescentSolver, Point, View
from .objective import JointGradient

__all__ = ["GradientDescent"]


@dataclass(frozen=True, eq=False)
class _JointPoint(Point):
    """A point, and the gradient there, which the same pass over the data gives."""

    joint: JointGradient


class _FreeConsequents(View):
    """Premises and consequents move."""

    def start(self, x):
        return self._at(x, self.problem.evaluate(self.premise.parameters(x)).coefficients)

    def _at(self, x, coefficients):
        joint = self.problem.joint(self.premise.parameters(x), coefficients)
        cost = joint.evaluation.cost + 0.5 * self.stiffness * (x @ x)
        return _JointPoint(x, joint.evaluation, cost, joint)

    def slope(self, point):
        slope, steepest = self.natural.slope(point.x, point.joint.premises, self.stiffness)
        by_coefficients = point.joint.coefficients.ravel()
        steepest = max(steepest, np.abs(by_coefficients).max())
        return np.concatenate([slope, by_coefficients]), steepest

    def step(self, point, step):
        coefficients = point.evaluation.coefficients
        change = step[point.x.size :].reshape(coefficients.shape)
        return self._at(self.natural.move(point.x, step[: point.x.size]), coefficients + change)


class GradientDescent(DescentSolver):
    """Back-propagation: steepest descent on premises and consequents together.

    Parameters
    ----------
    step_size : float, default=0.01
        Length of the first step, in standardised units; positive.
    error_goal, tol, stiffness
        As for :class:`~skanfis.learning.Hybrid`.

    See Also
    --------
    skanfis.ANFISRegressor : Takes it as ``solver``.

    References
    ----------
    .. [1] J.-S. R. Jang, "ANFIS: adaptive-network-based fuzzy inference system", IEEE Transactions
       on Systems, Man, and Cybernetics 23 (1993) 665-685.

    Examples
    --------
    >>> from sklearn.model_selection import GridSearchCV
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.learning import GradientDescent
    >>> X, y = make_jang_sinc()
    >>> model = ANFISRegressor(n_mfs=2, solver=GradientDescent(), max_iter=20, out_of_bounds="clip")
    >>> search = GridSearchCV(model, {"solver__step_size": [0.001, 0.1]}, cv=2).fit(X, y)
    >>> search.best_params_
    {'solver__step_size': 0.1}
    """

    _view = _FreeConsequents
