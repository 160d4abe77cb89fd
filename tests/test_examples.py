"""The example that `make demo` runs: it draws its picture, and what it claims holds."""

import runpy
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from sklearn import gaussian_process

from skanfis import datasets

plt = pytest.importorskip("matplotlib.pyplot")
SCRIPT = Path(__file__).parents[1] / "examples" / "plot_gyro_compensation.py"
if not SCRIPT.is_file():
    pytest.skip("the examples are not here", allow_module_level=True)

pytestmark = pytest.mark.page


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """Its names after a run with fewer rows, and the folder that it was given."""
    folder = tmp_path_factory.mktemp("demo") / "figures"
    with pytest.MonkeyPatch.context() as patch:
        every = datasets.make_ofog
        patch.setattr(
            datasets,
            "make_ofog",
            lambda **options: every(**(options | {"sampling_interval": 45.0, "n_runs": 9})),
        )
        # Its kernel as it is given: what the process leaves is not asked for below.
        process = partial(gaussian_process.GaussianProcessRegressor, optimizer=None)
        patch.setattr(gaussian_process, "GaussianProcessRegressor", process)
        patch.setattr(sys, "argv", [str(SCRIPT), str(folder)])
        patch.setattr(plt, "show", lambda: None)
        yield runpy.run_path(str(SCRIPT), run_name="__main__"), folder
    plt.close("all")


def test_runs_held_out_are_whole_and_within_the_calibrated_temperatures(ran):
    names, _ = ran
    log, new = names["log"], names["new"]
    assert set(log["run"][new]).isdisjoint(log["run"][~new])
    assert log["temperature"][~new].min() < log["temperature"][new].min()
    assert log["temperature"][~new].max() > log["temperature"][new].max()
    assert names["known"].sum() > 0.9 * new.sum()


def test_the_rules_do_better_than_what_is_simpler(ran):
    names, _ = ran
    rms = names["rms"]
    left = names["error"][names["known"]] - names["anfis"].predict(names["X"][names["known"]])
    assert rms["ANFIS"] == pytest.approx(np.sqrt(np.mean(left**2)))
    assert rms["ANFIS"] < rms["cubic polynomial"] < rms["straight line"] < rms["uncompensated"]


def test_the_picture_is_saved(ran):
    names, folder = ran
    assert [path.name for path in folder.iterdir()] == ["gyro.png"]
    axes = [axes for sub in names["figure"].subfigs for axes in sub.axes]
    assert [a.get_xlabel() for a in axes[:2]] == ["temperature [°C]", "output [°/s]"]
    told = {text.get_text() for text in axes[2].texts}
    assert told == {f"{3600 * value:,.0f} °/h" for value in names["rms"].values()}
