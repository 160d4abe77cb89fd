"""Rows in chunks make the model that one least-squares fit of all rows makes."""

import pickle
from copy import deepcopy
from functools import partial

import numpy as np
import pandas as pd
import pytest
from sklearn.base import clone

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_sinc
from skanfis.exceptions import ForgottenRowsWarning

from ..quick import quick

GIVEN = {"agreement": 1e-3, "alpha": 1e-4}
# Of standard deviations of the target.
EXACT = 1e-10
# The same where weights differ in their last digit: those that the evidence finds are rounded to
# three, and where one is half way, the order of a sum says to which.
LAST_DIGIT = 1e-3
CHUNKINGS = {
    "one": [300],
    "rows": [1] * 15 + [285],
    "a row, then most": [1, 298, 1],
    "uneven": [7, 150, 2, 141],
}
KINDS = {
    "weights by evidence": {},
    "weights given": {"agreement": 0.01, "alpha": 0.02},
    "no penalty": {"agreement": 0.0, "alpha": 0.0},
    "order 0": {"order": 0},
    "some inputs": {"consequent_features": [1]},
}


def surface(n_rows=300, n_outputs=1, seed=0):
    """Rows whose columns lie far from the origin, on scales of their own."""
    g = np.random.default_rng(seed)
    Z = g.uniform(-1.0, 1.0, (n_rows, 2))
    y = np.sin(3.0 * Z[:, 0]) + Z[:, 0] * Z[:, 1] + 0.05 * g.normal(size=n_rows)
    y = np.column_stack([5e3 + y, 1e-6 * y**2])[:, :n_outputs]
    return 1e6 + Z * [300.0, 1e-2] + [0.0, -1e6], y if n_outputs > 1 else y[:, 0]


X, Y = surface()


@pytest.fixture(scope="module")
def premises():
    """A model that has seen other rows."""
    return quick([3, 2], **GIVEN).fit(*surface(seed=1))


def chunk(premises, **settings):
    return ANFISRegressor(partition=premises, solver="lse", **settings)


def in_chunks(model, X, y, sizes, weight=None, **options):
    start = 0
    for size in sizes:
        part = slice(start, start + size)
        own = None if weight is None else weight[part]
        model.partial_fit(X[part], y[part], own, **options)
        start += size
    return model


def difference(one, other, X):
    """Largest difference of predictions, in the deviations of each output."""
    found, expected = (model.model_.predict(X) for model in (one, other))
    return np.max(np.abs(found - expected) / expected.std(axis=0))


def weights_of(model):
    return [model.agreement_, model.alpha_, model.slope_alpha_]


def tolerance(one, other):
    """Where the last digit of a weight, or of a pull, depends on rounding, so do predictions."""
    weights = [(weights_of(model), model.pulls_, model.slope_pulls_) for model in (one, other)]
    return EXACT if weights[0] == weights[1] else LAST_DIGIT


@pytest.fixture(scope="module", params=KINDS)
def whole_and_settings(request, premises):
    """One fit of all rows."""
    settings = KINDS[request.param]
    return chunk(premises, **settings).fit(*surface()), settings


@pytest.mark.parametrize("learn", ["fit", "partial_fit"])
def test_rules_that_compensate_one_another_are_learnt_again(learn, rng):
    X = rng.uniform(-1.0, 1.0, (200, 1))
    first = ANFISRegressor(n_mfs=3).fit(X, np.sin(6.0 * X[:, 0]) + 1e-3 * rng.normal(size=200))
    again = getattr(chunk(first), learn)(X, first.predict(X))
    assert difference(again, first, X) < 1e-4


@pytest.mark.parametrize("chunking", CHUNKINGS)
def test_any_chunks_equal_one_fit(premises, whole_and_settings, chunking):
    """But for the penalty's extents, which are about the rules' centres in the first model."""
    whole, settings = whole_and_settings
    model = in_chunks(chunk(premises, **settings), X, Y, CHUNKINGS[chunking])
    once = chunk(premises, **settings).partial_fit(X, Y)
    assert weights_of(model) == pytest.approx(weights_of(once), rel=0.01)
    assert "alpha" not in settings or weights_of(model) == weights_of(once)
    assert difference(model, once, X) < tolerance(model, once)
    has_slopes = settings.get("order", 1) == 1 and settings.get("alpha") != 0.0
    assert difference(model, whole, X) < (0.05 if has_slopes else tolerance(model, whole))
    assert model.agreement_ == pytest.approx(whole.agreement_, rel=0.03)
    error = 10.0 * tolerance(model, once)
    assert model.loss_curve_[-1] == pytest.approx(once.loss_curve_[-1], rel=error)
    assert model.redundant_rules_ == whole.redundant_rules_
    for name in ("minimum", "maximum", "reference", "spread", "rule_weights", "rule_rows"):
        found, expected = getattr(model.model_, name), getattr(whole.model_, name)
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9), name
    support, expected = model.model_.support, whole.model_.support
    assert np.array_equal(support.share, expected.share)
    assert support.center == pytest.approx(expected.center, rel=1e-9)
    # The farthest row of a rule may be gone: then another one, hardly nearer, stands for it.
    assert np.all(support.radius <= expected.radius * (1.0 + 1e-9))
    assert np.all(support.radius >= 0.99 * expected.radius)
    assert model.n_samples_seen_ == 300


def test_weights_zeros_and_several_outputs(premises):
    X, y = surface(n_outputs=2)
    weight = np.random.default_rng(3).integers(0, 4, len(X)).astype(float)
    whole = chunk(premises).partial_fit(X, y, weight)
    model = in_chunks(chunk(premises), X, y, CHUNKINGS["uneven"], weight)
    assert difference(model, whole, X) < EXACT
    repeated = np.repeat(np.arange(len(X)), weight.astype(int))
    again = chunk(premises).partial_fit(X[repeated], y[repeated])
    assert difference(model, again, X) < EXACT
    assert model.model_.rule_rows == pytest.approx(again.model_.rule_rows, rel=1e-9)
    assert model.n_samples_seen_ == np.count_nonzero(weight)


def test_forgetting_is_a_fit_with_fading_weights(premises):
    new = partial(chunk, premises, agreement=0.01, alpha=0.0)
    whole = new().fit(X, Y, 0.98 ** np.arange(299.0, -1.0, -1.0))
    for sizes in ([300], [1] * 20 + [280], [100, 200]):
        model = in_chunks(new(), X, Y, sizes, forgetting=0.98)
        assert difference(model, whole, X) < EXACT
    assert model.noise_std_ > 0.0


def test_drift_of_inputs_costs_no_digits(premises):
    """The first chunk lies a million of its own deviations from the rest."""
    near = X.copy()
    near[:150, 0] = 0.0 + 1e-4 * np.arange(150)
    new = partial(chunk, premises, agreement=0.01, alpha=0.01)
    whole = new().partial_fit(near, Y)
    model = in_chunks(new(), near, Y, [150, 150])
    assert difference(model, whole, near) < EXACT


@pytest.mark.parametrize("order", [0, 1])
def test_first_call_is_a_fit_and_premises_stay(order):
    X, y = surface(600)
    given = GIVEN | {"order": order}
    fitted = quick([3, 2], **given).fit(X[:200], y[:200])
    model = quick([3, 2], **given).partial_fit(X[:200], y[:200])
    assert np.array_equal(model.predict(X[:200]), fitted.predict(X[:200]))
    assert model.n_samples_seen_ == 200
    model.partial_fit(X[200:], y[200:])
    assert model.memberships_ == fitted.memberships_
    held = chunk(fitted, **given).partial_fit(X, y)
    assert difference(model, held, X) < EXACT
    # And what fit says afterwards is of its own rows.
    model.fit(X[:200], y[:200])
    assert not hasattr(model, "n_samples_seen_")


def test_the_penalty_that_the_first_fit_found_stays():
    """Its pulls too: rows of hardly any weight leave the model as it was."""
    X, y = surface(200)
    model = ANFISRegressor(n_mfs=[3, 2], solver="lse").partial_fit(X, y)
    assert len(model.pulls_) > 1
    before = model.predict(X)
    model.partial_fit(X[:5], y[:5], sample_weight=np.full(5, 1e-8))
    assert np.abs(model.predict(X) - before).max() < 1e-6 * np.ptp(y)


def test_a_stray_row_that_is_forgotten_weighs_on_no_slope():
    """Nor do later rows make the weights that the first fit found heavier."""
    X, y = surface(900)
    models = [ANFISRegressor(n_mfs=[3, 2]).partial_fit(X[:100], y[:100]) for _ in range(2)]
    stray = X[:1] + 1e3 * np.ptp(X, axis=0)
    models[1].partial_fit(stray, y[:1], forgetting=0.9)
    for model in models:
        in_chunks(model, X[100:], y[100:], [400, 400], forgetting=0.9)
    assert difference(*models, X) < EXACT


def test_after_fit_premises_stay_and_rows_are_new(premises):
    model = deepcopy(premises)
    with pytest.warns(ForgottenRowsWarning, match="no sums over its 300 rows"):
        model.partial_fit(X, Y)
    held = chunk(premises, **GIVEN).partial_fit(X, Y)
    assert difference(model, held, X) < EXACT
    assert model.n_samples_seen_ == 300


def test_nearly_exact_data_stay_so():
    """A fit without noise found weights of next to nothing: another row does not change that."""
    X, y = make_jang_sinc()
    model = ANFISRegressor(n_mfs=4).partial_fit(X[:-1], y[:-1])
    before = np.sqrt(np.mean((model.predict(X[:-1]) - y[:-1]) ** 2))
    model.partial_fit(X[-1:], y[-1:])
    assert np.sqrt(np.mean((model.predict(X) - y) ** 2)) < 2.0 * before


def test_noise_of_one_rule_is_that_of_a_line():
    """n / (n - k) times the mean square, as in the textbook."""
    model = ANFISRegressor(n_mfs=1, agreement=0.0, alpha=0.0, solver="lse")
    model = in_chunks(model, X, Y, [200, 100])
    design = np.column_stack([np.ones(300), X - X.mean(axis=0)])
    residual = Y - design @ np.linalg.lstsq(design, Y, rcond=None)[0]
    assert model.noise_std_**2 == pytest.approx(residual @ residual / 297.0, rel=1e-6)


def test_merged_equals_all_rows(premises):
    whole = chunk(premises).partial_fit(X, Y)
    parts = [slice(0, 90), slice(90, 91), slice(91, 300)]
    models = [chunk(premises).partial_fit(X[part], Y[part]) for part in parts]
    before = models[0].predict(X[:90])
    for order in ([0, 1, 2], [2, 0, 1]):
        first, *others = (models[i] for i in order)
        merged = first.merge(*others)
        assert difference(merged, whole, X) < EXACT
        assert merged.n_samples_seen_ == 300
        assert merged.noise_std_ == pytest.approx(whole.noise_std_, rel=1e-9)
    assert np.array_equal(models[0].predict(X[:90]), before)


def test_chunks_forget_what_the_premises_were_known_to_rise_with():
    """Beyond the range too they are the fit of all rows to the same premises."""
    X = np.random.default_rng(0).uniform(-1.0, 1.0, (200, 2))
    y = X[:, 0] + np.tanh(3.0 * X[:, 0]) * (1.5 + X[:, 1])
    known = ANFISRegressor(n_mfs=2, monotonic_cst=[1, 0]).fit(X, y)
    free = partial(chunk, known, alpha=0.0, agreement=0.0)
    whole, chunks = free().fit(X, y), in_chunks(free(), X, y, [100, 100])
    beyond = X[:50] + np.sign(X[:50])
    assert np.allclose(chunks.predict(beyond), whole.predict(beyond), atol=1e-9)
    with pytest.raises(AttributeError, match="has no attribute 'merge'"):
        chunks.set_params(monotonic_cst=[1, 0]).merge(chunks)


def test_merge_says_how_premises_differ(premises):
    model = chunk(premises).partial_fit(X, Y)
    other = ANFISRegressor(n_mfs=[3, 2], solver="lse").partial_fit(X[:100], Y[:100])
    with pytest.raises(ValueError, match=r"term 0, 'low' of 'x0', has center .* in one and"):
        model.merge(other)
    with pytest.raises(ValueError, match="6 and 4 rules"):
        model.merge(ANFISRegressor(n_mfs=2, solver="lse").partial_fit(X, Y))
    with pytest.raises(ValueError, match="linear in x0, x1 and in none"):
        model.merge(chunk(premises, order=0).partial_fit(X, Y))
    frame = pd.DataFrame(X, columns=["a", "b"])
    named = chunk(premises).partial_fit(frame, Y)
    with pytest.raises(ValueError, match="inputs are x0, x1 and a, b"):
        model.merge(named)
    with pytest.raises(ValueError, match="Model 1 of merge has not been trained by partial_fit"):
        model.merge(premises)


def test_state_survives_a_file_and_not_a_clone(premises):
    model = chunk(premises).partial_fit(X[:200], Y[:200])
    loaded = pickle.loads(pickle.dumps(model))
    for one in (model, loaded):
        one.partial_fit(X[200:], Y[200:])
    assert np.array_equal(loaded.predict(X), model.predict(X))
    assert not hasattr(clone(model), "n_samples_seen_")
    deep = deepcopy(model).partial_fit(X[:1], Y[:1] + 1e3)
    assert deep.n_samples_seen_ == 301
    assert model.n_samples_seen_ == 300


def test_rows_far_beyond_the_premises_are_refused_by_name(premises):
    X, y = surface(50)
    model = chunk(premises).partial_fit(X, y)
    for value in (1e299, -1e150):
        X[7, 1] = value
        with pytest.raises(ValueError, match=r"'x1' of X holds .*more than 1e\+100 standard"):
            model.partial_fit(X, y)
        with pytest.raises(ValueError, match=r"Column 'x1' of X holds"):
            chunk(premises).partial_fit(X, y)
    X[7, 1], y[3] = 1e50, 1e299
    for one in (model, chunk(premises)):
        with pytest.raises(ValueError, match=r"Column 'y' of y holds numbers up to 1e\+299"):
            one.partial_fit(X, y)
    y[3] = 0.0
    assert np.isfinite(model.partial_fit(X, y).predict(X[:3])).all()


def test_rows_of_before_a_jump_stay_covered(premises):
    """What was near the centre of a rule is its farthest row once the centre has moved."""
    jumped = np.where(np.arange(300)[:, None] < 150, X, X - [3e4, -1.0])
    model = in_chunks(chunk(premises, **GIVEN), jumped, Y, [30] * 10)
    once = chunk(premises, **GIVEN).partial_fit(jumped, Y)
    assert model.coverage(jumped) == pytest.approx(once.coverage(jumped), abs=1e-3)


@pytest.mark.parametrize("forgetting", [0.0, 1e-13, 1.01, np.nan, "0.9", True, None])
def test_forgetting_out_of_range(premises, forgetting):
    with pytest.raises(ValueError, match=r"forgetting=.*a number from 1e-12 to 1"):
        chunk(premises).partial_fit(*surface(), forgetting=forgetting)


def test_forgetting_as_fast_as_it_may_leaves_the_latest_row(premises):
    model = chunk(premises).partial_fit(X[:100], Y[:100])
    for i in range(100, 150):
        model.partial_fit(X[[i]], Y[[i]], forgetting=1e-12)
    assert model.predict(X[[149]]) == pytest.approx(Y[[149]], abs=1e-9)


BAD_CHUNKS = {
    "NaN": (lambda X: X.replace(X.iloc[4, 0], np.nan), "column 'a', first at row 4"),
    "empty": (lambda X: X[:0], "0 sample"),
    "other order": (lambda X: X[["b", "a"]], "must be in the same order"),
    "other names": (lambda X: X.rename(columns={"a": "c"}), "unseen at fit time"),
    "fewer columns": (lambda X: X[["a"]], r"missing|1 features"),
}


@pytest.mark.parametrize("case", BAD_CHUNKS)
def test_bad_chunk_leaves_the_model_as_it_was(premises, case):
    X, y = surface(50)
    X = pd.DataFrame(X, columns=["a", "b"])
    model = chunk(premises).partial_fit(X, y)
    before, n_seen = model.predict(X), model.n_samples_seen_
    damage, message = BAD_CHUNKS[case]
    bad = damage(X)
    with pytest.raises(ValueError, match=message):
        model.partial_fit(bad, y[: len(bad)])
    assert np.array_equal(model.predict(X), before)
    assert model.n_samples_seen_ == n_seen


def test_what_chunks_cannot_be_asked(premises):
    X, y = surface(60, n_outputs=2)
    one = y[:, 0]
    for settings, message in [
        ({"loss": "huber"}, "loss='huber' reweights earlier rows"),
        ({"early_stopping": True}, "early_stopping=True"),
        ({"monotonic_cst": [1, 0]}, "monotonic_cst=[1, 0]"),
    ]:
        model = chunk(premises, **settings)
        with pytest.raises(AttributeError) as caught:
            model.partial_fit(X, one)
        assert message in str(caught.value.__cause__)
    with pytest.raises(ValueError, match=r"max_iter=0 .*leave max_iter at its default"):
        chunk(premises, max_iter=0).partial_fit(X, one)
    with pytest.raises(ValueError, match="first chunk has 1 row,"):
        ANFISRegressor().partial_fit(X[:1], one[:1])
    with pytest.raises(ValueError, match="no row with a positive weight"):
        chunk(premises).partial_fit(X, one, np.zeros(60))
    model = chunk(premises).partial_fit(X, pd.DataFrame(y, columns=["u", "v"]))
    with pytest.raises(ValueError, match="Earlier chunks had the outputs u, v, and y has 1"):
        model.partial_fit(X, one)
    for names in (["v", "u"], ["v", "w"], ["w", "u"]):
        with pytest.raises(ValueError, match=f"columns of y are {', '.join(names)}, but .* u, v:"):
            model.partial_fit(X, pd.DataFrame(y[:, ::-1], columns=names))
    with pytest.raises(ValueError, match="but weights in partial_fit must be zero or between"):
        model.partial_fit(X, y, np.full(60, 1e200))
    with pytest.raises(ValueError, match="order was 1 at the first partial_fit"):
        model.set_params(order=0).partial_fit(X, y)


def test_names_that_were_given_stay(premises):
    model = chunk(premises).partial_fit(X[:200], Y[:200])
    model.rename_terms({"x1": ["cold", "hot"]})
    assert "x1 is cold" in model.readability_.rules["if"].iloc[0]
    names = (*premises.model_.term_names[:3], "cold", "hot")
    other = chunk(premises).partial_fit(X[200:], Y[200:])
    for later in (model.merge(other), model.partial_fit(X[200:], Y[200:])):
        assert later.model_.term_names == names
        assert difference(later, chunk(premises).partial_fit(X, Y), X) < LAST_DIGIT


def test_one_row_says_nothing_of_noise(premises):
    model = chunk(premises, **GIVEN).partial_fit(X[:1], Y[:1])
    assert model.noise_std_ is None
    with pytest.raises(ValueError, match=r"has no posterior, .* seen a single row"):
        model.predict(X, return_std=True)
    model.partial_fit(X[1:], Y[1:])
    whole = chunk(premises, **GIVEN).partial_fit(X, Y)
    assert model.noise_std_ == pytest.approx(whole.noise_std_, rel=1e-6)


def test_a_constant_target_at_first_settles_nothing():
    """The weights that a fit to it found would let no slope in, ever."""
    X, y = surface(600)
    y[:100] = y[0]
    first = ANFISRegressor(n_mfs=[3, 2]).fit(X[:100], y[:100])
    model = in_chunks(ANFISRegressor(n_mfs=[3, 2]), X, y, [100, 500])
    assert difference(model, chunk(first).partial_fit(X, y), X) < LAST_DIGIT
    assert model.score(X[100:], y[100:]) > 0.9


@pytest.mark.theory
@pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstantInputWarning")
def test_an_input_that_rounding_alone_changes_has_no_slope_to_leave_out(rng):
    X, y = surface(300)
    wobble = np.where(rng.random(300) < 0.5, 0.3, 0.1 + 0.2)
    tables = [np.column_stack([still, X]) for still in (np.full(300, 0.3), wobble)]
    models = [in_chunks(ANFISRegressor(max_rules=2), table, y, [100, 200]) for table in tables]
    exact, found = (model.predict(np.column_stack([wobble, X])) for model in models)
    np.testing.assert_allclose(found, exact, atol=1e-9)


def test_a_chunk_without_weight_in_any_form_changes_nothing(premises):
    model = chunk(premises).partial_fit(X, Y)
    before = model.predict(X)
    for nothing in (0.0, np.zeros(300), [0] * 300):
        assert np.array_equal(model.partial_fit(X, 1e9 * Y, nothing).predict(X), before)


def test_the_unit_of_the_target_makes_no_difference(rng):
    """With repeated inputs, each with ten targets."""
    table = np.repeat(rng.uniform(-1.0, 1.0, (12, 2)), 10, axis=0)
    y = np.sin(3.0 * table[:, 0]) + 0.1 * rng.normal(size=120)
    premises = quick(2, **GIVEN).fit(table, y)
    found, small = (chunk(premises).partial_fit(table, y * unit) for unit in (1.0, 1e-20))
    assert found.alpha_ == small.alpha_
    np.testing.assert_allclose(small.predict(table) * 1e20, found.predict(table), rtol=LAST_DIGIT)
