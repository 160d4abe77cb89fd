"""The command on logs as they come: at rest, several axes, many files."""

from itertools import pairwise

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("matplotlib")

from skanfis import __version__
from skanfis.datasets import make_ofog
from skanfis.gyro import GyroCompensator
from skanfis.gyro.command import main

from .test_command import no_report  # noqa: F401

pytestmark = pytest.mark.usefixtures("given_weights")


def thermal_cycle(*turns, n_rows=300, lag=0.05):
    """A MEMS log: a bias that is a parabola of the temperature, and lags behind by its rate."""
    temperature = np.concatenate(
        [np.linspace(a, b, n_rows, endpoint=False) for a, b in pairwise(turns)]
    )
    time = 10.0 * np.arange(temperature.size)
    bias = 0.2 + 0.01 * temperature + 1e-4 * temperature**2
    bias += lag * np.sign(np.gradient(temperature))
    noise = np.random.default_rng(0).normal(scale=1e-3, size=(2, time.size))
    table = {"Timestamp [ms]": 1000.0 * time, "Temp": temperature}
    return pd.DataFrame(table | {"gyro_x_dps": bias + noise[0], "gyro_y_dps": noise[1] - bias})


@pytest.mark.usefixtures("no_report")
def test_a_thermal_cycle_of_two_axes_at_rest(tmp_path, capsys):
    thermal_cycle(20, -20, 60, -20, 60, 20).to_csv(tmp_path / "mems.csv", index=False)
    out = tmp_path / "out"
    assert main([str(tmp_path / "mems.csv"), "--terms", "3,1", "--output", str(out)]) == 0
    said = capsys.readouterr().out
    assert sorted(path.name for path in out.iterdir()) == ["x", "y"]
    assert said.count("whole legs between turning points of the temperature held out (5 legs") == 2
    assert said.count("taken as at rest (--at-rest)") == 2
    assert said.count("time = 'Timestamp [ms]' in ms; temperature = 'Temp'") == 2
    for axis, sign in (("x", 1.0), ("y", -1.0)):
        compensator = GyroCompensator.read_json(out / axis / "compensator.json")
        assert compensator.inputs == ("temperature", "temperature_rate")
        log = pd.DataFrame({"time": [0.0, 1e4], "temperature": 10.0, "output": sign * 0.31})
        # Neither warming nor cooling: between the two.
        assert compensator.apply(log)["rate_compensated"].abs().max() < 0.02
    lines = [line.split() for line in said.splitlines() if line.startswith("hysteresis")]
    for line in lines:
        # Twice the lag of 0.05 deg/s. After a turn, the low-pass takes its time to tell of it.
        assert float(line[1]) == pytest.approx(2 * 0.05 * 3600, rel=0.1)
        assert float(line[-2]) < 0.4 * float(line[1])


@pytest.mark.usefixtures("no_report")
def test_one_cycle_in_counts_is_checked_by_pieces_and_needs_a_scale_factor(tmp_path, capsys):
    log = thermal_cycle(-20, 60, -20)
    log["gyro_x_lsb"] = (131.0 * log["gyro_x_dps"]).round()
    log.drop(columns=["gyro_x_dps", "gyro_y_dps"]).to_csv(tmp_path / "mems.csv", index=False)
    arguments = [str(tmp_path / "mems.csv"), "--terms", "3,1", "--output", str(tmp_path / "out")]
    assert main(arguments) == 3
    assert "does not tell its scale factor" in capsys.readouterr().err
    assert main([*arguments, "--scale-factor", "131"]) == 0
    said = capsys.readouterr().out
    assert "pieces of the legs" in said
    assert "whether a cycle repeats, so few cannot show" in said
    compensator = GyroCompensator.read_json(tmp_path / "out" / "compensator.json")
    assert (compensator.scale_factor, compensator.output_unit) == (131.0, "counts")


@pytest.mark.usefixtures("no_report")
def test_axes_that_the_table_did_not_turn_are_left_out_and_many_files_are_applied(tmp_path, capsys):
    log = make_ofog(n_devices=1, n_runs=4, duration=600.0, random_state=0)
    g = np.random.default_rng(0)
    table = log[["time", "temperature", "rate"]].assign(
        gyro_x=log["output"], gyro_y=g.normal(size=len(log)), gyro_z=g.normal(size=len(log))
    )
    (tmp_path / "logs").mkdir()
    for run, part in table.groupby(log["run"]):
        part.to_csv(tmp_path / "logs" / f"run{run}.csv", index=False)
    out, where = tmp_path / "out", str(tmp_path / "logs")
    arguments = [where, "--terms", "1,1,2", "--inputs", "time", "temperature", "output"]
    assert main([*arguments, "--output", str(out)]) == 0
    said, told = capsys.readouterr()
    assert [path.name for path in out.iterdir()] == ["x"]
    assert "axis y is left out: the log, column 'gyro_y' (output): does not follow the rate" in told
    assert "axis y is left out" in said
    assert "axis x         gyro_x, rate" in said
    assert "read 4 of 4" in told
    assert "whole runs held out (4 runs" in said
    model, target = str(out / "x" / "compensator.json"), tmp_path / "rates.csv"
    arguments = ["--apply", model, "--columns", "output=gyro_x", "--output", str(target)]
    assert main([where, *arguments]) == 0
    rates = pd.read_csv(target)
    whole = GyroCompensator.read_json(model).apply(log)
    np.testing.assert_allclose(rates["rate_compensated"], whole["rate_compensated"], atol=1e-9)
    assert rates["run"].tolist() == [f"run{run}" for run in log["run"]]


def test_version(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0
    assert capsys.readouterr().out == f"skanfis {__version__}\n"
