"""N, B and K of noise whose truth is known, and what is said where the curve has none."""

import sys

import numpy as np
import pytest

from skanfis.gyro.allan import allan_coefficients, allan_deviation

HOUR = 3600.0
TAU = 2.0 ** np.arange(16)


def test_planted_curve_is_read_back():
    """sigma^2 = N^2/tau + (0.664 B)^2 + K^2 tau/3, with the parts far apart."""
    n, b, k = 0.05, 0.1, 0.5  # deg/sqrt(h), deg/h, deg/h/sqrt(h)
    tau_h = TAU / HOUR
    variance = n**2 / tau_h + 2 * np.log(2) / np.pi * b**2 + k**2 * tau_h / 3
    read = allan_coefficients(TAU, np.sqrt(variance))
    # Neighbouring parts lift the points of a slope a little.
    assert read.angle_random_walk == pytest.approx(n, rel=0.01)
    assert read.rate_random_walk == pytest.approx(k, rel=0.01)
    assert read.bias_instability == read.allan_minimum / np.sqrt(2 * np.log(2) / np.pi)
    assert read.allan_minimum == pytest.approx(np.sqrt(variance.min()))
    assert read.notes == {}


def test_pure_slopes_are_read_exactly():
    white = allan_coefficients(TAU, 60.0 * 0.05 / np.sqrt(TAU))
    assert white.angle_random_walk == pytest.approx(0.05, rel=1e-12)
    walk = allan_coefficients(TAU, 3.0 * np.sqrt(TAU / HOUR / 3))
    assert walk.rate_random_walk == pytest.approx(3.0, rel=1e-12)


def test_a_coefficient_that_is_not_there_is_none_and_said():
    white = allan_coefficients(TAU, 3.0 / np.sqrt(TAU))
    assert white.allan_minimum is None
    assert white.bias_instability is None
    assert white.rate_random_walk is None
    assert "still falls at its longest averaging time, 32768 s" in white.notes["bias_instability"]
    assert white.notes["rate_random_walk"] == "no slope of +1/2"
    walk = allan_coefficients(TAU, np.sqrt(TAU))
    assert walk.angle_random_walk is None
    assert "rises from its shortest averaging time, 1 s" in walk.notes["allan_minimum"]
    ramp = allan_coefficients(TAU, TAU)
    assert ramp.rate_random_walk is None


@pytest.mark.parametrize(
    ("tau", "deviation", "message"),
    [
        ([1, 2], [1, 2], "has 2 points"),
        ([1, 2, 2], [1, 2, 3], "averaging_time must be positive and increase"),
        ([1, 2, 4], [1, 0, 3], "deviation must be positive; its smallest value is 0"),
        ([1, 2, 4], [1, np.nan, 3], "deviation must be finite"),
    ],
)
def test_bad_curves_are_refused(tau, deviation, message):
    with pytest.raises(ValueError, match=message):
        allan_coefficients(tau, deviation)


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

    def test_noise_has_its_coefficient(self, rng):
        """White noise over h has the deviation N / sqrt(h); a random walk steps by K sqrt(h)."""
        n, k, interval = 0.05, 3.0, 0.1
        white, steps = rng.normal(size=(2, 2**16))
        for error, name, value in (
            (n / 60.0 / np.sqrt(interval) * white, "angle_random_walk", n),
            (k * np.sqrt(interval / HOUR) * steps.cumsum() / HOUR, "rate_random_walk", k),
        ):
            curve = allan_deviation(error, interval)
            read = allan_coefficients(curve["averaging_time"], curve["deviation"])
            assert getattr(read, name) == pytest.approx(value, rel=0.1)

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
