"""Consequents that go on learning in C learn what partial_fit learns."""

from copy import deepcopy

import numpy as np
import pytest

from skanfis import ANFISRegressor
from skanfis.cluster import FuzzyCMeans
from skanfis.export import export_c, fold
from skanfis.export._numbers import Numbers
from skanfis.export.c._learner import learner_of

from .c_compiler import SANITIZE, STRICT, gcc, needs_compiler, run

N_TRAINED = 400

# Learns all rows, then writes what it answers on the last of them, and the learner.
_DRIVER = """
#include <stdio.h>
#define M_SELF_TEST
#include "m.c"

static {real} row[{width}];
static m_learner q;

int main(void)
{{
    FILE *in = fopen("rows", "rb"), *out = fopen("answers", "wb");
    int i, status;
    {real} y[M_N_OUTPUTS];
    if (!in || !out || m_self_test() != 0) {{
        return 2;
    }}
    m_reset(&q);
    for (i = 0; i < {n_rows}; ++i) {{
        if (fread(row, sizeof row, 1, in) != 1) {{
            return 3;
        }}
        status = m_learn(&q, row, row + M_N_INPUTS);
        fwrite(&status, sizeof status, 1, out);
    }}
    if (fseek(in, {ask}L * (long)sizeof row, SEEK_SET)) {{
        return 4;
    }}
    while (fread(row, sizeof row, 1, in) == 1) {{
        m_predict_learnt(&q, row, y);
        fwrite(y, sizeof y, 1, out);
    }}
    fwrite(q.upper, sizeof q.upper, 1, out);
    fwrite(q.diagonal, sizeof q.diagonal, 1, out);
    fclose(in);
    return fclose(out) == 0 ? 0 : 5;
}}
"""


def rows(n_rows, seed=0):
    """A surface of two outputs that goes on changing."""
    g = np.random.default_rng(seed)
    X = g.uniform(-1.0, 1.0, (n_rows, 2)) * [300.0, 2.0] + [1e4, 0.0]
    u, v = (X[:, 0] - 1e4) / 300.0, X[:, 1]
    y = np.sin(3.0 * u) + u * v + 0.05 * g.normal(size=n_rows)
    return X, np.column_stack([5.0 + y, 1e-3 * (u - v**2)])


def trained(**settings):
    """A model that knows its rows; its range is that of all others."""
    X, y = rows(N_TRAINED, seed=1)
    X[:2] = [[1e4 - 301.0, -2.1], [1e4 + 301.0, 2.1]]
    return ANFISRegressor(**{"n_mfs": [3, 2], "agreement": 0.0, "alpha": 0.0} | settings).fit(X, y)


def learning(premises, **settings):
    X, y = rows(N_TRAINED, seed=1)
    X[:2] = [[1e4 - 301.0, -2.1], [1e4 + 301.0, 2.1]]
    weights = {"agreement": 0.0, "alpha": 0.0} | settings
    return ANFISRegressor(partition=premises, solver="lse", **weights).partial_fit(X, y)


@pytest.fixture(scope="module")
def model():
    return learning(trained())


class Answers:
    """What the compiled learner says after rows X with targets t."""

    def __init__(self, code, X, t, folder, n_ask, flags=("-O2",), std="c99"):
        dtype = np.float32 if "float m_" in code.header or "const float" in code.header else float
        table = np.hstack([X, t]).astype(dtype)
        table.tofile(folder / "rows")
        driver = _DRIVER.format(
            real=np.dtype(dtype).name.replace("float64", "double").replace("float32", "float"),
            width=table.shape[1],
            n_rows=len(X),
            ask=len(X) - n_ask,
        )
        (folder / "m.h").write_text(code.header, encoding="ascii")
        (folder / "m.c").write_text(code.source, encoding="ascii")
        (folder / "driver.c").write_text(driver, encoding="ascii")
        gcc([f"-std={std}", *STRICT, *flags, "driver.c", "-o", "driver", "-lm"], folder)
        done = run(["./driver"], folder)
        assert done.returncode == 0, (done.returncode, done.stderr[:2000])
        data = (folder / "answers").read_bytes()
        self.status = np.frombuffer(data, np.intc, len(X))
        values = np.frombuffer(data, dtype, offset=self.status.nbytes).astype(float)
        self.y, rest = values[: n_ask * t.shape[1]].reshape(n_ask, -1), values[n_ask * t.shape[1] :]
        # n (n - 1) / 2 entries above, n on the diagonal.
        n = round((np.sqrt(8.0 * rest.size + 1.0) - 1.0) / 2.0)
        self.diagonal = rest[-n:]
        upper = np.eye(n)
        upper.T[np.tril_indices(n, -1)] = rest[:-n]
        self.covariance = (upper * self.diagonal) @ upper.T


def difference(found, expected):
    return np.max(np.abs(found - expected) / expected.std(axis=0))


@pytest.mark.theory
@needs_compiler
@pytest.mark.parametrize("forgetting", [1.0, 0.99])
def test_double_learns_what_partial_fit_learns(model, forgetting, tmp_path):
    X, t = rows(300)
    code = export_c(model, name="m", forgetting=forgetting)
    found = Answers(code, X, 1.2 * t, tmp_path, 300)
    expected = deepcopy(model).partial_fit(X, 1.2 * t, forgetting=forgetting)
    # Without a penalty the information has a condition of 2e7; partial_fit loses digits by it too.
    assert difference(found.y, expected.predict(X)) < 1e-8
    assert difference(model.predict(X), expected.predict(X)) > 1e-3


def drifting(n_rows):
    X, t = rows(n_rows)
    X = X.astype(np.float32).astype(float)
    return X, t + np.sin(np.arange(n_rows) / 3e4)[:, None] * t.std(axis=0)


@pytest.mark.theory
@needs_compiler
@pytest.mark.parametrize(("forgetting", "n_rows"), [(1.0, 100_000), (0.999, 20_000)])
def test_float_stays_with_partial_fit_for_a_hundred_thousand_rows(forgetting, n_rows, tmp_path):
    """Triangles: a row touches some of the rules and no other."""
    model = learning(trained(mf="triangular", n_mfs=[4, 3], order=0), order=0)
    X, t = drifting(n_rows)
    code = export_c(model, name="m", dtype="float", forgetting=forgetting)
    found = Answers(code, X, t, tmp_path, 1000)
    expected = deepcopy(model).partial_fit(X, t, forgetting=forgetting)
    assert difference(found.y, expected.predict(X[-1000:])) < 1e-4
    assert (found.diagonal > 0.0).all()


@pytest.mark.theory
@needs_compiler
def test_float_stays_with_double_where_rules_are_lines(tmp_path):
    """With a penalty, as models mostly have."""
    premises = trained(mf="triangular", n_mfs=[4, 2])
    model = learning(premises, agreement=1e-3, alpha=1e-3)
    X, t = drifting(40_000)
    found = [
        Answers(export_c(model, name="m", dtype=dtype, forgetting=1.0), X, t, tmp_path, 1000).y
        for dtype in ("float", "double")
    ]
    assert difference(*found) < 1e-3


@pytest.mark.theory
@needs_compiler
@pytest.mark.parametrize("dtype", ["double", "float"])
def test_covariance_is_bounded_where_nothing_comes(model, dtype, tmp_path):
    """A sensor that stays in one corner for long, and then goes elsewhere."""
    X, t = rows(20_000)
    X[:-100] = [1e4 - 290.0, -1.9] + 0.01 * (X[:-100] - [1e4, 0.0])
    code = export_c(model, name="m", dtype=dtype, forgetting=0.99)
    found = Answers(code, X, t, tmp_path, 100)
    learner = learner_of(model, Numbers.of(fold(model), code_dtype(dtype)), 0.99)
    variances = np.diagonal(found.covariance)
    assert (found.diagonal > 0.0).all()
    assert (variances <= learner.bound * 0.99 ** -float(learner.n) * 1.01).all()
    # Without a bound some would be 0.99^-19900 times as large.
    assert variances.max() > 0.5 * learner.bound.min()
    assert np.abs(found.y - t[-100:]).max() < 3.0 * t.std(axis=0).max()


def code_dtype(dtype):
    return np.float32 if dtype == "float" else np.float64


@pytest.mark.theory
@needs_compiler
@pytest.mark.parametrize(
    ("dtype", "std", "settings"),
    [
        ("double", "c89", {"n_mfs": [3, 2]}),
        ("float", "c99", {"n_mfs": [1, 3], "out_of_bounds": "clip"}),
        ("double", "c99", {"n_mfs": 2, "order": 0, "out_of_bounds": "raise"}),
        ("float", "c89", {"partition": FuzzyCMeans(4, random_state=0), "n_mfs": "auto"}),
    ],
)
def test_every_kind_compiles_and_passes_its_own_test(dtype, std, settings, tmp_path):
    """With weights of the penalty as they come; under the sanitizers."""
    learnt = {"order": settings.get("order", 1), "agreement": "auto", "alpha": "auto"}
    model = learning(trained(agreement=1e-3, alpha=1e-3, **settings), **learnt)
    model.set_params(out_of_bounds=settings.get("out_of_bounds", "linear"))
    code = export_c(model, name="m", dtype=dtype, std=std, forgetting=0.9)
    X, t = rows(50)
    found = Answers(code, X, t, tmp_path, 10, SANITIZE, std)
    assert not found.status.any()


@pytest.mark.theory
@needs_compiler
def test_rows_that_are_not_learnt(model, tmp_path):
    X, t = rows(20)
    X[3] += [1e3, 0.0]
    X[4, 1] = np.nan
    t[5, 1] = np.inf
    code = export_c(model, name="m", min_coverage=None, forgetting=1.0)
    found = Answers(code, X, t, tmp_path, 20, SANITIZE)
    assert np.array_equal(found.status[3:6], [16 + 1, 16 + 2 + 8, 16])
    assert not np.delete(found.status, [3, 4, 5]).any()
    good = np.delete(np.arange(20), [3, 4, 5])
    expected = deepcopy(model).partial_fit(X[good], t[good])
    assert difference(found.y[good], expected.predict(X[good])) < 1e-9


@needs_compiler
def test_own_test_finds_a_wrong_learner(model, tmp_path):
    code = export_c(model, name="m", forgetting=0.9)
    for right, wrong in [("gain[i] * step", "gain[i] * step * 1.001"), ("old * v", "old * f")]:
        assert right in code.source
        (tmp_path / "m.h").write_text(code.header, encoding="ascii")
        (tmp_path / "m.c").write_text(code.source.replace(right, wrong), encoding="ascii")
        flags = ["-DM_SELF_TEST", "-DM_SELF_TEST_MAIN"]
        gcc(["-std=c99", *STRICT, *flags, "m.c", "-o", "m", "-lm"], tmp_path)
        assert run(["./m"], tmp_path).returncode == 1


def test_cost_counts_what_is_there(model):
    plain = export_c(model, name="m", min_coverage=None).cost
    price = export_c(model, name="m", min_coverage=None, forgetting=0.99, dtype="float").cost
    n = 6 * 3
    assert plain.learn_multiply_adds == plain.learner_bytes == 0
    assert price.learner_bytes == 4 * (n * (n - 1) // 2 + n + 2 * n) + 8
    # The bulk is two observations of 3/2 n^2 each.
    assert 3 * n * n < price.learn_multiply_adds < 3 * n * n + 20 * n
    never = export_c(model, name="m", min_coverage=None, forgetting=1.0).cost
    assert never.learn_multiply_adds < 0.65 * price.learn_multiply_adds


@pytest.mark.parametrize("forgetting", [0.0, 1.5, np.nan, "1", True])
def test_forgetting_out_of_range(model, forgetting):
    with pytest.raises(ValueError, match=r"forgetting=.* above 0 and at most 1, or None"):
        export_c(model, name="m", forgetting=forgetting)


def test_a_model_that_does_not_know_cannot_learn():
    with pytest.raises(ValueError, match="trained by partial_fit; ANFISRegressor does not know"):
        export_c(trained(), name="m", forgetting=0.99)
