"""Shares against definitions on data; what is said, and what is refused."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from sklearn.cluster import KMeans
from sklearn.compose import make_column_transformer
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import OneHotEncoder, StandardScaler

from skanfis import ANFISRegressor
from skanfis.export import export_json, fold
from skanfis.export.json_reader import parse_json
from skanfis.inspection import anova, effects

from ..export.rule_bases import MODELS, build, narrow_target, rows_of
from ..quick import quick
from .test_anova import SUBSETS, TREE, mean_over, on_the_product, variance_of

NAMES = ["time", "chip temperature", "rate"]
LABELS = [" and ".join(NAMES[j] for j in v) for v in SUBSETS[:6]]


def product_shares(y, weight):
    """Of the three inputs, the three pairs, and all three, by the definition of the ANOVA."""
    closed = [variance_of(mean_over(y, v, weight), weight) for v in SUBSETS]
    own = dict(zip(SUBSETS, closed, strict=True))
    for v in SUBSETS[3:]:
        own[v] -= sum(own[u] for u in SUBSETS if set(u) < set(v))
    return np.array(list(own.values())) / closed[-1]


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("rules", ["grid", "tree"])
def test_both_shares_are_those_of_the_definition(rules, order):
    grid = MODELS[f"grid, order {order}, 2 outputs"]
    model = build(TREE, order, 2) if rules == "tree" else grid
    X, weight, place = rows_of(model, 1.0, 9), np.full(9, 1.0 / 9.0), np.arange(9)
    for k in range(2):
        y = on_the_product(model, X)[..., k]
        found = effects(model, X, output=k).table
        expected = product_shares(y, weight)
        every = [*LABELS, "three or more"]
        assert_allclose(found["sobol"].reindex(every), expected, rtol=0, atol=1e-10)
        # The component of a row is that of the combination of its own three values.
        closed = [mean_over(y, v, weight)[place, place, place] for v in SUBSETS]
        own = dict(zip(SUBSETS, closed, strict=True))
        for v in SUBSETS[3:]:
            own[v] = own[v] - y.mean() - sum(own[u] - y.mean() for u in SUBSETS if set(u) < set(v))
        yhat = y[place, place, place]
        parts = [np.mean((c - c.mean()) * (yhat - yhat.mean())) / yhat.var() for c in own.values()]
        assert_allclose(sum(parts), 1.0)
        assert_allclose(found["rows"].reindex(every), parts, rtol=0, atol=1e-10)


def test_what_fit_keeps_is_what_its_rows_give(rng):
    X = rng.uniform([250.0, -1e-3, 0.0], [330.0, 1e-3, 5.0], (60, 3))
    y = np.column_stack([np.sin(X[:, 0] / 20.0) + 1e6 * X[:, 1] ** 2 + X[:, 2], X[:, 2]])
    y *= 0.01
    model, weight = quick(n_mfs=[3, 2, 1]).fit(X, y), np.full(60, 1 / 60)
    scaled = make_pipeline(StandardScaler(), quick(n_mfs=[3, 2, 1])).fit(X, y)
    for k in range(2):
        of_rows = effects(model, X, output=k).table["sobol"]
        kept = effects(model, output=k).table["sobol"]
        assert_allclose(kept[of_rows.index], of_rows, rtol=0, atol=1e-10)
        folded = effects(scaled, output=k).table["sobol"]
        assert_allclose(folded[of_rows.index], of_rows, rtol=0, atol=1e-6)
        grid = on_the_product(model.model_, X)[..., k]
        others = [variance_of(mean_over(grid, v, weight), weight) for v in [(1, 2), (0, 2), (0, 1)]]
        total = variance_of(grid, weight) - np.array(others)
        assert_allclose(model.feature_importances_[k], total / total.sum(), rtol=0, atol=1e-10)
    alone = quick(n_mfs=[3, 2, 1]).fit(X, y[:, 1])
    assert_allclose(alone.feature_importances_, [0, 0, 1], atol=1e-6)


def test_inputs_that_go_together_are_told(rng):
    X = rng.normal(size=(300, 2))
    X[:, 1] = X[:, 0] + 0.2 * X[:, 1]
    model = quick(n_mfs=1).fit(X, X[:, 0] + X[:, 1])
    found = effects(model, X)
    variances, both = X.var(axis=0), np.cov(X.T, bias=True)
    assert_allclose(found.table["sobol"].loc[["x0", "x1"]], variances / variances.sum(), rtol=1e-3)
    assert_allclose(found.table["rows"].loc[["x0", "x1"]], both.sum(0) / both.sum(), rtol=1e-3)
    assert found.notes == []
    model = quick(n_mfs=1).fit(X, X[:, 0] + 0.3 * X[:, 1])
    found = effects(model, X)
    assert len(found.notes) == 1
    assert found.notes[0].startswith("Inputs go together in the rows, which changes shares: x0 0.")
    assert "; x1 0." in found.notes[0]
    assert repr(found) == str(found)
    assert str(found).endswith(found.notes[0])


def categories():
    """A column of categories, which goes with another by products."""
    rng = np.random.default_rng(2)
    X = pd.DataFrame({"rate": rng.uniform(-1.0, 1.0, 90), "fibre": rng.choice(["a", "b", "c"], 90)})
    y = X["rate"] * X["fibre"].map({"a": 2.0, "b": -1.0, "c": 0.5}) + (X["fibre"] == "a")
    return X, y


@pytest.mark.parametrize("drop", [None, "first"])
@pytest.mark.parametrize("has_names", [True, False])
def test_columns_of_one_category_enter_as_one(drop, has_names):
    X, y = categories()
    table = X if has_names else X.to_numpy(dtype=object)
    encoder = make_column_transformer(
        (OneHotEncoder(sparse_output=False, drop=drop), [1]), remainder=StandardScaler()
    )
    model = make_pipeline(encoder, quick(n_mfs=[2] + [1] * (3 if drop is None else 2)))
    fitted = GridSearchCV(model, {}, cv=2).fit(table, y)
    rate, fibre = ["rate", "fibre"] if has_names else ["x0", "x1"]
    # All combinations of a rate and a fibre, by the rows' frequencies.
    n = len(X)
    both = pd.DataFrame({"rate": np.repeat(X["rate"], n), "fibre": np.tile(X["fibre"], n)})
    rows = np.column_stack([both["rate"], *(both["fibre"] == level for level in "abc")])
    rows = rows[:, [0, 1, 2, 3] if drop is None else [0, 2, 3]]
    yhat = fold(fitted).predict(rows.astype(float))[:, 0].reshape(n, n)
    expected = np.array([yhat.mean(axis=1).var(), yhat.mean(axis=0).var()]) / yhat.var()
    for found in (effects(fitted, table).table, effects(fitted).table):
        assert_allclose(found.loc[[rate, fibre], "sobol"], expected, rtol=0, atol=1e-9)
        assert set(found.index) <= {rate, fibre, f"{rate} and {fibre}"}
    with pytest.raises(ValueError, match="has the same name as a column that is not in it"):
        effects(fitted, table, groups={fibre: [rate]})
    # A category is called by its name in a group too.
    named = effects(fitted, table, groups={"sort": [fibre]}).table
    assert_allclose(named.loc[[rate, "sort"], "sobol"], expected, rtol=0, atol=1e-9)
    assert list(effects(fitted, table, groups={"both": [rate, fibre]}).table.index) == ["both"]


@pytest.fixture(scope="module")
def of_indicators():
    """A model of a rate and a column for each fibre, and its rows."""
    X, y = categories()
    X = pd.concat([X[["rate"]], pd.get_dummies(X["fibre"], dtype=float)], axis=1)
    return quick(n_mfs=[1, 2, 1, 1]).fit(X, y), X


def test_groups_enter_as_one(of_indicators):
    model, X = of_indicators
    found = effects(model, X, groups={"fibre": ["a", "b", "c"]}).table
    assert list(found.index[:2]) in (["rate", "fibre"], ["fibre", "rate"])
    assert_allclose(found.sum(), 1.0)
    with pytest.raises(ValueError, match="groups needs X"):
        effects(model, groups={"fibre": ["a", "b", "c"]})


@pytest.mark.parametrize(
    ("groups", "match"),
    [
        ({"fibre": ["a", "d"]}, "'d' is no input"),
        ({"one": ["a", "b"], "two": ["b", "c"]}, r"\['two'\] shares columns with 'one'"),
        ({"one": ["a"], "two": ["a", "b"]}, "none of another group"),
        ({"fibre": "a"}, r"groups\['fibre'\]='a' must list one or more"),
        (["a", "b"], "must be a dict"),
    ],
)
def test_groups_that_are_none_are_refused(of_indicators, groups, match):
    with pytest.raises(ValueError, match=match):
        effects(*of_indicators, groups=groups)


def test_what_is_held_is_told():
    free = MODELS["grid, order 1, 1 outputs"]
    model = replace(free, target=narrow_target(1))
    X = rows_of(model, 1.0, 9)
    y = on_the_product(model, X)
    low, high = model.output_limits
    expected = np.mean((y < low) | (y > high))
    found = effects(model, X)
    assert expected > 0.05
    assert abs(found.held - expected) < 0.02
    assert found.notes[-1].startswith(f"In {100 * found.held:.1f} % of the combinations")
    assert_allclose(found.table, effects(free, X).table)
    assert effects(free, X).held == 0.0


def test_an_output_that_never_changes_is_not_held(rng):
    X = rng.uniform(size=(60, 2))
    Y = np.column_stack([np.sin(6 * X[:, 0]) + X[:, 1], np.full(60, 7.1)])
    found = effects(ANFISRegressor(n_mfs=2).fit(X, Y), X, output=1)
    assert (found.held, found.notes) == (0.0, [])
    assert not found.table.to_numpy().any()


def test_inputs_without_terms_do_nothing_together():
    X = rows_of(MODELS["grid, order 1, 1 outputs"], 1.0, 9)
    found = effects(MODELS["grid on two inputs, order 0, 1 outputs"], X).table
    assert list(found.index[3:]) == ["time and rate", "three or more"]


def test_columns_that_do_nothing_take_no_products(rng, monkeypatch):
    X, times = rng.normal(size=(200, 40)), []
    model = quick(n_mfs=[2, *[1] * 39], consequent_features=[0, 1]).fit(X, np.abs(X[:, 0]))
    plain = anova._times
    monkeypatch.setattr(anova, "_times", lambda *pair: times.append(1) or plain(*pair))
    table = effects(model).table
    assert_allclose(table["sobol"].sum(), 1.0)
    # Two per input and two per pair, in place of one for each of 40 columns.
    assert len(times) < 10 * len(table)


def test_what_does_nothing_is_printed_as_one_row(rng):
    X = rng.normal(size=(80, 30))
    X = np.vstack([X, -X])
    model = quick(n_mfs=[2, *[1] * 29], consequent_features=[0, 1, 2])
    found = effects(model.fit(X, X[:, 0] * X[:, 1] + X[:, 2]), X)
    every = found.table["sobol"]
    assert every.size == 30 + 29 + 1
    assert_allclose(every[["x7", "x0 and x7"]], 0.0, atol=1e-20)
    header, *rows = str(replace(found, notes=[])).splitlines()
    assert header.split() == ["sobol", "rows"]
    printed = {name.strip(): values for name, *values in (row.rsplit(maxsplit=2) for row in rows)}
    nothing = {name for name, values in printed.items() if values == ["0.000", "0.000"]}
    # An input stays that does something together with another alone.
    assert nothing == {"x1", "27 inputs and 27 pairs more", "three or more"}
    assert printed.keys() == nothing | {"x0", "x2", "x0 and x1", "x0 and x2"}
    assert_allclose(sum(float(own) for own, _ in printed.values()), 1.0, atol=0.002)


def test_what_was_kept_of_a_tree_is_not_taken_for_its_rule_table(rng):
    X = rng.uniform(-2.0, 2.0, (500, 2))
    y = (np.abs(X[:, 0]) < 0.8) * (1.0 + X[:, 1]) + 0.05 * rng.normal(size=500)
    model = ANFISRegressor(partition="tree", max_rules=3).fit(X, y).model_
    table = model.as_rule_table()
    assert max(map(len, model.antecedent.paths)) == 2
    found = (effects(one).table["sobol"].loc["x0"] for one in (model, table))
    assert_allclose(*found, atol=0.03)


def test_models_that_know_of_no_rows_ask_for_them():
    X, y = np.random.default_rng(4).uniform(size=(40, 2)), np.arange(40.0)
    fitted = quick(n_mfs=2).fit(X, y)
    read = parse_json(export_json(fitted))
    with pytest.raises(ValueError, match="Give rows of its inputs as X"):
        effects(read)
    assert_allclose(effects(read, X).table, effects(fitted, X).table, atol=1e-9)
    given = ANFISRegressor(partition=read, max_iter=0).fit(X, y)
    assert not hasattr(given, "feature_importances_")
    with pytest.raises(ValueError, match="Give rows of its inputs as X"):
        effects(fitted.without_rules([0]))


def test_a_constant_output_has_no_shares():
    X = np.random.default_rng(5).uniform(size=(30, 2))
    model = quick(n_mfs=2).fit(X, np.full(30, 3.0))
    assert_allclose(effects(model, X).table, 0.0)
    assert_allclose(model.feature_importances_, 0.0)


@pytest.mark.parametrize("settings", [{"n_mfs": [3, 2]}, {"n_mfs": 1}, {"partition": "tree"}])
def test_rows_that_are_all_the_same_have_no_shares(settings):
    X = np.random.default_rng(5).uniform(-1.0, 1.0, (60, 2))
    model = quick(**settings).fit(X, 1e5 + np.sin(3.0 * X[:, 0]) * X[:, 1])
    for row in X[:10]:
        found = effects(model, np.tile(row, (7, 1)))
        assert_allclose(found.table, 0.0)
        assert not found.notes


def test_of_draws_what_no_rule_names_has_no_share_at_all(rng):
    X = rng.normal(size=(300, 3))
    y = np.tanh(2.0 * X[:, 0]) + X[:, 1] + 0.1 * rng.standard_normal(300)
    features = {"premise_features": [0], "consequent_features": [0, 1]}
    model = quick(partition=KMeans(3, n_init=1, random_state=0), **features).fit(X, y)
    table = effects(model, X).table
    assert_allclose(table.loc[[name for name in table.index if "x2" in name]], 0.0, atol=1e-12)
    assert table.loc["x1", "sobol"] > 0.2


def test_draws_without_rows_say_that_they_miss_the_ends_of_tails():
    rng = np.random.default_rng(0)
    X = np.column_stack([rng.uniform(0.0, 3.0, 3000), rng.lognormal(sigma=1.5, size=3000)])
    y = 3.0 * np.sin(2.0 * X[:, 0]) + 0.5 * X[:, 1]
    model = quick(partition=KMeans(3, n_init=1, random_state=0)).fit(X, y)
    known, given = effects(model), effects(model, X)
    assert np.abs(known.table["sobol"] - given.table["sobol"]).max() > 0.02
    assert "from 200 quantiles each" in known.notes[-1]
    assert not any("quantiles" in note for note in given.notes)
