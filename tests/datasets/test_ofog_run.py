"""One run: its limits, where all effects but one are off."""

from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.datasets._ofog_population import Device, Run
from skanfis.datasets._ofog_run import simulate_run

TIME = 5.0 * np.arange(720)
RATE = np.repeat(np.linspace(-120, 120, 9), 80)
NO_NORMALS = np.zeros((2, TIME.size))
MEASUREMENT = ["time", "temperature", "rate", "output", "error"]
# Those that are no size of an effect stay: an interferometer without them is none.
STRUCTURAL = {"sagnac_factor", "warm_up_time", "thermal_time", "correlation_time"}
IDEAL = replace(Device(), **{e.name: 0.0 for e in fields(Device) if e.name not in STRUCTURAL})


def simulate(device, *, ambient=20.0, residual_heat=0.0, bias=0.0, normals=NO_NORMALS):
    return simulate_run(Run(device, 0, ambient, residual_heat, bias), TIME, RATE, normals, 5.0)


def parts(columns):
    return {name: values for name, values in columns.items() if name not in MEASUREMENT}


def test_ideal_gyro_obeys_the_arcsine_law():
    columns = simulate(IDEAL)
    sine = 0.2536 * np.deg2rad(columns["output"])
    assert_allclose(np.rad2deg(np.arcsin(sine) / 0.2536), RATE, atol=1e-11)
    assert_array_equal(columns["error"], columns["nonlinearity"])
    for name, values in parts(columns).items():
        assert name == "nonlinearity" or not values.any()


@pytest.mark.parametrize(
    ("coefficient", "part"),
    [
        ({"scale_factor": 500.0}, "scale_factor"),
        ({"sagnac_temperature": -370.0}, "scale_factor_temperature"),
        ({"amplitude_temperature": -40.0}, "scale_factor_temperature"),
        ({"amplitude_curvature": -0.5}, "scale_factor_temperature"),
        ({"bias": 10.0}, "bias"),
        ({"bias_temperature": 0.5}, "bias_temperature"),
        ({"bias_temperature_curvature": 0.01}, "bias_temperature"),
        ({"warm_up": 30.0}, "warm_up"),
        ({"thermal_rate": 5.0, "self_heating": 10.0}, "thermal_rate"),
        ({"bias_instability": 0.5}, "bias_instability"),
        ({"angle_random_walk": 0.05}, "angle_random_walk"),
    ],
)
def test_each_coefficient_acts_in_its_own_part_alone(coefficient, part):
    normals = np.random.RandomState(0).standard_normal((2, TIME.size))
    columns = simulate(replace(IDEAL, **coefficient), normals=normals)
    acting = {name for name, values in parts(columns).items() if np.abs(values).max() > 1e-12}
    assert acting == {"nonlinearity", part}
    assert_allclose(
        columns["error"] - columns["nonlinearity"], columns[part], rtol=1e-9, atol=1e-12
    )


def test_parts_add_up_to_the_error_even_where_effects_are_large():
    # A bias of 10 deg/s makes the sine's curvature felt within the bias itself.
    device = replace(Device(), bias=36_000.0, warm_up=-20_000.0, scale_factor=5e4)
    normals = np.random.RandomState(0).standard_normal((2, TIME.size))
    columns = simulate(device, ambient=60.0, residual_heat=0.3, bias=3.0, normals=normals)
    assert_array_equal(columns["error"], columns["output"] - columns["rate"])
    assert_allclose(sum(parts(columns).values()), columns["error"], atol=1e-12)


def test_net_temperature_coefficient_of_the_scale_factor():
    # Small-signal slope over 10 degC, by two rates close to rest; the gyro does not heat itself.
    device = replace(IDEAL, sagnac_temperature=-370.0, amplitude_temperature=-40.0)
    rate = 0.1 * np.sign(TIME - TIME.mean())
    slopes = []
    for ambient in (20.0, 30.0):
        run = Run(device, 0, ambient, 0.0, 0.0)
        output = simulate_run(run, TIME, rate, NO_NORMALS, 5.0)["output"]
        slopes.append((output[-1] - output[0]) / 0.2)
    assert_allclose((slopes[1] - slopes[0]) / 10.0, -410e-6, rtol=1e-3)


def test_gyro_at_rest_shows_its_bias():
    device = replace(IDEAL, bias=7.0, warm_up=30.0)
    columns = simulate(device, bias=-2.0)
    rest = RATE == 0
    expected = 7.0 - 2.0 + 30.0 * np.exp(-TIME[rest] / 180.0)
    assert_allclose(columns["output"][rest] * 3600, expected, rtol=1e-9)


def test_thermometer_follows_the_coil_with_two_time_constants():
    device = replace(IDEAL, self_heating=15.0, thermometer_lag=180.0)
    temperature = simulate(device, ambient=10.0, residual_heat=0.4)["temperature"]
    slow, fast = np.exp(-TIME / 1200), np.exp(-TIME / 180)
    expected = 25.0 - 15 * 0.6 * (1200 * slow - 180 * fast) / (1200 - 180)
    assert_allclose(temperature, expected, atol=2e-3)  # first-order hold of a curve
    assert temperature[0] == 16.0


def test_run_in_thermal_equilibrium_has_no_thermal_rate():
    columns = simulate(Device(), residual_heat=1.0)
    assert_allclose(columns["thermal_rate"], 0.0, atol=1e-15)
    assert_allclose(columns["temperature"], 35.0, rtol=1e-13)
