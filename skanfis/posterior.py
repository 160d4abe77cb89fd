r"""How far off a prediction can be: the posterior of a fit, and the variance of a row's output.

The derivative of a row's output by the consequents is its design phi, that by the premises is d.
With F and T inverse factors of the posterior precision, and B their cross term, the variance is

    sigma^2 + |h|^2 ,    h = [sigma F phi, T d - B F phi] ,

from noise, consequents and premises. Out of the range, at delta from the nearest point c in it, the
variance is that of the tangent at c: h = h(c) + h'(c) delta. docs/mathematics.rst derives both.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import blas

from .antecedent import Antecedent, by_parameter
from .consequent import rule_outputs

# A model of more parameters keeps no posterior: its factor would take more than 32 MB.
MOST_PARAMETERS = 2000
# Known values at points that lie close together count as one below this relative singular value.
_DEPENDENT = 1e-7
# Terms may have a corner on the edge. So the tangent there is that of a parabola through points
# one, two and three steps inside: weights of its value, and of its slope outwards in steps. A step
# is the first part of the narrowest term, or of the input's standard deviation if that is less.
# Terms count as at least the second part of the deviation wide, which floats can still resolve.
_VALUE, _SLOPE = (3.0, -3.0, 1.0), (2.5, -4.0, 1.5)
_STEP, _NARROWEST = 2.0**-14, 2.0**-24


@dataclass(frozen=True, eq=False)
class Posterior:
    r"""One factor of the joint posterior covariance of consequents and premises.

    With phi = w_r [1, x - x0] the design of a row, d_k the derivatives of output k by the
    antecedent's parameters, u = F phi and v_k = T d_k - B_k u, the variance of output k is
    noise_k^2 + |h|^2 - |Q_k h|^2 with h = [noise_k u, v_k].
    """

    noise: np.ndarray  # standard deviation of the noise, in the outputs' units, (n_outputs,)
    inputs: np.ndarray  # inputs that the consequents are linear in
    consequents: np.ndarray  # F, lower triangular, (n_columns, n_columns)
    premises: np.ndarray  # T, (n_displacements, n_parameters); no rows if none were learnt
    cross: np.ndarray  # B_k, (n_outputs, n_displacements, n_columns)
    # Q_k, orthonormal rows: directions that values known for certain fix in each output,
    # (n_outputs, n_pinned, n_columns + n_displacements). Padded with zeros.
    pinned: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 0)))

    def __post_init__(self):
        if not self.pinned.size:
            none = np.zeros((self.noise.size, 0, sum(self.cross.shape[1:])))
            object.__setattr__(self, "pinned", none)

    def __getstate__(self):
        """The state to pickle, without the zeros of the triangle."""
        lower = self.consequents[np.tril_indices(len(self.consequents))]
        return vars(self) | {"consequents": lower}

    def __setstate__(self, state):
        n_columns = int(np.sqrt(2 * state["consequents"].size))
        full = np.zeros((n_columns, n_columns))
        full[np.tril_indices(n_columns)] = state["consequents"]
        vars(self).update(state | {"consequents": full})

    @property
    def n_values(self):
        """Roughly how many numbers per row a deviation holds in memory."""
        return 4 * sum(self.cross.shape[1:]) + 2 * self.noise.size * self.premises.shape[1]

    def change_units(self, antecedent: Antecedent, scale, order):
        """Return the same posterior for inputs given as offset + scale * x, in another order.

        ``antecedent`` is the model's own, before the change.
        """
        place = np.argsort(order)
        widths = np.concatenate([[1.0], scale[self.inputs]])
        return replace(
            self,
            inputs=place[self.inputs],
            consequents=self.consequents / np.tile(widths, antecedent.n_rules),
            premises=self.premises * parameter_units(antecedent, scale),
        )

    def change_target_units(self, scale):
        """Return the same posterior for outputs given as offset + scale * y."""
        pinned = self.pinned.copy()
        pinned[:, :, self.cross.shape[2] :] *= np.sign(scale)[:, None, None]
        return replace(
            self,
            noise=self.noise * np.abs(scale),
            cross=self.cross * scale[:, None, None],
            pinned=pinned,
        )

    def given(self, model, points):
        """The same posterior, given that the outputs at some points are known for certain.

        The remaining uncertainty is orthogonal to that of the known values: h of every row loses
        its part along the h of these points. This is exact for a Gaussian posterior and equalities.
        ``points`` (n_points, n_inputs) lie in the range.
        """
        if not len(points):
            return self
        halves = self._halves(self._rows(model, np.array(points.T, order="C")))
        spans = [_orthonormal_rows(half) for half in halves]
        pinned = np.zeros((self.noise.size, max(map(len, spans)), spans[0].shape[1]))
        for own, rows in zip(pinned, spans, strict=True):
            own[: len(rows)] = rows
        return replace(self, pinned=pinned)

    def of_coefficients(self, n_rules):
        """Deviations of the coefficients on ``model.basis``, (n_rules, n_basis, n_outputs)."""
        n_columns, n_changes = len(self.consequents), self.noise.size * self.premises.shape[1]
        halves = self._halves(np.eye(n_columns + n_changes, n_columns))
        found = [np.sqrt(np.maximum(self._product(k, h, h), 0.0)) for k, h in enumerate(halves)]
        return (np.array(found) * self._unit[:, None]).T.reshape(n_rules, -1, self.noise.size)

    def inside(self, model, Z):
        """Standard deviations (n_outputs, n_rows) at rows Z (n_inputs, n_rows) in the range."""
        halves = self._halves(self._rows(model, Z))
        return self._deviations([self._product(k, h, h) for k, h in enumerate(halves)])

    def of_mean(self, model, Z, before=None):
        """Deviation of the mean over rows, or of its change from rows ``before``, without noise."""
        rows = self._rows(model, Z)
        if before is not None:
            rows = rows - self._rows(model, before)
        halves = self._halves(rows.mean(axis=1, keepdims=True))
        squares = np.array([self._product(k, h, h)[0] for k, h in enumerate(halves)])
        return np.sqrt(np.maximum(squares, 0.0)) * self._unit

    def tangent(self, model, Z, way):
        """Deviations of tangents at points Z of the edge, at the end of ``way`` (n_inputs, n_rows).

        They never fall on the way: the product of value and change counts only if positive.
        """
        lengths = way / _lengths(model)[:, None]
        length = np.sqrt(np.sum(lengths**2, axis=0))
        step = way * (_STEP / np.maximum(length, np.finfo(float).tiny))
        edge = change = 0.0
        # Subtract rows before the product with the factor, so that no digits are lost.
        for i, (of_value, of_slope) in enumerate(zip(_VALUE, _SLOPE, strict=True), start=1):
            rows = self._rows(model, Z - i * step)
            edge, change = edge + of_value * rows, change + of_slope * rows
        squares = []
        ahead = length / _STEP
        pairs = zip(self._halves(edge), self._halves(change), strict=True)
        for k, (half, slope) in enumerate(pairs):
            both, steep = self._product(k, half, slope), self._product(k, slope, slope)
            square = self._product(k, half, half) + 2.0 * np.maximum(both * ahead, 0.0)
            squares.append(square + np.maximum(steep, 0.0) * ahead**2)
        return self._deviations(squares)

    @property
    def _unit(self):
        """A power of two near the noise of every output, as a unit in which squares stay finite."""
        return np.ldexp(1.0, np.frexp(self.noise)[1])

    def _deviations(self, squares):
        """Deviations from squares |h|^2 of every output; never below the noise."""
        noise = (self.noise / self._unit)[:, None]
        return np.sqrt(noise**2 + np.maximum(squares, 0.0)) * self._unit[:, None]

    def _product(self, k, one, other):
        """Inner products of two h of output k, less the part along directions that are known."""
        found = np.einsum("pn,pn->n", one, other)
        if self.pinned.shape[1]:
            found -= np.einsum("pn,pn->n", self.pinned[k] @ one, self.pinned[k] @ other)
        return found

    def _rows(self, model, Z):
        """The design, then the derivatives d_k of every output, (n_values, n_rows)."""
        antecedent = model.antecedent
        log_mu, gradients = antecedent.log_memberships_and_gradient(Z)
        strengths, shares = antecedent.normalise(log_mu)
        basis = model.basis(Z)
        own = basis[np.concatenate([[0], 1 + self.inputs])]
        rows = [(strengths[:, None] * own).reshape(-1, Z.shape[1])]
        for coefficients in model.coefficients.transpose(2, 0, 1) if self.premises.size else ():
            by_term = antecedent.term_sensitivity(
                *rule_outputs(coefficients, strengths, basis), shares
            )
            rows.append(by_parameter(gradients, by_term))
        return np.concatenate(rows)

    def _halves(self, rows):
        """The half h of every output, in its unit, (n_columns + n_displacements, n_rows) each."""
        n_columns, n_parameters = self.consequents.shape[0], self.premises.shape[1]
        # A product with a triangle takes half the work of a full one.
        u = blas.dtrmm(1.0, self.consequents.T, rows[:n_columns].T, side=1).T
        halves = []
        for k, unit in enumerate(self._unit):
            start = n_columns + k * n_parameters
            parts = [u * (self.noise[k] / unit)]
            if self.premises.size:
                changes = rows[start : start + n_parameters] / unit
                parts.append(self.premises @ changes - (self.cross[k] / unit) @ u)
            halves.append(np.concatenate(parts))
        return halves


def parameter_units(antecedent: Antecedent, scale):
    """For every parameter, its change in other units, per change in the units of now."""
    units = []
    for group in antecedent.groups:
        kinds = np.array([parameter.kind for parameter in group.family.parameters])
        units.append(np.where(kinds[:, None] == "location", scale[group.inputs], 1.0).ravel())
    return np.concatenate(units) if units else np.empty(0)


def _lengths(model):
    """Length over which each input's memberships change: its narrowest term, or its deviation."""
    lengths = model.spread.copy()
    for group in model.antecedent.groups:
        natural = group.family.natural(group.theta)
        for parameter, values in zip(group.family.parameters, natural, strict=True):
            if parameter.kind == "log_width":
                np.minimum.at(lengths, group.inputs, values)
    return np.maximum(lengths, _NARROWEST * model.spread)


def _orthonormal_rows(columns):
    """Orthonormal rows that span some columns, (n, n_columns); dependent columns add none."""
    lengths = np.sqrt(np.sum(columns**2, axis=0))
    columns = columns[:, lengths > 0.0] / lengths[lengths > 0.0]
    left, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return left[:, sizes > _DEPENDENT * sizes.max(initial=0.0)].T
