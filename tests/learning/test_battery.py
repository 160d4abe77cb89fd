"""What every solver has to do, whatever its method: one set of tests over all of ``SOLVERS``."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.learning import SOLVERS
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty

from .test_varpro import assert_is_as_planted, planted

ITERATIVE = sorted(set(SOLVERS) - {"lse"})
KINDS = ["one input", "grid", "bells", "two families", "scattered"]
# Those whose cost may rise on the way: Jang's step has a given length.
RESTLESS = {"hybrid", "gradient"}

every_solver = pytest.mark.parametrize("name", SOLVERS)
every_iterative_solver = pytest.mark.parametrize("name", ITERATIVE)


class Recording:
    """A premise that notes every displacement it is asked about."""

    def __init__(self, premise, at):
        self.premise, self.at = premise, at

    def __getattr__(self, name):
        return getattr(self.premise, name)

    def parameters(self, x):
        self.at.append(x.copy())
        return self.premise.parameters(x)


def solve(name, rows, premise, alpha=1e-8, **settings):
    problem = SeparableProblem(rows, premise.antecedent, Penalty(alpha=alpha, slope=alpha))
    solver = SOLVERS[name]()
    own = {key: settings.pop(key) for key in ("tol", "step_size") if key in settings}
    if "tol" in solver.get_params():
        solver.set_params(**({"tol": 1e-6} | own))
    return solver.solve(problem, premise, **({"max_iter": 15} | settings))


def noisy(kind="grid"):
    rows, premise, *_ = planted(kind, 0, displaced=0.5, noise=0.1)
    return rows, premise


@every_solver
@pytest.mark.parametrize("kind", KINDS)
def test_at_the_truth_there_is_nothing_to_gain(name, kind):
    rows, premise, truth, beta = planted(kind, 0, displaced=0.0)
    result = solve(name, rows, premise, alpha=1e-14)
    # The first evaluation is a difference of numbers of size one.
    assert result.loss_curve[0] < 1e-13
    assert result.evaluation.mean_squared_error < 1e-13
    assert_is_as_planted(rows, premise, truth, beta, result.evaluation)


@every_solver
def test_loss_curve_begins_at_the_start(name, rng):
    rows, premise = noisy()
    problem = SeparableProblem(rows, premise.antecedent, Penalty(alpha=1e-8, slope=1e-8))
    for start in (None, 0.1 * rng.normal(size=premise.size)):
        result = solve(name, rows, premise, start=start)
        at = np.zeros(premise.size) if start is None else start
        there = problem.evaluate(premise.parameters(at))
        assert_allclose(result.loss_curve[0], there.mean_squared_error, rtol=1e-9)


@every_solver
@pytest.mark.parametrize("kind", ["grid", "bells", "scattered"])
def test_no_point_is_out_of_the_box(name, kind):
    rows, premise = noisy(kind)
    tight = replace(premise, lower=0.02 * premise.lower, upper=0.02 * premise.upper)
    at = []
    # So long a step leaves any box.
    long = {"step_size": 10.0} if name in RESTLESS else {}
    result = solve(name, rows, Recording(tight, at), max_iter=30, **long)
    zero, one = np.zeros(tight.size), np.ones(tight.size)
    at = [x for x in at if not (np.array_equal(x, zero) or np.array_equal(x, one))]
    if name != "lse":
        assert any((x == tight.lower).any() or (x == tight.upper).any() for x in at)
    for x in at:
        assert (x >= tight.lower).all()
        assert (x <= tight.upper).all()
    assert np.isfinite(result.evaluation.antecedent.parameters).all()


@every_solver
def test_caller_hears_of_every_iteration(name):
    rows, premise = noisy()
    seen = []
    result = solve(name, rows, premise, on_iteration=lambda *arguments: seen.append(arguments))
    assert [n for n, _ in seen] == list(range(1, result.n_iter + 1))
    errors = [evaluation.mean_squared_error for _, evaluation in seen]
    assert_array_equal(result.loss_curve[1:], errors)
    assert any(evaluation is result.evaluation for _, evaluation in seen)


@every_iterative_solver
@pytest.mark.parametrize("max_iter", [1, 4])
def test_max_iter_is_the_number_of_iterations(name, max_iter):
    rows, premise = noisy()
    result = solve(name, rows, premise, tol=0.0, max_iter=max_iter)
    assert result.n_iter == max_iter
    assert result.status == ("epochs" if name in RESTLESS else "max_iter")
    assert result.converged is (name in RESTLESS)


@every_iterative_solver
def test_what_watches_can_end_the_training(name):
    rows, premise = noisy()
    result = solve(name, rows, premise, on_iteration=lambda n_iter, _: n_iter == 3)
    assert (result.status, result.n_iter) == ("stopped", 3)
    assert result.converged
