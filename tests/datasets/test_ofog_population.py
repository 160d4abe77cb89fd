"""Devices within their tolerances, runs over the whole range, rates on their levels."""

from dataclasses import fields

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.datasets._ofog_population import (
    Device,
    RateTable,
    check_phase,
    draw_devices,
    draw_runs,
    nominal_device,
    with_noise,
)


@pytest.fixture
def random_state():
    return np.random.RandomState(3)


def _values(devices, name):
    return np.array([getattr(device, name) for device in devices])


def test_devices_fill_their_tolerances_and_not_more(random_state):
    devices = draw_devices(Device(), 2000, 1.0, random_state)
    factors = _values(devices, "sagnac_factor") / 0.2536 - 1
    assert_allclose([factors.min(), factors.max()], [-0.02, 0.02], atol=1e-4)
    assert_allclose(factors.std(), 0.02 / np.sqrt(3), rtol=0.05)
    scale_factors = _values(devices, "scale_factor")  # nominally zero: an absolute tolerance
    assert_allclose([scale_factors.min(), scale_factors.max()], [-500, 500], atol=5)
    assert set(_values(devices, "bias_repeatability")) == {1.0}


def test_coefficients_of_a_device_are_independent(random_state):
    devices = draw_devices(Device(), 2000, 1.0, random_state)
    spread = [e.name for e in fields(Device) if np.ptp(_values(devices, e.name)) > 0]
    correlations = np.corrcoef([_values(devices, name) for name in spread])
    assert np.abs(correlations - np.eye(len(spread))).max() < 0.1


def test_without_spread_every_device_is_nominal(random_state):
    nominal = nominal_device({"warm_up": 12.0})
    assert draw_devices(nominal, 2, 0.0, random_state) == [nominal, nominal]


def test_nominal_device_takes_the_coefficients_given():
    assert nominal_device(None) == Device()
    assert nominal_device({"bias": 3, "thermometer_lag": 0}) == Device(
        bias=3.0, thermometer_lag=0.0
    )


@pytest.mark.parametrize(
    ("coefficients", "error", "message"),
    [
        ({"warmup": 1.0}, ValueError, r"unknown names \['warmup'\]; known are .*'warm_up'"),
        ({"warm_up": "1"}, TypeError, r"coefficients\['warm_up'\] must be an instance of float"),
        ({"warm_up": float("inf")}, ValueError, "must be finite"),
        ({"warm_up_time": 0.0}, ValueError, r"coefficients\['warm_up_time'\] == 0.0, must be > 0"),
        ({"thermometer_lag": -1.0}, ValueError, "must be >= 0"),
        ({"sagnac_temperature": -3000}, ValueError, "must be >= -2000"),
        ([("warm_up", 1.0)], TypeError, "must be a dict of names to numbers, not list"),
    ],
)
def test_refuses_coefficients_without_meaning(coefficients, error, message):
    with pytest.raises(error, match=message):
        nominal_device(coefficients)


def test_each_part_of_the_ambient_range_holds_one_run_of_each_device(random_state):
    runs = draw_runs([Device()] * 3, 7, 1, (-20.0, 50.0), 0.5, random_state)
    for device_id in range(3):
        ambients = [run.ambient for run in runs if run.device_id == device_id]
        assert sorted((np.array(ambients) + 20) // 10) == list(range(7))
        assert ambients != sorted(ambients)


def test_runs_differ_in_residual_heat_and_bias(random_state):
    devices = [Device(bias_repeatability=4.0)] * 500
    runs = draw_runs(devices, 4, 2, (20.0, 20.0), 0.5, random_state)
    heats = np.array([run.residual_heat for run in runs])
    assert_allclose([heats.min(), heats.mean(), heats.max()], [0, 0.25, 0.5], atol=0.01)
    # Every power-up of a run has a bias of its own.
    biases = np.array([run.biases for run in runs])
    assert_allclose(biases.std(axis=0), 4.0, rtol=0.05)
    assert abs(np.corrcoef(biases.T)[0, 1]) < 0.05
    assert_allclose(np.mean([run.rising for run in runs]), 0.5, atol=0.05)
    assert {run.ambient for run in runs} == {20.0}


def test_every_rate_is_held_once_before_any_comes_again(random_state):
    levels = np.linspace(-100, 100, 5)
    rate = RateTable(levels, 100.0, 4, "random").draw(4 * 13 - 1, random_state)
    assert rate.size == 51
    dwells = [rate[start : start + 4] for start in range(0, 51, 4)]
    assert all(np.ptp(dwell) == 0 for dwell in dwells)
    order = np.array([dwell[0] for dwell in dwells])
    assert_array_equal(np.sort(order[:10].reshape(2, 5), axis=1), [levels, levels])
    assert not np.array_equal(order[:5], order[5:10])


def test_rates_in_a_sweep_go_up_and_down_again(random_state):
    levels = np.array([-10.0, 0.0, 10.0])
    rate = RateTable(levels, 10.0, 2, "sweep").draw(17, random_state)
    assert_array_equal(rate[::2], [-10, 0, 10, 0, -10, 0, 10, 0, -10])
    assert_array_equal(rate[1::2], rate[:-1:2])
    free = RateTable(None, 10.0, 1, "sweep").draw(100, random_state)
    steps = np.diff(free)
    assert (steps[:49] > 0).all()
    assert (steps[50:] < 0).all()


def test_one_rate_is_held_for_ever(random_state):
    for order in ("random", "sweep"):
        rate = RateTable(np.array([38.69]), 38.69, 3, order).draw(100, random_state)
        assert_array_equal(rate, 38.69)


def test_rates_without_levels_fill_the_range_and_never_come_again(random_state):
    rate = RateTable(None, 100.0, 12, "random").draw(12 * 40, random_state)
    dwells = rate[::12]
    assert_array_equal(np.repeat(dwells, 12), rate)
    assert np.unique(dwells).size == 40
    assert sorted((dwells + 100) // 5) == list(range(40))
    assert not np.array_equal(dwells, np.sort(dwells))


def test_factor_on_the_noise_leaves_what_is_systematic_alone():
    device = Device(thermometer_noise=0.1)
    silent, louder = with_noise(device, 0.0), with_noise(device, 3.0)
    assert silent.angle_random_walk == silent.quantisation == silent.bias_repeatability == 0
    assert silent.bias_instability == silent.rate_random_walk == silent.thermometer_noise == 0
    assert (louder.angle_random_walk, louder.thermometer_noise) == pytest.approx((0.15, 0.3))
    assert with_noise(silent, 1.0) == silent
    changed = {e.name for e in fields(Device) if getattr(silent, e.name) != getattr(device, e.name)}
    assert "correlation_time" not in changed
    assert len(changed) == 6


def test_phase_is_refused_exactly_where_a_device_reaches_a_quarter_turn():
    device = Device(sagnac_temperature=0.0)
    limit = 90.0 / 0.2536
    check_phase(device, 0.0, np.nextafter(limit, 0) - 1e-9, (-20.0, 50.0), "max_rate")
    with pytest.raises(ValueError, match=r"must be < 354\.9 deg/s: .*arcsine is not defined"):
        check_phase(device, 0.0, limit, (-20.0, 50.0), "max_rate")


def test_phase_limit_holds_for_the_whole_population(random_state):
    with pytest.raises(ValueError, match=r"must be < 341\.7 deg/s"):
        check_phase(Device(), 1.0, 400.0, (-20.0, 50.0), "max_rate")
    largest = 0.0
    for device in draw_devices(Device(), 2000, 1.0, random_state):
        for coil in (-20.0, 50.0 + device.self_heating):
            factor = 1 + 1e-6 * device.sagnac_temperature * (coil - 25)
            largest = max(largest, factor * device.sagnac_factor)
    assert 0.97 * np.pi / 2 < largest * np.deg2rad(341.7) < np.pi / 2
