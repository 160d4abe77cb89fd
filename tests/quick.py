"""An estimator whose weights are given: where it matters that a model is fitted, and not which."""

from skanfis import ANFISRegressor
from skanfis.solvers import VariableProjection


def quick(n_mfs=2, **settings):
    """What finds no weights by the evidence, and so is fitted in a fifth of the time."""
    given = {"agreement": 0.1, "alpha": 1e-5, "solver": VariableProjection(stiffness=1e-3)}
    if "partition" in settings:
        return ANFISRegressor(**given | settings)
    return ANFISRegressor(n_mfs, **given | settings)
