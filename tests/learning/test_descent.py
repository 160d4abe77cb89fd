"""Jang's rule against a transcription of his paper that shares nothing with the package.

And descent along the joint gradient, of which test_objective speaks.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.datasets import make_jang_three_input
from skanfis.learning import GradientDescent, Hybrid
from skanfis.learning.data import StandardisedData
from skanfis.learning.descent import NaturalPremise
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.learning.premise import Premise
from skanfis.membership import MEMBERSHIPS, Bell
from skanfis.search.sample import unit_scale

from .. import oracles
from .test_varpro import planted


class Jang1993:
    """ANFIS with two bells per input, in numpy's plainest, after sections II to IV of the paper.

    Premises are an array (n_inputs, 2, 3) of a, b, c; rules are all combinations of bells.
    """

    def __init__(self, X, y):
        self.X, self.y = X, y

    def premises_at_the_start(self):
        """Bells at the ends of each input that cross in the middle at one half, with b = 2."""
        ends = np.stack([self.X.min(axis=0), self.X.max(axis=0)], axis=1)
        return np.array([[[np.ptp(own) / 2, 2.0, c] for c in own] for own in ends])

    def layers_1_to_3(self, premises):
        """Normalised firing strengths of each rule, a column each."""
        products = [np.ones(len(self.X))]
        for x, bells in zip(self.X.T, premises, strict=True):
            mu = [1 / (1 + (((x - c) / a) ** 2) ** b) for a, b, c in bells]
            products = [product * m for product in products for m in mu]
        return np.array(products).T / np.sum(products, axis=0)[:, None]

    def output(self, premises, consequents):
        """Layers 4 and 5."""
        strengths = self.layers_1_to_3(premises)
        return np.sum(strengths * (self.X @ consequents[:, :-1].T + consequents[:, -1]), axis=1)

    def least_squares(self, premises):
        """p, q, r, ... of all rules."""
        strengths, inputs = self.layers_1_to_3(premises), np.c_[self.X, np.ones(len(self.X))]
        A = np.einsum("nr,ni->nri", strengths, inputs).reshape(len(self.X), -1)
        solution, *_ = np.linalg.lstsq(A, self.y, rcond=None)
        return solution.reshape(strengths.shape[1], -1)

    def train(self, epochs, step_size):
        """RMSE before the first epoch and after each, and the premises in the end."""
        premises, errors, grown, shrunk = self.premises_at_the_start(), [], 0, 0
        for epoch in range(epochs + 1):
            consequents = self.least_squares(premises)
            error = self.y - self.output(premises, consequents)
            errors.append(np.sqrt(np.mean(error**2)))
            if epoch == epochs:
                return np.array(errors), premises
            if epoch - grown >= 4 and all(np.diff(errors[-5:]) < 0):
                step_size, grown = 1.1 * step_size, epoch
            if epoch - shrunk >= 4:
                up_1, down_1, up_2, down_2 = np.diff(errors[-5:])
                if up_1 > 0 and down_1 < 0 and up_2 > 0 and down_2 < 0:
                    step_size, shrunk = 0.9 * step_size, epoch

            def measure(flat, consequents=consequents, shape=premises.shape):
                return np.sum((self.y - self.output(flat.reshape(shape), consequents)) ** 2)

            gradient = oracles.complex_step(measure, premises.ravel())
            eta = step_size / np.sqrt(np.sum(gradient**2))
            premises = premises - eta * gradient.reshape(premises.shape)
        raise AssertionError


def in_raw_units(X, y):
    """Rows that are not standardised, as Jang's were not."""
    return StandardisedData(X, y[:, None], None, unit_scale(X), unit_scale(y[:, None]))


def two_bells(rows):
    """The problem and the premise of Jang's examples; neighbours cross at one half."""
    low, high = rows.inputs.box
    n_inputs = low.size
    antecedent = oracles.even_grid([Bell] * n_inputs, [2] * n_inputs, low, high, 0.5)
    problem = SeparableProblem(rows, antecedent, Penalty())
    return problem, Premise.of(antecedent, low, high, is_unbounded=True)


@pytest.mark.theory
@pytest.mark.parametrize(("step_size", "raw"), [(0.01, True), (0.1, False)])
def test_three_input_problem_is_trained_as_by_the_transcription(step_size, raw):
    X, y = make_jang_three_input()
    rows = in_raw_units(X, y) if raw else StandardisedData.of(X, y[:, None])
    seen = []
    result = Hybrid(tol=0.0, step_size=step_size).solve(
        *two_bells(rows), max_iter=60, on_iteration=lambda n, at: seen.append(at.antecedent)
    )
    table = rows.table(slice(None))
    errors, premises = Jang1993(table[:, :-1], table[:, -1]).train(60, step_size)
    assert_allclose(np.sqrt(result.loss_curve), errors, rtol=1e-7)
    assert errors[-1] < 0.8 * errors[0]
    (group,) = seen[-1].groups
    center, width, slope = group.family.natural(group.theta)
    found = np.stack([width, slope, center], axis=-1).reshape(premises.shape)
    assert_allclose(found, premises, rtol=1e-7, atol=1e-7)


@pytest.mark.theory
@pytest.mark.parametrize("kind", ["one input", "two families", "scattered", *MEMBERSHIPS])
def test_slope_is_the_derivative_by_the_numbers(kind, rng):
    """That a person reads, and that a move adds to; in a box that nothing leaves."""
    one = np.ones(2)
    if kind in MEMBERSHIPS:
        antecedent = oracles.even_grid([MEMBERSHIPS[kind]] * 2, [3, 2], -one, one, 0.6)
        premise = Premise.of(antecedent, -one, one)
    else:
        premise = planted(kind, 0)[1]
    edge = np.full(premise.size, 20.0)
    premise = replace(premise, lower=-edge, upper=edge)
    natural = NaturalPremise(premise)
    x, weights = 0.2 * rng.normal(size=premise.size), rng.normal(size=premise.size)
    stiffness = 0.3

    def numbers(x):
        groups = premise.antecedent.with_parameters(premise.parameters(x)).groups
        return np.concatenate([g.family.natural(g.theta).ravel() for g in groups])

    def function(step):
        moved = natural.move(x, step)
        penalty = 0.5 * stiffness * moved @ moved
        return weights @ np.sin(premise.parameters(moved)) + penalty

    step = 0.1 * rng.uniform(-1.0, 1.0, premise.size)
    assert_allclose(numbers(natural.move(x, step)), numbers(x) + step, rtol=1e-12, atol=1e-13)
    by_parameters = weights * np.cos(premise.parameters(x))
    slope, _ = natural.slope(x, by_parameters, stiffness)
    expected = oracles.central_difference(function, np.zeros(premise.size), 1e-3)
    assert_allclose(slope, expected, rtol=1e-8, atol=1e-10)


class TestEnd:
    def solve(self, max_iter, **settings):
        rows, premise, *_ = planted("grid", 0, displaced=0.5, noise=0.1)
        penalty = Penalty(alpha=1e-8, slope=1e-8)
        problem = SeparableProblem(rows, premise.antecedent, penalty)
        return Hybrid(tol=0.0, **settings).solve(problem, premise, max_iter=max_iter)

    def test_error_goal_ends_it(self):
        free = self.solve(30)
        goal = np.sqrt(free.loss_curve[12])
        result = self.solve(30, error_goal=goal)
        assert result.status == "error_goal"
        assert result.converged
        first = int(np.argmax(np.sqrt(free.loss_curve) <= goal))
        assert result.n_iter == first
        assert_array_equal(result.loss_curve, free.loss_curve[: first + 1])
        assert np.sqrt(result.evaluation.mean_squared_error) <= goal

    def test_best_epoch_and_not_the_last(self):
        # So long a step goes up and down.
        result = self.solve(25, step_size=0.5)
        best = int(result.loss_curve.argmin())
        assert best < 25
        assert_allclose(result.evaluation.mean_squared_error, result.loss_curve[best])


def test_step_is_along_the_gradient_by_natural_premises_and_consequents():
    rows, premise, *_ = planted("bells", 0, displaced=0.5, noise=0.1, n_outputs=2)
    antecedent, penalty = premise.antecedent, Penalty(agreement=0.1, alpha=1e-4, slope=1e-3)
    problem = SeparableProblem(rows, antecedent, penalty)
    dense = oracles.DenseProblem(rows, antecedent, 1, penalty)
    seen = []
    solver = GradientDescent(tol=0.0)
    solver.solve(problem, premise, max_iter=2, on_iteration=lambda n, e: seen.append(e))
    # The first step, from the solution of least squares, leaves the consequents where they are.
    (before, start), (_, found) = ((one, variables_of(one)) for one in seen)
    n_consequents = before.coefficients.size

    def cost(variables):
        center, width, slope = variables[:-n_consequents].reshape(3, -1)
        parameters = np.concatenate([center, np.log(width), np.log(slope)])
        return dense.cost_at(parameters, variables[-n_consequents:].reshape(-1, 2))

    slope = oracles.complex_step(cost, start)
    assert np.linalg.norm(slope[-n_consequents:]) > 0.01 * np.linalg.norm(slope)
    expected = start - 0.01 * slope / np.linalg.norm(slope)
    assert_allclose(found, expected, rtol=0, atol=1e-9)


def variables_of(evaluation):
    """Numbers of the premises, as a person reads them, and consequents, in a row."""
    (group,) = evaluation.antecedent.groups
    natural = group.family.natural(group.theta)
    return np.concatenate([natural.ravel(), evaluation.coefficients.ravel()])
