"""What a user writes: ``mypy`` checks it strictly, with the package (see pyproject.toml)."""

import numpy as np

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_sinc
from skanfis.export import export_text
from skanfis.inspection import LossCurveDisplay
from skanfis.options import EarlyStopping, Huber, LinearExtrapolation
from skanfis.solvers import Hybrid

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
display: LossCurveDisplay = LossCurveDisplay(loss=model.loss_curve_)
# Were the type lost on the way, there would be nothing to ignore, which is an error too.
wrong: str = model.predict(X)  # type: ignore[assignment]
