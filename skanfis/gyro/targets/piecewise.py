"""A polynomial on every cell of a grid, and how far an error can be from it at most.

The difference is certain: branch and bound over boxes of one cell each, by the mean value theorem.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ...bounds.search import largest
from .error_model import ErrorModel, polynomial_ranges

# Boxes to look at for each side; how near to the largest difference is near enough, and nothing.
_MOST_BOXES, _TOLERANCE, _NOTHING = 100_000, 0.02, 1e-7
_N_POINTS = 4096


@dataclass(frozen=True, eq=False)
class Piecewise:
    """sum_k c_k prod_j s_j^p_kj with s_j = (x_j - origin_j) / width_j; held beyond the edges.

    ``edges`` (n_cells + 1), ``origins`` (n_cells) and ``widths`` are by axis; ``powers`` are of
    shape (n_terms, n_axes), ``coefficients`` (n_terms, *n_cells) [deg/s]. ``slack`` is what the
    arithmetic of the target adds at most.
    """

    edges: list[np.ndarray]
    origins: list[np.ndarray]
    widths: list[float]
    powers: np.ndarray
    coefficients: np.ndarray
    slack: float

    @property
    def ends(self):
        """Where it begins and ends, (n_axes, 2)."""
        return np.array([edges[[0, -1]] for edges in self.edges])

    def __call__(self, points):
        """Values at points (n_points, n_axes)."""
        held = np.clip(points, *self.ends.T).T
        return self.ranges(held, held)[0][0]

    def ranges(self, low, high):
        """Range over boxes (n_axes, n_boxes) within a cell each, and of the slopes by axis."""
        cells = tuple(
            np.clip(np.searchsorted(edges, x, side="right") - 1, 0, edges.size - 2)
            for edges, x in zip(self.edges, 0.5 * (low + high), strict=True)
        )
        origins = np.array([given[at] for given, at in zip(self.origins, cells, strict=True)])
        widths = np.reshape(self.widths, (-1, 1))
        ends = [(side - origins) / widths for side in (low, high)]
        value, slopes = polynomial_ranges(self.powers, self.coefficients[:, *cells], *ends)
        return value, slopes / widths


def spread(ends):
    """Points all over a box of one or two axes."""
    n_each = round(_N_POINTS ** (1.0 / len(ends)))
    axes = [np.linspace(low, high, n_each) for low, high in ends]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(ends))


def difference(error: ErrorModel, target: Piecewise):
    """What the error minus the target lies between where the target is not held: certainly."""
    points = spread(target.ends)
    errors = error(points)
    sampled = errors - target(points)
    tolerance = _TOLERANCE * np.ptp(sampled) + _NOTHING * np.abs(errors).max()
    ends = []
    for sign in (-1, 1):
        top = int(np.argmax(sign * sampled))
        evaluate = partial(_upper_bounds, error, target, sign)
        start, cuts = (points[top], sign * sampled[top]), _cuts(target.edges)
        low, high = target.ends.T
        found = largest(evaluate, low, high, tolerance, _MOST_BOXES, cuts, start)
        ends.append(sign * (found.bound + target.slack))
    return ends


def _upper_bounds(error, target, sign, low, high):
    """Of sign (error - target) over boxes, as ``bounds.search.largest`` asks for them."""
    middle = low + 0.5 * (high - low)
    value = sign * (error.ranges(middle, middle)[0] - target.ranges(middle, middle)[0])[::sign]
    (_, own), (_, its) = error.ranges(low, high), target.ranges(low, high)
    gain = np.abs([own[0] - its[1], own[1] - its[0]]).max(axis=0) * (high - low)
    bound = value[1] + 0.5 * gain.sum(axis=0) * (1.0 + 1e-9)
    # Of boxes of many cells nothing is known but that they must be cut.
    n_more = np.array(
        [
            np.searchsorted(edges, above) - np.searchsorted(edges, below, side="right")
            for edges, below, above in zip(target.edges, low, high, strict=True)
        ]
    )
    is_known = (n_more <= 0).all(axis=0) & np.isfinite(bound)
    gain = np.where(is_known, gain, n_more)
    return np.where(is_known, bound, np.inf), middle, np.where(is_known, value[0], -np.inf), gain


def _cuts(edges):
    """Inner edges by axis: of those in a box the last is cut at, here that next to the middle."""
    found = np.full((len(edges), max(each.size for each in edges) - 2), np.nan)
    for row, inner in zip(found, (each[1:-1] for each in edges), strict=True):
        places = np.arange(1, inner.size + 1)
        row[: inner.size] = inner[np.argsort(places & -places, kind="stable")]
    return found
