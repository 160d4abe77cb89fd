"""Constraints of the estimator: kept everywhere, proven, the least change, and what is refused."""

import re
from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import lsq_linear
from sklearn.base import clone
from sklearn.cluster import KMeans

from skanfis import ANFISRegressor
from skanfis.bounds import FixedPoint, OutputLimits, bounds, monotonicity
from skanfis.bounds.consequents import Consequents
from skanfis.bounds.construction import is_in_order
from skanfis.exceptions import ConstraintWarning
from skanfis.export import export_json
from skanfis.export.json_reader import parse_json
from skanfis.learning import GradientDescent, VariableProjection
from skanfis.membership import Gaussian
from skanfis.options import LinearExtrapolation

QUICK = {"n_mfs": 3, "max_iter": 5, "agreement": 0.0, "alpha": 1e-3}
QUICK |= {"solver": VariableProjection(tol=0.1, stiffness=0.01)}
pytestmark = pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")


# Rising with the first input, anything with the second; noise that the fit follows.
G = np.random.default_rng(0)
X = G.uniform(-1.0, 1.0, (120, 2))
Y = np.tanh(3.0 * X[:, 0]) + 0.3 * X[:, 1] ** 2 + 0.3 * G.normal(size=120)


def points_on_a_line(*places):
    return [FixedPoint([0.0, x], x) for x in places]


def falls(model, j, rng):
    """The most that predictions fall over steps up along an input, in the range."""
    low, high = model.model_.minimum, model.model_.maximum
    X = rng.uniform(low, high, (4000, 2))
    higher = X.copy()
    higher[:, j] = np.minimum(X[:, j] + rng.uniform(0.0, 0.3, 4000), high[j])
    return (model.predict(X) - model.predict(higher)).max()


@pytest.mark.parametrize(
    "params",
    [
        {"order": 0, "n_mfs": 4},
        {"mf": "bell", "out_of_bounds": "clip"},
        {"loss": "huber", "solver": GradientDescent(error_goal=0.5)},
    ],
    ids=str,
)
def test_predictions_rise_everywhere(params, rng):
    quick = QUICK | params
    free = ANFISRegressor(**quick).fit(X, Y)
    assert free.constraints_ is None
    assert falls(free, 0, rng) > 1e-3
    held = ANFISRegressor(**quick, monotonic_cst=[1, 0]).fit(X, Y)
    assert held.constraints_["certified"]
    assert held.constraints_["loss_after"] >= held.constraints_["loss_before"] * (1.0 - 1e-12)
    assert falls(held, 0, rng) <= 1e-12
    assert monotonicity(held, 0) == 1
    assert_allclose(free.memberships_[0]["center"], held.memberships_[0]["center"])


def test_slopes_that_rules_have_in_common_stay_one_to_the_last_bit():
    y = Y - 0.3 * X[:, 1] ** 2 + X[:, 1]
    held = ANFISRegressor(n_mfs=[3, 1], monotonic_cst=[1, 1]).fit(X, y)
    assert held.model_.common_slopes[:, 1].all()


def test_signs_and_points_are_read_by_name_or_position():
    told = ANFISRegressor(**QUICK, monotonic_cst=[1, 0]).fit(X, Y)
    assert told.constraints_["certified"]
    signs = {"time": 0, "rate": 1}
    for names, given in (
        (None, {0: 1}),
        (["0", "1"], {0: 1}),
        (["0", "1"], {"0": 1}),
        (["rate", "time"], signs),
        (["rate", "time"], pd.Series(signs)),
        (["rate", "time"], pd.DataFrame([signs])),
    ):
        rows = X if names is None else pd.DataFrame(X, columns=names)
        held = ANFISRegressor(**QUICK, monotonic_cst=given).fit(rows, Y)
        assert_array_equal(held.predict(rows), told.predict(X))
    known = FixedPoint(pd.Series({"time": 0.5, "rate": 0.7}), 0.9)
    held = ANFISRegressor(**QUICK, constraints=[known]).fit(rows, Y)
    assert_allclose(held.predict(pd.DataFrame([[0.7, 0.5]], columns=rows.columns)), 0.9)


def test_the_search_judges_what_is_kept(rng):
    """Of a valley told to rise: what is expected of new rows is what the held model leaves."""
    X, X_new = rng.uniform(-1.0, 1.0, (2, 300, 2))
    y, y_new = (x[:, 0] ** 2 + 0.5 * x[:, 1] + 0.1 * rng.normal(size=300) for x in (X, X_new))
    with pytest.warns(ConstraintWarning, match="The data contradict monotonic_cst=1 of 'y'"):
        held = ANFISRegressor(max_rules=4, monotonic_cst=[1, 0]).fit(X, y)
    assert {one["kind"] for one in held.structures_} == {"one rule", "grid", "tree"}
    expected = next(one["expected_error"] for one in held.structures_ if one["chosen"])
    left = np.sqrt(np.mean((held.predict(X_new) - y_new) ** 2))
    assert_allclose(expected * y.std(), left, rtol=0.1)
    # A free fit leaves little more than the noise.
    assert left > 0.25


@pytest.mark.parametrize("kind", ["tree", "grid", "scattered"])
def test_predictions_rise_beyond_the_range_too(kind):
    """It is proven, and so are steps up from anywhere; the free fit falls there."""
    rng = np.random.default_rng(3)
    X = rng.uniform(-1.0, 1.0, (200, 2)) * [1.0, 30.0]
    # It rises with the first input where the second is not low: asked is that it does everywhere.
    y = np.tanh(3.0 * X[:, 0]) * (1.0 + 4.0 / 3.0 * np.tanh(X[:, 1] / 10.0))
    y += 0.3 * rng.normal(size=200)
    params = {"partition": kind, "max_rules": 4, "out_of_bounds": LinearExtrapolation(2.0)}
    free = ANFISRegressor(**params).fit(X, y)
    held = ANFISRegressor(**params, monotonic_cst=[1, 0]).fit(X, y)
    assert held.constraints_["certified"]
    low, high = 3.0 * X.min(axis=0), 3.0 * X.max(axis=0)
    box = np.stack([low, high], axis=1)
    assert_array_equal(monotonicity(held, 0, box), [1])
    before = rng.uniform(low, high, (30_000, 2))
    after = before + rng.exponential(0.3, (30_000, 1)) * [1.0, 0.0]
    assert (held.predict(before) - held.predict(after)).max() <= 1e-12
    assert (free.predict(before) - free.predict(after)).max() > 1e-3


def test_what_is_proven_in_the_range_is_proven_beyond_it():
    """Also of rules that are not in order, beyond the range of inputs that are free."""
    rng = np.random.default_rng(5)
    X = rng.uniform(-1.0, 1.0, (300, 3))
    y = 2.0 * np.tanh(2.0 * X[:, 0]) + X[:, 1] * X[:, 2] + 0.1 * rng.normal(size=300)
    held = ANFISRegressor(partition="tree", max_rules=5, monotonic_cst=[1, 0, 0]).fit(X, y)
    assert not is_in_order(held.model_, 0, np.array([1, 0, 0]))
    assert_array_equal(monotonicity(held, 0), [1])
    assert_array_equal(monotonicity(held, 0, [(-9.0, 9.0)] * 3), [1])


def test_data_that_contradict_are_told():
    # Noise that a fit follows is no contradiction: the other tests turn warnings into errors.
    message = r"contradict monotonic_cst=-1 of 'y' by 'x0': .*\. Rows [\d, ]+ contradict"
    with pytest.warns(ConstraintWarning, match=message) as told:
        ANFISRegressor(**QUICK, monotonic_cst=[-1, 0]).fit(X, Y)
    rows = re.search("Rows (.*) contradict", str(told[0].message))[1].split(", ")
    # The falling model is a constant in x0: rows at either end are the furthest from it.
    assert (np.abs(X[[int(row) for row in rows], 0]) > 0.3).all()


def test_one_rule_is_bounded_least_squares(rng):
    """Without terms: a ridge of nearly nothing with the sign of each slope given."""
    X = rng.normal(size=(60, 3))
    y = X @ [1.0, -0.5, 0.2] + rng.normal(size=60)
    signs = np.array([-1, 1, 1])
    held = ANFISRegressor(n_mfs=1, alpha=1e-9, agreement=0.0, monotonic_cst=signs)
    # The slope by the first input is 1.
    with pytest.warns(ConstraintWarning, match="contradict monotonic_cst=-1 of 'y' by 'x0': keep"):
        held.fit(X, y)
    centred = X - X.mean(axis=0)
    ends = np.where(signs > 0, 0.0, -np.inf), np.where(signs > 0, np.inf, 0.0)
    expected = lsq_linear(centred, y - y.mean(), bounds=ends).x
    # A millionth of deviations keeps slopes off zero.
    assert_allclose(held.consequents_[0, 1:], expected, atol=3e-6)
    assert (held.consequents_[0, 1:] * signs > 0.0).all()


def test_limits_hold():
    y = np.column_stack([Y, -2.0 * Y])
    known = [OutputLimits(lower=[-0.9, -np.inf], upper=[1.0, 1.7])]
    held = ANFISRegressor(**QUICK, constraints=known, monotonic_cst=[[0, 0], [-1, 0]]).fit(X, y)
    found = bounds(held, tol=1e-3)
    assert held.constraints_["certified"]
    left = (np.mean((held.predict(X) - y) ** 2, axis=0) / y.var(axis=0)).sum()
    assert_allclose(held.constraints_["loss_after"], left, rtol=1e-9)
    assert found.highest[0] <= 1.0
    assert found.lowest[0] >= -0.9
    assert found.highest[1] <= 1.7
    assert found.highest[1] > 1.6
    assert monotonicity(held, 0)[1] == -1


@pytest.mark.parametrize("policy", ["linear", "clip", LinearExtrapolation(np.inf)])
def test_limits_hold_beyond_the_range(rng, policy):
    """A tangent is followed up to them; so it is in a file, and the box of it is proven."""
    params = QUICK | {"out_of_bounds": policy}
    known = OutputLimits(lower=-0.9, upper=Y.max())
    held = ANFISRegressor(**params, constraints=[known]).fit(X, Y)
    free = replace(held.model_, target=None)
    beyond = rng.uniform(-9.0, 9.0, (2000, 2))
    told = held.predict(beyond)
    if policy == "linear":
        limits = held.model_.output_limits[:, 0]
        # The upper one is nearer than what the target holds by.
        assert_allclose(limits, [-0.9, Y.max()], rtol=1e-12)
    assert_allclose(told, np.clip(free.predict(beyond)[:, 0], -0.9, Y.max()), rtol=1e-12)
    crosses = free.predict(beyond)[:, 0] > Y.max()
    assert crosses.any() == (policy != "clip")
    assert_array_equal(parse_json(export_json(held)).predict(beyond)[:, 0], told)
    if policy == "linear":
        found = bounds(held, [(-9.0, 9.0)] * 2)
        assert -0.9 <= found.lower[0] <= found.upper[0] <= Y.max()


def test_points_are_met_and_rows_weigh(rng):
    known = [FixedPoint([0.0, 0.0], 0.0), FixedPoint({"x0": 0.7, "x1": 0.5}, 0.9)]
    params = QUICK | {"constraints": known, "monotonic_cst": [1, 0]}
    held = ANFISRegressor(**params).fit(X, Y)
    assert_allclose(held.predict([[0.0, 0.0], [0.7, 0.5]]), [0.0, 0.9], atol=1e-9)
    assert monotonicity(held, 0) == 1
    weight = rng.integers(1, 3, len(Y))
    weighted = ANFISRegressor(**params).fit(X, Y, sample_weight=weight)
    repeated = ANFISRegressor(**params).fit(np.repeat(X, weight, 0), np.repeat(Y, weight))
    assert_allclose(weighted.predict(X), repeated.predict(X), atol=1e-6)


def test_points_are_met_by_a_line_where_the_data_ask_for_no_slopes():
    rng = np.random.default_rng(1)
    X, y = rng.normal(size=(42, 2)), rng.normal(size=42)
    assert not ANFISRegressor(n_mfs=1).fit(X, y).consequents_[0, 1:].any()
    known = [FixedPoint([0.0, 0.0], -0.2), FixedPoint([1.0, 0.0], 0.1)]
    held = ANFISRegressor(n_mfs=1, constraints=known).fit(X, y)
    assert_allclose(held.predict([[0.0, 0.0], [1.0, 0.0]]), [-0.2, 0.1], atol=1e-9)
    assert held.constraints_["drawn"] == 1.0


@pytest.mark.theory
def test_a_known_input_that_says_nothing_is_not_read():
    """It rises by not changing, as the free fit has it."""
    rng = np.random.default_rng(1)
    X = rng.uniform(size=(200, 3))
    y = np.sin(6.0 * X[:, 0]) + 0.2 * rng.normal(size=200)
    told = (None, [0, 0, 1])
    free, held = (ANFISRegressor(monotonic_cst=s, max_rules=4).fit(X, y) for s in told)
    assert not held.consequents_[:, 3].any()
    assert held.readability_.reading_cost == free.readability_.reading_cost


@pytest.mark.parametrize("policy", ["linear", "clip", LinearExtrapolation(np.inf)])
def test_points_beyond_the_range_are_met_by_the_policy(policy):
    """Zero rate of a campaign that began at some: what is predicted there, not at the edge."""
    points = np.stack([X.max(axis=0), X.min(axis=0)]) + np.array([[0.4, -0.3], [0.0, -0.1]])
    known = [FixedPoint(point, value) for point, value in zip(points, (0.2, -0.1), strict=True)]
    params = QUICK | {"out_of_bounds": policy}
    # The edge that is held all the way is known from its rows.
    told = pytest.warns(ConstraintWarning) if policy == "clip" else nullcontext()
    with told:
        held = ANFISRegressor(**params, constraints=known).fit(X, Y)
    free = ANFISRegressor(**params).fit(X, Y)
    assert_allclose(held.predict(points), [0.2, -0.1], atol=1e-9)
    std = held.model_.standard_deviation(np.clip(points, X.min(axis=0), X.max(axis=0)))[:, 0]
    assert (std[0] < held.noise_std_ * (1.0 + 1e-9)) == (policy == "clip")
    # Two numbers of 27 are given away.
    assert held.score(X, Y) > free.score(X, Y) - (0.3 if policy == "clip" else 0.1)


def test_what_cannot_be_proven_is_drawn_to_a_line():
    """Of a family that nobody knows only a line is certain, the best one with the right sign."""

    class Own(Gaussian):
        name = "own"

    held = ANFISRegressor(**QUICK, mf=Own, monotonic_cst=[1, 0])
    with pytest.warns(ConstraintWarning, match=r"monotonic_cst=1 of 'y' by 'x0', .*'tree'"):
        held.fit(X, Y)
    assert held.constraints_["certified"]
    assert held.constraints_["drawn"] == 1.0
    assert_array_equal(held.consequents_, np.broadcast_to(held.consequents_[0], (9, 3)))
    # Not the line of least squares, for the penalty: but next to it.
    line = np.linalg.lstsq(np.column_stack([np.ones(len(Y)), X]), Y, rcond=None)[0]
    assert_allclose(held.consequents_[0], line, atol=0.1)


def test_rules_drawn_all_the_way_are_said_to_be_and_of_a_false_sign_they_are_no_remedy():
    """Clusters that share no places are far from any order, and no proof is found in between."""
    rng = np.random.default_rng(0)
    X = rng.uniform(-1.0, 1.0, (200, 3))
    y = 2.0 * np.tanh(3.0 * X[:, 0]) + X[:, 1] + X[:, 2] ** 2 + 0.1 * rng.normal(size=200)
    clusters = KMeans(6, n_init=1, random_state=0)
    held = ANFISRegressor(**QUICK | {"n_mfs": "auto", "partition": clusters})
    moved = "moved 100 % of the way to rules that provably keep this.*Use partition='tree'"
    with pytest.warns(ConstraintWarning, match=moved):
        held.set_params(monotonic_cst=[1, 1, 0]).fit(X, y)
    assert held.constraints_["drawn"] == 1.0
    assert len(np.unique(held.consequents_, axis=0)) > 1
    with pytest.warns(ConstraintWarning) as told:
        held.set_params(monotonic_cst=[-1, 1, 0]).fit(X, y)
    assert held.constraints_["drawn"]
    assert ["The data contradict" in str(one.message) for one in told] == [True]


@pytest.mark.parametrize("least", [0.0, 0.01, 0.3, 0.6, 0.99])
def test_the_way_to_rules_in_order_is_halved(least):
    """What is proven from some point of it on is found to a 32nd of the way."""
    way = object.__new__(Consequents)
    way.free = SimpleNamespace(antecedent=SimpleNamespace(groups=()))
    way._nearest_at_points = lambda ordered: 0.0 * ordered
    way._is_proven = lambda local: local >= least
    local, drawn = way.nearest_proven(1.0)
    assert local == drawn
    assert least <= drawn < least + 1.0 / 32.0


def test_there_is_always_a_line(rng):
    """Of triangles, slopes of which jump, with sparse slopes."""
    held = ANFISRegressor(n_mfs=4, mf="triangular", monotonic_cst=[1, 0])
    with pytest.warns(ConstraintWarning, match="the rules were moved"):
        held.fit(X, Y)
    assert held.constraints_["certified"]
    assert falls(held, 0, rng) <= 1e-12


@pytest.mark.parametrize(
    ("known", "message"),
    [
        ({"monotonic_cst": [1]}, r"monotonic_cst has shape \(1,\), not \(2,\) or \(1, 2\)"),
        ({"monotonic_cst": [2, 0]}, r"must hold only -1 \(falling\), 0 \(free\) and 1"),
        ({"monotonic_cst": {"rate": 1}}, "names 'rate', which is no column of X.* without names"),
        ({"constraints": [3.0]}, "constraints holds 3.0: it must be a list of OutputLimits"),
        ({"constraints": [OutputLimits(1.0, 0.0)]}, r"limits the output to \[1, 0\]"),
        ({"constraints": [OutputLimits(lower="a")]}, "lower='a' in constraints must hold numbers"),
        ({"monotonic_cst": ["a", 1]}, r"monotonic_cst=\['a', 1\] must hold numbers only"),
        ({"monotonic_cst": {"x0": "up"}}, r"monotonic_cst={'x0': 'up'} must hold numbers only"),
        ({"constraints": [OutputLimits([0.0, 1.0])]}, r"a number, or one per output .*\(1\)"),
        ({"constraints": [FixedPoint([0.0], 1.0)]}, "a number for each of the 2 columns of X"),
        ({"constraints": [FixedPoint({"x0": 0.0}, 1.0)]}, "it must name every column of X"),
        ({"constraints": [FixedPoint([0.0, np.nan], 1.0)]}, "must hold finite numbers only"),
        (
            {"out_of_bounds": "nan", "constraints": [FixedPoint([0.0, 9.0], 0.0)]},
            r"FixedPoint at \[0. 9.\].* predicts nothing there\. .*'x1'",
        ),
        (
            {"constraints": [OutputLimits(upper=1.0), FixedPoint([0.0, 0.0], 1.0)]},
            "is not strictly within the OutputLimits",
        ),
        (
            {"constraints": [FixedPoint([0.0, 0.0], 1.0), FixedPoint([0.0, 0.0], 2.0)]},
            r"output 0 is fixed to 2 at \[0. 0.\], so .* at \[0. 0.\], where it is fixed to 1",
        ),
        (
            {"constraints": [FixedPoint([0.0, x], x**2) for x in np.linspace(-0.5, 0.5, 40)]},
            "No consequents of 9 rules keep the 40 fixed points. Drop a constraint",
        ),
        (
            {"monotonic_cst": [0, -1], "constraints": points_on_a_line(0.0, 0.2)},
            "constraints contradicts itself or monotonic_cst: output 0 is",
        ),
        (
            # A line through two points leaves the limit.
            {"n_mfs": 1, "constraints": [*points_on_a_line(-0.5, 0.5), OutputLimits(upper=0.7)]},
            "1 rule keep the upper limit 0.7 of 'y' together with the 2 fixed points",
        ),
        (
            # There is no room for the margin between both.
            {"constraints": [FixedPoint([0.0, 0.0], 1.0), OutputLimits(upper=1.0 + 1e-9)]},
            "limit 1 of 'y' together with the 1 fixed point. Drop a constraint, or use more rules",
        ),
    ],
)
def test_what_cannot_be_is_refused(known, message):
    estimator = ANFISRegressor(**QUICK | known)
    with pytest.raises(ValueError, match=message):
        estimator.fit(X, Y)
    assert not hasattr(estimator, "model_")


@pytest.mark.parametrize("n_mfs", [1, 2])
@pytest.mark.parametrize("seed", range(4))
def test_a_free_fit_without_any_error_is_held_too(n_mfs, seed):
    X = np.random.default_rng(seed).normal(size=(20, 1))
    rising, falling = (ANFISRegressor(n_mfs, monotonic_cst=[sign]) for sign in (1, -1))
    assert_allclose(rising.fit(X, X[:, 0]).predict(X), X[:, 0], atol=1e-4)
    with pytest.warns(ConstraintWarning, match="contradict monotonic_cst=-1 of 'y' by 'x0'"):
        falling.fit(X, X[:, 0])
    assert_array_equal([monotonicity(model, 0)[0] for model in (rising, falling)], [1, -1])


def test_points_may_say_the_same():
    """Given twice, more of them on a line than it needs, or beyond the range with one edge."""
    points = [FixedPoint([0.2, 0.0], 0.1), FixedPoint([0.0, 0.0], 0.0)]
    once, twice = (ANFISRegressor(**QUICK, constraints=of).fit(X, Y) for of in (points, points * 2))
    assert_array_equal(once.predict(X), twice.predict(X))
    line = [FixedPoint([x, 0.0], x) for x in (-0.2, 0.0, 0.2)]
    edge = [FixedPoint([0.0, x], 0.3) for x in (2.0, 2.5, 3.0)]
    for known, settings in ((line, {"n_mfs": 1}), (edge, {"out_of_bounds": "clip"})):
        told = [ANFISRegressor(**QUICK | settings, constraints=of) for of in (known, known[::2])]
        held, fewer = (model.fit(X, Y) for model in told)
        assert_allclose(held.predict([one.x for one in known]), [one.y for one in known], atol=1e-9)
        assert_allclose(held.predict(X), fewer.predict(X), atol=1e-9)


def test_a_constant_target_or_two_rows_contradict_no_sign():
    # Its rules are the constant, without the margins of order, alone and beside another target.
    for targets in (np.full(len(X), 1e-6), np.c_[Y, np.full(len(X), 1e-6)]):
        held = ANFISRegressor(**QUICK, monotonic_cst=[1, -1]).fit(X, targets)
        assert_array_equal(held.model_.coefficients[:, :, -1], [[1e-6, 0.0, 0.0]] * held.n_rules_)
        assert monotonicity(held, "x0")[-1] == 1
    held = ANFISRegressor(n_mfs=1, alpha=1.0, monotonic_cst=[-1]).fit([[0.0], [1.0]], [0.0, 1.0])
    assert_allclose(held.predict([[0.0], [1.0]]), 0.5, atol=1e-5)


def test_a_constant_keeps_a_limit_that_the_data_contradict():
    held = ANFISRegressor(n_mfs=1, order=0, constraints=[OutputLimits(lower=5.0)])
    with pytest.warns(ConstraintWarning, match="The data contradict the lower limit 5 of 'y'"):
        held.fit(X, Y)
    assert_allclose(held.predict(X), 5.0, atol=2e-3 * Y.std())


@pytest.mark.theory
def test_a_kind_goes_on_while_its_free_rules_gain(rng):
    # A bias of temperature and a wave of the rate: terms on both, before either pays in order.
    X, fresh = rng.uniform(size=(200, 2)), rng.uniform(0.02, 0.98, (2000, 2))

    def truth(X):
        rate, temperature = 2.0 * X.T - 1.0
        bias = 0.3 * np.sin(3.0 * temperature) + 0.1 * np.sin(6.0 * rate)
        return rate * (1.0 + 0.1 * temperature) + bias

    noise = 0.2 * truth(fresh).std()
    y = truth(X) + noise * rng.standard_normal(200)
    y_fresh = truth(fresh) + noise * rng.standard_normal(2000)
    free = ANFISRegressor(partition="grid", max_rules=9).fit(X, y)
    told = clone(free).set_params(monotonic_cst=[1, 0]).fit(X, y)
    errors = [np.mean((model.predict(fresh) - y_fresh) ** 2) for model in (free, told)]
    assert errors[1] < errors[0]
    assert told.constraints_["certified"]
    assert falls(told, 0, rng) <= 1e-12
    assert monotonicity(told, 0) == 1
