r"""How far beyond the data the outermost rows speak for the tangent.

Beyond the data nothing can be measured, but what following the tangent would have done among them
can. Had the box ended at the quartiles of every input, most rows would have been beyond it; what
the model says there, and its tangents, tell these rows the better, the further it is safe to go.
With e(L) their mean squared error where the tangent is followed for L standard deviations of every
input, and sigma the noise of the rows, which new ones have as well, the distance is

    argmin_L e(L)   where   e(L) + sigma^2 < (e(1/2) + sigma^2) / 4 ,

half the error; else it is a half. Distances beyond the outermost row all tell the same, and the
least of them counts: what has not been tried is not relied on.
"""

from dataclasses import replace

import numpy as np

from ..learning.data import StandardisedData
from ..model import TSKModel
from ..policies import FARTHEST, MAX_EXTRAPOLATION
from ..search import representative_rows, weighted_quantile

__all__ = ["told_by_outermost"]

_DISTANCES = (MAX_EXTRAPOLATION, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0, FARTHEST)
# Less of the squared error is more than chance: with a half in place of a quarter, one fit in
# twenty is 4 % worse on rows beyond the range, with a quarter none.
_DECISIVE = 0.25
_QUARTILE = 0.25
# More rows tell nothing new.
_MOST_ROWS = 2000


def told_by_outermost(model: TSKModel, rows: StandardisedData) -> float:
    """L of the tangent beyond the data, in standard deviations of every input, a half or more.

    ``model`` is in the user's units, ``rows`` are those that it was trained on.
    """
    table, weight, _ = representative_rows(rows.sample or rows, _MOST_ROWS)
    X, y = np.hsplit(table, [model.n_inputs])
    X = np.clip(rows.inputs.offset + rows.inputs.scale * X, model.minimum, model.maximum)
    y = rows.targets.offset + rows.targets.scale * y
    low, high = (
        np.array([weighted_quantile(column, weight, _QUARTILE, side) for column in X.T])
        for side in (1, -1)
    )
    nearest = np.clip(X, low, high)
    is_beyond = (nearest != X).any(axis=1)
    if not is_beyond.any():
        return MAX_EXTRAPOLATION
    X, y, nearest, weight = X[is_beyond], y[is_beyond], nearest[is_beyond], weight[is_beyond]
    way = (X - nearest) / model.spread
    free = replace(model, target=None)  # outputs are not held
    values, slopes = free.predict(nearest), free.gradient(nearest) * model.spread[:, None]
    if model.posterior is None:
        deviations = (free.predict(X) - y) / rows.targets.scale
        noise = float(np.average(deviations**2, axis=0, weights=weight).sum())
    else:
        noise = float(np.sum((model.posterior.noise / rows.targets.scale) ** 2))

    def left_by(distance):
        told = values + np.einsum("nj,njo->no", np.clip(way, -distance, distance), slopes)
        squares = ((told - y) / rows.targets.scale) ** 2
        return float(np.average(squares, axis=0, weights=weight).sum()) + noise

    left = [left_by(distance) for distance in _DISTANCES]
    best = int(np.argmin(left))
    return _DISTANCES[best] if left[best] < _DECISIVE * left[0] else MAX_EXTRAPOLATION
