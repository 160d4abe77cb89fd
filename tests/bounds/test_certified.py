"""Bounds over a whole box: closed forms, brute force, policies, pipelines, and what is refused."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from skanfis import ANFISRegressor
from skanfis.antecedent import RuleTableAntecedent, TermGroup
from skanfis.bounds import bounds, gradient_bounds, monotonicity
from skanfis.bounds.construction import is_in_order
from skanfis.learning import VariableProjection
from skanfis.membership import Gaussian
from skanfis.options import LinearExtrapolation

from ..export.every_model import CASES
from ..export.rule_bases import MODELS, OFFSET, SCALE, build

pytestmark = pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")
NO_TERMS = build(RuleTableAntecedent((), np.empty((3, 0), dtype=int)), 1, 2)
ONE_RULE = MODELS["one rule, order 1, 2 outputs"].with_out_of_bounds("linear", 0.5)


@pytest.mark.parametrize("model", [ONE_RULE, NO_TERMS], ids=["one rule", "no terms"])
def test_a_line_is_bounded_by_its_corners(model):
    box = np.stack([OFFSET - SCALE, OFFSET + SCALE], axis=1)
    found = bounds(model, box)
    height, *slopes = model.coefficients.mean(axis=0)
    middle, half = height + (OFFSET - model.reference) @ slopes, SCALE @ np.abs(slopes)
    assert_allclose(found.lower, middle - half, rtol=1e-8)
    assert_allclose(found.upper, middle + half, rtol=1e-8)
    slope = gradient_bounds(model, "rate", box)
    assert_allclose([slope.lower, slope.upper], [slopes[2], slopes[2]], rtol=1e-9)
    assert (slope.tightness >= 0.0).all()
    assert_allclose(monotonicity(model, 2, box), np.sign(slopes[2]))
    assert (found.n_boxes, found.converged) == (4, True)
    # As written, too, no value is beyond.
    ends = {"lower": np.array([-1.02616491]), "upper": np.array([1.91238491])}
    found = replace(found, **ends, output_names=("y0",))
    assert repr(found) == "Bounds(y0 in [-1.02617, 1.91239])"
    found = replace(found, lowest=found.lower + 0.2, highest=found.upper - 0.1)
    assert_allclose(found.tightness, 0.2 / (1.91238491 + 1.02616491 - 0.3))


def test_a_search_has_converged_if_it_has_for_every_output():
    model = MODELS["scattered, order 0, 2 outputs"]
    found = bounds(replace(model, coefficients=model.coefficients * [0.0, 1.0]), max_boxes=1)
    assert found.lower[0] == found.upper[0] == 0.0
    assert not found.converged


def test_two_rules_of_order_zero_are_a_sigmoid():
    """w = s(k (x - c)) of two Gaussians of one width: the bounds are its values at the ends."""
    model = MODELS["scattered, order 0, 1 outputs"]
    theta = np.zeros((2, 2))
    theta[0] = OFFSET[0] + np.array([-1.0, 1.0]) * SCALE[0]
    theta[1] = np.log(SCALE[0])
    group = TermGroup(Gaussian, np.zeros(2, dtype=int), theta)
    antecedent = replace(model.antecedent, groups=(group,), table=np.array([[0], [1]]))
    values = np.array([2.0, 5.0]).reshape(2, 1, 1)
    model = replace(model, antecedent=antecedent, coefficients=values, term_names=("a", "b"))
    z = np.array([-0.7, 0.4])
    found = bounds(model, {"time": tuple(OFFSET[0] + SCALE[0] * z)}, tol=1e-6)
    assert_allclose([found.lower[0], found.upper[0]], 2.0 + 3.0 / (1.0 + np.exp(-2.0 * z)), 1e-6)
    slope = gradient_bounds(model, "time", tol=1e-4)
    assert_allclose(slope.upper, 3.0 * 0.25 * 2.0 / SCALE[0], rtol=2e-4)
    assert monotonicity(model, "time") == 1
    assert monotonicity(replace(model, coefficients=-model.coefficients), "time") == -1


def test_the_box_is_held_where_the_policy_holds(rng):
    X = rng.uniform([-20.0, -100.0], [60.0, 100.0], (200, 2))
    y = 1e-3 * X[:, 1] * (1.0 + 0.01 * X[:, 0]) + 0.1 * np.sin(X[:, 0] / 15.0)
    estimator = ANFISRegressor(n_mfs=3, max_iter=5, solver=VariableProjection(tol=0.1)).fit(X, y)
    without_end = [(-np.inf, np.inf)] * 2
    found = bounds(estimator, without_end)
    rows = rng.uniform([-5000.0, -9000.0], [5000.0, 9000.0], (5000, 2))
    predicted = estimator.predict(rows)
    assert found.lower[0] <= predicted.min()
    assert predicted.max() <= found.upper[0]
    assert predicted.max() > found.highest[0] - 0.02 * np.ptp(predicted)
    for policy in ("clip", "nan", "raise"):
        held = bounds(estimator.set_params(out_of_bounds=policy), without_end)
        inside = bounds(estimator)
        assert_allclose([held.lower, held.upper], [inside.lower, inside.upper])
        assert held.upper < found.upper
        # Where the edge is held the slope is none; where nothing is predicted there is none.
        is_rising = gradient_bounds(estimator, 1, without_end).lower[0] > 0.0
        assert is_rising == (policy != "clip")
    estimator.set_params(out_of_bounds=LinearExtrapolation(np.inf))
    with pytest.raises(ValueError, match=r"'x0', but the model extrapolates without limit"):
        bounds(estimator, without_end)
    # As far as floats go results saturate, and are enclosed.
    far = bounds(estimator, [(-1.7e308, 1.7e308)] * 2, max_boxes=2000)
    ends = estimator.predict([[s * 1e308, t * 1e308] for s in (-1, 1) for t in (-1, 1)])
    assert far.lower[0] <= ends.min() < -1e90
    assert 1e90 < ends.max() <= far.upper[0] < np.inf


@pytest.mark.parametrize("policy", ["linear", "clip"])
def test_points_lie_in_a_box_beyond_the_range(policy):
    model = ONE_RULE.with_out_of_bounds(policy, 0.5)
    beyond = model.maximum + 100.0 * SCALE
    box = np.stack([beyond, beyond + SCALE], axis=1)
    for found in (bounds(model, box), gradient_bounds(model, "rate", box)):
        for point in (*found.at_lowest, *found.at_highest):
            assert (box[:, 0] <= point).all()
            assert (point <= box[:, 1]).all()
    found = bounds(model, box)
    assert_allclose(np.diag(model.predict(found.at_lowest)), found.lowest)


def test_what_rises_in_the_range_may_fall_beyond_that_of_another_input(rng):
    X = rng.uniform(-1.0, 1.0, (200, 2))
    model = ANFISRegressor(n_mfs=2, out_of_bounds=LinearExtrapolation(5.0))
    rising = model.fit(X, X[:, 0] * (1.5 + X[:, 1])).model_
    # With both slopes positive the rules are in order, which says nothing beyond their range.
    ordered = model.set_params(n_mfs=[1, 2]).fit(X, X[:, 0]).model_
    terms = ordered.antecedent.with_parameters(np.array([-1.0, 1.0, 0.0, 0.0]))
    slopes = np.array([[0.0, 0.5, 0.0], [0.0, 2.5, 0.0]])[:, :, None]
    ordered = replace(ordered, antecedent=terms, coefficients=slopes)
    assert is_in_order(ordered, 0, np.array([1, 0]))
    for one in (rising, ordered):
        assert monotonicity(one, 0) == 1
        assert monotonicity(one, 0, {"x1": (-3.0, 1.0)}) == 0


def test_a_frame_is_read_by_its_labels():
    names, low = list(ONE_RULE.input_names), OFFSET - SCALE
    frame = pd.DataFrame({"low": low, "high": low + [1.0, 2.0, 3.0] * SCALE}, index=names)
    expected = frame.to_numpy()
    turned = frame.loc[names[::-1]]
    for box in (frame, turned, turned.T, frame.reset_index(drop=True), frame.apply(tuple, axis=1)):
        assert_allclose(bounds(ONE_RULE, box).box, expected)
    assert_allclose(bounds(ONE_RULE, turned[:1]).box[2], expected[2])


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"box": [(0.0, 1.0)]}, r"for each input .*got \[\(0.0, 1.0\)\]"),
        ({"box": "all"}, r"one \(low, high\) for each input .*got 'all'"),
        (
            {"box": {"speed": (0.0, 1.0)}},
            "box names 'speed', .* no column .*'rate', at positions 0",
        ),
        ({"box": {"rate": (0.0, 1.0), 2: (0.0, 2.0)}}, r"box=\['rate', 2\] names a column twice"),
        ({"box": {"rate": (1.0, 0.0)}}, r"box has \(1, 0\) for 'rate': low must not be above high"),
        ({"box": {"rate": (np.nan, 0.0)}}, "neither may be NaN"),
        ({"box": {"rate": ("a", 1.0)}}, r"got {'rate': \('a', 1.0\)}"),
        ({"tol": -1}, "tol=-1 must be a number, zero or positive"),
        ({"tol": "a"}, "tol='a' must be a number"),
        ({"max_boxes": 0}, "max_boxes=0 must be a whole number of 1 or more"),
    ],
)
def test_parameters_are_checked(asked, message):
    with pytest.raises(ValueError, match=message):
        bounds(ONE_RULE, **asked)


def test_what_cannot_be_bounded_is_refused():
    with pytest.raises(ValueError, match=r"'rate', outside the range .* predicts nothing there"):
        bounds(ONE_RULE.with_out_of_bounds("nan"), {"rate": (5.0, 6.0)})

    class Own(Gaussian):
        name = "own"

    model = CASES[0].model
    groups = tuple(replace(group, family=Own) for group in model.antecedent.groups)
    with pytest.raises(ValueError, match="The ranges of 'own' memberships are not known"):
        bounds(replace(model, antecedent=replace(model.antecedent, groups=groups)))
