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

from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.linalg import blas
from scipy.special import ndtr

from .antecedent import Antecedent
from .consequent import NormalFactor, basis, rule_outputs
from .gram import DesignMoments
from .objective import Evaluation, SeparableProblem
from .premise import Premise

__all__ = ["MOST_PARAMETERS", "Posterior"]

# A model of more parameters keeps no posterior: its factor would take more than 32 MB.
MOST_PARAMETERS = 2000
# Where rows leave no freedom, the noise is that of so many.
_LEAST_FREEDOM = 1.0
# Derivatives along a way out of the box, by differences of this many standard deviations. They are
# taken inside: terms may have a corner on the edge. These weights of the values at one, two and
# three steps inside are exact for parabolas.
_STEP = 1e-4
_WEIGHTS = (2.5, -4.0, 1.5)


@dataclass(frozen=True, eq=False)
class Posterior:
    r"""One factor of the joint posterior covariance of consequents and premises.

    With phi = w_r [1, x - x0] the design of a row, d_k the derivatives of output k by the
    antecedent's parameters, u = F phi and v_k = T d_k - B_k u, the variance of output k is
    noise_k^2 (1 + |u|^2) + |v_k|^2.

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
    """

    noise: np.ndarray
    inputs: np.ndarray
    consequents: np.ndarray
    premises: np.ndarray
    cross: np.ndarray

    def __getstate__(self):
        """What a file holds: of a triangle no zeros."""
        lower = self.consequents[np.tril_indices(self.consequents.shape[0])]
        return {one.name: getattr(self, one.name) for one in fields(self)} | {"consequents": lower}

    def __setstate__(self, state):
        n_columns = int(np.sqrt(2 * state["consequents"].size))
        full = np.zeros((n_columns, n_columns))
        full[np.tril_indices(n_columns)] = state["consequents"]
        self.__dict__.update(state | {"consequents": full})

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
        return replace(
            self, noise=self.noise * np.abs(scale), cross=self.cross * scale[:, None, None]
        )

    def inside(self, model, Z):
        """Outputs and their deviations, each (n_outputs, n_rows), at rows Z (n_inputs, n_rows).

        u is not formed: u' u is the sum of moments of ``gram``, of which there are fewer. Outputs
        are those of the consequents' own inputs.
        """
        strengths, shares, basis_rows, outputs, changes = self._derivatives(model, Z)
        moments, table, slopes = self._tables(model)
        basis_rows[1:] /= model.spread[self.inputs, None]
        square = moments.quadratic(table, shares, basis_rows)
        unit = self._unit
        found = (self.noise[:, None] / unit) ** 2 * (1.0 + np.maximum(square, 0.0))
        for k, change in enumerate(changes):
            by_basis = (slopes[k] @ strengths).reshape(basis_rows.shape[0], -1, Z.shape[1])
            half = self.premises @ change
            # The first basis function is one.
            half -= by_basis[0]
            half -= np.einsum("iqn,in->qn", by_basis[1:], basis_rows[1:])
            half /= unit[k]
            found[k] += np.einsum("qn,qn->n", half, half)
        return outputs, np.sqrt(found) * unit

    def beyond(self, model, Z, way, unfollowed):
        """Deviation of every output, (n_outputs, n_rows), of rows out of the box.

        Z is the nearest point in it, ``way`` the way from there, (n_inputs, n_rows), and
        ``unfollowed`` (n_outputs, n_rows) what the prediction leaves out of the tangent.
        """
        halves = self._halves(model, Z)
        length = np.sqrt(np.sum((way / model.spread[:, None]) ** 2, axis=0))
        step = way * (_STEP / np.maximum(length, np.finfo(float).tiny))
        inside = [self._halves(model, Z - (k + 1) * step) for k in range(len(_WEIGHTS))]
        slopes = []
        for parts in zip(*inside, strict=True):
            slope = sum(w * part for w, part in zip(_WEIGHTS, parts, strict=True))
            slopes.append(slope * (length / _STEP))
        growth = 2.0 * np.maximum(self._products(halves, slopes), 0.0)
        growth += self._products(slopes, slopes)
        unit = self._unit
        found = (self.noise[:, None] / unit) ** 2 + self._products(halves, halves) + growth
        return np.sqrt(found + (unfollowed / unit) ** 2) * unit

    def values_per_row(self, beyond):
        """Numbers that a row takes while its variance is found, in range or ``beyond``.

        In range far from all, and not u: larger blocks cost less than what the cache lacks.
        """
        n_columns, n_parameters = self.consequents.shape[0], self.premises.shape[1]
        return 3 * n_parameters + (n_columns if beyond else 0)

    def _tables(self, model):
        """What ``inside`` needs of F and B_k, found once: moments, table of F' F, B_k F."""
        if not hasattr(self, "_cached"):
            n_rules, n_basis = model.n_rules, 1 + self.inputs.size
            # Of inputs in standard deviations: squares of others might be beyond all floats.
            widths = np.concatenate([[1.0], model.spread[self.inputs]])
            factor = self.consequents * np.tile(widths, n_rules)
            moments = DesignMoments(model.antecedent.share_counts, n_basis)
            slopes = (self.cross @ factor).reshape(*self.cross.shape[:2], n_rules, n_basis)
            slopes = slopes.transpose(0, 3, 1, 2).reshape(self.noise.size, -1, n_rules)
            found = moments, moments.of_matrix(factor.T @ factor), np.ascontiguousarray(slopes)
            object.__setattr__(self, "_cached", found)
        return self.__dict__["_cached"]

    @property
    def _unit(self):
        """A power of two near the noise of every output, (n_outputs, 1): squares stay finite."""
        return np.ldexp(1.0, np.frexp(self.noise)[1])[:, None]

    def _products(self, one, other):
        """Inner products of every output and row in squares of its unit, (n_outputs, n_rows)."""
        found = (self.noise[:, None] / self._unit) ** 2 * np.einsum("pn,pn->n", one[0], other[0])
        return found + np.einsum("kqn,kqn->kn", one[1], other[1])

    def _halves(self, model, Z):
        """U (n_columns, n_rows), and v of every output (n_outputs, n_displacements, n_rows).

        The latter in units of ``_unit``.
        """
        strengths, _, basis_rows, _, changes = self._derivatives(model, Z)
        design = (strengths[:, None, :] * basis_rows).reshape(-1, Z.shape[1])
        # Half the work of a full product, and in Fortran order no copies.
        half = blas.dtrmm(1.0, self.consequents.T, design.T, side=1, lower=0, overwrite_b=1).T
        found = np.empty((self.noise.size, self.premises.shape[0], Z.shape[1]))
        for k, change in enumerate(changes):
            found[k] = (self.premises @ change - self.cross[k] @ half) / self._unit[k]
        return half, found

    def _derivatives(self, model, Z):
        """Strengths, shares, basis, outputs, and every output's derivatives by the premises."""
        antecedent = model.antecedent
        log_mu, gradients = antecedent.log_memberships_and_gradient(Z)
        strengths, shares = antecedent.normalise(log_mu)
        basis_rows = basis(Z[self.inputs] - model.reference[self.inputs, None])
        columns = np.concatenate([[0], 1 + self.inputs]) if model.order == 1 else [0]
        outputs, every = [], []
        for one in model.coefficients[:, columns].transpose(2, 0, 1):
            by_rule, output = rule_outputs(one, strengths, basis_rows)
            outputs.append(output)
            if self.premises.shape[0] == 0:
                continue
            by_term = antecedent.term_sensitivity(by_rule, output, shares)
            changes = np.empty((self.premises.shape[1], Z.shape[1]))
            row = term = 0
            for gradient in gradients:
                out = changes[row : row + gradient.shape[0] * gradient.shape[1]]
                own = by_term[term : term + gradient.shape[1]]
                np.multiply(gradient, own, out=out.reshape(gradient.shape))
                row, term = row + out.shape[0], term + own.shape[0]
            every.append(changes)
        return strengths, shares, basis_rows, np.stack(outputs), every


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
    factor = NormalFactor(hessian + stiffness * identity)
    inverse = factor.half_solve(identity)
    n_determined = premise.size - stiffness * float(np.sum(inverse**2))
    premises = inverse @ transposed
    cross = np.stack([premises @ half.T for half in raw.cross])
    return premises, cross, n_determined


def _units(antecedent: Antecedent, scale):
    """Of every parameter, how much it changes in the user's units as the standardised changes."""
    units = []
    for group in antecedent.groups:
        kinds = np.array([parameter.kind for parameter in group.family.parameters])
        units.append(np.where(kinds[:, None] == "location", scale[group.inputs], 1.0).ravel())
    return np.concatenate(units) if units else np.empty(0)
