"""Temperatures and effects of one run against closed forms, and the statistics that define them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import minimize_scalar

from skanfis.datasets import _ofog_physics as physics
from skanfis.datasets._ofog import _POPULATION
from skanfis.datasets._ofog_physics import Schedule, simulate_power_up, temperatures

NOMINAL = {name: entry[0] for name, entry in _POPULATION.items()}
# Those that are no size of an effect stay: an interferometer without them is none.
STRUCTURAL = ("amplitude", "sagnac_factor", "warm_up_time", "thermal_time", "correlation_time")
IDEAL = NOMINAL | {name: 0.0 for name in NOMINAL if name not in STRUCTURAL}
SCHEDULE = Schedule(720, 5.0, 1, 0, "constant", (-20.0, 60.0))
TIME = 5.0 * np.arange(720)
RATE = np.repeat(np.linspace(-120, 120, 9), 80)
OPTICS = (0.2536, 0.98, 1.01)


def history(schedule=SCHEDULE, start=10.0, rising=True, heat=0.0, **coefficients):
    device = SimpleNamespace(**NOMINAL | coefficients)
    return list(temperatures(device, schedule, start, rising, heat))


def simulate(device, bias=0.0):
    """Measurement and parts of the error at an ambient temperature of 20 degC."""
    normals = np.random.RandomState(0).standard_normal((4, TIME.size))
    (thermal,) = history(SCHEDULE, 20.0, **device)
    return simulate_power_up(SimpleNamespace(**device), bias, RATE, thermal, normals, 5.0)


def test_thermometer_follows_the_coil_with_two_time_constants():
    (thermal,) = history(heat=0.4)
    slow, fast = np.exp(-TIME / 1200), np.exp(-TIME / 180)
    assert_allclose(thermal.coil, 25.0 - 15 * 0.6 * slow, rtol=1e-12)
    expected = 25.0 - 15 * 0.6 * (1200 * slow - 180 * fast) / (1200 - 180)
    assert_allclose(thermal.thermometer, expected, atol=2e-3)  # first-order hold of a curve
    assert thermal.thermometer[0] == 16.0


@pytest.mark.parametrize("thermometer_lag", [0.0, 180.0])
@pytest.mark.parametrize("profile", ["constant", "ramps"])
def test_rates_are_the_derivatives_of_the_temperatures(profile, thermometer_lag):
    schedule = replace(SCHEDULE, n_samples=7200, sampling_interval=0.5, profile=profile)
    (thermal,) = history(schedule, thermometer_lag=thermometer_lag)
    pairs = ((thermal.coil, thermal.coil_rate), (thermal.thermometer, thermal.thermometer_rate))
    for temperature, rate in pairs:
        # The ramp turns once; there the derivative of the coil has a kink.
        assert_allclose(np.gradient(temperature, 0.5)[1:-1], rate[1:-1], atol=1e-5)
    lagging = thermal.thermometer + thermometer_lag * thermal.thermometer_rate
    assert_allclose(lagging, thermal.coil, rtol=1e-11)
    standing = SimpleNamespace(**NOMINAL), 0.0, np.zeros(7200), thermal, np.zeros((4, 7200)), 0.5
    measured, _ = simulate_power_up(*standing)
    assert_array_equal(measured["temperature"], thermal.thermometer)
    assert_array_equal(measured["temperature_rate"], thermal.thermometer_rate)


def test_chamber_ramps_and_soaks():
    schedule = replace(SCHEDULE, profile="ramps")
    for rising in (True, False):
        ambient = schedule.ambient(0, 721, 10.0, rising)
        assert (ambient[1] > ambient[0]) == rising
        assert ambient[[0, -1]].tolist() == pytest.approx([10.0, 10.0])
        assert [ambient.min(), ambient.max()] == pytest.approx([-20.0, 60.0], abs=0.3)
        # 80 degC up and 80 down in an hour
        assert np.median(np.abs(np.diff(ambient)) / 5.0) == pytest.approx(160.0 / 3600.0)
    ambient = replace(SCHEDULE, profile="soaks").ambient(0, 720, 10.0, True)
    soaks, n_samples = np.unique(ambient, return_counts=True)
    assert_allclose(soaks, [-20, 0, 20, 40, 60])
    # The ends are met once on the way up and down, the others twice.
    assert_allclose(n_samples, [90, 180, 180, 180, 90], atol=2)


def test_later_power_ups_begin_as_warm_as_the_off_time_leaves_the_gyro():
    histories = history(replace(SCHEDULE, n_power_ups=3, n_off=120))
    on, off = np.exp(-3600 / 1200), np.exp(-600 / 1200)
    heat = 0.0
    for thermal in histories:
        assert thermal.coil[0] == pytest.approx(10.0 + heat, rel=1e-12)
        # The thermometer lags: it is still warmer when the coil has cooled.
        assert (thermal.thermometer[0] > thermal.coil[0]) == (heat > 0)
        heat = (15.0 - (15.0 - heat) * on) * off
    # The chamber goes on while the gyro is off.
    schedule = replace(SCHEDULE, profile="ramps", n_power_ups=2, n_off=120)
    first, second = history(schedule)
    assert second.ambient[0] == schedule.ambient(840, 1, 10.0, True)[0] != first.ambient[0]


@pytest.mark.parametrize(
    ("coefficient", "part"),
    [
        ({"scale_factor": 500.0}, "scale_factor"),
        ({"sagnac_temperature": -370.0}, "wavelength"),
        ({"amplitude_temperature": -40.0}, "amplitude"),
        ({"warm_up_scale_factor": 200.0}, "warm_up_scale_factor"),
        ({"bias_temperature": 0.5}, "bias_temperature"),
        ({"warm_up": 30.0}, "warm_up"),
        ({"bias_temperature_rate": 5.0, "self_heating": 10.0}, "bias_temperature_rate"),
        ({"bias_instability": 0.5}, "bias_instability"),
        ({"rate_random_walk": 0.3}, "rate_random_walk"),
        ({"angle_random_walk": 0.05}, "angle_random_walk"),
        ({"quantisation": 0.5}, "quantisation"),
    ],
)
def test_each_coefficient_acts_in_its_own_part_alone(coefficient, part):
    measured, parts = simulate(IDEAL | coefficient)
    acting = {name for name, values in parts.items() if np.abs(values).max() > 1e-12}
    assert acting == {"nonlinearity", part}
    assert_allclose(measured["error"] - parts["nonlinearity"], parts[part], rtol=1e-9, atol=1e-12)


def test_noise_is_what_a_perfect_compensation_leaves():
    # With every systematic coefficient known, the arcsine inverts the law; noise is all that stays.
    device = NOMINAL | {"quantisation": 3.0}
    measured, parts = simulate(device, bias=2.0)
    coil = 20.0 + 15.0 * (1 - np.exp(-TIME / 1200.0))
    factor = 0.2536 * (1 - 370e-6 * (coil - 25))
    amplitude = 1 + 1e-6 * (coil - 25) * (-40 - 0.5 * (coil - 25))
    amplitude = amplitude * (1 + 200e-6 * np.exp(-TIME / 180))
    phase = np.arcsin(0.2536 * np.deg2rad(measured["output"]) / amplitude)
    bias = 0.5 * (coil - 25) + 0.01 * (coil - 25) ** 2
    bias = bias + 30 * np.exp(-TIME / 180) + 5 * 60 * (35 - coil) / 1200
    compensated = np.rad2deg(phase / factor) - bias / 3600
    noise = np.sqrt(np.mean(measured["noise"] ** 2))
    assert_allclose(compensated - RATE, measured["noise"], atol=1e-5 * noise)
    assert_allclose(sum(parts.values()), measured["error"], atol=1e-12)
    assert noise > np.sqrt(np.mean(parts["angle_random_walk"] ** 2))


@pytest.mark.parametrize("bias", [0.0, 1e-12, 0.01, -30.0])
def test_bias_gain_is_the_secant_of_the_response(bias):
    rate = np.linspace(-200, 200, 9)
    gain = physics.bias_gain(rate, bias, *OPTICS)
    ends = [physics.open_loop_response(each, *OPTICS) for each in (rate, rate + bias)]
    assert_allclose(gain * bias, ends[1] - ends[0], atol=1e-13)
    if bias == 0.0:
        assert_allclose(gain, 0.98 * 1.01 * np.cos(0.2536 * 0.98 * np.deg2rad(rate)), rtol=1e-13)


def test_lag_is_exact_whatever_the_interval():
    for interval in (0.1, 7.0, 500.0, 1e4):
        time = interval * np.arange(50)
        lagged = physics.first_order_lag(np.full(50, 20.0), 5.0, 300.0, interval)
        assert_allclose(lagged, 20 - 15 * np.exp(-time / 300), rtol=1e-12)
        # Behind a ramp u = t it stays by tau, whatever the start.
        lagged = physics.first_order_lag(time, 5.0, 300.0, interval)
        assert_allclose(lagged, time - 300.0 + 305.0 * np.exp(-time / 300), atol=1e-9 * time[-1])
    assert_allclose(physics.first_order_lag(time, 9.0, 0.0, 1.0), time)


def allan_deviation(rate, n_mean):
    """Overlapping Allan deviation of samples of a rate, over the mean of ``n_mean`` of them."""
    angle = np.concatenate([[0.0], np.cumsum(rate)])
    means = (angle[n_mean:] - angle[:-n_mean]) / n_mean
    return np.sqrt(0.5 * np.mean((means[n_mean:] - means[:-n_mean]) ** 2))


def allan_deviation_of_gauss_markov(x):
    """At x correlation times, in standard deviations (the closed form of IEEE 952's annex)."""
    return np.sqrt(2 / x * (1 - (3 - 4 * np.exp(-x) + np.exp(-2 * x)) / (2 * x)))


def test_allan_deviation_of_the_bias_instability_peaks_at_its_flicker_floor():
    peak = minimize_scalar(lambda x: -allan_deviation_of_gauss_markov(x), bounds=(0.5, 5))
    normals = np.random.RandomState(0).standard_normal(500_000)
    noise = 3600 * physics.bias_instability(normals, 2.0, 50.0, 1.0)
    assert_allclose(-peak.fun * noise.std(), 0.664 * 2.0, rtol=0.03)
    n_mean = round(50 * peak.x)
    means = noise[: noise.size // n_mean * n_mean].reshape(-1, n_mean).mean(axis=1)
    assert_allclose(np.sqrt(0.5 * np.mean(np.diff(means) ** 2)), 0.664 * 2.0, rtol=0.05)


def test_allan_deviation_of_the_rate_random_walk_grows_with_the_root_of_time(rng):
    # The mean over an ensemble: one walk of any length tells its Allan deviation badly.
    interval, K, n_means = 10.0, 0.4, np.array([16, 32, 64])
    walks = [physics.rate_random_walk(rng.standard_normal(2000), K, interval) for _ in range(300)]
    squares = [[allan_deviation(walk, n) ** 2 for n in n_means] for walk in walks]
    # K is in deg/h/sqrt(h): its deviation reads K at tau = 3 h.
    expected = K * np.sqrt(interval * n_means / 3600 / 3)
    assert_allclose(3600 * np.sqrt(np.mean(squares, axis=0)), expected, rtol=0.03)


def test_quantised_rate_counts_whole_increments_and_loses_no_angle(rng):
    interval, Q = 0.01, 0.8  # s, arcsec
    # Enough white noise to make the angle forget where the last step was.
    rate = 3.0 + 2.0 * rng.standard_normal(400_000)
    read = physics.quantised(rate, Q, interval)
    for n_mean in (1, 4, 16):
        expected = np.sqrt(3) * Q / 3600 / (n_mean * interval)
        assert_allclose(allan_deviation(read - rate, n_mean), expected, rtol=0.02)
    increment = np.sqrt(12) * Q / 3600
    counted = read[:5000] * interval / increment
    assert_allclose(counted, np.rint(counted), atol=1e-7)
    assert np.abs(np.cumsum(read - rate) * interval).max() <= increment / 2 + 1e-9
    assert physics.quantised(rate, 0.0, interval) is rate
