"""A model in a file comes back the same: joblib, and skops for files from strangers."""

import sys
from functools import partial
from importlib import import_module
from io import BytesIO

import joblib
import numpy as np
import pytest
from numpy.testing import assert_array_equal
from sklearn.base import clone
from sklearn.cluster import KMeans
from sklearn.compose import ColumnTransformer
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.bounds import FixedPoint, OutputLimits
from skanfis.cluster import FuzzyCMeans, SubtractiveClustering
from skanfis.export import TRUSTED_TYPES, register_onnx_converter
from skanfis.export.fis.reader import parse_fis
from skanfis.gyro import OpenLoopArcsineRegressor, ResidualRegressor, ThermalRate
from skanfis.intervals import ConformalRegressor
from skanfis.learning import SOLVERS, Hybrid
from skanfis.membership import FAMILIES, MEMBERSHIPS
from skanfis.options import EarlyStopping, Huber, LinearExtrapolation

from ..quick import quick, with_few_candidates
from .fis_files import BY_HAND

OPTIONS = {"loss": Huber(), "early_stopping": EarlyStopping()}
ESTIMATORS = {
    "auto": ANFISRegressor(max_rules=2),
    "own subtractive": quick(partition=SubtractiveClustering(radius=0.6)),
    "own fcm": quick(partition=FuzzyCMeans(3)),
    "clusterer": quick(partition=KMeans(3, random_state=0)),
    "model": quick(partition=parse_fis(BY_HAND)),
    "pipeline": make_pipeline(StandardScaler(), quick()),
    "words as objects": quick(solver=Hybrid(), out_of_bounds=LinearExtrapolation(), **OPTIONS),
    **{name: quick(solver=solver()) for name, solver in SOLVERS.items()},
    "constrained": quick(constraints=[OutputLimits(-50, 50), FixedPoint([5.0, 0.5], [-0.4, 2.5])]),
    **{mf: quick(mf=mf) for mf in MEMBERSHIPS},
}
X = np.random.default_rng(0).uniform(0.0, [10.0, 1.0], (60, 2))
Y = np.column_stack([np.sin(X[:, 0]) + X[:, 1], X[:, 0] * X[:, 1]])

pytestmark = pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning")


def fitted(estimator):
    short = {name: 5 for name in estimator.get_params() if name.endswith("regressor__max_iter")}
    with pytest.MonkeyPatch.context() as patch:
        with_few_candidates(patch)
        return clone(estimator).set_params(**(short or {"max_iter": 5})).fit(X, Y), X


def compensator():
    """Of a gyro: what its log does not say, a law, and rules for what the law leaves."""
    time, output = np.arange(60.0), np.random.default_rng(1).uniform(-1, 1, 60)
    log = np.column_stack([time, 20.0 + time / 60.0, output])
    columns = [("rate", ThermalRate(30.0, time=0), [0, 1]), ("log", "passthrough", [0, 1, 2])]
    law = OpenLoopArcsineRegressor(output=-1, temperature=1)
    pipeline = make_pipeline(ColumnTransformer(columns), ResidualRegressor(law, quick(n_mfs=1)))
    return pipeline.fit(log, output + 0.1 * output**3), log


# What makes an estimator, and rows for it.
MADE = {name: partial(fitted, estimator) for name, estimator in ESTIMATORS.items()}
MADE |= {
    "learning": lambda: (quick().partial_fit(X, Y), X),
    "intervals": lambda: (ConformalRegressor(quick(), cv=2).fit(X, Y[:, 0]), X),
    "compensator": compensator,
}


@pytest.mark.parametrize("name", MADE)
def test_joblib_and_skops_give_the_same_predictions(name):
    (estimator, rows), file = MADE[name](), BytesIO()
    joblib.dump(estimator, file)
    assert_array_equal(joblib.load(file).predict(rows), estimator.predict(rows))
    io = pytest.importorskip("skops.io", reason="skops IS NOT INSTALLED: its files are not checked")
    data = io.dumps(estimator)
    assert set(io.get_untrusted_types(data=data)) <= set(TRUSTED_TYPES)
    assert_array_equal(io.loads(data, trusted=TRUSTED_TYPES).predict(rows), estimator.predict(rows))


def test_trusted_types_are_all_there_and_no_more():
    for name in TRUSTED_TYPES:
        module, _, name = name.rpartition(".")
        assert isinstance(getattr(import_module(module), name), type)
    families = {f"{family.__module__}.{family.__name__}" for family in FAMILIES.values()}
    assert families == {name for name in TRUSTED_TYPES if ".membership." in name}


def test_missing_onnx_packages_are_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "skl2onnx", None)
    with pytest.raises(ImportError, match=r"pip install skl2onnx onnxruntime .*'\.\[onnx\]'"):
        register_onnx_converter()
