"""Temperatures of chamber, coil and thermometer against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.datasets._ofog_chamber import Schedule, ambient_temperature, thermal_history
from skanfis.datasets._ofog_population import Device, Run

SCHEDULE = Schedule(720, 5.0, 1, 0, "constant", (-20.0, 60.0), 5)
DEVICE = Device(self_heating=15.0, thermal_time=1200.0, thermometer_lag=180.0)


def run(device=DEVICE, *, ambient=10.0, rising=True, residual_heat=0.0, n_power_ups=1):
    return Run(device, 0, ambient, rising, residual_heat, (0.0,) * n_power_ups)


def test_thermometer_follows_the_coil_with_two_time_constants():
    ((_, coil, _, thermometer, _),) = thermal_history(run(residual_heat=0.4), SCHEDULE)
    slow, fast = np.exp(-SCHEDULE.time / 1200), np.exp(-SCHEDULE.time / 180)
    assert_allclose(coil, 25.0 - 15 * 0.6 * slow, rtol=1e-12)
    expected = 25.0 - 15 * 0.6 * (1200 * slow - 180 * fast) / (1200 - 180)
    assert_allclose(thermometer, expected, atol=2e-3)  # first-order hold of a curve
    assert thermometer[0] == 16.0


@pytest.mark.parametrize("thermometer_lag", [0.0, 180.0])
@pytest.mark.parametrize("profile", ["constant", "ramps"])
def test_rates_are_the_derivatives_of_the_temperatures(profile, thermometer_lag):
    schedule = replace(SCHEDULE, n_samples=7200, sampling_interval=0.5, profile=profile)
    device = replace(DEVICE, thermometer_lag=thermometer_lag)
    ((_, coil, coil_rate, thermometer, thermometer_rate),) = thermal_history(run(device), schedule)
    for temperature, rate in ((coil, coil_rate), (thermometer, thermometer_rate)):
        # The ramp turns once; there the derivative of the coil has a kink.
        assert_allclose(np.gradient(temperature, 0.5)[1:-1], rate[1:-1], atol=1e-5)


def test_temperature_of_the_coil_follows_from_the_thermometer_and_its_rate():
    history = thermal_history(run(residual_heat=0.7), replace(SCHEDULE, profile="ramps"))
    ((_, coil, _, thermometer, thermometer_rate),) = history
    assert_allclose(thermometer + 180.0 * thermometer_rate, coil, rtol=1e-12)


def test_ramps_go_up_and_down_the_whole_range_from_where_they_start():
    schedule = replace(SCHEDULE, profile="ramps")
    for rising in (True, False):
        ambient = ambient_temperature(schedule, schedule.time, 10.0, rising)
        assert ambient[0] == pytest.approx(10.0)
        assert (ambient[1] > ambient[0]) == rising
        assert [ambient.min(), ambient.max()] == pytest.approx([-20.0, 60.0], abs=0.3)
        # 80 degC up and 80 down in an hour
        speeds = np.abs(np.diff(ambient)) / 5.0
        assert np.median(speeds) == pytest.approx(160.0 / 3600.0)
    end = ambient_temperature(schedule, np.array([schedule.period]), 10.0, True)
    assert end[0] == pytest.approx(10.0)


def test_soaks_rest_at_equally_spaced_temperatures():
    schedule = replace(SCHEDULE, profile="soaks", n_soaks=5)
    ambient = ambient_temperature(schedule, schedule.time, 10.0, True)
    temperatures, n_samples = np.unique(ambient, return_counts=True)
    assert_allclose(temperatures, [-20, 0, 20, 40, 60])
    # The ends are met once on the way up and down, the others twice.
    assert_allclose(n_samples, [90, 180, 180, 180, 90], atol=2)


def test_a_range_of_one_temperature_is_constant_whatever_the_profile():
    for profile in ("constant", "soaks", "ramps"):
        schedule = replace(SCHEDULE, profile=profile, ambient_range=(21.0, 21.0))
        ambient = ambient_temperature(schedule, schedule.time, 21.0, True)
        assert_array_equal(ambient, 21.0)


def test_later_power_ups_begin_as_warm_as_the_off_time_leaves_the_gyro():
    schedule = replace(SCHEDULE, n_power_ups=3, n_off=120)
    histories = list(thermal_history(run(n_power_ups=3), schedule))
    assert len(histories) == 3
    on, off = np.exp(-3600 / 1200), np.exp(-600 / 1200)
    heat = 0.0
    for _, coil, _, thermometer, _ in histories:
        assert coil[0] == pytest.approx(10.0 + heat, rel=1e-12)
        # The thermometer lags: it is still warmer when the coil has cooled.
        assert (thermometer[0] > coil[0]) == (heat > 0)
        heat = (15.0 - (15.0 - heat) * on) * off


def test_without_off_time_power_ups_go_on_where_the_last_one_stopped():
    whole = replace(SCHEDULE, n_samples=1440)
    halves = replace(SCHEDULE, n_power_ups=2)
    ((_, coil, _, thermometer, _),) = thermal_history(run(), whole)
    parts = list(thermal_history(run(n_power_ups=2), halves))
    assert_allclose(np.concatenate([part[1] for part in parts]), coil, rtol=1e-12)
    assert_allclose(np.concatenate([part[3] for part in parts]), thermometer, rtol=1e-12)


def test_the_chamber_goes_on_while_the_gyro_is_off():
    schedule = replace(SCHEDULE, profile="ramps", n_power_ups=2, n_off=120)
    first, second = thermal_history(run(n_power_ups=2), schedule)
    clock = np.array([3600.0 + 600.0])
    assert second[0][0] == ambient_temperature(schedule, clock, 10.0, True)[0]
    assert second[0][0] != first[0][0]
