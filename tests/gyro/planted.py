"""Logs of planted errors, and calibrations of them with folds that are known by hand."""

from itertools import islice

import numpy as np
import pandas as pd
from sklearn.model_selection import GroupKFold

from skanfis.gyro import _simpler
from skanfis.gyro._calibration import Recipe, calibrate
from skanfis.gyro._split import Split

NOISE = 2e-4  # deg/s


def log_of(error, n_runs=8, n_rows=60, seed=0):
    """Runs at temperatures and rates that overlap, with an error of both [deg/s] and noise."""
    rng = np.random.default_rng(seed)
    run = np.repeat(np.arange(n_runs), n_rows)
    temperature = rng.uniform(0.0, 50.0, run.size)
    rate = rng.uniform(-100.0, 100.0, run.size)
    output = rate + error(temperature, rate) + NOISE * rng.normal(size=run.size)
    columns = {"run": run, "temperature": temperature, "rate": rate, "output": output}
    return pd.DataFrame(columns)


def calibrated(log, inputs=("temperature", "output"), n_folds=2, **options):
    """With whole runs held out."""
    labels = log["run"].astype(str).to_numpy(dtype=object)
    folds = list(GroupKFold(n_folds).split(log, groups=log["run"]))
    split = Split("run", folds, labels, "runs held out")
    return calibrate(log, split, Recipe(inputs, **options), lambda text: None)


def with_few_rivals(patch):
    """Of what is simpler than rules the simplest alone; test_calibration.py asks for the others."""
    every = _simpler.kinds
    patch.setattr(_simpler, "kinds", lambda *given: islice(every(*given), 3))


def evaluated(formula, columns):
    """What a reader computes of a printed formula, line after line; what is named, by its name."""
    found = {"arcsin": np.arcsin, **columns}
    for line in formula.replace("\n    ", " ").replace("^", "**").split("\n"):
        name, _, value = line.partition(" = ")
        found[name] = eval(value, {}, found)
    return found
