"""Standard deviations and intervals in C are those of Python."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.cluster import KMeans
from sklearn.frozen import FrozenEstimator
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.bounds import FixedPoint
from skanfis.export import export_c, fold
from skanfis.intervals import ConformalRegressor
from skanfis.learning import VariableProjection
from skanfis.options import LinearExtrapolation

from .c_compiler import SANITIZE, UNTOUCHED, needs_compiler, run_on_rows

pytestmark = [
    # Models are not trained to the end, and asked out of their range.
    pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning"),
    pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning"),
    pytest.mark.filterwarnings("ignore::skanfis.exceptions.ReadabilityWarning"),
]

# Writes what a function answers on every row.
_CALL = """
    for (i = 0; i < {n_rows}; ++i) {{
        real s[{n_outputs}], spare[{n_outputs}];
        (void)spare;
        for (o = 0; o < {n_outputs}; ++o) {{
            s[o] = (real)-12345.0;
        }}
        {name}_{call};
        fwrite(s, sizeof s, 1, out);
    }}
"""


def surface(n_outputs=1, n_rows=150):
    """Two inputs, one of them far from the origin for its spread."""
    g = np.random.default_rng(0)
    X = g.uniform(-1.0, 1.0, (n_rows, 2)) * [300.0, 2.0] + [1e4, 0.0]
    u, v = (X[:, 0] - 1e4) / 300.0, X[:, 1]
    y = 5.0 + np.sin(3.0 * u) + u * v + 0.05 * g.normal(size=n_rows)
    return X, np.column_stack([y, 1e-3 * (u - v**2) + 1e-4 * g.normal(size=n_rows)])[
        :, :n_outputs
    ].squeeze()


def around(X, n_rows=300, dtype=np.float64):
    low, high = X.min(axis=0), X.max(axis=0)
    unit = np.random.default_rng(1).uniform(-0.4, 1.4, (n_rows, X.shape[1]))
    unit[: n_rows // 2] = np.clip(unit[: n_rows // 2], 0.01, 0.99)
    return (low + (high - low) * unit).astype(dtype)


def answers(codes, X, folder, n_outputs, std="c99", call="deviation(x[i], s)", sanitize=()):
    """What compiled models say, each (n_rows, n_outputs)."""
    words = {"n_rows": len(X), "n_outputs": n_outputs, "call": call}
    calls = [_CALL.format(name=code.name, **words) for code in codes]
    found = np.frombuffer(run_on_rows(codes, X, folder, std, calls, sanitize), X.dtype)
    return found.reshape(len(codes), len(X), n_outputs)


def quick(mf="gaussian", policy="linear", **options):
    # With weights that are given: to find them takes longer than all else.
    given = {"agreement": 0.01, "alpha": 1e-3, "solver": VariableProjection(stiffness=1e-3)}
    shape = {"n_mfs": [3, 2], "mf": mf, "out_of_bounds": policy, "max_iter": 3}
    return ANFISRegressor(**shape | given | options)


FAMILIES = [
    "gaussian", "bell", "triangular", "trapezoidal", "two_sided_gaussian", "pi_shaped",
    "sigmoid_difference", "sigmoid_product", ["s_shaped", "z_shaped"],
]  # fmt: skip
OTHERS = {
    "clusters": lambda: quick(n_mfs="auto", partition=KMeans(4, n_init=1, random_state=0)),
    "order 0": lambda: quick(order=0),
    "held": lambda: quick(policy="clip"),
    "without end": lambda: quick(policy=LinearExtrapolation(np.inf)),
    "plane": lambda: quick(n_mfs=1),
    "premises given": lambda: quick(solver="lse"),
    "a column without slopes": lambda: quick(consequent_features=[1]),
    "a value known": lambda: quick(constraints=[FixedPoint([1e4, 0.5], [5.0, 0.0])]),
    "rising": lambda: quick(solver="lse", monotonic_cst=[0, 1]),
    "behind a scaler": lambda: make_pipeline(StandardScaler(), quick(policy="clip")),
}


@needs_compiler
@pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstraintWarning")
@pytest.mark.parametrize("std", ["c99", "c89"])
def test_deviations_are_those_of_python(std, tmp_path):
    X, y = surface(n_outputs=2)
    kinds = [lambda mf=mf: quick(mf) for mf in FAMILIES] + list(OTHERS.values())
    # C89 differs by its exp and log alone, in single precision.
    fitted = [make().fit(X, y) for make in (kinds if std == "c99" else kinds[::5])]
    sanitize = SANITIZE if std == "c89" else []
    for dtype, tolerance in ((np.float64, 1e-9), (np.float32, 1e-2)):
        models = fitted
        if dtype is np.float32:
            models = [*fitted[1:4], *fitted[5::5]] if std == "c99" else fitted
        if std == "c89" and dtype is np.float64:
            models = models[:1]
        rows = around(X, dtype=dtype)
        codes = [
            export_c(
                model,
                name=f"m{i}",
                dtype="double" if dtype is np.float64 else "float",
                std=std,
                min_coverage=None if i % 2 else 0.1,
                deviation=True,
            )
            for i, model in enumerate(models)
        ]
        found = answers(codes, rows, tmp_path, 2, std, sanitize=sanitize)
        for i, (model, one) in enumerate(zip(models, found, strict=True)):
            wanted = fold(model).standard_deviation(rows.astype(float))
            off = np.abs(one / wanted - 1.0).max()
            assert off < tolerance, (i, dtype, off)


@pytest.mark.theory
@needs_compiler
def test_columns_far_from_the_origin_lose_no_digits(tmp_path):
    """A step inside is a hundredth of a deviation, and of floats out there the spacing is more."""
    g = np.random.default_rng(5)
    X = g.uniform(-1.0, 1.0, (150, 2)) + np.array([1e5, -300.0])
    y = np.sin(3.0 * (X[:, 0] - 1e5)) + X[:, 1] + 300.0 + 0.1 * g.normal(size=150)
    for dtype, tolerance in ((np.float32, 3e-3), (np.float64, 1e-6)):
        # As they are held.
        held = X.astype(dtype)
        clusters = {"n_mfs": "auto", "partition": KMeans(3, n_init=1, random_state=0)}
        kinds = quick(), quick("trapezoidal"), quick(**clusters)
        models = [rules.fit(held, y) for rules in kinds]
        word = "double" if dtype is np.float64 else "float"
        codes = [
            export_c(model, name=f"m{i}", dtype=word, deviation=True)
            for i, model in enumerate(models)
        ]
        rows = around(X, dtype=dtype)
        for model, one in zip(models, answers(codes, rows, tmp_path, 1), strict=True):
            wanted = model.model_.standard_deviation(rows.astype(float))
            np.testing.assert_allclose(one, wanted, rtol=tolerance)


def test_steps_that_do_not_tell_what_goes_on_at_an_edge_are_refused():
    """At the lower end one term of two is as good as false, and the other just begins."""
    X, y = surface()
    model = quick("pi_shaped", n_mfs=[2, 1]).fit(X, y).model_
    group, low, spread = model.antecedent.groups[0], model.minimum[0], model.spread[0]
    theta = group.theta.copy()
    theta[:, 0] = low + 1.2 * spread, *np.log(spread * np.array([1.001, 1.0, 0.4]))
    theta[:, 1] = low + 2.6 * spread, *np.log(spread * np.array([1.2, 1.0, 0.4]))
    antecedent = replace(model.antecedent, groups=(replace(group, theta=theta),))
    model = replace(model, antecedent=antecedent)
    with pytest.raises(ValueError, match=r"0\.0078 standard deviations, and is off by .* of 'x0'"):
        export_c(model, name="m", dtype="float", deviation=True)
    export_c(model, name="m", dtype="double", deviation=True)


@needs_compiler
@pytest.mark.parametrize("policy", ["linear", "nan", "raise"])
def test_interval_is_that_of_the_conformal_regressor(policy, tmp_path):
    X, y = surface(n_outputs=2)
    rules = quick(policy=policy, max_iter=2).fit(X, y)
    sure = ConformalRegressor(FrozenEstimator(rules), method="split", calibration_fraction=1.0)
    sure.fit(X, y + 0.05 * np.random.default_rng(2).standard_t(2, y.shape))
    code = export_c(sure, name="m", coverage=0.9, min_coverage=None)
    X = around(X)
    inside = rules.in_bounds(X)
    answered = inside if policy != "linear" else np.full(len(X), True)
    lower, upper = sure.predict_interval(X[answered], 0.9)
    real = [
        answers([code], X, tmp_path, 2, call=call)[0]
        for call in ("interval(x[i], s, spare)", "interval(x[i], spare, s)")
    ]
    # Intervals have the five digits of the deviations that they are made of.
    np.testing.assert_allclose(real[0][answered], lower, rtol=1e-5)
    np.testing.assert_allclose(real[1][answered], upper, rtol=1e-5, atol=1e-7)
    left = UNTOUCHED if policy == "raise" else np.nan
    np.testing.assert_array_equal(real[0][~answered], left)


def test_deviation_takes_a_posterior_and_an_interval_one_model():
    X, y = surface()
    rules = quick(max_iter=1)
    bare = replace(rules.fit(X, y).model_, posterior=None)
    with pytest.raises(ValueError, match="knows of no posterior"):
        export_c(bare, name="m", deviation=True)
    # A foot that little inside the range lies within three steps of single precision.
    flanks = quick("triangular", max_iter=1).fit(X, y).model_
    group = flanks.antecedent.groups[0]
    theta = group.theta.copy()
    theta[1, 1] = np.log(theta[0, 1] - flanks.minimum[0] - 0.002 * flanks.spread[0])
    near = replace(flanks.antecedent, groups=(replace(group, theta=theta),))
    near = replace(flanks, antecedent=near)
    with pytest.raises(ValueError, match=r"flank lies 0\.002 standard deviations inside .* 'x0'"):
        export_c(near, name="m", dtype="float", deviation=True)
    export_c(near.with_out_of_bounds("nan"), name="m", dtype="float", deviation=True)
    with pytest.raises(ValueError, match="deviation='yes' must be True or False"):
        export_c(rules, name="m", deviation="yes")
    with pytest.raises(ValueError, match="give one of them"):
        export_c(rules, name="m", deviation=True, forgetting=0.9)
    with pytest.raises(ValueError, match="takes a fitted ConformalRegressor; got ANFISRegressor"):
        export_c(rules, name="m", coverage=0.9)
    cross = ConformalRegressor(rules, cv=2, method="cross").fit(X, y)
    with pytest.raises(ValueError, match="method='cross' has no one half width"):
        export_c(cross, name="m", coverage=0.9)
    plain = ConformalRegressor(rules, method="split", scaled=False).fit(X, y)
    with pytest.raises(ValueError, match="one width for all rows"):
        export_c(plain, name="m", coverage=0.9)
    # And that width is what it says.
    lower, upper = plain.predict_interval(X[:1], 0.9)
    assert 0.5 * (upper - lower)[0] == pytest.approx(plain.half_width(0.9))


def test_cost_counts_the_tables():
    X, y = surface()
    model = quick().fit(X, y)
    plain, sure = (export_c(model, name="m", deviation=one).cost for one in (False, True))
    # A triangle of 18, 10 displacements by 10 parameters and by 18 columns, the place of each
    # parameter's term and of 2 inputs; noise, unit and its inverse.
    numbers = 18 * 19 // 2 + 10 * 10 + 10 * 18 + 3
    assert sure.table_bytes - plain.table_bytes == 8 * numbers + 10 + 2
    assert plain.deviation_multiply_adds == 0 < sure.deviation_multiply_adds


@needs_compiler
def test_beside_a_row_far_off_and_of_an_output_that_never_changed(tmp_path):
    """Below all others the deviation grows by terms far narrower than the standard deviation."""
    X, y = surface(n_outputs=2)
    X[0, 0] += 3e7
    y[:, 1] = 4.0
    model = quick(policy="clip").fit(X, y)
    rows = around(X[1:])
    rows[:, 0] = np.minimum(rows[:, 0], X[1:, 0].max())
    code = export_c(model, name="m", deviation=True, min_coverage=None)
    found = answers([code], rows, tmp_path, 2)[0]
    expected = model.predict(rows, return_std=True)[1]
    outside = rows[:, 0] < X[:, 0].min()
    assert outside.sum() > 20
    assert (expected[outside, 0] > 2.0 * model.noise_std_[0]).any()
    np.testing.assert_allclose(found[:, 0], expected[:, 0], rtol=1e-4)
    np.testing.assert_allclose(found[:, 1], 0.0, atol=1e-6)
    with pytest.raises(ValueError, match="no digit of it in the range, which of 'x0'"):
        export_c(model, name="m", deviation=True, dtype="float")


@needs_compiler
def test_in_single_precision_the_self_test_knows_how_far_terms_are_from_a_row_far_off(tmp_path):
    """A logarithm of a membership of thousands takes more digits off than a usual one."""
    rng = np.random.default_rng(100)
    X = rng.uniform(-1.0, 1.0, (150, 2))
    y = np.sin(3.0 * X[:, 0]) + X[:, 0] * X[:, 1] + 0.05 * rng.normal(size=150)
    X[0, 0] = 30.0
    model = ANFISRegressor([3, 2]).fit(X, y)
    rows = around(X[1:], dtype=np.float32)
    code = export_c(model, name="m", deviation=True, min_coverage=None, dtype="float")
    found = answers([code], rows, tmp_path, 1)[0][:, 0]
    np.testing.assert_allclose(found, model.predict(rows, return_std=True)[1], rtol=0.02)
