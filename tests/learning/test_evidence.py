"""The evidence against integrals: the normal distribution's own, and quadrature."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import integrate, optimize, stats

from skanfis.antecedent import GridAntecedent
from skanfis.learning.data import StandardisedData
from skanfis.learning.evidence import (
    PRIOR_DISPLACEMENT,
    laplace,
    reestimated,
)
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.learning.premise import Premise
from skanfis.membership import Gaussian

from .. import oracles

ONE_RULE = GridAntecedent((), counts=())
CONSEQUENTS = ("agreement", "alpha", "slope")
FIRST = Penalty(agreement=1e-2, alpha=1e-2, slope=1e-2)
PENALTIES = [
    Penalty(agreement=0.1, alpha=0.01, slope=0.3),
    Penalty(agreement=1e-3, alpha=2e-3, slope=1e-2),
    Penalty(agreement=0.0, alpha=1.0, slope=1e-4),
    Penalty(agreement=1.0, alpha=1e-5, slope=1e-5),
]
# Pulls of components are expected to be within this factor of one another, as one deviation.
LIKENESS = np.log(3.0)


def rules(rng, n_rules):
    return oracles.random_grid(rng, [Gaussian], [n_rules]) if n_rules > 1 else ONE_RULE


def laplace_at(problem, evaluation, penalty, **premises):
    """The posterior of the problem's rows, at an evaluation of it."""
    other = problem.with_penalty(penalty)
    other.effective_weight = problem.rows.total_weight
    return laplace(other, other.solved_again(evaluation), **premises)


def problem_of(rows, antecedent, order):
    inputs = np.arange(order * rows.X.shape[1])
    return SeparableProblem(rows, antecedent, FIRST, consequent_inputs=inputs)


def posterior(rows, antecedent, order, penalty):
    """The posterior at the start, from an evaluation at weights of its own."""
    problem = problem_of(rows, antecedent, order)
    return laplace_at(problem, problem.evaluate(antecedent.parameters), penalty)


def with_pulls(penalty, line, g):
    """The penalty with a pull for every slope and component, whose geometric means are one."""

    def around_one(names):
        logs = g.normal(size=len(names))
        pulls = np.exp(logs - logs.mean()) if len(names) > 1 else []
        return dict(zip(names, pulls, strict=False))

    components, slopes = around_one(line.components), around_one(line.slopes)
    return replace(penalty, pulls=components, slope_pulls=slopes)


def prior_of_pulls(penalty):
    """Minus twice the logarithm of the prior of the pulls, but for a constant."""
    pulls = [*penalty.pulls.values(), *penalty.slope_pulls.values()]
    return np.sum(np.log(pulls) ** 2) / LIKENESS**2 if pulls else 0.0


def in_full(found):
    """-2 log p but for (n - 1) log 2 pi per output, with what depends on n alone put back."""
    n, freedom = found.effective_weight, found.freedom
    left_out = freedom * (1.0 + np.log(n / freedom)) + found.n_outputs * np.log(n)
    return found.minus_twice_log + left_out


class Dense:
    """A problem written out: design, penalty and rows."""

    def __init__(self, rows, antecedent, order, penalty):
        problem = oracles.DenseProblem(rows, antecedent, order, penalty)
        matrix = problem.residual_matrix(antecedent.parameters)
        self.y, self.n = problem.y, rows.total_weight
        self.weight = self.n * problem.weight
        self.phi = problem.design(antecedent.parameters)
        self.roots = matrix[len(self.y) :]
        self.penalty = self.roots.T @ self.roots
        # All rules rise by one.
        self.height = np.zeros(matrix.shape[1])
        self.height[:: matrix.shape[1] // antecedent.n_rules] = 1.0

    def at_its_noise(self, minus_twice_log):
        """The least over sigma^2, and where."""
        found = optimize.minimize_scalar(
            lambda log_variance: minus_twice_log(np.exp(log_variance)),
            bounds=(-15.0, 5.0),
            method="bounded",
            options={"xatol": 1e-7},
        )
        return found.fun, np.exp(found.x)

    def by_the_normal_distribution(self, variance):
        """Of y alone: N(height, V) with a flat prior of the height, the consequents summed out."""
        prior = np.linalg.pinv(self.penalty, rcond=1e-11, hermitian=True) / self.n
        spread = variance * (np.diag(1.0 / self.weight) + self.phi @ prior @ self.phi.T)
        one = np.ones(len(self.y))
        precise = np.linalg.solve(spread, one)
        total = 0.0
        for y in self.y.T:
            height = precise @ y / (precise @ one)
            # Over the height, the density is its value at the best one times a normal integral.
            total -= 2.0 * stats.multivariate_normal.logpdf(y, np.full(len(y), height), spread)
            total += np.log(precise @ one / (2.0 * np.pi))
            total -= (len(y) - 1.0) * np.log(2.0 * np.pi)
        return total


# The number of inputs, and the rules.
KINDS = {
    "one rule": (1, lambda g: rules(g, 1)),
    "two rules": (1, lambda g: rules(g, 2)),
    "three rules": (1, lambda g: rules(g, 3)),
    "grid": (2, lambda g: oracles.random_grid(g, [Gaussian] * 2, [3, 2])),
    "scattered": (2, lambda g: oracles.random_scattered(g, Gaussian, 4, [0, 1])),
}


@pytest.mark.theory
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("n_outputs", [1, 2])
def test_it_is_the_marginal_likelihood_of_normal_data(order, kind, n_outputs, rng):
    """To the last constant, so that rule bases of any size and order can be compared."""
    n_inputs, build = KINDS[kind]
    rows, antecedent = oracles.bumpy_rows(rng, 20, n_inputs, n_outputs), build(rng)
    line = problem_of(rows, antecedent, order).common_line
    for plain in PENALTIES:
        # And with a pull for every component.
        for penalty in (plain, with_pulls(plain, line, rng)):
            found = posterior(rows, antecedent, order, penalty)
            dense = Dense(rows, antecedent, order, penalty)
            expected, variance = dense.at_its_noise(dense.by_the_normal_distribution)
            assert_allclose(in_full(found), expected + prior_of_pulls(penalty), atol=1e-7)
            assert_allclose(found.noise_variance, variance, rtol=1e-5)


def at_fixed_premises(seed):
    """The posterior as a function of the penalty, of problems of many kinds."""
    g = np.random.default_rng(seed)
    rows = oracles.bumpy_rows(g, [30, 100, 300][seed % 3], 2, 1 + seed % 2, seed % 5 == 0)
    if seed % 4:
        antecedent = oracles.random_grid(g, [Gaussian] * 2, [2, 2 + seed % 2])
    else:
        antecedent = oracles.random_scattered(g, Gaussian, 5, [0, 1])
    problem = problem_of(rows, antecedent, 0 if seed % 7 == 0 else 1)
    evaluation = problem.evaluate(antecedent.parameters)

    def at(penalty, **premises):
        return laplace_at(problem, evaluation, penalty, **premises)

    penalty = Penalty(*10.0 ** g.uniform(-6.0, 0.0, 3))
    return at, with_pulls(penalty, problem.common_line, g)


def slope_of(function, penalty, key):
    """Derivative by the logarithm of a weight."""
    log = np.log([getattr(penalty, key)])
    return oracles.central_difference(
        lambda x: function(replace(penalty, **{key: float(np.exp(x[0]))})), log, 1e-3
    )[0]


BLOCKS = {"slope": "slope_pulls", "alpha": "pulls"}


def logs_of(penalty, block):
    """Logarithms of the weights on every slope, or on every component."""
    mean = getattr(penalty, block)
    return np.log([mean * pull for pull in getattr(penalty, BLOCKS[block]).values()])


def with_logs(penalty, block, logs):
    """The penalty with such weights."""
    names, mean = getattr(penalty, BLOCKS[block]), float(np.exp(np.mean(logs)))
    pulls = dict(zip(names, np.exp(logs - np.mean(logs)).tolist(), strict=True))
    return replace(penalty, **{block: mean, BLOCKS[block]: pulls})


class TestReestimated:
    @pytest.mark.theory
    @pytest.mark.parametrize("seed", range(6))
    def test_no_step_lowers_the_evidence_and_the_last_is_stationary(self, seed):
        at, penalty = at_fixed_premises(seed)
        before = at(penalty).minus_twice_log
        for _ in range(200):
            penalty = reestimated(at(penalty), CONSEQUENTS)
            after = at(penalty).minus_twice_log
            assert after < before + 1e-6
            before = after
        for key in CONSEQUENTS:
            slope = slope_of(lambda p: at(p).minus_twice_log, penalty, key)
            # At an edge the evidence may rise still, but not by anything.
            assert abs(slope) < 1e-3
        for block, pulls in BLOCKS.items():
            if getattr(penalty, pulls):
                slopes = oracles.central_difference(
                    lambda logs, b=block: at(with_logs(penalty, b, logs)).minus_twice_log,
                    logs_of(penalty, block),
                    1e-3,
                )
                assert np.abs(slopes).max() < 2e-3

    def test_no_weight_falls_below_its_own_least_or_moves_by_more_than_a_step(self):
        at, penalty = at_fixed_premises(1)
        found = at(penalty)
        free = reestimated(found, CONSEQUENTS)
        none = Penalty(slope=0.0)
        least = replace(none, agreement=1.2 * free.agreement)
        assert reestimated(found, CONSEQUENTS, least) == replace(free, agreement=least.agreement)
        # Of the pulls every one is held.
        for block in BLOCKS:
            logs = logs_of(free, block)
            least = replace(none, **{block: float(np.exp(np.median(logs)))})
            held = reestimated(found, CONSEQUENTS, least)
            assert_allclose(logs_of(held, block), np.maximum(logs, np.median(logs)), rtol=1e-10)
        # Where nothing is paid at all, the weight rises as far as a step goes.
        risen = reestimated(replace(found, paid=np.zeros_like(found.paid)), ["agreement"])
        assert_allclose(risen.agreement, min(100.0 * penalty.agreement, 1.0), rtol=1e-12)


STEPS = np.array([-0.01, 0.0, 0.01])


class OneWidth:
    """A grid whose premises move along one displacement, the width of a term."""

    def __init__(self, n_rows, noise=0.3):
        g = np.random.default_rng(0)
        X = g.uniform(-1.0, 1.0, (n_rows, 1))
        y = np.sin(3.0 * X) + 0.4 * X**2 + noise * g.normal(size=X.shape)
        self.rows = StandardisedData.of(X, y)
        low, high = self.rows.inputs.box
        self.antecedent = oracles.even_grid([Gaussian], [3], low, high, 0.6)
        self.premise = Premise.of(self.antecedent, low, high)
        self.unit = np.zeros(self.premise.size)
        self.unit[4] = 1.0  # the middle term's width

    def laplace(self, penalty):
        """By the module: with the curvature of Gauss and Newton, and with the cost's own."""
        problem = SeparableProblem(self.rows, self.antecedent, penalty)

        def cost(x):
            evaluation = problem.evaluate(self.premise.parameters(x * self.unit))
            return evaluation.cost + 0.5 * penalty.stiffness * x**2

        x = optimize.minimize_scalar(cost, bounds=(-1, 1), options={"xatol": 1e-9}).x
        evaluation = problem.evaluate(self.premise.parameters(x * self.unit))
        raw = problem.linearise(evaluation)
        _, hessian = self.premise.pull_back(x * self.unit, raw.gradient, raw.gauss_newton)
        costs = [problem.evaluate(self.premise.parameters((x + h) * self.unit)).cost for h in STEPS]
        for curvature in (hessian[4, 4], np.diff(costs, 2)[0] / STEPS[-1] ** 2):
            premises = {"displacement": np.array([x]), "curvature": np.array([curvature])}
            yield laplace_at(problem, evaluation, penalty, **premises)

    def by_quadrature(self, penalty, variance):
        """The integral over the displacement of what is left of the consequents'."""
        dense = oracles.DenseProblem(self.rows, self.antecedent, 1, penalty)
        n = self.rows.total_weight

        def minus_log(x):
            parameters = self.premise.parameters(x * self.unit)
            matrix = dense.residual_matrix(parameters)
            roots = matrix[self.rows.n_rows :]
            penalised = np.linalg.eigvalsh(roots.T @ roots)[1:]
            determinants = np.linalg.slogdet(matrix.T @ matrix)[1] - np.sum(np.log(penalised))
            paid = 2.0 * dense.cost(parameters) + penalty.stiffness * x**2
            return 0.5 * (n * paid / variance + determinants + np.log(self.antecedent.n_rules))

        x = np.linspace(-1.0, 1.0, 201)
        values = np.array([minus_log(one) for one in x])
        height = values.min()
        integral = integrate.simpson(np.exp(height - values), x=x)
        prior = 0.5 * np.log(n * penalty.stiffness / (2.0 * np.pi * variance))
        return 2.0 * (height - np.log(integral) - prior) + (n - 1.0) * np.log(variance) + np.log(n)


class TestPremises:
    def prior_of_weight(self, found):
        """As a hundred displacements seen before would do."""
        expected = found.effective_weight * found.penalty.stiffness / found.noise_variance
        expected *= PRIOR_DISPLACEMENT**2
        return 100.0 * (expected - np.log(expected) - 1.0)

    @pytest.mark.theory
    def test_a_displacement_is_integrated_over(self):
        case, errors, sizes = OneWidth(1500), [], []
        for stiffness in (1e-4, 1.0):
            penalty = Penalty(agreement=0.05, alpha=0.01, slope=0.01, stiffness=stiffness)
            found = list(case.laplace(penalty))
            own = np.array([in_full(one) - self.prior_of_weight(one) for one in found])
            sizes.append(np.log1p(found[1].curvature[0] / stiffness))
            errors.append(own - case.by_quadrature(penalty, found[0].noise_variance))
        rough, exact = np.array(errors).T
        assert max(sizes) > 5.0
        assert_allclose(exact, 0.0, atol=0.05)
        # The curvature leaves out what residuals and the disagreement bring.
        assert_allclose(rough, 0.0, atol=2.0)

    @pytest.mark.parametrize("seed", [1, 2, 8])
    def test_weight_is_reestimated_where_its_own_evidence_is_largest(self, seed):
        # The noise is held where the prior of the weight is concerned.
        at, penalty = at_fixed_premises(seed)
        g = np.random.default_rng(seed)
        premises = {"displacement": 0.2 * g.normal(size=6)}
        premises["curvature"] = 10.0 ** g.uniform(-4.0, 0.0, 6)
        penalty = replace(penalty, stiffness=1e-3)
        for _ in range(100):
            penalty = reestimated(at(penalty, **premises), ["stiffness"])
        found = at(penalty, **premises)

        def own(p):
            there = at(p, **premises)
            return there.minus_twice_log - self.prior_of_weight(there)

        slope = slope_of(own, penalty, "stiffness")
        assert_allclose(slope + 100.0 * (found.prior_precision - 1.0), 0.0, atol=1e-4)
        assert 0.5 < found.prior_precision < 2.0
