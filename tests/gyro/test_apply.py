"""``--apply`` gives what the compensator gives, however the log is read."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

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


def cold_starts(log, gap):
    """Runs of one device on clocks from power-on, the second without its first rows, or values."""
    table = log[log["device"] == log["device"].iloc[0]][[*COLUMNS, "run"]].reset_index(drop=True)
    early = (table["run"] == table["run"].iloc[-1]) & (table["time"] < 100.0)
    if gap == "rows":
        return table[~early]
    return table.assign(output=table["output"].mask(early))


@pytest.mark.parametrize("gap", ["rows", "values"])
def test_time_counts_from_power_on_and_not_from_the_first_row_that_is_left(
    log, model, gap, tmp_path, say
):
    whole = cold_starts(log, None) if gap is None else cold_starts(log, "values")
    cold_starts(log, gap).to_csv(tmp_path / "log.csv", index=False)
    out = tmp_path / "out.csv"
    code, told, _ = say("--apply", model, tmp_path / "log.csv", "--output", out, "--quiet")
    assert code == 0
    assert ("begins up to 100 s after power-on" in told) == (gap == "rows")
    kept = whole.dropna()
    expected = GyroCompensator.read_json(model).apply(whole.ffill().bfill()).loc[kept.index]
    late = kept["run"].to_numpy() == kept["run"].iloc[-1]
    settled = ~late | (kept["time"].to_numpy() > 500.0)
    found = pd.read_csv(out)
    assert len(found) == len(kept)
    assert_allclose(
        found["rate_compensated"][settled], expected["rate_compensated"][settled], rtol=1e-3
    )


def test_rows_without_the_true_rate_are_compensated(log, model, tmp_path, say):
    table = log[log["device"] == log["device"].iloc[0]][[*COLUMNS, "run"]].reset_index(drop=True)
    answers = []
    for name, known in (
        ("all", table),
        ("few", table.assign(rate=table["rate"].mask(table.index < 99))),
    ):
        path, out = tmp_path / f"{name}.csv", tmp_path / f"{name}-out.csv"
        known.to_csv(path, index=False)
        assert say("--apply", model, path, "--output", out, "--quiet")[0] == 0
        answers.append(pd.read_csv(out))
    pd.testing.assert_frame_equal(*answers)
