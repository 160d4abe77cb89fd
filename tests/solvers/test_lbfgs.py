"""Joint descent against the optimum that variable projection finds, and its reasons to stop."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis.objective import SeparableProblem
from skanfis.penalty import Penalty
from skanfis.premise import Premise
from skanfis.rows import Rows
from skanfis.solvers.lbfgs import lbfgs
from skanfis.solvers.varpro import varpro

from .. import oracles
from .test_varpro import Recording, planted, start_of


def problem_of(kind, seed=1, alpha=1e-4, agreement=0.0, **settings):
    rows, premise, *_ = planted(kind, seed, displaced=0.3, noise=0.1, **settings)
    penalty = Penalty(agreement=agreement, alpha=alpha)
    return SeparableProblem(rows, premise.antecedent, 1, penalty), premise


@pytest.mark.parametrize(
    ("kind", "n_outputs", "stiffness"),
    [
        ("one input", 1, 0.0),
        ("grid", 1, 0.0),
        ("grid", 1, 1e-3),
        ("grid", 2, 0.0),
        ("scattered", 1, 1e-3),
    ],
)
@pytest.mark.parametrize("agreement", [0.0, 0.1])
def test_optimum_of_variable_projection_is_reached(kind, n_outputs, stiffness, agreement):
    problem, premise = problem_of(kind, n_outputs=n_outputs, agreement=agreement)
    at = [], []
    settings = {"max_iter": 3000, "tol": 1e-6, "stiffness": stiffness}
    reduced, joint = (
        solver(problem, Recording(premise, noted), **settings)
        for solver, noted in zip((varpro, lbfgs), at, strict=True)
    )
    assert joint.converged
    costs = []
    for result, noted in zip((reduced, joint), at, strict=True):
        parameters = result.evaluation.antecedent.parameters
        x = next(x for x in noted if np.array_equal(premise.parameters(x), parameters))
        costs.append(result.evaluation.cost + 0.5 * stiffness * x @ x)
    assert_allclose(costs[1], costs[0], rtol=1e-4)
    solved = problem.evaluate(joint.evaluation.antecedent.parameters)
    assert_allclose(joint.evaluation.cost, solved.cost, rtol=1e-4)


def test_consequents_are_never_solved_for_again():
    problem, premise = problem_of("grid")
    calls = []
    evaluate = problem.evaluate
    problem.evaluate = lambda *arguments: calls.append(arguments) or evaluate(*arguments)
    lbfgs(problem, premise, max_iter=5, tol=0.0)
    assert len(calls) == 1


class TestStatus:
    def check(self, result, status, converged=True):
        assert result.status == status
        assert result.converged is converged
        assert result.loss_curve.shape == (result.n_iter + 1,)

    def test_cost_settles(self):
        problem, premise = problem_of("grid")
        costs = [problem.evaluate(premise.antecedent.parameters).cost]
        result = lbfgs(
            problem,
            premise,
            max_iter=3000,
            tol=1e-4,
            on_iteration=lambda n, e: costs.append(e.cost),
        )
        self.check(result, "cost")
        over_ten = np.array(costs[:-10]) - np.array(costs[10:])
        assert over_ten[-1] <= 1e-4 * costs[-1]
        assert (over_ten[:-1] > 1e-4 * np.array(costs[10:-1])).all()

    def test_gradient_vanishes_where_the_target_is_constant(self, rng):
        X = rng.normal(size=(50, 2))
        rows = Rows.standardised(X, np.full((50, 1), 3.0))
        premise = Premise.of(start_of("grid", rows), *oracles.box(rows))
        problem = SeparableProblem(rows, premise.antecedent, 1, Penalty(alpha=1e-8))
        result = lbfgs(problem, premise, max_iter=10, tol=1e-6)
        self.check(result, "gradient")
        assert result.n_iter == 0

    def test_gradient_vanishes_on_the_way(self):
        # Held so fast that the premises' optimum is at hand, and the ridge makes all of it round.
        problem, premise = problem_of("grid", alpha=1.0)
        result = lbfgs(problem, premise, max_iter=500, tol=1e-2, stiffness=1.0)
        self.check(result, "gradient")
        assert result.n_iter > 0

    def test_step_is_the_end_where_the_gradient_is_wrong(self):
        # A gradient that points uphill: no step decreases the cost.
        problem, premise = problem_of("grid")
        right = problem.joint

        def uphill(*arguments):
            joint = right(*arguments)
            return replace(joint, premises=-joint.premises, coefficients=-joint.coefficients)

        problem.joint = uphill
        result = lbfgs(problem, premise, max_iter=50, tol=1e-6)
        self.check(result, "step")
        assert_allclose(result.evaluation.mean_squared_error, result.loss_curve[0])

    def test_where_nothing_is_tolerated_it_ends_too(self):
        problem, premise = problem_of("grid", alpha=1e-2)
        result = lbfgs(problem, premise, max_iter=20_000, tol=0.0, stiffness=0.1)
        assert result.status in {"step", "cost"}  # no digit of the cost changes any more

    def test_max_iter(self):
        problem, premise = problem_of("grid")
        self.check(lbfgs(problem, premise, max_iter=3, tol=0.0), "max_iter", converged=False)
