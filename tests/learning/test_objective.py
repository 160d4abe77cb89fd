"""Cost, gradient and Gauss-Newton matrix against the dense problem of tests/oracles.py.

The points at which they are compared are far from any optimum. Gradients are complex steps of the
dense cost, with beta eliminated inside it: nothing is left out of the derivative.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis import blocks
from skanfis.antecedent import GridAntecedent
from skanfis.learning import data as rows
from skanfis.learning.data import StandardisedData
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.membership import Bell, Gaussian

from .. import oracles

# Of the two: the ridge that every problem has, and all that there is at once, with pulls of their
# own for all parts of the departures and all slopes.
PLAIN = Penalty(alpha=1e-4, slope=1e-4)
FULL = Penalty(agreement=0.3, alpha=1e-3, slope=1e-2)


def dead_rule(rng):
    """Four rules, one of them fifty deviations away from all data."""
    theta = Gaussian.from_center_and_width(rng.normal(size=(4, 2)), np.ones((4, 2)))
    theta[0, 1] = 50.0
    return oracles.own_terms(Gaussian, np.arange(2), theta)


def dead_term(rng):
    """A grid whose last term on the first input lies outside the data."""
    centers = np.array([-1, 1, 90]), np.array([-1, 1])
    thetas = [Gaussian.start(c, np.ones(c.size), 0.6) for c in centers]
    return GridAntecedent.build([Gaussian, Gaussian], [0, 1], thetas)


def duplicated_rule(rng):
    """Four rules, two of them the same."""
    theta = Bell.from_center_and_width(rng.normal(size=(4, 2)), rng.uniform(0.5, 1.5, (4, 2)))
    theta[:, 3] = theta[:, 1]
    return oracles.own_terms(Bell, np.arange(2), theta)


CASES = {
    # antecedent from rng, order, outputs, weighted, and the consequents' inputs if not all
    "slopes of one": (lambda g: oracles.random_grid(g, [Gaussian] * 2, [3, 2]), 1, 2, True, [1]),
    "rules listed one by one": (lambda g: oracles.random_table(g, inputs=2), 1, 1, True),
    "grid of gaussians": (lambda g: oracles.random_grid(g, [Gaussian] * 2, [3, 2]), 1, 1, False),
    "grid of bells": (lambda g: oracles.random_grid(g, [Bell] * 2, [2, 3]), 1, 1, True),
    "grid of both": (lambda g: oracles.random_grid(g, [Bell, Gaussian], [3, 2]), 1, 2, True),
    "slope of another": (lambda g: oracles.random_grid(g, [Gaussian], [4], [1]), 1, 1, True, [0]),
    "grid of three": (lambda g: oracles.random_grid(g, [Bell] * 3, [2, 3, 2]), 1, 1, True),
    "three, order 0": (lambda g: oracles.random_grid(g, [Bell] * 3, [2, 2, 3]), 0, 2, True),
    "grid, order 0": (lambda g: oracles.random_grid(g, [Gaussian] * 2, [3, 3]), 0, 1, False),
    "grid, order 0, outputs": (lambda g: oracles.random_grid(g, [Bell] * 2, [2, 2]), 0, 3, True),
    "scattered": (lambda g: oracles.random_scattered(g, Gaussian, 4, [0, 1]), 1, 1, True),
    "scattered bells": (lambda g: oracles.random_scattered(g, Bell, 3, [0, 1]), 1, 2, False),
    "scattered, order 0": (lambda g: oracles.random_scattered(g, Bell, 5, [1]), 0, 1, True),
    "dead rule": (dead_rule, 1, 1, True),
    "dead term": (dead_term, 1, 1, False),
    "duplicated rule": (duplicated_rule, 1, 1, False),
    "duplicated rule, outputs": (duplicated_rule, 1, 2, True),
}
# With little to hold them, those that need it.
PAIRS = [(name, FULL) for name in CASES]
PAIRS += [(name, PLAIN) for name in ("grid of both", "scattered", "dead rule", "duplicated rule")]


class Case:
    """A problem, its dense form, and a point away from the start."""

    def __init__(self, antecedent, order, rows, penalty=PLAIN, **settings):
        consequent_inputs = settings.get("consequent_inputs")
        settings.setdefault("consequent_inputs", np.arange(order * rows.X.shape[1]))
        problem = SeparableProblem(rows, antecedent, penalty, **settings)
        if penalty is FULL:
            g, line = np.random.default_rng(6), problem.common_line
            pulls, slope_pulls = (
                {name: 10.0 ** g.uniform(-1.0, 1.0) for name in names}
                for names in (line.components, line.slopes)
            )
            penalty = replace(FULL, pulls=pulls, slope_pulls=slope_pulls)
        self.rows, self.order, self.penalty = rows, order, penalty
        self.problem = problem.with_penalty(penalty)
        self.dense = oracles.DenseProblem(rows, antecedent, order, penalty, consequent_inputs)
        g = np.random.default_rng(5)
        self.point = antecedent.parameters + 0.2 * g.normal(size=antecedent.parameters.size)

    @classmethod
    def named(cls, name, penalty=PLAIN):
        g = np.random.default_rng(3)
        build, order, n_outputs, weighted, *inputs = CASES[name]
        settings = {"consequent_inputs": np.array(inputs[0])} if inputs else {}
        rows = oracles.bumpy_rows(g, 250, 3 if "three" in name else 2, n_outputs, weighted)
        return cls(build(g), order, rows, penalty, **settings)

    def at_point(self):
        evaluation = self.problem.evaluate(self.point)
        return evaluation, self.problem.linearise(evaluation)


@pytest.fixture(scope="module", params=PAIRS, ids=lambda pair: f"{pair[0]}, {pair[1].alpha}")
def case(request):
    return Case.named(*request.param)


def assert_all_close(one, other, rtol):
    """Close on the scale of the largest entry."""
    assert_allclose(one, other, rtol=0, atol=rtol * np.abs(other).max())


def arrays(evaluation, linearisation):
    return [
        np.array([evaluation.cost, evaluation.mean_squared_error]),
        evaluation.coefficients,
        evaluation.masses,
        linearisation.gradient,
        linearisation.gauss_newton,
    ]


def test_evaluation_is_that_of_the_dense_ridge_regression(case):
    found, dense = case.problem.evaluate(case.point), case.dense
    assert_allclose(found.cost, dense.cost(case.point), rtol=1e-11)
    assert_all_close(found.coefficients, dense.coefficients(case.point), 1e-9)
    squares = dense.weight @ (dense.y - dense.design(case.point) @ found.coefficients) ** 2
    assert_allclose(found.mean_squared_error, np.sum(squares), rtol=1e-10)
    assert_allclose(found.mean_squares, squares, rtol=1e-9)
    firing = oracles.strengths(case.problem.antecedent, case.point, dense.Z)
    assert_allclose(found.masses, firing @ dense.weight, rtol=1e-11, atol=1e-15)


@pytest.mark.theory
def test_gradient_is_exact_far_from_the_optimum_and_gauss_newton_the_schur_complement(case):
    _, linearisation = case.at_point()
    expected = case.dense.gradient(case.point)
    assert np.abs(expected).max() > 1e-3
    assert_all_close(linearisation.gradient, expected, 1e-10)
    expected = case.dense.gauss_newton(case.point)
    assert_all_close(linearisation.gauss_newton, expected, 1e-10)
    assert_all_close(linearisation.gauss_newton, linearisation.gauss_newton.T, 1e-13)


def test_joint_gradient_is_that_at_any_consequents(case):
    dense, shape = case.dense, (case.problem.n_columns, case.problem.n_outputs)
    coefficients = np.random.default_rng(8).normal(size=shape)
    evaluation, by_premises, by_consequents = case.problem.joint(case.point, coefficients)
    assert_allclose(evaluation.cost, dense.cost_at(case.point, coefficients), rtol=1e-12)
    residual = dense.y - dense.design(case.point) @ coefficients
    error = np.sum(dense.weight @ residual**2)
    assert_allclose(evaluation.mean_squared_error, error, rtol=1e-11)
    firing = oracles.strengths(case.problem.antecedent, case.point, dense.Z)
    assert_allclose(evaluation.masses, firing @ dense.weight, rtol=1e-10, atol=1e-14)
    assert evaluation.coefficients is coefficients
    assert_array_equal(evaluation.antecedent.parameters, case.point)
    expected = oracles.complex_step(lambda p: dense.cost_at(p, coefficients), case.point)
    assert_all_close(by_premises, expected, 1e-11)
    residuals = dense.residual_matrix(case.point)
    left = residuals @ coefficients - dense.right_side(len(residuals))
    assert_all_close(by_consequents, residuals.T @ left, 1e-10)


@pytest.mark.parametrize("alpha", [1e-6, 1e-8, 1e-10])
def test_duplicated_rule_with_little_ridge_leaves_the_gradient_exact(alpha, rng):
    # Solving with one factorisation and projecting with another is 4 % wrong here.
    penalty = Penalty(alpha=alpha, slope=alpha)
    case = Case(duplicated_rule(rng), 1, oracles.bumpy_rows(rng, 250), penalty)
    point = case.problem.antecedent.parameters  # the two rules are the same still
    linearisation = case.problem.linearise(case.problem.evaluate(point))
    # Rounding grows by 1 / alpha along what the two rules leave open, in the dense problem too.
    assert_all_close(linearisation.gradient, case.dense.gradient(point), 1e-13 / alpha)


@pytest.mark.theory
def test_blocks_and_chunks_change_rounding_alone(case, monkeypatch):
    whole = arrays(*case.at_point())
    monkeypatch.setattr(blocks, "FEWEST_ROWS", 8)
    monkeypatch.setattr(blocks, "BLOCK_BYTES", 1)
    monkeypatch.setattr(rows, "_BLOCKS_PER_CHUNK", 3)
    inputs = {"consequent_inputs": case.problem.consequent_inputs}
    split = Case(case.problem.antecedent, case.order, case.rows, case.penalty, **inputs)
    assert len(split.rows.chunks(split.problem._block_rows)) > 10
    for one, other in zip(arrays(*split.at_point()), whole, strict=True):
        assert_all_close(one, other, 1e-9)


def test_other_weights_of_the_penalty_need_no_pass(case, monkeypatch):
    before = case.problem.evaluate(case.point)
    other = case.problem.with_penalty(Penalty(agreement=0.02, alpha=3e-3, slope=1e-3))
    expected = other.evaluate(case.point)
    slope = other.linearise(expected).gradient
    with monkeypatch.context() as patched:
        patched.delattr(SeparableProblem, "_sum")
        found = other.solved_again(before)
    assert_allclose(found.cost, expected.cost, rtol=1e-10)
    assert_allclose(found.mean_squared_error, expected.mean_squared_error, rtol=1e-9)
    assert_all_close(found.coefficients, expected.coefficients, 1e-8)
    assert_all_close(found.normal.penalty, expected.normal.penalty, 1e-12)
    assert_all_close(other.linearise(found).gradient, slope, 1e-8)


def test_cost_of_a_nearly_exact_fit_keeps_its_digits(rng):
    # |r|^2 is 1e-18 of |y|^2: out of y'y it would come as nothing but rounding.
    antecedent = oracles.random_grid(rng, [Gaussian, Gaussian], [2, 2])
    X = rng.normal(size=(400, 2))
    Z = ((X - X.mean(axis=0)) / X.std(axis=0)).T
    phi = oracles.dense_design(antecedent, antecedent.parameters, Z, 1)
    y = phi @ rng.normal(size=(12, 1))
    y = (y - y.mean()) / y.std()
    noise = 1e-9 * rng.normal(size=(400, 1))
    data = StandardisedData.of(X, y + noise)
    problem = SeparableProblem(data, antecedent, Penalty())
    blind = problem.evaluate(antecedent.parameters)
    seeing = problem.evaluate(antecedent.parameters, blind.coefficients)
    residual = noise - phi @ np.linalg.lstsq(phi, noise, rcond=None)[0]
    least = np.mean(residual**2)
    assert_allclose(seeing.mean_squared_error, least, rtol=0.02)
    assert abs(blind.mean_squared_error - least) > 0.1 * least


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("n_outputs", [1, 2])
def test_leave_one_out_error_is_that_of_leaving_each_row_out(weighted, n_outputs, rng):
    rows = oracles.bumpy_rows(rng, 40, 2, n_outputs, weighted)
    penalty = Penalty(agreement=0.3, alpha=1e-2, slope=0.1)
    antecedent = oracles.random_grid(rng, [Gaussian] * 2, [2, 2])
    problem = SeparableProblem(rows, antecedent, penalty)
    evaluation = problem.evaluate(antecedent.parameters)
    dense = oracles.DenseProblem(rows, antecedent, 1, penalty)
    phi, total = dense.design(antecedent.parameters), 0.0
    held = dense.residual_matrix(antecedent.parameters)[40:]
    # The weights may be those of other numbers of rows than there are of them.
    n_rows = problem.effective_weight = 0.8 * rows.total_weight
    for i in range(40):
        weight = dense.weight.copy()
        weight[i] -= 1.0 / n_rows  # as much as one row has
        gram = (phi.T * weight) @ phi + held.T @ held
        beta = np.linalg.solve(gram, (phi.T * weight) @ dense.y)
        total += dense.weight[i] * np.sum((dense.y[i] - phi[i] @ beta) ** 2)
    assert_allclose(problem.leave_one_out_error(evaluation), total, rtol=1e-8)
