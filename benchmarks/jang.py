"""Three problems of Jang 1993; defaults but for ``n_mfs`` and ``mf``.

Mackey-Glass is also fitted with Jang's cost, squared error alone.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_sinc, make_jang_three_input, make_mackey_glass

from .report import Measure, Results, Row
from .scores import rms_error
from .timing import best_of

__all__ = ["run"]


def percentage_error(model, X, y):
    """Jang's average percentage error."""
    return float(100.0 * np.mean(np.abs(model.predict(X) - y) / np.abs(y)))


@dataclass(frozen=True)
class Problem:
    """Data to train on and to check with, and what is asked of both errors."""

    name: str
    reference: str
    params: dict
    train: tuple
    check: tuple
    error: Callable
    # What it is called on either data, its unit, the bar and the aim.
    on_train: tuple
    on_check: tuple

    def row(self):
        model, seconds = best_of(3, ANFISRegressor(**self.params).fit, *self.train)
        measures = [
            Measure(name, self.error(model, *rows), *asked)
            for rows, (name, *asked) in ((self.train, self.on_train), (self.check, self.on_check))
        ]
        return Row(
            f"{self.name}, {self.params['mf']} ({self.reference})",
            [*measures, Measure("CPU", seconds, "s", 1.0)],
        )


PROBLEMS = [
    Problem(
        name="Jang's sinc, 16 rules",
        reference="Jang's rule: 2.1e-3 after 250 epochs",
        params={"n_mfs": 4, "mf": "gaussian"},
        train=make_jang_sinc(),
        check=make_jang_sinc(midpoints=True),
        error=rms_error,
        on_train=("grid RMSE", "", 2.1e-3, None),
        on_check=("midpoint RMSE", "", None, 0.0145),
    ),
    Problem(
        name="Jang's three-input, 8 rules",
        reference="Jang 1993: 0.043 % / 1.066 %",
        params={"n_mfs": 2, "mf": "bell"},
        train=make_jang_three_input(),
        check=make_jang_three_input("check"),
        error=percentage_error,
        on_train=("train APE", "%", 0.043, None),
        on_check=("check APE", "%", 1.066, 0.25),
    ),
    Problem(
        name="Mackey-Glass, 16 rules",
        reference="Jang 1993: 0.0016 / 0.0015 after 500 epochs",
        params={"n_mfs": 2, "mf": "bell"},
        train=make_mackey_glass(),
        check=make_mackey_glass("check"),
        error=rms_error,
        on_train=("train RMSE", "", 0.0016, 0.0011),
        on_check=("check RMSE", "", 0.0026, 0.0022),
    ),
]
SQUARED_ERROR_ALONE = replace(
    PROBLEMS[-1],
    name="Mackey-Glass, 16 rules, squared error alone",
    params=PROBLEMS[-1].params | {"agreement": 0.0, "alpha": 0.0},
)


def run(options):
    return Results([problem.row() for problem in [*PROBLEMS, SQUARED_ERROR_ALONE]])
