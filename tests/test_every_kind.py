"""Every public operation on a model of every kind: grid, tree and scattered rules."""

import pickle
import warnings

import joblib
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.antecedent import (
    GridAntecedent,
    RuleTableAntecedent,
    ScatteredAntecedent,
    TreeAntecedent,
)
from skanfis.bounds import FixedPoint, OutputLimits, bounds, gradient_bounds, monotonicity
from skanfis.exceptions import ForgottenRowsWarning
from skanfis.export import (
    export_c,
    export_fis,
    export_json,
    fold,
    read_fis,
    read_json,
)
from skanfis.export.json_reader import parse_json
from skanfis.inspection import (
    MembershipDisplay,
    ResponseSurfaceDisplay,
    StructureDisplay,
    TreeDisplay,
    explain,
    export_text,
    readability,
    rules_html,
    rules_table,
)
from skanfis.intervals import ConformalRegressor
from skanfis.learning import VariableProjection
from skanfis.options import LinearExtrapolation

from .export.c_compiler import evaluate_all, needs_compiler
from .oracles import central_difference

KINDS = {"grid": GridAntecedent, "tree": TreeAntecedent, "scattered": ScatteredAntecedent}
pytestmark = [pytest.mark.parametrize("kind", KINDS)]
# Weights that are given are not sought: a fit takes a tenth of the time.
GIVEN = {"agreement": 0.01, "alpha": 1e-4, "solver": VariableProjection(stiffness=1e-3)}


def data():
    """A step, a slope, and a column of two values."""
    g = np.random.default_rng(0)
    X = g.uniform(-1.0, 1.0, (300, 3)) * [1.0, 10.0, 1.0] + [0.0, 5.0, 0.0]
    X[:, 2] = g.integers(0, 2, 300)
    y = np.where(X[:, 0] > 0.2, 0.3 * X[:, 1], 1.0 - 0.1 * X[:, 1]) + X[:, 2] * (X[:, 1] > 5.0)
    return X, y + 0.05 * g.normal(size=300)


X, Y = data()
WEIGHT = np.random.default_rng(1).integers(0, 3, 300)
_FITTED: dict = {}


def searched(kind, **settings):
    given = GIVEN | {"partition": kind, "max_rules": 5, "simplicity": 0.0} | settings
    return ANFISRegressor(**given)


def fitted(kind):
    """One fit of each kind for all that only read it."""
    if kind not in _FITTED:
        _FITTED[kind] = searched(kind).fit(X, Y)
        assert _FITTED[kind].n_rules_ > 2
    return _FITTED[kind]


def onward(kind, **settings):
    """What goes on from its rules."""
    return ANFISRegressor(**GIVEN | {"partition": fitted(kind).model_} | settings)


def assert_is(estimator, kind):
    """Of this kind, and of some use."""
    assert type(estimator.model_.antecedent) is KINDS[kind]
    assert estimator.score(X, Y if estimator.model_.n_outputs == 1 else two()) > 0.8
    assert_array_equal(estimator.strengths(X).shape, (300, estimator.n_rules_))
    assert_allclose(estimator.strengths(X).sum(axis=1), 1.0, rtol=1e-12)
    if kind == "tree":
        above, below = estimator.model_.antecedent.groups
        assert_array_equal(above.theta, below.theta)


def two():
    return np.column_stack([Y, Y**2])


class TestAnswers:
    def test_is_what_was_asked_for(self, kind):
        assert_is(fitted(kind), kind)
        assert {one["kind"] for one in fitted(kind).structures_} <= {kind, "one rule"}

    def test_gradient_is_that_of_the_prediction(self, kind):
        model = fitted(kind).model_
        row = np.array([0.11, 3.2, 1.0])
        slope = central_difference(lambda x: model.predict(x[None])[0], row, 1e-3)
        found = model.gradient(row[None])[0]
        # The last input stands on the edge of the box.
        assert_allclose(found[:2], slope[0, :2, None], rtol=1e-5, atol=1e-7)

    def test_deviations_and_coverage(self, kind):
        estimator = fitted(kind)
        y, deviation = estimator.predict(X, return_std=True)
        assert_array_equal(y, estimator.predict(X))
        within = np.abs(y - Y) < 2.0 * deviation
        assert 0.85 < within.mean() <= 1.0
        covered = estimator.coverage(np.array([[0.0, 5.0, 1.0], [40.0, 5.0, 1.0]]))
        assert covered[0] > 0.9
        assert covered[1] < 1e-9

    def test_out_of_bounds(self, kind):
        model, row = fitted(kind).model_, np.array([[3.0, 5.0, 1.0]])
        clipped, edge = model.with_out_of_bounds("clip"), np.minimum(row, X.max(axis=0))
        assert_array_equal(clipped.predict(row), clipped.predict(edge))
        assert np.isnan(model.with_out_of_bounds("nan").predict(row)).all()
        with pytest.raises(ValueError, match="x0"):
            model.with_out_of_bounds("raise").predict(row)

    def test_explained(self, kind):
        table = explain(fitted(kind), X)
        assert_allclose(table.groupby("row")["contribution"].sum(), fitted(kind).predict(X))

    def test_intervals(self, kind):
        intervals = ConformalRegressor(onward(kind)).fit(X, Y)
        low, high = np.asarray(intervals.predict_interval(X)).reshape(2, -1)
        assert 0.85 < np.mean((low <= Y) & (high >= Y)) <= 1.0


class TestFits:
    def test_families_are_of_grids_and_scattered_rules(self, kind):
        if kind == "tree":
            for mf in ("bell", ["gaussian", "bell", "gaussian"]):
                with pytest.raises(ValueError, match=r"mf=.* means nothing to partition='tree'"):
                    searched(kind, mf=mf).fit(X, Y)
        else:
            assert_is(searched(kind, mf="bell").fit(X, Y), kind)

    @pytest.mark.parametrize("order", [0, 1])
    def test_orders_and_several_outputs(self, kind, order):
        estimator = searched(kind, order=order, max_rules=6).fit(X, two())
        assert_is(estimator, kind)
        assert estimator.predict(X).shape == (300, 2)
        assert estimator.model_.order == order

    def test_weight_of_two_is_the_row_twice(self, kind):
        kept = WEIGHT > 0
        weighted = searched(kind).fit(X[kept], Y[kept], sample_weight=WEIGHT[kept])
        repeated = searched(kind).fit(np.repeat(X, WEIGHT, axis=0), np.repeat(Y, WEIGHT))
        assert_allclose(weighted.predict(X[kept]), repeated.predict(X[kept]), atol=1e-4)

    def test_features_of_both_parts(self, kind):
        settings = {"premise_features": ["x0", "x2"], "consequent_features": [1]}
        estimator = searched(kind, **settings).fit(X, Y)
        assert_is(estimator, kind)
        assert set(estimator.model_.antecedent.term_inputs) <= {0, 2}
        slopes = estimator.model_.coefficients[:, 1:]
        assert_array_equal(np.flatnonzero(slopes.any(axis=(0, 2))), [1])

    @pytest.mark.parametrize("solver", ["varpro", "lse"])
    def test_solvers(self, kind, solver):
        estimator = onward(kind, solver=solver, max_iter=15).fit(X, Y)
        assert_is(estimator, kind)
        moved = estimator.model_.antecedent.parameters != fitted(kind).model_.antecedent.parameters
        assert moved.any() or solver == "lse"

    def test_rules_as_they_are(self, kind):
        estimator = onward(kind, max_iter=0).fit(X, Y)
        assert_array_equal(estimator.predict(X), fitted(kind).predict(X))

    def test_early_stopping_groups_and_losses(self, kind):
        assert_is(searched(kind, early_stopping=True, loss="huber").fit(X, Y), kind)
        assert_is(searched(kind).fit(X, Y, groups=np.arange(300) // 30), kind)

    def test_grid_search(self, kind):
        X_wide = X[np.r_[X.argmin(axis=0), X.argmax(axis=0), :300]]
        y = fitted(kind).predict(X_wide)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = GridSearchCV(onward(kind), {"order": [0, 1]}, cv=2).fit(X_wide, y)
        assert found.best_params_ == {"order": 1}

    def test_parts_add_up(self, kind):
        whole = onward(kind, solver="lse").partial_fit(X, Y)
        first, second = (pickle.loads(pickle.dumps(whole)) for _ in range(2))
        first.partial_fit(X[:100], Y[:100])
        second.partial_fit(X[:100], Y[:100])
        assert_allclose(first.predict(X), second.predict(X))
        merged = first.merge(second)
        assert_is(merged, kind)
        again = first.partial_fit(X, Y).partial_fit(X[:100], Y[:100])
        assert_allclose(merged.predict(X), again.predict(X), rtol=1e-6, atol=1e-8)
        with pytest.warns(ForgottenRowsWarning):
            assert_is(pickle.loads(pickle.dumps(fitted(kind))).partial_fit(X, Y), kind)

    def test_on_a_cluster(self, kind):
        pytest.importorskip("dask")
        import dask
        import dask.array as da

        from skanfis.dask import DaskANFISRegressor

        single = onward(kind).fit(X, Y)
        with dask.config.set(scheduler="synchronous"):
            spread = DaskANFISRegressor(**single.get_params(deep=False)).fit(
                da.from_array(X, chunks=(70, 3)), da.from_array(Y, chunks=70)
            )
        assert_is(spread, kind)
        assert_allclose(spread.model_.predict(X), single.model_.predict(X), atol=1e-8)

    def test_scaler_is_folded_in(self, kind):
        pipeline = make_pipeline(StandardScaler(), searched(kind)).fit(X, Y)
        model = fold(pipeline)
        assert type(model.antecedent) is KINDS[kind]
        assert_allclose(model.predict(X)[:, 0], pipeline.predict(X), rtol=1e-9, atol=1e-10)
        deviation = pipeline.predict(X, return_std=True)[1]
        assert_allclose(model.standard_deviation(X)[:, 0], deviation, rtol=1e-6)


class TestProofs:
    def test_bounds_hold_and_are_met(self, kind):
        found = bounds(fitted(kind))
        rows = np.random.default_rng(0).uniform(X.min(axis=0), X.max(axis=0), (20_000, 3))
        y = fitted(kind).model_.predict(rows)[:, 0]
        assert found.converged
        assert found.lower[0] <= y.min()
        assert y.max() <= found.upper[0]
        taken = np.ptp(np.concatenate([y, found.lowest, found.highest]))
        assert found.upper[0] - found.lower[0] < 1.03 * taken
        slopes = gradient_bounds(fitted(kind), "x1")
        steep = fitted(kind).model_.gradient(rows)[:, 1, 0]
        assert slopes.lower[0] <= steep.min()
        assert steep.max() <= slopes.upper[0]

    @pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstraintWarning")
    def test_constraints_are_kept(self, kind):
        settings = {"monotonic_cst": {"x1": 1}, "constraints": [FixedPoint([0.5, 5.0, 1.0], 0.7)]}
        estimator = onward(kind, **settings).fit(X, np.maximum(X[:, 0], 0.0) + 0.04 * X[:, 1])
        assert type(estimator.model_.antecedent) is KINDS[kind]
        assert_array_equal(monotonicity(estimator, "x1"), [1])
        assert_allclose(estimator.predict([[0.5, 5.0, 1.0]]), 0.7)
        top = float(fitted(kind).predict(X).max()) - 0.1
        limited = onward(kind, constraints=[OutputLimits(upper=top)]).fit(X, np.minimum(Y, top))
        assert bounds(limited).upper[0] <= top + 1e-9


class TestReading:
    def test_texts_tables_and_pictures(self, kind):
        estimator = fitted(kind)
        text = export_text(estimator)
        assert text.count("\n  IF ") == estimator.n_rules_
        assert rules_html(estimator).count("</tr>") == estimator.n_rules_ + 2
        assert len(rules_table(estimator)) == estimator.n_rules_
        found = readability(estimator, X, Y)
        assert_allclose(found.rules["weight"].sum(), 1.0)
        pytest.importorskip("matplotlib")
        for display in (MembershipDisplay, ResponseSurfaceDisplay, StructureDisplay):
            display.from_estimator(estimator)
        if kind == "tree":
            TreeDisplay.from_estimator(estimator)
        else:
            with pytest.raises(ValueError, match="are no tree"):
                TreeDisplay.from_estimator(estimator)

    def test_terms_get_other_names(self, kind):
        estimator = pickle.loads(pickle.dumps(fitted(kind)))
        inputs = estimator.model_.antecedent.term_inputs
        names = [f"sort {k}" for k in range(np.count_nonzero(inputs == inputs[0]))]
        estimator.rename_terms({f"x{inputs[0]}": names})
        assert f"x{inputs[0]} is sort 0" in export_text(estimator)

    def test_without_a_rule(self, kind):
        left = fitted(kind).without_rules([1])
        assert isinstance(left.antecedent, RuleTableAntecedent)
        before = np.delete(fitted(kind).strengths(X), 1, axis=1)
        expected = before / before.sum(axis=1, keepdims=True)
        assert_allclose(left.strengths(X), expected, rtol=1e-6, atol=1e-12)
        again = ANFISRegressor(**GIVEN | {"partition": left}).fit(X, Y)
        assert again.score(X, Y) > 0.7
        for model in (left, again.model_):
            assert_file_is(model)


def assert_file_is(model):
    """JSON gives the same back."""
    read = parse_json(export_json(model))
    assert type(read.antecedent) is type(model.antecedent)
    assert_array_equal(read.predict(X), model.predict(X))


class TestFiles:
    def test_json_and_pickles(self, kind, tmp_path):
        estimator = fitted(kind)
        export_json(estimator, tmp_path / "model.json", posterior=True)
        read = read_json(tmp_path / "model.json")
        assert type(read.antecedent) is KINDS[kind]
        assert_array_equal(read.predict(X), estimator.model_.predict(X))
        assert_array_equal(read.standard_deviation(X), estimator.model_.standard_deviation(X))
        joblib.dump(estimator, tmp_path / "model.joblib")
        assert_array_equal(joblib.load(tmp_path / "model.joblib").predict(X), estimator.predict(X))

    def test_fis(self, kind, tmp_path):
        export_fis(fitted(kind), tmp_path / "model.fis")
        read = read_fis(tmp_path / "model.fis")
        came_back = RuleTableAntecedent if kind == "tree" else KINDS[kind]
        assert type(read.antecedent) is came_back
        assert_allclose(read.predict(X), fitted(kind).model_.predict(X), atol=1e-9)
        rules = export_fis(fitted(kind)).partition("[Rules]")[2].split("\n")
        assert len([line for line in rules if line]) == fitted(kind).n_rules_

    @needs_compiler
    def test_c(self, kind, tmp_path):
        code = export_c(fitted(kind), name="model")
        Z = np.vstack([X, 1.5 * X])
        ((y, status),) = evaluate_all([code], Z, tmp_path, "c99", [1], [])
        assert_allclose(y, fitted(kind).model_.predict(Z), atol=1e-9)
        assert_array_equal(status & 1, ~fitted(kind).in_bounds(Z))

    def test_onnx(self, kind):
        skl2onnx = pytest.importorskip("skl2onnx")
        onnxruntime = pytest.importorskip("onnxruntime")
        from skanfis.export import register_onnx_converter

        register_onnx_converter()
        far = LinearExtrapolation(2.0)
        for dtype, atol in ((np.float64, 1e-9), (np.float32, 1e-3)):
            estimator = pickle.loads(pickle.dumps(fitted(kind))).set_params(out_of_bounds=far)
            Z = np.vstack([X, 1e3 * X]).astype(dtype)
            graph = skl2onnx.to_onnx(estimator, Z[:1]).SerializeToString()
            session = onnxruntime.InferenceSession(graph, providers=["CPUExecutionProvider"])
            (y,) = session.run(None, {"X": Z})
            model = estimator.model_.with_out_of_bounds("linear", 2.0)
            assert_allclose(y, model.predict(Z.astype(float)), atol=atol)
