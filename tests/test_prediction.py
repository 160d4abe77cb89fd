"""Predictions in the range of the training data and out of it, under every policy, and warnings."""

import math
import pickle

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone

from skanfis import ANFISRegressor
from skanfis.exceptions import OutOfBoundsWarning
from skanfis.options import LinearExtrapolation
from skanfis.policies import FARTHEST

from . import oracles
from .memory import traced
from .quick import quick

NAMES = ["time", "temperature", "rate"]
X = np.random.default_rng(0).uniform([0.0, -40.0, -300.0], [1800.0, 85.0, 300.0], (240, 3))
FRAME = pd.DataFrame(X, columns=NAMES)
Y = np.exp(-X[:, 0] / 600.0) + np.tanh(X[:, 2] / 150.0) * np.sin(X[:, 1] / 30.0)


@pytest.fixture(scope="module")
def trained():
    """Trained where temperature is in [-40, 85] and rate in [-300, 300]."""
    return quick(2).fit(FRAME, Y)


OUTSIDE = pd.DataFrame(
    [[900.0, 20.0, 100.0], [900.0, 120.0, 100.0], [900.0, 99.5, -400.0], [-5.0, 20.0, 0.0]],
    columns=NAMES,
)


def test_out_of_bounds_rows_are_reported(trained):
    low, high = FRAME["temperature"].min(), FRAME["temperature"].max()
    message = (
        rf"'time' in 1 of 4 rows .*'temperature' in 2 of 4 rows "
        rf"\(trained on \[{low:.6g}, {high:.6g}\], found \[20, 120\]\); "
        rf"'rate' in 1 of 4 rows .*Policy: out_of_bounds='linear', "
        rf"max_extrapolation={trained.model_.max_extrapolation}"
    )
    with pytest.warns(OutOfBoundsWarning, match=message) as caught:
        trained.predict(OUTSIDE)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert_array_equal(trained.in_bounds(OUTSIDE), [True, False, False, False])
    with pytest.warns(OutOfBoundsWarning, match=message):
        trained.score(OUTSIDE, np.arange(4.0))


def with_policy(estimator, policy):
    return clone(estimator).set_params(out_of_bounds=policy).fit(FRAME, Y)


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.3, 3.0])
def test_line_is_followed_for_as_many_deviations_as_the_target_has_of_the_noise(rng, noise):
    """Accounts that add up, far."""
    X = rng.lognormal(sigma=1.0, size=(200, 4))
    y = X @ [1.0, 2.0, 0.5, 1.5] + noise * rng.normal(size=200)
    model = ANFISRegressor(n_mfs=1).fit(X, y)
    limit = model.model_.max_extrapolation
    assert limit == pytest.approx(y.std() / model.noise_std_ if noise else FARTHEST, rel=5e-3)
    # The noise that was planted, to what 200 rows tell of it.
    assert model.noise_std_ == pytest.approx(noise, rel=0.15, abs=1e-3)
    edge = X.max(axis=0)
    for way in (0.9 * limit, 5.0 * limit):
        expected = oracles.held_tangent(model.model_, edge[None] + way * X.std(axis=0), limit)
        held = min(expected[0, 0], y.max() + limit * y.std())
        found = model.predict(edge[None] + way * X.std(axis=0))
        assert_allclose(found, held, rtol=1e-6)


def test_rules_are_followed_as_far_as_the_output_with_most_noise_allows(rng):
    """Whatever policy they were fitted with."""
    y = np.column_stack([Y, Y]) + [0.01, 0.2] * rng.normal(size=(240, 2))
    model = quick(2, out_of_bounds=LinearExtrapolation(math.inf)).fit(FRAME, y)
    limit = min(y.std(axis=0) / model.noise_std_)
    assert limit == pytest.approx(y[:, 1].std() / 0.2, rel=0.2)
    found = model.set_params(out_of_bounds="linear").predict(OUTSIDE)
    followed = oracles.held_tangent(model.model_, OUTSIDE.to_numpy(), float(f"{limit:.3g}"))
    margin = 0.25 * np.ptp(y, axis=0)
    assert_allclose(found, followed.clip(y.min(axis=0) - margin, y.max(axis=0) + margin))


def test_policy_may_be_changed_after_training(trained):
    model = pickle.loads(pickle.dumps(trained))
    for policy in ("linear", "nan", "clip"):
        found = model.set_params(out_of_bounds=policy).predict(OUTSIDE)
        assert_array_equal(found, with_policy(trained, policy).predict(OUTSIDE))
    for refusing in (model.set_params(out_of_bounds="raise"), with_policy(trained, "raise")):
        with pytest.raises(ValueError, match=r"'temperature' in 2 of 4 .*'rate' in 1 of 4 rows"):
            refusing.predict(OUTSIDE)
        assert_array_equal(refusing.predict(OUTSIDE[:1]), trained.predict(OUTSIDE[:1]))
    model.set_params(out_of_bounds=LinearExtrapolation())
    for limit in (0.0, 0.2, math.inf):
        found = model.set_params(out_of_bounds__max_extrapolation=limit).predict(OUTSIDE)
        expected = oracles.held_tangent(trained.model_, OUTSIDE.to_numpy(), limit)
        assert_allclose(found, expected[:, 0], rtol=1e-10)
    for limit in (-0.1, math.nan, "far"):
        model.set_params(out_of_bounds__max_extrapolation=limit)
        with pytest.raises(ValueError, match=f"max_extrapolation={limit!r} must be a number"):
            model.predict(OUTSIDE)
    with pytest.raises(ValueError, match="'extrapolate' must be one of clip, linear, nan, raise"):
        trained.model_.with_out_of_bounds("extrapolate")


@pytest.mark.parametrize("policy", ["clip", "linear"])
def test_array_in_single_precision_is_not_copied_as_a_whole(policy):
    """A file may be mapped to memory that would not hold its rows as doubles."""
    single = np.tile(X.astype(np.float32), (1000, 1))
    model = quick(2, out_of_bounds=policy).fit(single[:240], Y)
    expected = model.predict(single[:240].astype(float))
    for act in (model.predict, model.coverage, model.model_.predict):
        with traced() as peak:
            found = act(single)
        assert peak[0] < 2 * single.nbytes
    assert_array_equal(found[:240, 0], expected)
