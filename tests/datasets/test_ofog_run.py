"""One power-up: its limits, where all effects but one are off."""

from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.datasets._ofog_chamber import Schedule, thermal_history
from skanfis.datasets._ofog_population import Device, Run
from skanfis.datasets._ofog_run import RANDOM_BIASES, simulate_power_up

TIME = 5.0 * np.arange(720)
RATE = np.repeat(np.linspace(-120, 120, 9), 80)
NO_NORMALS = np.zeros((4, TIME.size))
# Those that are no size of an effect stay: an interferometer without them is none.
STRUCTURAL = {"amplitude", "sagnac_factor", "warm_up_time", "thermal_time", "correlation_time"}
IDEAL = replace(Device(), **{e.name: 0.0 for e in fields(Device) if e.name not in STRUCTURAL})


def simulate(device, *, ambient=20.0, residual_heat=0.0, bias=0.0, normals=NO_NORMALS, rate=RATE):
    """Measurement and parts of the error at a constant ambient temperature."""
    run = Run(device, 0, ambient, True, residual_heat, (bias,))
    schedule = Schedule(TIME.size, 5.0, 1, 0, "constant", (ambient, ambient), 5)
    (temperatures,) = thermal_history(run, schedule)
    return simulate_power_up(device, bias, TIME, rate, temperatures, normals, 5.0)


def test_ideal_gyro_obeys_the_arcsine_law():
    measured, parts = simulate(IDEAL)
    sine = 0.2536 * np.deg2rad(measured["output"])
    assert_allclose(np.rad2deg(np.arcsin(sine) / 0.2536), RATE, atol=1e-11)
    assert_array_equal(measured["error"], parts["nonlinearity"])
    assert not measured["noise"].any()
    for name, values in parts.items():
        assert name == "nonlinearity" or not values.any()


@pytest.mark.parametrize(
    ("coefficient", "part"),
    [
        ({"scale_factor": 500.0}, "scale_factor"),
        ({"sagnac_temperature": -370.0}, "wavelength"),
        ({"amplitude_temperature": -40.0}, "amplitude"),
        ({"amplitude_curvature": -0.5}, "amplitude"),
        ({"warm_up_scale_factor": 200.0}, "warm_up_scale_factor"),
        ({"bias": 10.0}, "bias"),
        ({"bias_temperature": 0.5}, "bias_temperature"),
        ({"bias_temperature_curvature": 0.01}, "bias_temperature"),
        ({"warm_up": 30.0}, "warm_up"),
        ({"bias_temperature_rate": 5.0, "self_heating": 10.0}, "bias_temperature_rate"),
        ({"bias_instability": 0.5}, "bias_instability"),
        ({"rate_random_walk": 0.3}, "rate_random_walk"),
        ({"angle_random_walk": 0.05}, "angle_random_walk"),
        ({"quantisation": 0.5}, "quantisation"),
    ],
)
def test_each_coefficient_acts_in_its_own_part_alone(coefficient, part):
    normals = np.random.RandomState(0).standard_normal((4, TIME.size))
    measured, parts = simulate(replace(IDEAL, **coefficient), normals=normals)
    acting = {name for name, values in parts.items() if np.abs(values).max() > 1e-12}
    assert acting == {"nonlinearity", part}
    assert_allclose(measured["error"] - parts["nonlinearity"], parts[part], rtol=1e-9, atol=1e-12)


def test_parts_add_up_to_the_error_even_where_effects_are_large():
    # A bias of 10 deg/s makes the sine's curvature felt within the bias itself.
    device = replace(Device(), bias=36_000.0, warm_up=-20_000.0, scale_factor=5e4)
    normals = np.random.RandomState(0).standard_normal((4, TIME.size))
    measured, parts = simulate(device, ambient=60.0, residual_heat=0.3, bias=3.0, normals=normals)
    assert_array_equal(measured["error"], measured["output"] - measured["rate"])
    assert_allclose(sum(parts.values()), measured["error"], atol=1e-12)


def test_net_temperature_coefficient_of_the_scale_factor():
    # Small-signal slope over 10 degC, by two rates close to rest; the gyro does not heat itself.
    device = replace(IDEAL, sagnac_temperature=-370.0, amplitude_temperature=-40.0)
    rate = 0.1 * np.sign(TIME - TIME.mean())
    slopes = []
    for ambient in (20.0, 30.0):
        output = simulate(device, ambient=ambient, rate=rate)[0]["output"]
        slopes.append((output[-1] - output[0]) / 0.2)
    assert_allclose((slopes[1] - slopes[0]) / 10.0, -410e-6, rtol=1e-3)


def test_gyro_at_rest_shows_its_bias():
    device = replace(IDEAL, bias=7.0, warm_up=30.0)
    measured, _ = simulate(device, bias=-2.0)
    rest = RATE == 0
    expected = 7.0 - 2.0 + 30.0 * np.exp(-TIME[rest] / 180.0)
    assert_allclose(measured["output"][rest] * 3600, expected, rtol=1e-9)


def test_noise_is_what_a_perfect_compensation_leaves():
    # With every systematic coefficient known, the arcsine inverts the law; noise is all that stays.
    device = replace(Device(), quantisation=3.0, bias_repeatability=1.0)
    normals = np.random.RandomState(0).standard_normal((4, TIME.size))
    measured, parts = simulate(device, bias=2.0, normals=normals)
    silent = replace(device, **dict.fromkeys(RANDOM_BIASES, 0.0), angle_random_walk=0.0)
    _, known = simulate(replace(silent, quantisation=0.0))
    relative_factor = 1 - 370e-6 * (_coil_of(device) - 25)
    amplitude = 1 + 1e-6 * (_coil_of(device) - 25) * (-40 - 0.5 * (_coil_of(device) - 25))
    amplitude = amplitude * (1 + 200e-6 * np.exp(-TIME / 180))
    factor = 0.2536 * relative_factor
    phase = np.arcsin(0.2536 * np.deg2rad(measured["output"]) / amplitude)
    bias = 0.5 * (_coil_of(device) - 25) + 0.01 * (_coil_of(device) - 25) ** 2
    bias = bias + 30 * np.exp(-TIME / 180) + 5 * 60 * (35 - _coil_of(device)) / 1200
    compensated = np.rad2deg(phase / factor) - bias / 3600
    assert known["bias"].any() == bool(device.bias)
    noise = np.sqrt(np.mean(measured["noise"] ** 2))
    assert_allclose(compensated - RATE, measured["noise"], atol=1e-5 * noise)
    assert noise > np.sqrt(np.mean(parts["angle_random_walk"] ** 2))


def _coil_of(device):
    return 20.0 + device.self_heating * (1 - np.exp(-TIME / device.thermal_time))


def test_thermometer_is_as_noisy_as_asked_for_and_its_rate_is_not():
    normals = np.random.RandomState(0).standard_normal((4, TIME.size))
    quiet, _ = simulate(Device(), normals=normals)
    noisy, _ = simulate(replace(Device(), thermometer_noise=0.2), normals=normals)
    assert_allclose(noisy["temperature"] - quiet["temperature"], 0.2 * normals[3], atol=1e-12)
    assert_array_equal(noisy["temperature_rate"], quiet["temperature_rate"])
    assert_array_equal(noisy["output"], quiet["output"])


def test_run_in_thermal_equilibrium_has_no_bias_by_the_rate_of_temperature():
    measured, parts = simulate(Device(), residual_heat=1.0)
    assert_allclose(parts["bias_temperature_rate"], 0.0, atol=1e-15)
    assert_allclose(measured["temperature"], 35.0, rtol=1e-13)
