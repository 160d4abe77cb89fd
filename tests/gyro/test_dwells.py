"""Logs that are not tidy: dwells found and clipped, temperatures made to count alike."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.datasets import make_ofog
from skanfis.gyro import clip_dwells, find_dwells, find_rate_levels, resample_in_temperature


@pytest.fixture
def log(rng):
    """A table that holds each of five rates for 20 s, and goes from one to the next at 5 deg/s^2.

    The gyro's output settles after each step with a time constant of 2 s.
    """
    rates = [0.0, 40.0, -40.0, 80.0, -80.0]
    pieces, at = [], 0.0
    for level in rates:
        way = np.arange(0.5, abs(level - at), 0.5) / abs(level - at) if level != at else []
        pieces += [at + (level - at) * np.asarray(way), np.full(200, level)]
        at = level
    rate = np.concatenate(pieces)
    time = 0.1 * np.arange(rate.size)
    return pd.DataFrame({"time": time, "rate": rate, "temperature": 20 + 0.01 * time})


def test_dwells_are_numbered_in_the_order_of_the_log():
    rate = [5.0, 5.0, -5.0, -5.0, -5.0, 5.0]
    assert find_dwells(rate).tolist() == [0, 0, 1, 1, 1, 2]
    assert find_dwells(rate, run=list("aaabbb")).tolist() == [0, 0, 1, 2, 2, 3]
    assert find_dwells(np.zeros(3)).tolist() == [0, 0, 0]


def test_dwells_are_those_of_the_simulation():
    data = make_ofog(n_devices=1, n_runs=3, random_state=0)
    dwells = find_dwells(data["rate"], run=data["run"])
    assert_array_equal(dwells, np.repeat(np.arange(3 * 30), 12))


def test_a_slow_ramp_is_no_dwell():
    ramp = np.arange(0.0, 100.0, 0.09)  # less than the tolerance from row to row
    assert np.bincount(find_dwells(ramp)).max() <= 3


def test_tolerance_is_about_the_first_rate_of_the_dwell():
    rate = [0.0, 0.3, -0.3, 0.6, 0.9, 1.2]
    assert find_dwells(rate, tolerance=0.5).tolist() == [0, 0, 0, 1, 1, 2]
    assert find_dwells(rate, tolerance=0).tolist() == list(range(6))
    with pytest.raises(ValueError, match="tolerance=-1 must be zero or a positive number"):
        find_dwells(rate, tolerance=-1)


def test_clipped_dwells_are_at_rest_on_their_levels(log):
    assert find_rate_levels(clip_dwells(log, lead=5.0)["rate"]).size == 5
    clipped = clip_dwells(log, lead=5.0, trail=1.0)
    assert_allclose(np.unique(clipped["rate"]), [-80, -40, 0, 40, 80])
    # 200 rows, less 50 at the start and 10 at the end of each dwell.
    assert set(clipped["rate"].value_counts()) == {140}
    # Nothing else is changed.
    pd.testing.assert_frame_equal(clipped, log.loc[clipped.index])


def test_clipping_by_nothing_keeps_everything(log):
    pd.testing.assert_frame_equal(clip_dwells(log, lead=0.0), log)


def test_clipping_knows_of_runs_and_other_names(log):
    twice = pd.concat([log[:200], log[:200].assign(time=log["time"][:200] + 100)])
    twice = twice.assign(run=np.repeat(["a", "b"], 200)).rename(columns={"rate": "table"})
    clipped = clip_dwells(twice, 5.0, rate="table", run="run")
    assert clipped["run"].value_counts().to_dict() == {"a": 150, "b": 150}


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"lead": -1.0}, "lead=-1.0 must be zero or a positive number"),
        ({"lead": 1.0, "trail": float("nan")}, "trail=nan must be zero or a positive number"),
        ({"lead": 30.0}, r"No row is left: lead=30 and trail=0 .* longest of \d+ dwells, 19.9."),
        ({"lead": 1.0, "rate": "table"}, r"no column 'table' \(rate\) among \['time', 'rate'"),
        ({"lead": 1.0, "run": "start"}, r"no column 'start' \(run\)"),
    ],
)
def test_clipping_refuses_what_makes_no_sense(parameters, message, log):
    with pytest.raises(ValueError, match=message):
        clip_dwells(log, **parameters)


def test_resampling_makes_every_temperature_count_alike(rng):
    # The bias is 1 + T^2, but 90 % of the rows are at 20 degC.
    temperature = np.concatenate([np.full(9000, 20.0), rng.uniform(-20, 60, 1000)])
    bias = 1 + 0.01 * temperature**2 + rng.normal(scale=0.1, size=temperature.size)
    log = pd.DataFrame({"temperature": temperature, "bias": bias})
    resampled = resample_in_temperature(log, 2.0)
    assert len(resampled) == 40
    assert_allclose(np.diff(resampled["temperature"]), 2.0, atol=1.5)
    assert resampled["n_rows"].sum() == len(log)
    assert resampled["n_rows"].max() > 9000
    assert_allclose(resampled["bias"], 1 + 0.01 * resampled["temperature"] ** 2, atol=0.3)
    assert resampled["temperature"].mean() == pytest.approx(20.0, abs=0.3)


def test_cells_hold_the_mean_of_their_rows_and_of_no_others(rng):
    log = pd.DataFrame(
        {
            "note": rng.choice(["up", "down"], 300),
            "temperature": rng.uniform(-5, 5, 300),
            "rate": rng.choice([-10.0, 10.0], 300),
            "output": rng.normal(size=300),
        }
    )
    resampled = resample_in_temperature(log, 0.5, by=["rate", "note"])
    assert list(resampled.columns) == ["note", "temperature", "rate", "output", "n_rows"]
    assert resampled["n_rows"].sum() == 300
    for cell in resampled.itertuples():
        rows = log[
            (log["rate"] == cell.rate)
            & (log["note"] == cell.note)
            & (np.floor(log["temperature"] / 0.5) == np.floor(cell.temperature / 0.5))
        ]
        assert len(rows) == cell.n_rows
        assert_allclose([cell.temperature, cell.output], rows[["temperature", "output"]].mean())
    one_column = resample_in_temperature(log.drop(columns="note"), 0.5, by="rate")
    assert one_column.groupby("rate")["temperature"].is_monotonic_increasing.all()


def test_resampling_refuses_what_makes_no_sense():
    log = pd.DataFrame({"temperature": [20.0, 21.0], "note": ["a", "b"]})
    with pytest.raises(ValueError, match=r"column 'note' cannot be averaged: .* Name it in by"):
        resample_in_temperature(log, 1.0)
    with pytest.raises(ValueError, match="step=0 must be a positive number"):
        resample_in_temperature(log, 0, by="note")
    with pytest.raises(ValueError, match=r"no column 'run' \(by\) among \['temperature', 'note'\]"):
        resample_in_temperature(log, 1.0, by="run")
    with pytest.raises(ValueError, match=r"no column 'T' \(temperature\)"):
        resample_in_temperature(log, 1.0, temperature="T", by="note")
    missing = log.assign(temperature=[20.0, np.nan])
    with pytest.raises(ValueError, match=r"column 'temperature' .temperature. must be finite"):
        resample_in_temperature(missing, 1.0, by="note")
