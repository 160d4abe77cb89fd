"""Three problems of Jang 1993; defaults but for ``n_mfs`` and ``mf``.

Mackey-Glass once more with the cost that Jang has, squared error alone: it fits the training rows
closer, and the rows that check it no better.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from skanfis import ANFISRegressor
from skanfis.datasets import make_jang_sinc, make_jang_three_input, make_mackey_glass

from .cases import rms
from .report import Measure, Results, Row
from .timing import best_of

__all__ = ["run"]


def rmse(model, X, y):
    return rms(model.predict(X) - y)


def percentage_error(model, X, y):
    """Jang's average percentage error."""
    return float(100.0 * np.mean(np.abs(model.predict(X) - y) / np.abs(y)))


@dataclass(frozen=True)
class Problem:
    """Data to train on and to check with, and what is asked of both errors."""

    name: str
    reference: str
    mf: str
    n_mfs: int
    train: tuple
    check: tuple
    error: Callable
    names: tuple[str, str]
    unit: str
    bars: tuple
    aims: tuple
    penalty: tuple[tuple[str, Any], ...] = ()  # weights that are not found by the evidence

    def fit(self):
        weights = dict(self.penalty)
        return ANFISRegressor(n_mfs=self.n_mfs, mf=self.mf, **weights).fit(*self.train)

    def row(self):
        seconds, model = best_of(self.fit)
        errors = [self.error(model, *rows) for rows in (self.train, self.check)]
        told = zip(self.names, errors, [self.unit] * 2, self.bars, self.aims, strict=True)
        measures = [Measure(*entry) for entry in told]
        return Row(
            f"{self.name}, {self.mf} ({self.reference})",
            [*measures, Measure("CPU", seconds, "s", 1.0)],
        )


PROBLEMS = [
    Problem(
        name="Jang's sinc, 16 rules",
        reference="Jang's rule: 2.1e-3 after 250 epochs",
        mf="gaussian",
        n_mfs=4,
        train=make_jang_sinc(),
        check=make_jang_sinc(midpoints=True),
        error=rmse,
        names=("grid RMSE", "midpoint RMSE"),
        unit="",
        bars=(2.1e-3, None),
        aims=(None, 0.0145),
    ),
    Problem(
        name="Jang's three-input, 8 rules",
        reference="Jang 1993: 0.043 % / 1.066 %",
        mf="bell",
        n_mfs=2,
        train=make_jang_three_input(),
        check=make_jang_three_input("check"),
        error=percentage_error,
        names=("train APE", "check APE"),
        unit="%",
        bars=(0.043, 1.066),
        aims=(None, 0.25),
    ),
    Problem(
        name="Mackey-Glass, 16 rules",
        reference="Jang 1993: 0.0016 / 0.0015 after 500 epochs",
        mf="bell",
        n_mfs=2,
        train=make_mackey_glass(),
        check=make_mackey_glass("check"),
        error=rmse,
        names=("train RMSE", "check RMSE"),
        unit="",
        bars=(0.0016, 0.0026),
        aims=(0.0011, 0.0022),
    ),
]
SQUARED_ERROR_ALONE = replace(
    PROBLEMS[-1],
    name="Mackey-Glass, 16 rules, squared error alone",
    penalty=(("agreement", 0.0), ("alpha", 0.0)),
)


def run(options):
    return Results([problem.row() for problem in [*PROBLEMS, SQUARED_ERROR_ALONE]])
