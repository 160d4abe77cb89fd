"""What a user writes: ``mypy`` checks it strictly, with the package (see pyproject.toml).

It is read, not run. The calls are those of the README, the examples and the pages of the guide.
"""

from pathlib import Path

import numpy as np
import pandas as pd
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.bounds import Bounds, FixedPoint, OutputLimits, bounds, gradient_bounds, monotonicity
from skanfis.dask import DaskANFISRegressor
from skanfis.datasets import make_jang_sinc, make_ofog
from skanfis.export import CCode, export_c, export_json, fold, fold_with_rows, read_json
from skanfis.gyro import (
    AllanDisplay,
    ErrorDisplay,
    GyroCompensator,
    OpenLoopArcsineRegressor,
    ResidualRegressor,
    ThermalRate,
    export_c_physics,
    group_by_rate_level,
    gyro_report,
    read_log,
)
from skanfis.inspection import (
    MembershipDisplay,
    Readability,
    ResponseSurfaceDisplay,
    explain,
    export_text,
    readability,
    rules_table,
)
from skanfis.intervals import ConformalRegressor
from skanfis.learning import Hybrid
from skanfis.options import EarlyStopping, Huber, LinearExtrapolation

X, y = make_jang_sinc()
model = ANFISRegressor(n_mfs=3).fit(X, y)
ANFISRegressor([2, 3], mf=["bell", "gaussian"], loss=Huber(1.1), premise_features=["a"])
ANFISRegressor(
    np.array([2, 3]),
    solver=Hybrid(step_size=0.1),
    early_stopping=EarlyStopping(0.2),
    out_of_bounds=LinearExtrapolation(1.0),
    partition=model,
    random_state=np.random.RandomState(0),
)
answers: np.ndarray = model.predict([[1.0, 2.0]])
text: str = export_text(model.rename_terms({"x0": ["low", "medium", "high"]}))
memberships: MembershipDisplay = MembershipDisplay.from_estimator(model)
n_findings: int = len(readability(model, X).findings)
# Were the type lost on the way, there would be nothing to ignore, which is an error too.
wrong: str = model.predict(X)  # type: ignore[assignment]

# Behind a pipeline or a search, the model itself.
search = GridSearchCV(make_pipeline(StandardScaler(), ANFISRegressor()), {}).fit(X, y)
folded = fold(search)
outputs: np.ndarray = folded.predict(X)
n_rules: int = fold_with_rows(search, X)[0].n_rules
tables: pd.DataFrame = rules_table(model)
told: pd.DataFrame = explain(model, X[:1])
code: CCode = export_c(model, name="sinc", dtype="float", std="c89", saturate=bounds(model))
wrong_code: str = code.cost.exponentials  # type: ignore[assignment]

# What is known, and how sure.
proven: Bounds = bounds(model, {"x0": (0.0, 1.0)}, tol=1e-3)
slopes: Bounds = gradient_bounds(model, "x0")
signs: np.ndarray = monotonicity(model, "x0")
ANFISRegressor(constraints=[OutputLimits(0.0, 1.0), FixedPoint([0.0, 0.0], 1.0)])
lower, upper = ConformalRegressor(model, method="split", n_jobs=1).fit(X, y).predict_interval(X)
width: np.ndarray = upper - lower
wrong_bounds: float = proven.tightness  # type: ignore[assignment]

# Rows that keep coming, or that lie on a cluster.
stream = ANFISRegressor(n_mfs=3).partial_fit(X[:60], y[:60]).partial_fit(X[60:], y[60:])
whole = stream.merge(ANFISRegressor(partition=stream, solver="lse").partial_fit(X, y))
score: float = DaskANFISRegressor(n_mfs=3).fit(X, y).score(X, y)

# A gyro.
log = make_ofog(n_devices=1, n_runs=4, random_state=0)
groups: np.ndarray = group_by_rate_level(log["rate"])
rates: np.ndarray = ThermalRate(60.0, time="time", run="run").fit_transform(log)
law = OpenLoopArcsineRegressor("output", "temperature", bias_degree=2)
composed = ResidualRegressor(law, ANFISRegressor(n_mfs=2)).fit(log, log["rate"])
physics: CCode = export_c_physics(composed, name="gyro")
compensator = GyroCompensator(composed, ("output", "temperature"), predicts="rate")
compensator.write_json("compensator.json")
applied: pd.DataFrame = GyroCompensator.read_json("compensator.json").apply(read_log("a.csv"))
report: pd.DataFrame = gyro_report(log["rate"], log["output"], composed.predict(log))
dwells: np.ndarray = log["rate"].to_numpy()
picture: ErrorDisplay = ErrorDisplay.from_predictions(dwells, dwells, dwells, position=dwells)
AllanDisplay.from_predictions(dwells, dwells, dwells, time=dwells).plot().tables()
wrong_rate: str = law.fit(log, log["rate"]).predict(log)  # type: ignore[assignment]

# What the parameters take: arrays, lists, frames and files; and what they do not.
frame = pd.DataFrame(X, columns=["x0", "x1"])
weights: list[float] = [1.0] * len(frame)
model.fit(frame, y, sample_weight=weights, groups=frame["x0"])
r2: float = model.score(frame, y)
inside: np.ndarray = model.in_bounds([[0.0, 0.0]])
covered: np.ndarray = model.coverage(frame)
mean, deviation = model.predict(frame, return_std=True)
either: np.ndarray | tuple[np.ndarray, np.ndarray] = model.predict(frame, return_std=bool(r2 > 0))
told_short: str = export_text(model, precision=3, max_shown=4, feature_names=["rate", "time"])
export_json(model, Path("model.json"))
restored: np.ndarray = read_json("model.json").predict(X)
found: Readability = readability(model, frame, y, sample_weight=weights)
ResponseSurfaceDisplay.from_estimator(model, frame, features=("x0", "x1"), held={"x1": 0.0})
sure = ConformalRegressor(model, cv=3).fit(frame, y, groups=[0, 1] * 60)
lower, upper = sure.predict_interval(frame, coverage=0.95)
model.partial_fit(frame, y, forgetting=0.99)
export_text(model, precision="many")  # type: ignore[arg-type]
export_c(model, min_coverage="most")  # type: ignore[arg-type]
model.coverage(None)  # type: ignore[arg-type]
