"""The posterior against dense Bayesian regression and Laplace's method written down plainly."""

import json
import pickle
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import integrate, stats
from sklearn.cluster import KMeans
from sklearn.compose import TransformedTargetRegressor, make_column_transformer
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import RobustScaler, StandardScaler

from skanfis import ANFISRegressor
from skanfis.antecedent import GridAntecedent
from skanfis.bounds import FixedPoint
from skanfis.export import export_json
from skanfis.export.json_reader import parse_json
from skanfis.learning import LeastSquares, VariableProjection
from skanfis.learning.covariance import _mean_squares, posterior_of
from skanfis.learning.data import StandardisedData
from skanfis.learning.objective import SeparableProblem
from skanfis.learning.penalty import Penalty
from skanfis.learning.premise import Premise
from skanfis.membership import Bell, Gaussian
from skanfis.options import LinearExtrapolation

from . import oracles
from .quick import frozen

PENALTY = Penalty(agreement=0.3, alpha=1e-3, slope=1e-2, stiffness=0.02)
KMEANS = KMeans(n_clusters=4, n_init=1, random_state=0)


def quick(tol=1e-3):
    """Weights of the penalty that are given."""
    solver = VariableProjection(tol=tol, stiffness=1e-2)
    return {"agreement": 0.01, "alpha": 1e-3, "solver": solver}


def dense_deviation(problem, premise, evaluation, new, is_learnt, n_known=0):
    """Noise and standard deviation of new rows of standardised inputs, of one output.

    The first ``n_known`` of them are known for certain: observed a great many times.

    The joint precision is J' J of every residual that the cost is made of, by complex steps, and
    inverted whole; by the premises that of the rows alone. The noise is what the residual leaves
    after the trace of the smoother.
    """
    antecedent, inputs = problem.antecedent, problem.consequent_inputs
    order = int(problem.n_basis > 1)
    dense = oracles.DenseProblem(problem.rows, antecedent, order, PENALTY, inputs)
    theta, beta = evaluation.antecedent.parameters, evaluation.coefficients[:, 0]
    n, p = problem.rows.n_rows, beta.size
    by_beta = dense.residual_matrix(theta)
    by_theta = oracles.complex_step(lambda t: dense.residual_matrix(t) @ beta, theta)
    by_theta[n:] = 0.0
    x = premise.displacement(theta)
    to_theta = oracles.central_difference(premise.parameters, x)
    jacobian = np.hstack([by_beta, by_theta @ to_theta])
    precision = jacobian.T @ jacobian
    precision[p:, p:] += PENALTY.stiffness * np.eye(x.size)
    new_design = oracles.dense_design(antecedent, theta, new, order, inputs)
    by_premises = oracles.complex_step(
        lambda t: oracles.dense_design(antecedent, t, new, order, inputs) @ beta, theta
    )
    row = np.hstack([new_design, by_premises @ to_theta])
    if not is_learnt:
        precision, row = precision[:p, :p], row[:, :p]
    covariance = np.linalg.inv(precision)
    # What of the parameters the data determine, and not the prior: that of the consequents at fixed
    # premises, that of the premises with the consequents eliminated.
    data = by_beta[:n].T @ by_beta[:n]
    k = np.trace(np.linalg.solve(by_beta.T @ by_beta, data))
    if is_learnt:
        k += x.size - PENALTY.stiffness * np.trace(covariance[p:, p:])
    squares = dense.weight @ (dense.y[:, 0] - dense.design(theta) @ beta) ** 2
    noise = np.sqrt(squares * n / (n - k))
    if n_known:
        seen = row[:n_known]
        covariance = np.linalg.inv(precision + 1e9 * np.trace(precision) * seen.T @ seen)
    model = np.einsum("ip,pq,iq->i", row, covariance, row) / n
    return noise, noise * np.sqrt(1.0 + model)


@pytest.mark.theory
@pytest.mark.parametrize("is_learnt", [False, True], ids=["fixed premises", "with the premises"])
@pytest.mark.parametrize("kind", ["grid", "tree", "scattered", "table, one slope", "order 0"])
def test_deviation_is_that_of_the_dense_posterior(kind, is_learnt, monkeypatch, rng):
    monkeypatch.setattr("skanfis.model.BLOCK_BYTES", 1)  # 64 rows
    rows = oracles.bumpy_rows(rng, 200, 2, 1, weighted=False)
    inputs, order = None, int(kind != "order 0")
    if kind == "scattered":
        antecedent = oracles.random_scattered(rng, Bell, 3, [0, 1])
    elif kind == "tree":
        antecedent = oracles.random_tree(rng, 4, (0, 1))
    elif kind == "table, one slope":
        antecedent, inputs = oracles.random_table(rng, inputs=2), np.array([1])
    else:
        thetas = [Gaussian.start(np.linspace(-1, 1, m), np.full(m, 1.0), 0.5) for m in (3, 2)]
        antecedent = GridAntecedent.build([Gaussian] * 2, [0, 1], thetas)
    used = np.arange(2 * order) if inputs is None else inputs
    problem = SeparableProblem(rows, antecedent, PENALTY, consequent_inputs=used)
    premise = Premise.of(antecedent, *rows.inputs.box)
    moved = np.clip(0.1 * rng.normal(size=premise.size), premise.lower, premise.upper)
    evaluation = problem.evaluate(premise.parameters(moved))
    posterior = posterior_of(problem, premise if is_learnt else None, evaluation, rows.n_rows)
    new = rng.uniform(-1, 1, size=(2, 80))
    noise, expected = dense_deviation(problem, premise, evaluation, new, is_learnt)
    wide_box = {"minimum": np.full(2, -1e3), "maximum": np.full(2, 1e3)}
    model = frozen(problem, evaluation, posterior=posterior, **wide_box)
    X = rows.inputs.offset + rows.inputs.scale * new.T
    found = model.standard_deviation(X)[:, 0]
    sure = replace(model, posterior=posterior.given(model, X[:3]))
    _, of_known = dense_deviation(problem, premise, evaluation, new, is_learnt, n_known=3)
    left = sure.standard_deviation(X)[:, 0]
    assert_allclose(left[:3], posterior.noise[0], rtol=2e-5)
    assert_allclose(left, of_known * rows.targets.scale[0], rtol=2e-5)
    assert_allclose(posterior.noise[0], noise * rows.targets.scale[0], rtol=1e-8)
    assert_allclose(found, expected * rows.targets.scale[0], rtol=1e-8)
    # Constraints hold the consequents elsewhere: the premises' part is that of the held ones.
    held = evaluation.coefficients + rng.normal(size=evaluation.coefficients.shape)
    there, learnt = replace(evaluation, coefficients=held), premise if is_learnt else None
    posterior = posterior_of(problem, learnt, evaluation, rows.n_rows, held=held)
    found = frozen(problem, there, posterior=posterior, **wide_box).standard_deviation(X)[:, 0]
    noise, expected = dense_deviation(problem, premise, there, new, is_learnt)
    assert_allclose(found / posterior.noise[0], expected / noise, rtol=1e-8)


def wave(rng, n_rows):
    X = rng.uniform(-1, 1, size=(n_rows, 2)) * [3.0, 500.0] + [20.0, 0.0]
    u, v = (X[:, 0] - 20.0) / 3.0, X[:, 1] / 500.0
    return X, np.sin(2 * u) + u * v + 0.1 * rng.normal(size=n_rows)


def test_noise_is_that_of_each_output_and_survives_a_file(rng):
    """Units and weights: test_invariance."""
    X, y = wave(rng, 150)
    new = wave(rng, 20)[0] * 1.2
    settings = {"n_mfs": [2, 2], **quick(), "solver": "lse"}
    both = ANFISRegressor(**settings).fit(X, np.column_stack([y, 3.0 * y + 7]))
    _, stds = both.predict(new, return_std=True)
    assert_allclose(stds[:, 1], 3.0 * stds[:, 0], rtol=1e-9)
    again = pickle.loads(pickle.dumps(both))
    assert (again.predict(new, return_std=True)[1] == stds).all()


@pytest.mark.parametrize("block_bytes", [1, 2**22])
def test_noise_of_hubers_loss_is_his_second_proposal(monkeypatch, block_bytes):
    monkeypatch.setattr("skanfis.blocks.BLOCK_BYTES", block_bytes)
    g, c = np.random.default_rng(12), 1.3
    given = oracles.bumpy_rows(g, 250, 2, 2, weighted=True)
    # As a fit leaves them: Huber's weights are in those of the rows.
    left = g.uniform(0.2, 1.0, 250)
    rows = replace(given, sample_weight=given.sample_weight * left)
    antecedent = oracles.random_grid(g, [Gaussian] * 2, [2, 2])
    problem = SeparableProblem(rows, antecedent, PENALTY)
    evaluation = problem.evaluate(antecedent.parameters)
    dense = oracles.DenseProblem(rows, antecedent, 1, PENALTY)
    r = dense.y - dense.design(antecedent.parameters) @ evaluation.coefficients
    psi = left[:, None] * r
    of_normal = 2.0 * integrate.quad(lambda t: min(t, c) ** 2 * stats.norm.pdf(t), 0.0, np.inf)[0]
    expected = np.average(psi**2, axis=0, weights=given.sample_weight) / of_normal
    assert_allclose(_mean_squares(problem, evaluation, (left, c)), expected, rtol=1e-7)


@pytest.mark.theory
def test_outputs_share_the_parameters_of_the_premises(rng):
    """The same output twice, at twice the stiffness: each has half of them."""
    rows = oracles.bumpy_rows(rng, 200, 2, 1, weighted=False)
    antecedent = oracles.random_scattered(rng, Gaussian, 3, [0, 1])
    premise, n = Premise.of(antecedent, *rows.inputs.box), rows.n_rows

    def n_parameters(n_outputs, learnt):
        given = StandardisedData.of(rows.X, np.repeat(rows.y, n_outputs, axis=1))
        penalty = replace(PENALTY, stiffness=n_outputs * PENALTY.stiffness)
        problem = SeparableProblem(given, antecedent, penalty)
        evaluation = problem.evaluate(antecedent.parameters)
        noise = posterior_of(problem, learnt, evaluation, n).noise / given.targets.scale
        return n * (1.0 - evaluation.mean_squares / noise**2)

    of_consequents, of_both = n_parameters(1, None), n_parameters(1, premise)
    assert_allclose(n_parameters(2, premise), 0.5 * (of_consequents + of_both).repeat(2), rtol=1e-9)


def test_what_has_no_posterior_says_why(monkeypatch):
    X, y = wave(np.random.default_rng(7), 100)
    settings = {"n_mfs": 2, "max_iter": 5, **quick(0.1)}
    model = ANFISRegressor(**settings).fit(X, y)
    # What a fitted model knows of itself it knows as the start of another, too.
    given = ANFISRegressor(partition=model, max_iter=0).fit(X, y)
    assert given.noise_std_ == model.noise_std_
    unknown = replace(model.model_, posterior=None)
    given = ANFISRegressor(partition=unknown, max_iter=0).fit(X, y)
    assert given.noise_std_ is None
    with pytest.raises(ValueError, match=r"has no posterior, .* from a \.fis file"):
        given.predict(X, return_std=True)
    monkeypatch.setattr("skanfis.learning.covariance.MOST_PARAMETERS", 10)
    monkeypatch.setattr("skanfis.model.MOST_PARAMETERS", 10)
    with pytest.raises(ValueError, match=r"20 parameters, .* more than 10 .* scaled=False"):
        ANFISRegressor(**settings).fit(X, y).predict(X, return_std=True)


@pytest.mark.parametrize("settings", [{}, {"consequent_features": [0, 2]}, {"solver": "lse"}])
def test_scalers_folded_in_and_json_keep_the_deviation(settings, rng):
    X, y = wave(rng, 120)
    X = np.column_stack([X[:, 1], rng.normal(size=120), X[:, 0]])
    rules = ANFISRegressor(n_mfs=[3, 1, 2], **quick() | settings)
    columns = make_column_transformer((StandardScaler(), [2, 0]), (RobustScaler(), [1]))
    columns.fit(X)
    scaled = make_pipeline(columns, rules)
    estimator = TransformedTargetRegressor(scaled, transformer=StandardScaler()).fit(X, y)
    inner, scaler = estimator.regressor_, estimator.transformer_
    new = X[:40] * [1.0, 1.3, 1.05]
    frozen = inner[-1].model_
    mean, std = frozen.predict_with_deviation(inner[0].transform(new))
    model = parse_json(export_json(estimator, posterior=True))
    assert_allclose(model.predict(new), scaler.inverse_transform(mean))
    assert_allclose(model.standard_deviation(new), std * scaler.scale_, rtol=1e-9)
    with pytest.raises(ValueError, match="has no posterior"):
        parse_json(export_json(estimator)).standard_deviation(new)
    with pytest.raises(ValueError, match=r"posterior=True, but the model has none"):
        export_json(parse_json(export_json(estimator)), posterior=True)


@pytest.fixture(scope="module")
def document():
    """A model with its posterior, as text."""
    X, y = wave(np.random.default_rng(9), 60)
    fitted = ANFISRegressor(n_mfs=2, max_iter=2, **quick(0.5)).fit(X, y)
    return export_json(fitted, posterior=True)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda p: p.pop("noise"), "posterior has no 'noise'"),
        (lambda p: p.update(noise=[-0.1]), r"posterior.noise\[0\] is neither 0 nor 1e-50 or more"),
        (lambda p: p.update(noise=[0.1, 0.2]), "posterior.noise: .* not a list of 1"),
        (lambda p: p.update(inputs=[0, 0]), "has an input twice"),
        (lambda p: p["consequents"].pop(), "posterior.consequents: .* is not a list of 78"),
        (lambda p: p["premises"].pop(), r"posterior.cross\[0\]: .* is not a list of 7"),
        (lambda p: p["cross"][0][0].insert(0, 1.0), r"posterior.cross\[0\]\[0\]: .* list of 12"),
        (lambda p: p["cross"][0][0].__setitem__(0, "1"), "is not a number of size up to"),
    ],
)
def test_json_of_a_posterior_that_is_none_is_refused(document, change, message):
    spoilt = json.loads(document)
    change(spoilt["posterior"])
    with pytest.raises(ValueError, match=message):
        parse_json(json.dumps(spoilt))


@pytest.mark.theory
@pytest.mark.parametrize("kind", ["gaussian", "order 0", "one slope", "bell", "clusters", "known"])
def test_out_of_range_it_is_the_deviation_of_the_tangent(kind, rng):
    """The row of the tangent by derivatives along its way, in the covariance of the posterior."""
    X, y = wave(rng, 150)
    X = np.column_stack([X, rng.normal(size=150)])
    settings = {"n_mfs": [3, 2, 1], "max_iter": 9, **quick(0.1)}
    settings |= {
        "order 0": {"order": 0, "n_mfs": [3, 2, 2]},
        "one slope": {"consequent_features": [1]},
        "bell": {"mf": "bell"},
        "clusters": {"n_mfs": "auto", "partition": KMEANS},
        "known": {"constraints": [FixedPoint([20.0, 0.0, 0.0], 0.02)]},
    }.get(kind, {})
    model = ANFISRegressor(**settings).fit(X, y).model_
    out = model.spread * rng.normal(size=(60, 3)) * [1.0, 1.0, 0.5]
    nearest = np.clip(X[:60] + 2.0 * out, model.minimum, model.maximum)
    new = nearest + np.where((nearest == model.minimum) | (nearest == model.maximum), out, 0.0)
    nearest = np.clip(new, model.minimum, model.maximum)
    way, free, h = new - nearest, wide(model), 1e-4
    covariance = posterior_covariance(model)
    rows = [posterior_rows(free, nearest + step * way) for step in (-h, 0.0, h)]
    value, slope = rows[1], (rows[2] - rows[0]) / (2.0 * h)
    near, both, change = (
        np.einsum("ip,pq,iq->i", a, covariance, b)
        for a, b in ((value, value), (value, slope), (slope, slope))
    )
    variance = model.posterior.noise**2 + near + 2.0 * np.maximum(both, 0.0) + change
    tangent = model.predict(nearest) + np.einsum("ij,ijo->io", way, model.gradient(nearest))
    for policy in ("linear", "clip"):
        held = replace(model.with_out_of_bounds(policy), target=None)
        left = (tangent - held.predict(new))[:, 0]
        expected = np.sqrt(variance + left**2)
        assert_allclose(held.standard_deviation(new)[:, 0], expected, rtol=1e-5)
    told = model.with_out_of_bounds("nan").standard_deviation(new)[:, 0]
    assert_array_equal(np.isnan(told), ~model.in_bounds(new))
    with pytest.raises(ValueError, match="lies outside the training data"):
        model.with_out_of_bounds("raise").standard_deviation(new)


def test_what_a_limit_of_the_output_takes_away_counts_but_for_what_the_user_rules_out():
    X = np.linspace(0.0, 1.0, 60)[:, None]
    model, far = ANFISRegressor(n_mfs=2).fit(X, X[:, 0] ** 2).model_, np.array([[3.0]])
    tangent, of_tangent = model.with_out_of_bounds("linear", np.inf).predict_with_deviation(far)
    for policy, upper in product(("linear", "clip"), (np.inf, 4.0, 1.1)):
        limited = replace(model, target=model.target.within(-np.inf, upper, [[1.0]]))
        outputs, deviation = limited.with_out_of_bounds(policy, 4.0).predict_with_deviation(far)
        assert outputs < 1.5 < 4.0 < tangent
        assert_allclose(deviation, np.hypot(of_tangent, min(tangent.item(), upper) - outputs))


def wide(model):
    """The same rules in a box without an edge."""
    return replace(model, minimum=model.minimum - 1e3, maximum=model.maximum + 1e3, target=None)


def posterior_rows(model, X):
    """Derivatives of the output by consequents and by parameters of the terms, by differences."""
    inputs, antecedent = model.posterior.inputs, model.antecedent
    basis = np.column_stack([np.ones(len(X)), (X - model.reference)[:, inputs]])
    design = (model.strengths(X)[:, :, None] * basis[:, None]).reshape(len(X), -1)

    def predicted(parameters):
        moved = replace(model, antecedent=antecedent.with_parameters(parameters))
        return moved.predict(X)[:, 0]

    return np.hstack([design, oracles.central_difference(predicted, antecedent.parameters)])


def posterior_covariance(model):
    """The covariance that the factors of a posterior of one output stand for."""
    posterior = model.posterior
    n_premises = posterior.premises.shape[1]
    top = np.pad(posterior.noise[0] * posterior.consequents, ((0, 0), (0, n_premises)))
    bottom = np.hstack([-posterior.cross[0] @ posterior.consequents, posterior.premises])
    factor = np.vstack([top, bottom])
    return factor.T @ factor - (posterior.pinned[0] @ factor).T @ (posterior.pinned[0] @ factor)


def test_rows_at_the_end_of_the_numbers_saturate():
    """A tangent without end: no row is so far off that its prediction is not a number."""
    X, y = wave(np.random.default_rng(13), 100)
    settings = {"n_mfs": 2, "max_iter": 2, **quick(0.5)}
    model = ANFISRegressor(out_of_bounds=LinearExtrapolation(np.inf), **settings).fit(X, y)
    far = np.array([[1.7e308, -1.7e308], [-1e308, 1e308], [1e120, 0.0], [0.0, -1e150]])
    mean, std = model.predict(far, return_std=True)
    assert np.isfinite([mean, std]).all()
    assert (mean == model.predict(far)).all()
    assert (np.abs(mean[:2]) > 1e90).all()
    assert (model.coverage(far) == 0.0).all()


@pytest.mark.parametrize("solver", [VariableProjection(stiffness=1e-2), LeastSquares()])
def test_deviation_of_a_mean_is_that_of_the_mean_design(solver, rng):
    X = rng.uniform(-1.0, 1.0, (80, 2))
    fitted = ANFISRegressor([3, 2], agreement=0.01, alpha=1e-3, solver=solver)
    frozen = fitted.fit(X, np.sin(3.0 * X[:, 0]) * X[:, 1] + 0.1 * rng.normal(size=80)).model_
    posterior, noise = frozen.posterior, frozen.posterior.noise
    for row in X[:5]:
        # Of a single row, all of the deviation but the noise.
        deviation = frozen.standard_deviation(row[None])[0]
        expected = np.sqrt(deviation**2 - noise**2)
        assert_allclose(posterior.of_mean(frozen, row[:, None].copy()), expected, rtol=1e-9)
    if isinstance(solver, LeastSquares):
        basis = np.column_stack([np.ones(80), X - frozen.reference])
        design = np.einsum("nr,ni->ri", frozen.strengths(X), basis).ravel() / 80
        expected = noise * np.linalg.norm(posterior.consequents @ design)
        assert_allclose(posterior.of_mean(frozen, X.T.copy()), expected, rtol=1e-9)
