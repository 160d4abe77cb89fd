"""Each effect against its closed form, or the statistic that defines its coefficient."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from skanfis.datasets import _ofog_physics as physics


def test_response_is_inverted_by_the_arcsine():
    rate = np.linspace(-300, 300, 101)
    output = physics.open_loop_response(rate, 0.2536)
    assert_allclose(np.rad2deg(np.arcsin(0.2536 * np.deg2rad(output)) / 0.2536), rate, atol=1e-10)


def test_response_departs_from_the_tangent_by_a_sixth_of_the_squared_phase():
    rate = 10.0
    phase = 0.2536 * np.deg2rad(rate)
    departure = physics.open_loop_response(rate, 0.2536) / rate - 1
    assert_allclose(departure, -(phase**2) / 6, rtol=phase**2)


def test_small_signal_scale_factor_is_that_of_its_parts():
    slope = physics.open_loop_response(1e-6, 0.25, relative_factor=1.02, amplitude=0.97) / 1e-6
    assert_allclose(slope, 1.02 * 0.97, rtol=1e-12)


@pytest.mark.parametrize("bias", [0.0, 1e-12, 0.01, -30.0])
def test_bias_gain_is_the_secant_of_the_response(bias):
    rate = np.linspace(-200, 200, 9)
    optics = (0.2536, 0.98, 1.01)
    gain = physics.bias_gain(rate, bias, *optics)
    difference = physics.open_loop_response(rate + bias, *optics) - physics.open_loop_response(
        rate, *optics
    )
    assert_allclose(gain * bias, difference, atol=1e-13)
    if bias == 0.0:
        assert_allclose(gain, 0.98 * 1.01 * np.cos(0.2536 * 0.98 * np.deg2rad(rate)), rtol=1e-13)


def test_noise_at_the_output_is_worth_the_inverse_slope_at_the_input():
    rate, step = np.linspace(-200, 200, 9), 1e-4
    optics = (0.2536, 0.98, 1.01)
    ends = [physics.open_loop_response(rate + d, *optics) for d in (-step, step)]
    slope = (ends[1] - ends[0]) / (2 * step)
    assert_allclose(physics.change_of_rate_by_output(rate, *optics), 1 / slope, rtol=1e-8)


def test_temperature_effects_vanish_at_the_reference_and_have_their_units():
    at = physics.REFERENCE_TEMPERATURE
    assert physics.relative_sagnac_factor(at, -370) == 1.0
    assert physics.relative_amplitude(at, -40, -0.5) == 1.0
    assert physics.temperature_bias(at, 0.5, 0.01) == 0.0
    assert_allclose(physics.relative_sagnac_factor(at + 10, -370), 1 - 3.7e-3, rtol=1e-14)
    assert_allclose(physics.relative_amplitude(at - 10, -40, -0.5), 1 + 400e-6 - 50e-6, rtol=1e-14)
    assert_allclose(physics.temperature_bias(at - 10, 0.5, 0.01) * 3600, -5 + 1, rtol=1e-14)


def test_biases_have_the_units_of_data_sheets():
    assert_allclose(physics.fixed_bias(3600.0), 1.0)
    # 1 degC/min at 5 deg/h/(degC/min) is 5 deg/h.
    assert_allclose(physics.thermal_rate_bias(1 / 60, 5.0) * 3600, 5.0)
    assert_allclose(physics.warm_up_bias(np.array([0.0, 180.0]), 30, 180) * 3600, [30, 30 / np.e])
    assert_allclose(physics.relative_scale_factor(500.0), 1.0005)
    warm_up = physics.warm_up_scale_factor(np.array([0.0, 180.0]), 200.0, 180.0)
    assert_allclose(warm_up - 1, [200e-6, 200e-6 / np.e], rtol=1e-9)


def test_lag_of_a_step_is_the_exponential_whatever_the_interval():
    for interval in (0.1, 7.0, 500.0, 1e4):
        time = interval * np.arange(50)
        lagged = physics.first_order_lag(np.full(50, 20.0), 5.0, 300.0, interval)
        assert_allclose(lagged, 20 - 15 * np.exp(-time / 300), rtol=1e-12)


def test_lag_of_a_ramp_is_late_by_the_time_constant():
    time = 5.0 * np.arange(2000)
    lagged = physics.first_order_lag(0.01 * time, 0.0, 300.0, 5.0)
    assert_allclose(lagged, 0.01 * (time - 300 * (1 - np.exp(-time / 300))), atol=1e-10)


def test_lag_solves_its_equation():
    time = np.arange(0.0, 2000.0)
    solution = solve_ivp(
        lambda t, y: (np.sin(t / 200) - y) / 150,
        (0, 1999),
        [0.3],
        t_eval=time,
        rtol=1e-9,
        atol=1e-10,
    )
    lagged = physics.first_order_lag(np.sin(time / 200), 0.3, 150.0, 1.0)
    assert_allclose(lagged, solution.y[0], atol=1e-5)


def test_no_lag_without_a_time_constant():
    values = np.array([3.0, 1.0, 2.0])
    assert_allclose(physics.first_order_lag(values, 9.0, 0.0, 1.0), values)
    assert_allclose(physics.first_order_lag(values, 3.0, 1e-6, 1.0), values, atol=1e-5)


def test_heat_balance_is_the_derivative_of_the_self_heating():
    time = np.linspace(0, 3600, 100)
    coil = 20 + 15 * (1 - np.exp(-time / 1200))
    rate = physics.coil_temperature_rate(35.0, coil, 1200.0)
    assert_allclose(rate, 15 / 1200 * np.exp(-time / 1200), rtol=1e-11)


def test_white_noise_makes_an_angle_that_walks_by_the_coefficient():
    # After one hour, the angle's deviation is N degrees, whatever the sampling interval.
    for interval in (0.01, 1.0, 60.0):
        n_samples = 3600 / interval
        angle = physics.angle_random_walk_deviation(0.05, interval) * interval * np.sqrt(n_samples)
        assert_allclose(angle, 0.05)


def _allan_deviation_of_gauss_markov(x):
    """At x correlation times, in standard deviations (the closed form of IEEE 952's annex)."""
    return np.sqrt(2 / x * (1 - (3 - 4 * np.exp(-x) + np.exp(-2 * x)) / (2 * x)))


def test_allan_deviation_of_the_bias_instability_peaks_at_its_flicker_floor():
    peak = minimize_scalar(lambda x: -_allan_deviation_of_gauss_markov(x), bounds=(0.5, 5))
    assert_allclose(peak.x, 1.89, rtol=0.01)
    normals = np.random.RandomState(0).standard_normal(500_000)
    noise = 3600 * physics.bias_instability(normals, 2.0, 50.0, 1.0)
    assert_allclose(-peak.fun * noise.std(), 0.664 * 2.0, rtol=0.03)
    n_mean = 94  # 1.89 correlation times
    means = noise[: noise.size // n_mean * n_mean].reshape(-1, n_mean).mean(axis=1)
    assert_allclose(np.sqrt(0.5 * np.mean(np.diff(means) ** 2)), 0.664 * 2.0, rtol=0.05)


def test_bias_instability_is_stationary_and_correlated_over_its_time():
    normals = np.random.RandomState(1).standard_normal((4000, 21))
    noise = np.array([physics.bias_instability(row, 1.0, 100.0, 10.0) for row in normals])
    deviations = noise.std(axis=0)
    assert_allclose(deviations, deviations.mean(), rtol=0.06)
    assert_allclose(np.corrcoef(noise[:, 0], noise[:, 10])[0, 1], np.exp(-1), atol=0.05)


def allan_deviation(rate, n_mean):
    """Overlapping Allan deviation of samples of a rate, over the mean of ``n_mean`` of them."""
    angle = np.concatenate([[0.0], np.cumsum(rate)])
    means = (angle[n_mean:] - angle[:-n_mean]) / n_mean
    return np.sqrt(0.5 * np.mean((means[n_mean:] - means[:-n_mean]) ** 2))


def slope_of_allan_deviation(rate, n_means):
    deviations = [allan_deviation(rate, n_mean) for n_mean in n_means]
    return np.polyfit(np.log(n_means), np.log(deviations), 1)[0]


def test_allan_deviation_of_the_angle_random_walk_falls_with_the_root_of_time(rng):
    interval = 0.5
    deviation = physics.angle_random_walk_deviation(0.03, interval)
    noise = deviation * rng.standard_normal(1_000_000)
    assert_allclose(slope_of_allan_deviation(noise, [1, 4, 16, 64]), -0.5, atol=0.01)
    # N is read off at 1 s; N in deg/sqrt(h) is N / 60 in deg/sqrt(s).
    assert_allclose(allan_deviation(noise, 2), 0.03 / 60, rtol=0.01)


def test_allan_deviation_of_the_rate_random_walk_grows_with_the_root_of_time(rng):
    # The mean over an ensemble: one walk of any length tells its Allan deviation badly.
    interval, K = 10.0, 0.4
    walks = [physics.rate_random_walk(rng.standard_normal(2000), K, interval) for _ in range(300)]
    assert all(walk[0] == 0 for walk in walks)
    tau = interval * np.array([16, 32, 64])
    measured = [
        3600 * np.sqrt(np.mean([allan_deviation(walk, n) ** 2 for walk in walks]))
        for n in (16, 32, 64)
    ]
    # K is in deg/h/sqrt(h): its deviation reads K at tau = 3 h.
    assert_allclose(measured, K * np.sqrt(tau / 3600 / 3), rtol=0.03)
    spread = 3600 * np.std([walk[-1] for walk in walks])
    assert_allclose(spread, K * np.sqrt(1999 * interval / 3600), rtol=0.1)


def test_allan_deviation_of_the_quantisation_falls_with_time(rng):
    interval, Q = 0.01, 0.8  # s, arcsec
    # Enough white noise to make the angle forget where the last step was.
    rate = 3.0 + 2.0 * rng.standard_normal(400_000)
    noise = physics.quantised(rate, Q, interval) - rate
    assert_allclose(slope_of_allan_deviation(noise, [1, 4, 16, 64]), -1.0, atol=0.02)
    for n_mean in (1, 16):
        expected = np.sqrt(3) * Q / 3600 / (n_mean * interval)
        assert_allclose(allan_deviation(noise, n_mean), expected, rtol=0.02)


def test_quantised_rate_counts_whole_increments_and_loses_no_angle(rng):
    rate = rng.normal(size=5000)
    read = physics.quantised(rate, 5.0, 0.1)
    increment = np.sqrt(12) * 5.0 / 3600
    counted = read * 0.1 / increment
    assert_allclose(counted, np.rint(counted), atol=1e-9)
    assert np.abs(np.cumsum(read - rate) * 0.1).max() <= increment / 2 + 1e-12
    assert physics.quantised(rate, 0.0, 0.1) is rate
