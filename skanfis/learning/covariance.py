r"""The posterior at the end of a fit, by Laplace's method.

The precision of consequents and displacements x of the premises is (docs/mathematics.rst)

    n / sigma^2  [ M   C' ]        M = Phi' S Phi / W + P ,
                 [ C   J  ] ,      J = D' S D / W + kappa I .

M is factored first, as in the fit; the Schur complement of J is H + kappa I, H the reduced
Gauss-Newton matrix. Every output has a sigma of its own for its noise and its consequents; the
premises, which all outputs share, have the root mean square of them.
"""

from dataclasses import replace

import numpy as np
from scipy.special import ndtr

from ..posterior import MOST_PARAMETERS, Posterior, parameter_units
from .objective import Evaluation, SeparableProblem
from .premise import Premise


def posterior_of(
    problem: SeparableProblem,
    premise: Premise | None,
    evaluation: Evaluation,
    effective_weight,
    robust=None,
    held=None,
) -> Posterior | None:
    """The posterior in the user's units; None for models of more than ``MOST_PARAMETERS``.

    ``premise`` is None if the premises were not learnt; ``effective_weight`` counts rows by weight;
    ``robust`` holds the weights that Huber's loss has left the rows, and its epsilon; ``held`` are
    the consequents of the model, if constraints hold them away from those of the evaluation.
    """
    antecedent, rows = evaluation.antecedent, problem.rows
    n_columns, n_parameters = problem.n_columns, antecedent.parameters.size
    if n_columns + n_parameters > MOST_PARAMETERS:
        return None
    if evaluation.normal is None:
        # These consequents were not solved for: they stay, with the factor of a solve there.
        solved = problem.evaluate(antecedent.parameters, evaluation.coefficients)
        evaluation = replace(evaluation, normal=solved.normal)
    normal = evaluation.normal
    assert normal is not None
    half = np.ascontiguousarray(normal.factor.half_solve(np.eye(n_columns)))
    n_effective = len(half) - float(np.sum(half * (half @ normal.penalty)))
    noise = np.sqrt(_mean_squares(problem, evaluation, robust))
    premises = np.zeros((0, n_parameters))
    cross = np.zeros((problem.n_outputs, 0, len(half)))
    n_determined = 0.0
    if premise is not None and premise.size:
        # The slopes by the premises, here and in ``Posterior``, are those of the model.
        there = evaluation if held is None else replace(evaluation, coefficients=held)
        premises, cross, n_determined = _premises(problem, premise, there)
    # At least one degree of freedom, even if there are no more rows than parameters.
    freedom = max(effective_weight - n_effective - n_determined / problem.n_varying, 1.0)
    noise *= np.sqrt(effective_weight / freedom)
    shared = np.sqrt(np.sum(noise**2) / problem.n_varying)
    # L^-1 T' is the factor for consequents on [1, z], T the local basis.
    half = np.ascontiguousarray(problem.local.to_global(half.T).T)
    blocks = half.reshape(len(half), -1, problem.n_basis)
    blocks[:, :, 1:] /= rows.inputs.scale[problem.consequent_inputs]
    half /= np.sqrt(effective_weight)
    if len(half) < n_columns:
        half, cross = _squared(half, cross)
    units, scale = parameter_units(antecedent, rows.inputs.scale), rows.targets.scale
    premises = premises * (shared / np.sqrt(effective_weight)) * units
    cross = cross * (shared * scale)[:, None, None]
    return Posterior(noise * scale, problem.consequent_inputs, half, premises, cross)


def _squared(half, cross):
    """A square lower triangle L with L' L = half' half, and the cross terms in its coordinates."""
    n_free, n_columns = half.shape
    turned, upper = np.linalg.qr(half[:, ::-1])
    triangle = np.zeros((n_columns, n_columns))
    triangle[-n_free:] = upper[::-1, ::-1]
    found = np.zeros((*cross.shape[:2], n_columns))
    found[:, :, -n_free:] = (cross @ turned)[:, :, ::-1]
    return triangle, found


def _mean_squares(problem, evaluation, robust):
    """Weighted mean square of the residual of every standardised output, robust if asked for.

    The robust one is Huber's second proposal (1964): the mean of psi(r)^2, psi = w r, over its
    expectation for a standard normal r.
    """
    if robust is None:
        return evaluation.mean_squares
    weights, c = robust
    total, total_weight = np.zeros(problem.n_outputs), 0.0
    for part, residual, weight in problem.residuals(evaluation):
        left = weights[part]
        # ``weight`` already contains Huber's weights.
        total += residual**2 @ (weight * left)
        total_weight += np.sum(weight / left)
    beyond = 2.0 * ndtr(-c)
    density = np.exp(-0.5 * c * c) / np.sqrt(2.0 * np.pi)
    return total / total_weight / (1.0 - beyond - 2.0 * c * density + c * (c * beyond))


def _premises(problem, premise, evaluation):
    """R^-1 for the standardised parameters, R^-1 C L'^-1, and the number that the data determine.

    R is a root of H + kappa I. sigma^2 / n is one in all of them.
    """
    x = premise.displacement(evaluation.antecedent.parameters)
    raw = problem.curvature(evaluation)
    jacobian, stiffness = premise.jacobian(x), problem.penalty.stiffness
    values, vectors = np.linalg.eigh(jacobian.T @ raw.gauss_newton @ jacobian)
    # Negative eigenvalues are rounding errors of large numbers, as from a row so far off that it
    # has a rule to itself. Directions that neither data nor stiffness tell from them are left out.
    told = np.maximum(values, stiffness) > -values[0]
    values = np.maximum(values[told], premise.size * np.finfo(float).eps * values[-1])
    inverse = vectors[:, told].T / np.sqrt(values + stiffness)[:, None]
    premises = inverse @ jacobian.T
    cross = np.stack([premises @ half.T for half in raw.cross])
    return premises, cross, float(np.sum(values / (values + stiffness)))
