r"""How far off a prediction can be: the posterior of a fit, and the variance that it gives a row.

The cost of ``objective`` is, in units of sigma^2 / n, minus the logarithm of a posterior (see
``evidence``). Laplace's method takes it for Gaussian where the fit ends, with the Gauss-Newton
matrix of consequents beta and displacements x of the premises for its precision,

    n / sigma^2  [ M   C' ]        M = Phi' S Phi / W + P ,
                 [ C   J  ] ,      J = (D' S D + lambda K) / W + kappa I ,

C the part of both. A row's output changes with beta by its design phi, with x by d; eliminated by
M's factor L, as in the fit, its variance is the sum of three parts,

    sigma^2 + sigma^2 / n  |L^-1 phi|^2 + sigma^2 / n  |R^-1 (d - C M^-1 phi)|^2 ,

noise, consequents at fixed premises, premises. R is the factor of H + kappa I, H the reduced
Gauss-Newton matrix. With fixed premises this is Bayesian linear regression.

sigma^2 is what the residual leaves after the effective number of parameters k, as in restricted
maximum likelihood and in MacKay (1992), n MSE / (n - k), k = tr M^-1 G + tr H (H + kappa)^-1. It is
the noise of a row of mean weight. With Huber's loss it is that of rows which are no outliers.
Every output has a sigma of its own for its noise and its
consequents; the premises, which all outputs share, have the mean of them.

Out of the box, on the way delta from its nearest point c, what is asked is how far the model's own
tangent may be from the prediction. Its design is phi(c) + delta phi'(c), and likewise d, so that
its deviation grows linearly. What the prediction does not follow of the tangent (beyond the limit,
or all of it where the edge value is held) is added in full,

    var tangent(x) + (tangent(x) - prediction(x))^2 .

Of the tangent's variance, which is |h0 + h1|^2 with h0 from phi(c) and h1 from delta phi'(c), the
product 2 h0 h1 counts where it is positive only: a deviation never falls on the way out.
"""

from dataclasses import dataclass, field, fields, replace

import numpy as np
from scipy.special import ndtr

from .antecedent import Antecedent
from .consequent import NormalFactor
from .deviation import DerivativeRows, DeviationTables, narrowed
from .learning.objective import Evaluation, SeparableProblem
from .learning.premise import Premise
from .outside import Outside
from .shortest import shortest_tables, single_tables

__all__ = ["MOST_PARAMETERS", "Posterior", "effective_premises"]

# A model of more parameters keeps no posterior: its factor would take more than 32 MB.
MOST_PARAMETERS = 2000
# Where rows leave no freedom, the noise is that of so many.
_LEAST_FREEDOM = 1.0
# Of what is known at points that lie close together, what says nothing new.
_DEPENDENT = 1e-7


@dataclass(frozen=True, eq=False)
class Posterior:
    r"""One factor of the joint posterior covariance of consequents and premises.

    With phi = w_r [1, x - x0] the design of a row, d_k the derivatives of output k by the
    antecedent's parameters, u = F phi and v_k = T d_k - B_k u, the variance of output k is
    noise_k^2 + |h|^2 - |Q_k h|^2 with h = [noise_k u, v_k].

    Attributes
    ----------
    noise : ndarray of shape (n_outputs,)
        Standard deviation of the noise, in the outputs' units.
    inputs : ndarray of int
        The inputs that the consequents are linear in.
    consequents : ndarray of shape (n_columns, n_columns)
        F, lower triangular.
    premises : ndarray of shape (n_displacements, n_parameters)
        T; of no rows where the premises were not learnt.
    cross : ndarray of shape (n_outputs, n_displacements, n_columns)
        B_k.
    pinned : ndarray of shape (n_outputs, n_pinned, n_columns + n_displacements)
        Q_k, orthonormal rows: what is known of each output for certain, by constraints that are
        met with equality. Rows of zeros where outputs have different numbers of them.
    """

    noise: np.ndarray
    inputs: np.ndarray
    consequents: np.ndarray
    premises: np.ndarray
    cross: np.ndarray
    pinned: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 0)))

    def __post_init__(self):
        if not self.pinned.size:
            none = np.zeros((self.noise.size, 0, sum(self.cross.shape[1:])))
            object.__setattr__(self, "pinned", none)

    def __getstate__(self):
        """What a file holds: of a triangle no zeros."""
        lower = self.consequents[np.tril_indices(self.consequents.shape[0])]
        return {one.name: getattr(self, one.name) for one in fields(self)} | {"consequents": lower}

    def __setstate__(self, state):
        n_columns = int(np.sqrt(2 * state["consequents"].size))
        full = np.zeros((n_columns, n_columns))
        full[np.tril_indices(n_columns)] = state["consequents"]
        self.__dict__.update(state | {"consequents": full})
        if "pinned" not in state:
            self.__dict__["pinned"] = np.zeros((0, 0, 0))
            self.__post_init__()

    @classmethod
    def of(
        cls,
        problem: SeparableProblem,
        premise: Premise | None,
        evaluation: Evaluation,
        n_rows,
        robust=None,
    ):
        """The posterior where a fit has ended, in the user's units.

        ``premise`` is None where the premises were not learnt; ``n_rows`` are rows by weight;
        ``robust`` are the weights that Huber's loss has left the rows, and its epsilon. None of a
        model of more than ``MOST_PARAMETERS``.
        """
        antecedent, rows = evaluation.antecedent, problem.rows
        n_columns, n_parameters = problem.n_columns, antecedent.parameters.size
        if n_columns + n_parameters > MOST_PARAMETERS:
            return None
        if evaluation.normal is None:
            # Consequents that were stepped to and not solved for: their own, with that curvature.
            solved = problem.evaluate(antecedent.parameters, evaluation.coefficients)
            evaluation = replace(evaluation, normal=solved.normal)
        normal = evaluation.normal
        assert normal is not None
        half = np.ascontiguousarray(normal.factor.half_solve(np.eye(n_columns)))
        n_effective = n_columns - float(np.sum(half * (half @ normal.penalty)))
        noise = np.sqrt(_mean_squares(problem, evaluation, robust))
        premises = np.zeros((0, n_parameters))
        cross = np.zeros((problem.n_outputs, 0, n_columns))
        n_varying = max(int(np.count_nonzero(~rows.targets.is_constant)), 1)
        n_determined = 0.0
        if premise is not None and premise.size:
            premises, cross, n_determined = _premises(problem, premise, evaluation)
        freedom = n_rows - n_effective - n_determined / n_varying
        noise *= np.sqrt(n_rows / max(freedom, _LEAST_FREEDOM))
        shared = np.sqrt(np.sum(noise**2) / n_varying)
        # L^-1 T' is F on [1, z], T the local basis.
        local = problem.local
        blocks = half.reshape(n_columns, -1, problem.n_basis)
        blocks[:, :, 1:] /= local.spread
        blocks[:, :, 0] -= np.einsum("crj,rj->cr", blocks[:, :, 1:], local.center)
        blocks[:, :, 1:] /= rows.inputs.scale[problem.consequent_inputs]
        half /= np.sqrt(n_rows)
        premises = premises * (shared / np.sqrt(n_rows)) * _units(antecedent, rows.inputs.scale)
        scale = rows.targets.scale
        return cls(
            noise * scale,
            problem.consequent_inputs,
            half,
            premises,
            cross * (shared * scale)[:, None, None],
        )

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
            premises=self.premises * _units(antecedent, scale),
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

    def given(self, model, known):
        """The same posterior, given that what an output does at some points is known.

        Where a value, or a difference of two, is known for certain, what remains uncertain is
        orthogonal to it: of the half h of every row the part along the halves of what is known is
        taken off. Exact for a Gaussian posterior and equalities.

        Parameters
        ----------
        model : TSKModel
            Whose posterior this is, in the user's units.
        known : list of (ndarray, ndarray or None)
            Of every output points (n_points, n_inputs) in the range; values are known there, or, if
            others of as many are given, the changes from those.
        """
        spans = []
        for k, parts in enumerate(known):
            halves = [np.zeros((sum(self.cross.shape[1:]), 0))]
            for points, others in parts:
                half = self._half(model, points, k)
                if others is not None:
                    half -= self._half(model, others, k)
                halves.append(half)
            spans.append(_orthonormal(np.hstack(halves)))
        pinned = np.zeros((self.noise.size, max(map(len, spans)), len(spans[0].T)))
        for own, rows in zip(pinned, spans, strict=True):
            own[: len(rows)] = rows
        return replace(self, pinned=pinned)

    def _half(self, model, X, k):
        """H of output k at points X (n_points, n_inputs), a column each, in units of its noise."""
        Z = np.ascontiguousarray(X.T, dtype=float)
        row, tables = self._row(model, Z), self._double(model)
        design = np.empty((self.consequents.shape[0], Z.shape[1]))
        row.design(design)
        u = tables.factor @ design * (self.noise[k] / tables.unit[k])
        if not self.premises.shape[0]:
            return u
        v = tables.joint[k, : self.premises.shape[0]] @ np.vstack(
            [row.changes(k, tables.unit), design]
        )
        return np.vstack([u, v])

    def inside(self, model, Z, exact=False):
        """Outputs and their deviations, each (n_outputs, n_rows), at rows Z (n_inputs, n_rows).

        u is not formed: u' u is the sum of moments of ``gram``, of which there are fewer. Outputs
        are those of the consequents' own inputs. ``exact`` is in double precision throughout; else
        deviations are right to ``shortest.DIGITS``.
        """
        return self._within(model, Z, self._double(model) if exact else self._shortest(model))

    def _within(self, model, Z, tables):
        row, unit = self._row(model, Z, tables), tables.unit
        shares = narrowed(row.shares, tables.dtype)
        basis = row.basis.astype(tables.dtype, copy=False)
        square = tables.form.values(shares, basis)
        np.maximum(square, 0.0, out=square)
        square += 1.0
        noise = (self.noise[:, None] / unit) ** 2
        found = noise * square + tables.constant
        if tables.joint.shape[1]:
            for k in range(len(unit)):
                half = tables.of_design(k, shares, basis)
                if tables.n_premises:
                    tables.add_premises(k, row.changes(k, unit, tables.dtype), half)
                found[k] += tables.signed(half, half)
        # Never below the noise, whatever rounding leaves of what is known.
        np.maximum(found, noise, out=found)
        return row.outputs, np.sqrt(found) * unit

    def row_of(self, model, Z, outputs, parts):
        """What is known of rows Z (n_inputs, n_rows) already, as ``beyond`` takes it."""
        if self.inputs.size < model.coefficients.shape[1] - 1:
            return self._row(model, Z)
        return DerivativeRows.of_parts(
            model, self.inputs, self.premises.shape[0] > 0, outputs, parts
        )

    def beyond(self, model, row, Z, way, unfollowed, exact=False):
        """Deviation of every output, (n_outputs, n_rows), of rows out of the box.

        Z is the nearest point in it, and ``row`` what ``row_of`` says of that; ``way`` the way from
        there, (n_inputs, n_rows), and ``unfollowed`` (n_outputs, n_rows) what the prediction leaves
        out of the tangent.
        """
        double = self._double(model)
        tables, faces = double, self.__dict__.setdefault("_faces", {})
        if not exact:
            tables = self._once(model, "single", lambda: single_tables(*self._finding(model)))
        outside = Outside(self, model, tables, double, lambda Z: self._row(model, Z), faces)
        square = outside.squares(row, Z, way)
        return np.sqrt(square + (unfollowed / tables.unit) ** 2) * tables.unit

    def _double(self, model):
        return self._once(model, "double", lambda: DeviationTables.of(self, model))

    def _shortest(self, model):
        """What rows in the range are multiplied with."""
        return self._once(
            model, "shortest", lambda: shortest_tables(self.noise, *self._finding(model))
        )

    def _finding(self, model):
        """The model, its tables in double precision, rows and deviations as they are compared."""
        return (
            model,
            self._double(model),
            lambda Z: self._row(model, Z),
            lambda Z, tables: self._within(model, Z, tables)[1],
        )

    def _once(self, model, name, find):
        """Tables of a model with this range, found when they are first asked for."""
        known = self.__dict__.setdefault("_tables_of", {})
        box = model.minimum.tobytes() + model.maximum.tobytes()
        if box not in known:
            known.clear()
            known[box] = {}
        if name not in known[box]:
            known[box][name] = find()
        return known[box][name]

    def _row(self, model, Z, tables=None):
        return DerivativeRows.of(model, Z, self.inputs, self.premises.shape[0] > 0, tables)


def _orthonormal(columns):
    """Orthonormal rows that span some columns, (n, n_columns); what rounding leaves is dropped."""
    lengths = np.sqrt(np.sum(columns**2, axis=0))
    columns = columns[:, lengths > 0.0] / lengths[lengths > 0.0]
    left, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return left[:, sizes > _DEPENDENT * sizes.max(initial=0.0)].T


def effective_premises(problem: SeparableProblem, premise: Premise, evaluation: Evaluation):
    """How many displacements of the premises the data determine, tr H (H + kappa)^-1."""
    return _premises(problem, premise, evaluation)[2] if premise.size else 0.0


def _mean_squares(problem, evaluation, robust):
    """Weighted mean square of the residual of every standardised output, or what outliers leave.

    By Huber's second proposal (1964): the mean of psi(r)^2, psi = w r, over what it is of a
    standard normal r.
    """
    if robust is None:
        return problem.mean_squares(evaluation)
    weights, c = robust
    total, total_weight = np.zeros(problem.n_outputs), 0.0
    for part, residual, weight in problem.residuals(evaluation):
        left = weights[part]
        weight = np.ones(residual.shape[1]) if weight is None else weight
        # The rows' weights have Huber's in them already.
        total += residual**2 @ (weight * left)
        total_weight += np.sum(weight / left)
    beyond = 2.0 * ndtr(-c)
    density = np.exp(-0.5 * c**2) / np.sqrt(2.0 * np.pi)
    return total / total_weight / (1.0 - beyond - 2.0 * c * density + c**2 * beyond)


def _premises(problem, premise, evaluation):
    """R^-1 by the standardised parameters, R^-1 C L'^-1, and how many data determine.

    All with sigma^2 / n equal to one.
    """
    x = premise.displacement(evaluation.antecedent.parameters)
    raw = problem.curvature(evaluation)
    identity = np.eye(premise.size)
    transposed, hessian = premise.pull_back(x, identity, raw.gauss_newton)
    stiffness = problem.penalty.stiffness
    try:
        inverse = NormalFactor(hessian + stiffness * identity).half_solve(identity)
    except FloatingPointError:
        inverse = _of_what_is_told(hessian, stiffness)
    n_determined = len(inverse) - stiffness * float(np.sum(inverse**2))
    premises = inverse @ transposed
    cross = np.stack([premises @ half.T for half in raw.cross])
    return premises, cross, n_determined


def _of_what_is_told(hessian, stiffness):
    """R^-1 of the directions in which a Gauss-Newton matrix is more than rounding.

    It has no negative eigenvalue but for what rounding leaves of large numbers, as beside a row so
    far off that a rule is its own. Directions of no more than the most negative one are held.
    """
    values, vectors = np.linalg.eigh(0.5 * (hessian + hessian.T))
    told = values > -values[0]
    return vectors[:, told].T / np.sqrt(values[told] + stiffness)[:, None]


def _units(antecedent: Antecedent, scale):
    """Of every parameter, how much it changes in the user's units as the standardised changes."""
    units = []
    for group in antecedent.groups:
        kinds = np.array([parameter.kind for parameter in group.family.parameters])
        units.append(np.where(kinds[:, None] == "location", scale[group.inputs], 1.0).ravel())
    return np.concatenate(units) if units else np.empty(0)
