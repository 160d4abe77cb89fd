"""The simulated experiment as a whole: what a user meets in the table."""

from dataclasses import fields

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.datasets import make_ofog
from skanfis.datasets._ofog_population import Device

PARTS = [
    "nonlinearity",
    "scale_factor",
    "scale_factor_temperature",
    "bias",
    "bias_temperature",
    "warm_up",
    "thermal_rate",
    "bias_instability",
    "angle_random_walk",
]


@pytest.fixture(scope="module")
def data():
    return make_ofog(random_state=0)


def test_parts_add_up_to_the_error(data):
    assert list(data.columns[7:]) == PARTS
    assert_array_equal(data["error"], data["output"] - data["rate"])
    assert_allclose(data[PARTS].sum(axis=1), data["error"], atol=1e-12)


def test_sizes_of_the_parts_are_those_of_a_tactical_gyro(data):
    largest = data[PARTS].abs().max()
    # sin(phi) / phi at 100 deg/s: 3.2 % of 100 deg/s, the Sagnac factor being known to 2 %.
    assert_allclose(largest["nonlinearity"], 3.23, rtol=0.05)
    # 410 ppm/degC over some 25 to 45 degC from the reference
    assert 0.8 < largest["scale_factor_temperature"] < 2.0
    assert largest["scale_factor"] < 500e-6 * 100
    in_degrees_per_hour = 3600 * largest
    for name, low, high in [
        ("bias", 1, 15),
        ("bias_temperature", 10, 80),
        ("warm_up", 20, 45),
        ("thermal_rate", 1, 10),
        ("bias_instability", 0.5, 5),
        ("angle_random_walk", 1, 10),
    ]:
        assert low < in_degrees_per_hour[name] < high


def test_runs_of_devices_are_numbered_without_repeats(data):
    runs = data.groupby("run")["device"].agg(["nunique", "first", "size"])
    assert_array_equal(runs["first"], np.repeat([0, 1, 2], 8))
    assert set(runs["nunique"]) == {1}
    assert set(runs["size"]) == {360}
    for _, run in data.groupby("run"):
        assert_allclose(run["time"], 10.0 * np.arange(360))


def test_rates_are_levels_of_both_signs_in_every_run(data):
    levels = np.linspace(-100, 100, 401)
    few = make_ofog(n_rate_levels=11, random_state=0)
    for _, run in data.groupby("run"):
        assert run["rate"].min() < 0 < run["rate"].max()
        assert np.abs(run["rate"].to_numpy()[:, None] - levels).min(axis=1).max() < 1e-9
    for _, run in few.groupby("run"):
        assert_allclose(np.unique(run["rate"]), levels[::40], atol=1e-12)


def test_coefficients_are_of_the_device_and_scale_factor_depends_on_nothing_else(data):
    ratio = data["scale_factor"] / (data["rate"] + data["nonlinearity"]).where(data["rate"] != 0)
    per_device = ratio.groupby(data["device"]).agg(["min", "max"])
    assert_allclose(per_device["min"], per_device["max"], rtol=1e-9)
    assert per_device["min"].nunique() == 3


def test_same_seed_same_table_another_seed_another():
    small = {"n_devices": 2, "n_runs": 2, "duration": 600.0}
    first, again = make_ofog(**small, random_state=5), make_ofog(**small, random_state=5)
    pd.testing.assert_frame_equal(first, again, check_exact=True)
    state = np.random.RandomState(5)
    pd.testing.assert_frame_equal(first, make_ofog(**small, random_state=state), check_exact=True)
    assert not np.allclose(first["output"], make_ofog(**small, random_state=6)["output"])


def test_seed_fixes_the_experiment_whatever_the_noise_and_the_devices():
    small = {"n_runs": 3, "duration": 900.0, "random_state": 2}
    noisy = make_ofog(**small)
    quiet = make_ofog(**small, noise=0.0)
    random_parts = ["bias_instability", "angle_random_walk"]
    assert not quiet[random_parts].any(axis=None)
    assert_array_equal(
        noisy[["time", "temperature", "rate"]], quiet[["time", "temperature", "rate"]]
    )
    # The noise within the sine moves the gain of the other biases by far less than itself.
    assert_allclose(noisy[PARTS[:-2]], quiet[PARTS[:-2]], atol=1e-8)
    louder = make_ofog(**small, noise=3.0)
    assert_allclose(louder["angle_random_walk"], 3 * noisy["angle_random_walk"], rtol=1e-12)
    nominal = make_ofog(**small, device_spread=0.0, coefficients={"warm_up": 0.0})
    assert_array_equal(nominal["rate"], noisy["rate"])
    assert not nominal["warm_up"].any()


def test_angle_random_walk_of_a_mean_falls_with_the_root_of_time():
    # The mean over a time t has the deviation N / sqrt(t).
    noise = make_ofog(
        n_devices=1,
        n_runs=1,
        duration=4e6,
        sampling_interval=10.0,
        device_spread=0.0,
        coefficients={"angle_random_walk": 0.1},
        random_state=0,
    )["angle_random_walk"].to_numpy()
    for hours, tolerance in ((1 / 360, 0.01), (0.1, 0.03), (1.0, 0.1)):
        means = noise[: noise.size // 360 * 360].reshape(-1, round(hours * 360)).mean(axis=1)
        assert_allclose(3600 * means.std(), 0.1 / np.sqrt(hours), rtol=tolerance)


def _residual_of_a_smooth_law(temperature, error):
    """What no single-valued smooth function of the temperature explains [deg/s]."""
    law = np.polynomial.Chebyshev.fit(temperature, error, 6)
    return np.sqrt(np.mean((error - law(temperature)) ** 2))


def _one_rate_of_a_quiet_device(**coefficients):
    without_others = {"bias_repeatability": 0.0, "warm_up": 0.0, "thermal_rate": 0.0}
    data = make_ofog(
        n_devices=1,
        n_runs=12,
        sampling_interval=5.0,
        n_rate_levels=11,
        device_spread=0.0,
        noise=0.0,
        coefficients=without_others | coefficients,
        random_state=1,
    )
    return data[data["rate"] == 100.0]


def test_lag_makes_the_error_many_valued_in_the_indicated_temperature():
    in_step = _one_rate_of_a_quiet_device(thermometer_lag=0.0)
    lagging = _one_rate_of_a_quiet_device()
    assert _residual_of_a_smooth_law(in_step["temperature"], in_step["error"]) < 1e-9
    assert _residual_of_a_smooth_law(lagging["temperature"], lagging["error"]) > 0.01


def test_rate_of_temperature_change_makes_it_single_valued_again():
    lagging = _one_rate_of_a_quiet_device()
    whole = make_ofog(
        n_devices=1,
        n_runs=12,
        sampling_interval=5.0,
        n_rate_levels=11,
        device_spread=0.0,
        noise=0.0,
        coefficients={"bias_repeatability": 0.0, "warm_up": 0.0, "thermal_rate": 0.0},
        random_state=1,
    )
    slope = whole.groupby("run")["temperature"].transform(lambda T: np.gradient(T, 5.0))
    inner = lagging[(lagging["time"] > 0) & (lagging["time"] < 3595)]
    coil = inner["temperature"] + 180.0 * slope[inner.index]
    many_valued = _residual_of_a_smooth_law(inner["temperature"], inner["error"])
    assert _residual_of_a_smooth_law(coil, inner["error"]) < 1e-3 * many_valued


def test_documentation_lists_every_coefficient_with_its_nominal_value():
    rows = [line.split() for line in make_ofog.__doc__.splitlines()]
    listed = {row[0]: row[1] for row in rows if len(row) > 3}
    for entry in fields(Device):
        assert float(listed[entry.name]) == entry.default


def test_sampling_keeps_to_the_durations_asked_for():
    data = make_ofog(
        n_devices=1, n_runs=1, duration=0.3, sampling_interval=0.1, dwell_time=0.1, random_state=0
    )
    assert_allclose(data["time"], [0.0, 0.1, 0.2])
    data = make_ofog(n_devices=1, n_runs=1, duration=100.0, sampling_interval=30.0, random_state=0)
    assert_allclose(data["time"], [0.0, 30.0, 60.0])


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"n_devices": 0}, ValueError, "n_devices == 0, must be >= 1"),
        ({"n_devices": 2.0}, TypeError, "n_devices must be an instance of int"),
        ({"n_runs": True}, TypeError, "n_runs must be an instance of int, not bool"),
        ({"duration": 5.0}, ValueError, r"duration == 5.0, must be >= 10.0"),
        ({"duration": float("inf")}, ValueError, "duration == inf, must be finite"),
        ({"sampling_interval": 0.0}, ValueError, "sampling_interval == 0.0, must be > 0"),
        ({"max_rate": 350.0}, ValueError, "arcsine is not defined"),
        ({"max_rate": -1.0}, ValueError, "max_rate == -1.0, must be > 0"),
        ({"n_rate_levels": 1}, ValueError, "n_rate_levels == 1, must be >= 2"),
        ({"dwell_time": 1.0}, ValueError, "dwell_time == 1.0, must be >= 10.0"),
        ({"ambient_range": 20.0}, ValueError, "ambient_range must be two temperatures"),
        ({"ambient_range": (30.0, 20.0)}, ValueError, r"ambient_range\[1\] == 20.0, must be >= 30"),
        ({"ambient_range": (-200.0, 20.0)}, ValueError, r"ambient_range\[0\] == -200.0"),
        ({"max_residual_heat": 1.1}, ValueError, "max_residual_heat == 1.1, must be <= 1"),
        ({"noise": float("nan")}, ValueError, "noise == nan, must be finite"),
        ({"device_spread": "all"}, TypeError, "device_spread must be an instance of float"),
        ({"coefficients": {"gain": 1}}, ValueError, "unknown names"),
        ({"random_state": "seed"}, ValueError, "cannot be used to seed"),
    ],
)
def test_refuses_parameters_without_meaning(parameters, error, message):
    with pytest.raises(error, match=message):
        make_ofog(**parameters)
