"""A polynomial on every cell of a grid, and how far an error can be from it at most.

The difference is certain: over boxes of one cell each, by the mean value theorem.
"""

from dataclasses import dataclass

import numpy as np

from .error_model import ErrorModel, polynomial_ranges

# Boxes to look at, and how small; how near to the largest difference is near enough, and nothing.
_MOST_BOXES, _MOST_CUTS, _TOLERANCE, _NOTHING = 100_000, 30, 0.02, 1e-7
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
    """What the error minus the target lies between where the target is not held: certainly.

    Boxes in which it may be larger than anything met are cut in halves, as long as that helps.
    """
    points = spread(target.ends)
    errors = error(points)
    sampled = errors - target(points)
    enough = _TOLERANCE * np.ptp(sampled) + _NOTHING * np.abs(errors).max()
    least, most = sampled.min(), sampled.max()
    low, high = (
        np.stack(np.meshgrid(*ends, indexing="ij")).reshape(len(ends), -1)
        for ends in ([each[:-1] for each in target.edges], [each[1:] for each in target.edges])
    )
    ends = np.array([least, most])
    for _ in range(_MOST_CUTS):
        below, above = _limits(error, target, low, high)
        is_open = ~((below >= least - enough) & (above <= most + enough))
        if not 0 < 2 ** len(low) * is_open.sum() <= _MOST_BOXES:
            break
        ends = np.array(
            [below[~is_open].min(initial=ends[0]), above[~is_open].max(initial=ends[1])]
        )
        low, high = low[:, is_open], high[:, is_open]
        for axis in range(len(low)):
            middle = 0.5 * (low[axis] + high[axis])
            low, high = np.tile(low, 2), np.tile(high, 2)
            high[axis, : middle.size] = low[axis, middle.size :] = middle
    return [min(ends[0], below.min()) - target.slack, max(ends[1], above.max()) + target.slack]


def _limits(error, target, low, high):
    """What the difference lies between in every box, by its middle and its slopes."""
    middle = 0.5 * (low + high)
    value = error.ranges(middle, middle)[0] - target.ranges(middle, middle)[0][::-1]
    (_, own), (_, its) = error.ranges(low, high), target.ranges(low, high)
    steepest = np.abs([own[0] - its[1], own[1] - its[0]]).max(axis=0)
    reach = 0.5 * (steepest * (high - low)).sum(axis=0) * (1.0 + 1e-9)
    return value[0] - reach, value[1] + reach
