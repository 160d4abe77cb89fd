"""N, B and K of noise whose truth is known, and what is said where the curve has none."""

import sys

import numpy as np
import pytest

from skanfis.gyro.metrics import allan_deviation, allan_figures

HOUR = 3600.0
TAU = 2.0 ** np.arange(16)


def read(tau, deviation):
    """Values, and notes where there are such."""
    found = allan_figures(np.asarray(tau, dtype=float), np.asarray(deviation, dtype=float))
    values = {name: value for name, (value, _) in found.items()}
    return values, {name: note for name, (_, note) in found.items() if note}


def test_planted_curve_is_read_back():
    """sigma^2 = N^2/tau + (0.664 B)^2 + K^2 tau/3, with the parts far apart."""
    n, b, k = 0.05, 0.1, 0.5  # deg/sqrt(h), deg/h, deg/h/sqrt(h)
    tau_h = TAU / HOUR
    variance = n**2 / tau_h + 2 * np.log(2) / np.pi * b**2 + k**2 * tau_h / 3
    values, notes = read(TAU, np.sqrt(variance))
    # Neighbouring parts lift the points of a slope a little.
    assert values["angle_random_walk"] == pytest.approx(n, rel=0.01)
    assert values["rate_random_walk"] == pytest.approx(k, rel=0.01)
    assert values["allan_minimum"] == pytest.approx(np.sqrt(variance.min()))
    flicker = np.sqrt(2 * np.log(2) / np.pi)
    assert values["bias_instability"] == pytest.approx(values["allan_minimum"] / flicker)
    assert notes == {}


def test_what_falls_behind_a_hump_is_no_white_noise():
    """White noise beside steps, which lift the curve at the time of a dwell and fall behind it."""
    white, steps = 180.0 / TAU, np.zeros(TAU.size)
    steps[5:] = 4e4 / (TAU[5:] / TAU[5]) ** 1.0
    assert read(TAU, np.sqrt(white + steps))[0]["angle_random_walk"] == pytest.approx(
        np.sqrt(180.0) / 60.0, rel=1e-9
    )
    values, notes = read(TAU[4:], np.sqrt(white + steps)[4:])
    assert np.isnan(values["angle_random_walk"])
    assert notes["angle_random_walk"] == "no slope of -1/2"


def test_pure_slopes_are_exact_and_a_figure_that_is_not_there_is_said():
    values, notes = read(TAU, 60.0 * 0.05 / np.sqrt(TAU))
    assert values.pop("angle_random_walk") == pytest.approx(0.05, rel=1e-12)
    assert np.isnan(list(values.values())).all()
    assert "still falls at its longest averaging time, 32768 s" in notes["bias_instability"]
    assert notes["rate_random_walk"] == "no slope of +1/2"
    values, notes = read(TAU, 3.0 * np.sqrt(TAU / HOUR / 3))
    assert values.pop("rate_random_walk") == pytest.approx(3.0, rel=1e-12)
    assert np.isnan(list(values.values())).all()
    assert "rises from its shortest averaging time, 1 s" in notes["allan_minimum"]
    assert np.isnan(read(TAU, TAU)[0]["rate_random_walk"])
    with pytest.raises(ValueError, match="has 2 points"):
        read([1, 2], [1, 2])
    with pytest.raises(ValueError, match="deviation must be positive; its smallest value is 0"):
        read([1, 2, 4], [1, 0, 3])


def test_without_allantools_the_way_to_get_it_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "allantools", None)
    with pytest.raises(ImportError, match="pip install allantools"):
        allan_deviation(np.zeros(10), 1.0)


class TestDeviation:
    @pytest.fixture(autouse=True)
    def _needs_allantools(self):
        pytest.importorskip("allantools")

    def test_is_that_of_its_definition(self, rng):
        """sigma^2(m h) = mean (y_{k+m} - y_k)^2 / 2 over all means y_k of m neighbours."""
        drift = rng.normal(size=300).cumsum()  # deg/h
        curve = allan_deviation(drift / HOUR, 0.5)
        np.testing.assert_array_equal(curve["averaging_time"], [0.5, 1.0, 2.0, 4.0, 8.0])
        for line in curve.itertuples():
            m = round(line.averaging_time / 0.5)
            means = np.convolve(drift, np.ones(m) / m, mode="valid")
            differences = means[m:] - means[:-m]
            assert line.n == differences.size
            assert line.deviation == pytest.approx(np.sqrt(np.mean(differences**2) / 2))
            assert line.error == pytest.approx(line.deviation / np.sqrt(line.n))

    def test_runs_are_not_joined(self, rng):
        """A step between two runs is no noise; their curve is the mean of the variances."""
        one, other = rng.normal(size=(2, 512)) / HOUR
        run = np.repeat([0, 1], 512)
        joined = allan_deviation(np.concatenate([one, other + 100.0]), 1.0, run=run)
        single = [allan_deviation(each, 1.0)["deviation"] for each in (one, other)]
        np.testing.assert_allclose(joined["deviation"], np.hypot(*single) / np.sqrt(2))

    def test_runs_too_short_are_refused(self):
        with pytest.raises(ValueError, match="no run has 10 rows"):
            allan_deviation(np.zeros(18), 1.0, run=np.repeat([0, 1], 9))
        with pytest.raises(ValueError, match="sampling_interval=0 must be positive"):
            allan_deviation(np.zeros(4), 0)
