"""The trust region by its optimality conditions; the solver by planted truth and by SciPy."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.learning.data import StandardisedData
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.learning.premise import Premise
from skanfis.learning.varpro import trust_region_step, varpro
from skanfis.membership import Bell, Gaussian

from .. import oracles

# The smallest curvature that a step sees, as part of the largest.
FLOOR = 1e-6


def semidefinite(rng, n, rank):
    root = rng.normal(size=(rank, n)) * np.geomspace(1.0, 1e-3, rank)[:, None]
    return root.T @ root


def model(gradient, hessian, step):
    return step @ gradient + 0.5 * np.einsum("...i,ij,...j", step, hessian, step)


@pytest.mark.parametrize("rank", [1, 3, 6])
@pytest.mark.parametrize("radius", [1e-8, 1e-3, 0.3, 1.0, 1e3])
@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_step_meets_the_optimality_conditions(rng, rank, radius, damping):
    # (H + mu I) s = -g with mu >= 0, and mu = 0 unless s ends on the edge
    for _ in range(10):
        gradient, hessian = rng.normal(size=6), semidefinite(rng, 6, rank)
        if damping == 0.0:
            gradient = hessian @ gradient  # else the floor alone would decide the length
        step = trust_region_step(gradient, hessian, radius, damping)
        length = np.linalg.norm(step)
        assert length <= 1.01 * radius * (1.0 + 1e-9)
        seen = hessian + (damping + FLOOR * np.linalg.eigvalsh(hessian)[-1]) * np.eye(6)
        force = -(gradient + seen @ step)
        multiplier = force @ step / length**2
        assert_allclose(force, multiplier * step, atol=1e-9 * np.linalg.norm(gradient))
        assert multiplier >= -1e-9 * np.linalg.norm(seen)
        if length < 0.99 * radius:
            assert_allclose(multiplier, 0.0, atol=1e-9 * np.linalg.norm(seen))


@dataclass
class Point:
    """What the solver asks of an evaluation, and where it is."""

    x: np.ndarray
    cost: float
    gradient: np.ndarray = None
    gauss_newton: np.ndarray = None

    @property
    def mean_squared_error(self):
        return 2.0 * self.cost

    @property
    def coefficients(self):
        return self.x


class Residuals:
    """|r(x)|^2 / 2 in place of a separable problem, with a note of where it was asked for."""

    def __init__(self, residuals, jacobian):
        self.residuals, self.jacobian = residuals, jacobian
        self.evaluated = []

    def evaluate(self, x, reference=None):
        self.evaluated.append(x)
        return Point(x, 0.5 * np.sum(self.residuals(x) ** 2))

    def linearise(self, point):
        J = self.jacobian(point.x)
        return Point(point.x, point.cost, J.T @ self.residuals(point.x), J.T @ J)


class Box:
    """Displacements that are the parameters themselves."""

    def __init__(self, lower, upper):
        self.lower, self.upper = np.array(lower, dtype=float), np.array(upper, dtype=float)
        self.size = self.lower.size

    def parameters(self, x):
        return x

    def pull_back(self, x, gradient, gauss_newton):
        return gradient, gauss_newton


def rosenbrock():
    """(10 (x2 - x1^2), 1 - x1): a curved valley with its minimum, zero, at (1, 1)."""
    return Residuals(
        lambda x: np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]]),
        lambda x: np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]]),
    )


class TestOnKnownProblems:
    @pytest.mark.parametrize(
        ("lower", "upper", "optimum"),
        [
            ([-3, -3], [0.5, 3], [0.5, 0.25]),
            # 200 x1^3 + (1 - 200 x2) x1 = 1 along the edge of x2
            ([-3, -3], [3, 0.5], [0.7085595, 0.5]),
            ([-3, -3], [0.4, 0.1], [0.3317691, 0.1]),
            ([-1, 0.0], [0.0, 1.0], [0.0, 0.0]),
        ],
    )
    def test_rosenbrock_in_a_box_ends_on_its_edge(self, lower, upper, optimum):
        start = np.array([-1.0, 0.05])
        result = varpro(rosenbrock(), Box(lower, upper), max_iter=500, tol=1e-10, start=start)
        assert_allclose(result.evaluation.x, optimum, atol=1e-6)

    def test_edge_is_met_to_the_last_bit(self, rng):
        # One ulp beyond leaves the box; one ulp short, and the edge does not hold the displacement.
        for start in rng.uniform(-1.0, 0.0, 100):
            problem = Residuals(lambda x: x - 2.0, lambda x: np.array([[1.0]]))
            box = Box([-3.0], [0.1])
            result = varpro(problem, box, max_iter=20, tol=1e-6, start=np.array([start]))
            assert max(problem.evaluated) <= 0.1
            assert_array_equal(result.evaluation.x, 0.1)
            assert result.status == "gradient"

    def test_trials_without_a_finite_cost_are_rejected(self):
        # log x, with no value for x <= -1 + 0.9 of the first radius: the start is at zero
        def residuals(x):
            with np.errstate(invalid="ignore", divide="ignore"):
                return np.array([np.log(x[0] + 0.2) - np.log(1e-3)])

        problem = Residuals(residuals, lambda x: np.array([[1.0 / (x[0] + 0.2)]]))
        result = varpro(problem, Box([-3], [3]), max_iter=100, tol=1e-10)
        assert any(not np.isfinite(problem.residuals(x)).all() for x in problem.evaluated)
        assert_allclose(result.evaluation.x, 1e-3 - 0.2, atol=1e-9)

    @pytest.mark.parametrize("stiffness", [1e-3, 1.0, 1e4])
    def test_stiffness_is_a_ridge_on_the_displacements(self, stiffness):
        # |A x - b|^2 / 2 + stiffness |x|^2 / 2
        A, b = np.array([[2.0, 1.0], [0.0, 1.0], [1.0, 1.0]]), np.array([1.0, -0.5, 0.7])
        problem = Residuals(lambda x: A @ x - b, lambda x: A)
        box = Box([-3, -3], [3, 3])
        result = varpro(problem, box, max_iter=100, tol=1e-12, stiffness=stiffness)
        expected = np.linalg.solve(A.T @ A + stiffness * np.eye(2), A.T @ b)
        assert_allclose(result.evaluation.x, expected, rtol=1e-5, atol=1e-7)
        assert result.n_iter < 12  # its curvature is known too
        assert_allclose(result.gauss_newton, A.T @ A, rtol=1e-12)


def start_of(kind, rows):
    low, high = rows.inputs.box
    if kind == "scattered":
        centers = np.array([[-1.0, -1.0], [1.0, -0.8], [0.0, 1.0]])
        theta = Gaussian.from_center_and_width(centers, np.ones_like(centers))
        return oracles.own_terms(Gaussian, np.arange(2), theta)
    families, counts = {
        "one input": ([Gaussian], [3]),
        "grid": ([Gaussian, Gaussian], [2, 3]),
        "bells": ([Bell, Bell], [2, 2]),
        "two families": ([Bell, Gaussian], [2, 2]),
    }[kind]
    return oracles.even_grid(families, counts, low, high, 0.6)


def planted(kind, seed, displaced=0.15, noise=0.0, n_outputs=1):
    """Rows that obey a TSK model, whose premises are displaced from those of the start."""
    g = np.random.default_rng(seed)
    X = g.uniform(-2.0, 2.0, (300, 1 if kind == "one input" else 2))
    rows = StandardisedData.of(X, X[:, :1])
    antecedent = start_of(kind, rows)
    # A truth that is displaced at random lies in the box of free terms, whatever the start.
    premise = Premise.of(antecedent, *rows.inputs.box, is_unbounded=True)
    truth = premise.parameters(displaced * g.uniform(-1.0, 1.0, premise.size))
    Z = rows.inputs.apply(rows.X.T)
    phi = oracles.dense_design(antecedent, truth, Z, 1)
    beta = g.normal(size=(phi.shape[1], n_outputs))
    y = phi @ beta + noise * g.normal(size=(len(phi), n_outputs))
    return StandardisedData.of(X, y), premise, truth, beta


def assert_is_as_planted(rows, premise, truth, beta, evaluation):
    """At new rows."""
    Z = np.random.default_rng(9).uniform(-1.5, 1.5, (len(rows.X.T), 100))
    every = truth, evaluation.antecedent.parameters
    expected, phi = (oracles.dense_design(premise.antecedent, own, Z, 1) for own in every)
    found = rows.targets.offset + rows.targets.scale * (phi @ evaluation.coefficients)
    assert_allclose(found, expected @ beta, atol=1e-6 * rows.targets.scale[0])


def solve(rows, premise, alpha=1e-8, **settings):
    problem = SeparableProblem(rows, premise.antecedent, Penalty(alpha=alpha, slope=alpha))
    return problem, varpro(problem, premise, **({"max_iter": 200, "tol": 1e-6} | settings))


@pytest.mark.theory
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["one input", "grid", "bells", "two families", "scattered"])
def test_planted_model_is_recovered(kind, seed):
    rows, premise, truth, beta = planted(kind, seed)
    _, result = solve(rows, premise, alpha=1e-14, max_iter=500)
    assert result.loss_curve[0] > 1e-6
    assert_is_as_planted(rows, premise, truth, beta, result.evaluation)


class TestStatus:
    """Reasons to stop that noisy rows do not reach, each by a small problem."""

    def test_gradient_vanishes_where_the_target_is_constant(self, rng):
        X = rng.normal(size=(50, 2))
        rows = StandardisedData.of(X, np.full((50, 1), 3.0))
        premise = Premise.of(start_of("grid", rows), *rows.inputs.box)
        _, result = solve(rows, premise)
        assert (result.status, result.n_iter) == ("gradient", 0)
        assert result.converged

    def test_step_is_the_end_where_there_is_none(self):
        # Weights that differ by 600 orders of magnitude leave no gradient to compute.
        class Counted(Residuals):
            def evaluate(self, x, reference=None):
                assert len(self.evaluated) < 100
                return super().evaluate(x, reference)

        problem = Counted(lambda x: x + 1.0, lambda x: np.array([[np.nan]]))
        result = varpro(problem, Box([-3.0], [3.0]), max_iter=5, tol=1e-3)
        assert (result.status, result.n_iter) == ("step", 0)

    def test_step_is_the_end_where_nothing_is_tolerated(self):
        rows, premise, *_ = planted("scattered", 0, noise=0.1)
        _, result = solve(rows, premise, tol=0.0, max_iter=5000)
        assert result.status == "step"
        assert result.converged
