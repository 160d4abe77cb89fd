"""The example that `make demo` runs: what it claims holds. Its picture is in the pages."""

import runpy
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from sklearn import gaussian_process

from skanfis import datasets

from .quick import with_few_candidates

plt = pytest.importorskip("matplotlib.pyplot")
SCRIPT = Path(__file__).parents[1] / "examples" / "plot_gyro_compensation.py"
if not SCRIPT.is_file():
    pytest.skip("the examples are not here", allow_module_level=True)

pytestmark = pytest.mark.page


def test_the_rules_do_better_on_runs_held_out_than_what_is_simpler(tmp_path, monkeypatch):
    """Of fewer rows and candidates; they are whole runs within the temperatures of the others."""
    every = datasets.make_ofog
    fewer = {"sampling_interval": 45.0, "n_runs": 9}
    monkeypatch.setattr(datasets, "make_ofog", lambda **options: every(**(options | fewer)))
    with_few_candidates(monkeypatch)
    # Its kernel as it is given: what the process leaves is not asked for below.
    process = partial(gaussian_process.GaussianProcessRegressor, optimizer=None)
    monkeypatch.setattr(gaussian_process, "GaussianProcessRegressor", process)
    monkeypatch.setattr(sys, "argv", [str(SCRIPT), str(tmp_path / "figures")])
    monkeypatch.setattr(plt, "show", lambda: None)
    names = runpy.run_path(str(SCRIPT), run_name="__main__")
    assert [path.name for path in (tmp_path / "figures").iterdir()] == ["gyro.png"]
    log, new, known, rms = (names[name] for name in ("log", "new", "known", "rms"))
    assert set(log["run"][new]).isdisjoint(log["run"][~new])
    assert log["temperature"][~new].min() < log["temperature"][new].min()
    assert log["temperature"][~new].max() > log["temperature"][new].max()
    assert known.sum() > 0.9 * new.sum()
    left = names["error"][known] - names["anfis"].predict(names["X"][known])
    assert rms["ANFIS"] == pytest.approx(np.sqrt(np.mean(left**2)))
    taught = rms["ANFIS, taught by the process"]
    assert taught == pytest.approx(rms["Gaussian process"], rel=0.01)
    assert rms["ANFIS"] < rms["cubic polynomial"] < rms["straight line"] < rms["uncompensated"]
