r"""How far a deviation in C may be from Python's: by longer steps, and by rounding.

With eps the spacing of floats at one, what is multiplied is off by some eps, and a sum of products
by less than its root mean square error of sqrt(n) eps (Higham and Mary 2019) of products that are
all of one size, which is some eps of the sum of their absolute values. Of u = F phi that is

    d = 16 eps | |F| |phi| | ,

likewise of v, in the precision of C and in Python's. Python sums |u|^2 from a table of F'F, and is
off by some eps of the square of that size. The deviation is the root of noise^2 + |h|^2
with h = [u, v], less what is known: off by d |h| over itself. Out of the range h is h0 + length h1
with differences over a step, and d grows by their weights over the step. In double precision points
inside are rounded to eps |c|, and the way turns by that over the step: h1 is off by what it would
be along the inputs themselves.
"""

from dataclasses import dataclass

import numpy as np

from ...deviation import DerivativeRows, DeviationTables

__all__ = ["Differences", "deviation_rounding", "longer_steps"]

# In eps: of shares, products and tables together.
_ROUNDINGS = 16.0
_DOUBLE, _TINY = np.finfo(float).eps, np.finfo(float).tiny


@dataclass(frozen=True)
class Differences:
    """How C goes out of the range: its step, in deviations, and the weights of points inside."""

    step: float
    of_slope: tuple[float, ...]
    at_edge: tuple[float, ...]
    by_distance: bool

    def growth(self, length):
        """What errors of halves are multiplied by, so many deviations out of the range."""
        slope = np.abs(self.of_slope).sum() * length / self.step
        return np.where(length > 0.0, np.abs(self.at_edge).sum() + slope, 1.0)


def longer_steps(model, X, wanted, differences: Differences):
    """Deviations (n_rows, n_outputs) by these differences but for rounding; wanted in the range."""
    tables = DeviationTables.of(model.posterior, model)
    near, way, length, ruler = _way(model, tables, X)
    outside, found = length > 0.0, wanted.copy()
    if not outside.any():
        return found
    near, way, length = near[:, outside], way[:, outside], length[outside]
    step = differences.step * ruler[:, outside] * way / length
    for k, (unit,) in enumerate(tables.unit):
        points = [
            _Halves(model, tables, near - place * step, k)
            for place in range(1, 1 + len(differences.of_slope))
        ]
        edge = _mean(points, differences.at_edge)
        slope = _mean(points, np.array(differences.of_slope) / differences.step) * length
        n = len(points[0].values)
        signs = np.where(np.arange(len(edge)) < n, 1.0, -1.0)[:, None]
        both = np.sum(signs * edge * slope, axis=0)
        square = np.sum(signs * (edge**2 + slope**2), axis=0) + 2.0 * np.maximum(both, 0.0)
        left = np.sum(_left_out(model, X[outside]) * model.gradient(X[outside])[:, :, k], axis=1)
        square += (model.posterior.noise[k] / unit) ** 2 + (left / unit) ** 2
        found[outside, k] = np.sqrt(square) * unit
    return found


def deviation_rounding(model, X, wanted, dtype, differences: Differences):
    """What deviations ``wanted`` (n_rows, n_outputs) of rows X may be off by, of the same shape."""
    tables = DeviationTables.of(model.posterior, model)
    near, way, length, ruler = _way(model, tables, X)
    found, left = [], _left_out(model, X)
    for k, (unit,) in enumerate(tables.unit):
        at = _Halves(model, tables, near, k)
        off = at.rounding(dtype) * differences.growth(length)
        along = np.zeros_like(length)
        for j in np.flatnonzero(way.any(axis=1)):
            step = differences.step * ruler[j]
            change = _change(model, tables, near, k, j, step * np.sign(way[j]))
            slope = change / differences.step
            along += np.abs(way[j]) * slope
            if not differences.by_distance:
                digits = _DOUBLE * np.abs(near[j]) / step
                off += np.where(way[j] != 0.0, 4.0 * digits * length * slope, 0.0)
        whole = _length(at.values) + along
        off += _ROUNDINGS * np.finfo(dtype).eps * whole
        # Of a square, which a root makes more of where there is nothing beside it.
        table = np.sqrt(_ROUNDINGS * _DOUBLE) * _length(at.sizes[0]) * (1.0 + length)
        right = wanted[:, k] / unit
        off += table**2 / np.maximum(right, np.maximum(table, _TINY))
        off *= unit * np.maximum(whole / np.where(right > 0.0, right, np.inf), 1.0)
        found.append(off + at.rounding_of_tangent(model, left.T, k, dtype))
    return np.stack(found, axis=1)


def _way(model, tables, X):
    """Nearest points in the range, the way from there, its length, and what measures it."""
    near = np.clip(X.T, model.minimum[:, None], model.maximum[:, None])
    below, above = tables.rulers[:, :, None]
    ruler = np.where(near > X.T, below, above)
    way = (X.T - near) / ruler
    return near, way, _length(way), ruler


def _left_out(model, X):
    """The way that a prediction does not follow the tangent, (n_rows, n_inputs)."""
    way = X - np.clip(X, model.minimum, model.maximum)
    return way - model.way_out(X) if model.out_of_bounds == "linear" else way


def _change(model, tables, near, k, j, step):
    """How much h changes from two steps inside to one along one input, (n_rows,)."""
    points = [near.copy(), near.copy()]
    for inside, point in enumerate(points, start=1):
        point[j] -= inside * step
    first, second = (_Halves(model, tables, point, k).values for point in points)
    return _length(first - second)


class _Halves:
    """H of rows Z (n_inputs, n_rows) for one output, and the size of the sums that it consists of.

    In units of the noise: ``values`` (n_halves, n_rows), and ``known``, whose squares are taken
    off; sizes without the output's constant, and of it.
    """

    def __init__(self, model, tables, Z, k):
        posterior = model.posterior
        row = DerivativeRows.of(model, Z, posterior.inputs, tables.n_premises > 0)
        design = np.empty((tables.factor.shape[0], Z.shape[1]))
        row.design(design)
        n, joint = tables.n_added, tables.joint[k]
        factor = posterior.noise[k] / tables.unit[k] * tables.factor
        sizes, rows = np.abs(design), design
        self.row, self.of_terms = row, _sizes_of_terms(model, row, k)
        self.of_constant = np.zeros(Z.shape[1])
        if tables.n_premises:
            rows = np.vstack([row.changes(k, tables.unit), design])
            unit = tables.unit[k]
            free, constant = (_by_parameters(row, one) / unit for one in self.of_terms)
            sizes = np.vstack([free, sizes])
            self.of_constant = _length(np.abs(joint[:n, : len(constant)]) @ constant)
        both = joint @ rows
        self.values, self.known = np.vstack([factor @ design, both[:n]]), both[n:]
        self.sizes = [np.abs(factor) @ np.abs(design), np.abs(joint[:n]) @ sizes]

    def rounding(self, dtype):
        """What each row's half is off by, in C and in Python."""
        return _lost(dtype, _length(np.vstack(self.sizes)), self.of_constant)

    def rounding_of_tangent(self, model, way, k, dtype):
        """What a prediction's tangent along a way (n_inputs, n_rows) is off by."""
        free, constant = (
            _size_of_tangent(model, self.row, way, k, one, with_slopes)
            for one, with_slopes in zip(self.of_terms, (True, False), strict=True)
        )
        return _lost(dtype, free, constant)


def _lost(dtype, sizes, of_constant):
    """What sums of such sizes are off by; C takes the output's constant off before."""
    return _ROUNDINGS * ((np.finfo(dtype).eps + _DOUBLE) * sizes + _DOUBLE * of_constant)


def _mean(points, weights):
    """Values, then what is known, of several points by weight."""
    return sum(
        weight * np.vstack([point.values, point.known])
        for weight, point in zip(weights, points, strict=True)
    )


def _sizes_of_terms(model, row, k):
    """Sizes of the derivatives by terms, without the output's constant, and of that."""
    coefficients = model.coefficients[:, :, k].copy()
    constant = float(model.rule_weights @ coefficients[:, 0]) / model.rule_weights.sum()
    coefficients[:, 0] -= constant
    columns = np.append(0, 1 + model.posterior.inputs) if model.order == 1 else [0]
    spread = np.append(1.0, model.spread[model.posterior.inputs])
    heights = np.abs(coefficients[:, columns]) * spread[: len(columns)]
    free, of_constant = row.strengths * (heights @ np.abs(row.basis)), abs(constant) * row.strengths
    return [
        model.antecedent.sum_over_rules(one + row.strengths * one.sum(axis=0))
        for one in (free, of_constant)
    ]


def _by_parameters(row, of_terms):
    """Sizes of the derivatives by parameters of those by terms."""
    start, parts = 0, []
    for gradient in row.gradients:
        own = of_terms[start : start + gradient.shape[1]]
        parts.append((np.abs(gradient) * own).reshape(-1, own.shape[1]))
        start += gradient.shape[1]
    return np.concatenate(parts)


def _size_of_tangent(model, row, way, k, of_terms, with_slopes):
    """Size of the sums that a prediction's tangent along a way consists of, (n_rows,)."""
    total, start = np.zeros(way.shape[1]), 0
    for group, gradient in zip(model.antecedent.groups, row.gradients, strict=True):
        own = of_terms[start : start + group.n_terms]
        total += np.sum(np.abs(gradient[0] * way[group.inputs]) * own, axis=0)
        start += group.n_terms
    if with_slopes and model.order == 1:
        slopes = np.abs(model.coefficients[:, 1:, k])
        total += np.sum(row.strengths * (slopes @ np.abs(way)), axis=0)
    return total


def _length(rows):
    return np.sqrt(np.sum(rows**2, axis=0))
