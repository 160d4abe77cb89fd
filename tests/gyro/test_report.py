"""The table of figures: planted truth, before and after, intervals and what is missing."""

import numpy as np
import pandas as pd
import pytest

from skanfis.gyro.report import gyro_report

HOUR = 3600.0
VALUES = ["before", "before_low", "before_high", "after", "after_low", "after_high"]


@pytest.fixture
def log(rng):
    """Eight runs of 100 rows with planted errors, and a compensation that leaves a tenth of them.

    Scale factor 1000 ppm high, and 2 ppm/degC more with temperature; bias 10 deg/h, 0.5
    deg/h/degC, 4 deg/h/(degC/min).
    """
    run = np.repeat(np.arange(8), 100)
    time = np.tile(np.arange(100.0), 8)
    rate = rng.permuted(np.tile(np.linspace(-100, 100, 100), (8, 1)), axis=1).ravel()
    temperature = 20.0 + 5.0 * (run - 3.5) + 2.0 * np.sin(time / 9.0)
    ramp = np.cos(time / 9.0)
    dt, dr = temperature - temperature.mean(), ramp - ramp.mean()
    error = (1e-3 + 2e-6 * dt) * rate + (10.0 + 0.5 * dt + 4.0 * dr) / HOUR
    error += 1e-3 * rng.normal(size=800)
    log = pd.DataFrame({"run": run, "time": time, "rate": rate, "temperature": temperature})
    return log.assign(temperature_rate=ramp, before=rate + error, after=rate + 0.1 * error)


def report_of(log, *names, **options):
    columns = {name: log[name] for name in names}
    options = {"random_state": 0, "n_resamples": 50} | options
    return gyro_report(log["rate"], log["before"], log["after"], **columns, **options)


def figures(report):
    return report.set_index("figure")


ALL = ("temperature", "temperature_rate", "time", "run")


def test_planted_truth_is_in_the_table(log):
    table = figures(report_of(log, *ALL))
    planted = {
        "scale_factor_error": (1000.0, 5.0),
        "scale_factor_temperature_sensitivity": (2.0 / 1.001, 0.1),
        "bias": (10.0, 0.5),
        "bias_temperature_sensitivity": (0.5, 0.05),
        "bias_ramp_sensitivity": (4.0, 1.0),
    }
    residual = log["before"] - log["rate"]
    for name, (value, tolerance) in planted.items():
        assert table.loc[name, "before"] == pytest.approx(value, abs=tolerance), name
        assert table.loc[name, "after"] == pytest.approx(0.1 * value, abs=tolerance), name
    sizes = [np.sqrt(np.mean(residual**2)), residual.abs().max(), np.ptp(residual)]
    names = ["residual_rms", "residual_peak", "residual_peak_to_peak"]
    np.testing.assert_allclose(table.loc[names, "before"], sizes, rtol=1e-12)
    assert table.loc["reduction_factor", "after"] == pytest.approx(10.0)


def test_intervals_hold_the_figure_and_come_back_with_the_seed(log):
    one, two = report_of(log, *ALL), report_of(log, *ALL)
    pd.testing.assert_frame_equal(one, two)
    table = figures(one)
    for side in ("before", "after"):
        known = table.dropna(subset=[f"{side}_low"])
        assert len(known) >= 13
        assert (known[f"{side}_low"] <= known[f"{side}_high"]).all()
    alone = gyro_report(log["rate"], log["before"], random_state=0, n_resamples=0)
    assert list(alone.columns) == ["figure", "unit", *VALUES[:3], "note"]
    assert (one.attrs["resampled"], alone.attrs["resampled"]) == ("runs", "blocks of rows")
    assert "reduction_factor" not in set(alone["figure"])
    assert table.loc["residual_peak", "note"] == "no interval: it is a largest value"


@pytest.mark.theory
def test_of_many_rows_intervals_are_of_such_as_the_figures_are_of(rng):
    """A table that turns one way and the other in turn: every second row has one sign alone."""
    n_runs, n_rows = 8, 600
    rate = np.tile([0.0, 0.0, 50.0, -50.0, 100.0, -100.0], n_runs * n_rows // 6)
    run = np.repeat(np.arange(n_runs), n_rows)
    own = rng.normal(scale=1e-4, size=n_runs)[run]
    before = rate * (1.0 + 5e-4 + 5e-5 * np.sign(rate) + own)
    before += rng.normal(scale=0.01, size=run.size)
    names = ["residual_rms", "scale_factor_error", "scale_factor_asymmetry", "bias"]
    report = figures(gyro_report(rate, before, run=run, random_state=0))
    found = report.loc[names, VALUES[:3]]
    assert (found["before_low"] < found["before"]).all()
    assert (found["before"] < found["before_high"]).all()


def test_interval_is_that_of_the_runs_not_of_the_rows(rng):
    """Each run has a bias of its own: the mean of 10 is known to 1 / sqrt(10) of their spread."""
    n_runs, biases = 10, 5.0 * rng.normal(size=10) / HOUR
    rate = np.tile(np.linspace(-100, 100, 40), n_runs)
    before = rate + np.repeat(biases, 40)
    run = np.repeat(np.arange(n_runs), 40)
    report = gyro_report(rate, before, run=run, n_resamples=1000, random_state=0)
    bias = figures(report).loc["bias"]
    expected = 2 * 1.96 * HOUR * biases.std() / np.sqrt(n_runs)
    # The binomial spread of percentiles of 1,000 resamples is some 4 %, the skewness of 10 more.
    assert bias["before_high"] - bias["before_low"] == pytest.approx(expected, rel=0.12)


@pytest.mark.theory
def test_sizes_of_means_lie_in_their_intervals_and_the_truth_does(rng):
    """A resample has fewer different rows, so that the noise of its means is larger."""
    time = np.tile(np.arange(2000.0), 8)
    rate, phase = rng.uniform(-100.0, 100.0, time.size), 2.0 * np.pi * time / 400.0
    run, heat = np.repeat(np.arange(8), 2000), {"temperature": 20.0 + 30.0 * np.sin(phase)}
    heat["temperature_rate"] = np.cos(phase)
    error = 1e-6 * rate**2 + 0.002 * np.sign(np.cos(phase)) + 0.01 * rng.normal(size=time.size)
    report = gyro_report(rate, rate + error, run=run, **heat, n_resamples=50, random_state=0)
    table = figures(report)
    planted = {
        "scale_factor_nonlinearity": 2.0 / 3.0 * 100.0,
        "scale_factor_nonlinearity_rms": np.sqrt(4.0 / 45.0) * 100.0,
        "hysteresis": 0.004 * HOUR,
    }
    for name, truth in planted.items():
        value, low, high = table.loc[name, VALUES[:3]]
        assert low < min(value, truth) <= max(value, truth) < high
    # Where there is no error there is none in any resample.
    none = gyro_report(0.0 * rate, 0.0 * rate, run=run, **heat, n_resamples=10, full_scale=100.0)
    assert (figures(none).loc["hysteresis", VALUES[:3]] == 0.0).all()


def test_refused_rows_are_left_out_of_both_sides(log):
    refused = np.arange(len(log)) % 10 == 0
    patchy = log.assign(after=log["after"].where(~refused))
    pd.testing.assert_frame_equal(report_of(patchy, "run"), report_of(log[~refused], "run"))
    # What has no column is left out.
    assert not {"hysteresis", "bias_stability_10s"} & set(report_of(log, "run")["figure"])


def test_what_is_missing_is_said(log):
    rest = log.assign(rate=0.0, before=log["before"] - log["rate"], after=0.001)
    table = figures(report_of(rest, *ALL, full_scale=100.0))
    note = "No scale factor: the rate is 0 deg/s in all rows."
    assert table.loc["scale_factor_error", "note"] == note
    assert np.isnan(table.loc["scale_factor_error", "before"])
    one = figures(report_of(log.assign(rate=log["rate"].where(log["run"] == 0, 0.0)), "run"))
    note = "no interval: too many resamples do not have this figure"
    assert one.loc["scale_factor_error", "note"] == note
    few = figures(report_of(log[log["run"] < 2], "run"))
    assert few.loc["bias_repeatability", "note"] == "no interval: fewer than 5 runs"
    assert np.isfinite(few.loc["bias_repeatability", "before"])
    long = figures(report_of(log, "time", "run"))
    assert "too long for a run" in long.loc["bias_stability_100s", "note"]


def test_allan_deviation_is_read(rng):
    pytest.importorskip("allantools")
    error = 0.05 / 60.0 * rng.normal(size=4096)
    still, options = np.zeros(4096), {"full_scale": 1.0, "allan": True, "n_resamples": 10}
    table = figures(gyro_report(still, error, time=np.arange(4096.0), **options))
    assert table.loc["angle_random_walk", "before"] == pytest.approx(0.05, rel=0.1)
    assert table.loc["angle_random_walk", "note"].startswith("no interval: see the standard errors")
    # A row that is lost, or refused, ends a stretch and no more.
    place = np.arange(4096.0)
    options["after"] = np.where(place == 3000.0, np.nan, error)
    table = figures(gyro_report(still, error, time=place + (place > 2000.0), **options))
    assert table.loc["angle_random_walk", "after"] == pytest.approx(0.05, rel=0.1)
    table = figures(gyro_report(still, error, time=0.0 * place, **options))
    assert "nowhere do 10 rows in range follow" in table.loc["angle_random_walk", "note"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"after": [1.0, np.inf]}, "after must be finite"),
        ({"after": [np.nan, np.nan]}, "after is NaN in all rows"),
        ({"after": [1.0]}, "after has 1 rows where the other columns have 2"),
        ({"before": []}, "before is empty"),
        ({"before": [[1.0, 2.0]]}, "before must have one dimension"),
        ({"after": ["a", "b"]}, "after must hold numbers"),
        ({"run": [0]}, "run has 1 rows"),
        ({"full_scale": 0.0}, "full_scale=0.0 must be positive"),
        ({"n_resamples": -1}, "n_resamples=-1"),
        ({"rate_unit": "deg"}, "rate_unit='deg' must be one of deg/s, deg/h"),
        ({"allan": True}, "allan=True needs the column time"),
    ],
)
def test_bad_arguments_are_named(options, message):
    arguments = {"rate": [1.0, 2.0], "before": [1.0, 2.0]} | options
    with pytest.raises(ValueError, match=message):
        gyro_report(**arguments)
