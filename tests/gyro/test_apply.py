"""``--apply`` gives what the compensator gives, however the log is read."""

import numpy as np
import pandas as pd
import pytest

from skanfis.datasets import make_ofog
from skanfis.gyro import GyroCompensator
from skanfis.gyro.compensator import features
from skanfis.gyro.log import read_log

from ..quick import quick

INPUTS = ("time", "temperature", "temperature_rate", "output")
COLUMNS = ["time", "temperature", "output", "rate"]


@pytest.fixture(scope="module")
def log():
    """Two devices of two runs, on clocks that begin anew with each."""
    return make_ofog(n_devices=2, n_runs=2, duration=600.0, sampling_interval=2.0, random_state=0)


@pytest.fixture(scope="module")
def model(log, tmp_path_factory):
    runs = log["device"].astype(str) + log["run"].astype(str)
    X = features(log.assign(run=runs), INPUTS, time_constant=60.0)
    error = log["output"] - log["rate"]
    estimator = quick([2, 2, 2, 1]).fit(X, error)
    path = tmp_path_factory.mktemp("model") / "compensator.json"
    GyroCompensator(estimator, INPUTS).write_json(path)
    return path


def labelled(log):
    return log[[*COLUMNS, "device", "run"]]


def interleaved(log):
    """The devices side by side, as one logger writes them."""
    table = log[[*COLUMNS, "device", "run"]]
    return table.sort_values(["run", "time", "device"], kind="stable")


def told_by_the_clock(log):
    """No labels: the clock begins anew, and once it jumps."""
    table = log[log["device"] == log["device"].iloc[0]][COLUMNS].reset_index(drop=True)
    table.loc[500:, "time"] += 5000.0
    return table


def one_run(log):
    return log[:300][COLUMNS]


@pytest.mark.parametrize("kind", [labelled, interleaved, told_by_the_clock, one_run])
def test_pieces_give_what_the_whole_gives(log, model, kind, tmp_path, monkeypatch, say):
    path = tmp_path / "log.csv"
    kind(log).to_csv(path, index=False)
    tables, said = [], []
    for rows in (100_000, 197):
        monkeypatch.setattr("skanfis.gyro.log._ROWS", rows)
        target = tmp_path / f"rates{rows}.csv"
        code, out, err = say("--apply", model, path, "--output", target)
        assert code == 0
        tables.append(pd.read_csv(target))
        notes = [line.partition("note:")[2] for line in err.splitlines() if "note:" in line]
        said.append(out.splitlines()[1:] + notes)
    whole, pieces = tables
    assert said[0] == said[1]
    assert list(whole.columns) == list(pieces.columns)
    for name in whole:
        if whole[name].dtype.kind == "f":
            np.testing.assert_allclose(pieces[name], whole[name], rtol=1e-9, atol=1e-11)
        else:
            assert whole[name].tolist() == pieces[name].tolist()
    if "run" in kind(log):
        # By the compensator itself, which knows nothing of files and pieces.
        direct = GyroCompensator.read_json(model).apply(read_log(path))
        np.testing.assert_allclose(
            pieces["rate_compensated"], direct["rate_compensated"], rtol=1e-9, atol=1e-11
        )
