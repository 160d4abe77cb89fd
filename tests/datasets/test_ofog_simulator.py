"""The simulated experiment as a whole: what a user meets in the table."""

from dataclasses import fields
from time import perf_counter

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.datasets import load_ofog, make_ofog
from skanfis.datasets._ofog_population import Device

PARTS = [
    "nonlinearity",
    "scale_factor",
    "wavelength",
    "amplitude",
    "warm_up_scale_factor",
    "bias",
    "bias_temperature",
    "warm_up",
    "bias_temperature_rate",
    "bias_repeatability",
    "bias_instability",
    "rate_random_walk",
    "angle_random_walk",
    "quantisation",
]


@pytest.fixture(scope="module")
def data():
    return make_ofog(random_state=0)


def test_parts_add_up_to_the_error(data):
    assert list(data.columns[12:]) == PARTS
    assert_array_equal(data["error"], data["output"] - data["rate"])
    assert_allclose(data[PARTS].sum(axis=1), data["error"], atol=1e-12)


def test_sizes_of_the_parts_are_those_of_a_tactical_gyro(data):
    largest = data[PARTS].abs().max()
    # sin(phi) / phi at 100 deg/s: 3.2 % of 100 deg/s, the Sagnac factor being known to 2 %.
    assert_allclose(largest["nonlinearity"], 3.23, rtol=0.05)
    # 370 and 40 ppm/degC over some 25 to 45 degC from the reference
    assert 0.8 < largest["wavelength"] < 2.0
    assert 0.08 < largest["amplitude"] < 0.4
    assert 0.01 < largest["warm_up_scale_factor"] < 0.03
    assert largest["scale_factor"] < 500e-6 * 100
    in_degrees_per_hour = 3600 * largest
    for name, low, high in [
        ("bias", 1, 15),
        ("bias_temperature", 10, 80),
        ("warm_up", 20, 45),
        ("bias_temperature_rate", 1, 10),
        ("bias_repeatability", 1, 4),
        ("bias_instability", 0.5, 5),
        ("rate_random_walk", 0.2, 2),
        ("angle_random_walk", 1, 10),
        ("quantisation", 0.05, 0.3),
    ]:
        assert low < in_degrees_per_hour[name] < high


def test_runs_of_devices_are_numbered_without_repeats(data):
    runs = data.groupby("run")["device"].agg(["nunique", "first", "size"])
    assert_array_equal(runs["first"], np.repeat([0, 1, 2], 8))
    assert set(runs["nunique"]) == {1}
    assert set(runs["size"]) == {360}
    for _, run in data.groupby("run"):
        assert_allclose(run["time"], 10.0 * np.arange(360))


def test_rates_are_the_levels_asked_for_in_every_run():
    few = make_ofog(n_rate_levels=11, random_state=0)
    for _, run in few.groupby("run"):
        assert_allclose(np.unique(run["rate"]), np.linspace(-100, 100, 11), atol=1e-12)
    given = make_ofog(rates=[30.0, 0.0, -2.5], random_state=0)
    assert_array_equal(np.unique(given["rate"]), [-2.5, 0.0, 30.0])
    assert set(make_ofog(rates=[0], random_state=0)["rate"]) == {0.0}


def test_by_default_no_two_runs_share_a_rate(data):
    runs_per_rate = data.groupby("rate")["run"].nunique()
    assert set(runs_per_rate) == {1}
    for _, run in data.groupby("run"):
        assert run["rate"].min() < -90
        assert run["rate"].max() > 90


def test_counts_obey_the_sine_of_the_gyro_measured():
    data = make_ofog(
        n_devices=1,
        n_runs=1,
        noise=0.0,
        device_spread=0.0,
        ambient_range=(10.0, 10.0),
        max_residual_heat=0.0,
        coefficients={"warm_up": 0, "warm_up_scale_factor": 0, "bias_temperature": 0}
        | {"bias_temperature_curvature": 0, "bias_temperature_rate": 0, "self_heating": 15.0}
        | {"thermal_time": 1e-3},
        random_state=0,
    )
    # Warm at once: at 25 degC from the second row on.
    data = data[data["time"] > 0]
    expected = 6.29e6 * np.sin(0.2536 * np.deg2rad(data["rate"]))
    assert_allclose(data["counts"], expected, rtol=1e-9)


def test_power_ups_are_numbered_without_repeats_and_begin_at_time_zero():
    data = make_ofog(n_devices=2, n_runs=3, n_power_ups=4, duration=900.0, random_state=0)
    power_ups = data.groupby("power_up").agg(
        runs=("run", "nunique"), run=("run", "first"), start=("time", "min"), rows=("time", "size")
    )
    assert len(power_ups) == 24
    assert set(power_ups["runs"]) == {1}
    assert_array_equal(power_ups["run"], np.repeat(np.arange(6), 4))
    assert set(power_ups["start"]) == {0.0}
    assert set(power_ups["rows"]) == {90}
    # One turn-on bias each, and one ambient temperature for a run.
    at_rest = data["bias_repeatability"].groupby(data["power_up"]).median()
    assert at_rest.nunique() == 24
    assert set(data.groupby("run")["ambient"].nunique()) == {1}


def test_linearised_gyro_leaves_1000_ppm():
    data = make_ofog(
        preset="linearised",
        n_devices=1,
        n_runs=1,
        duration=72_000.0,
        device_spread=0.0,
        noise=0.0,
        random_state=0,
    )
    assert data["rate"].abs().max() > 370
    best_line = np.polynomial.Polynomial.fit(data["rate"], data["nonlinearity"], 1)
    left = data["nonlinearity"] - best_line(data["rate"])
    assert_allclose(np.sqrt(np.mean(left**2)) / 375.0, 1000e-6, rtol=0.02)


def test_conditions_of_the_paper_give_a_table_like_its_own():
    paper = make_ofog(preset="paper", n_devices=1, device_spread=0.0, random_state=0)
    printed = load_ofog().data
    assert set(paper.groupby("run").size()) == {len(printed)}
    assert_array_equal(paper.loc[paper["run"] == 0, "time"], printed["time"])
    assert_allclose(paper["rate"].mean(), printed["rate"].mean(), atol=0.3)
    assert_allclose(paper["temperature"].mean(), printed["temperature"].mean(), atol=0.2)
    assert_allclose(paper["temperature"].std(), printed["temperature"].std(), rtol=0.3)
    warm, output = paper["time"] > 0, load_ofog().target
    assert_allclose(paper["output"][warm].mean(), np.median(output), atol=0.01)
    assert_allclose(paper["output"][~warm].mean(), output[0], atol=0.02)


def test_table_is_made_in_seconds():
    start = perf_counter()
    data = make_ofog(n_devices=1, n_runs=2, duration=1e6, random_state=0)
    assert len(data) == 200_000
    # A million rows take some 1.2 s on one core: a loop over rows would not do.
    assert perf_counter() - start < 5.0


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
    random_parts = PARTS[9:]
    assert not quiet[[*random_parts, "noise"]].any(axis=None)
    assert_array_equal(
        noisy[["time", "temperature", "rate"]], quiet[["time", "temperature", "rate"]]
    )
    # The noise within the sine moves the gain of the other biases by far less than itself.
    assert_allclose(noisy[PARTS[:9]], quiet[PARTS[:9]], atol=1e-8)
    louder = make_ofog(**small, noise=3.0)
    assert_allclose(louder["angle_random_walk"], 3 * noisy["angle_random_walk"], rtol=1e-12)
    nominal = make_ofog(**small, device_spread=0.0, coefficients={"warm_up": 0.0})
    assert_array_equal(nominal["rate"], noisy["rate"])
    assert not nominal["warm_up"].any()


@pytest.mark.theory
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
    """A gyro without noise, whose error depends on the coil's temperature alone."""
    without_others = {"warm_up": 0.0, "warm_up_scale_factor": 0.0, "bias_temperature_rate": 0.0}
    return make_ofog(
        n_devices=1,
        n_runs=12,
        sampling_interval=5.0,
        rates=[100.0],
        device_spread=0.0,
        noise=0.0,
        coefficients=without_others | coefficients,
        random_state=1,
    )


def test_lag_makes_the_error_many_valued_in_the_indicated_temperature():
    in_step = _one_rate_of_a_quiet_device(thermometer_lag=0.0)
    lagging = _one_rate_of_a_quiet_device()
    assert _residual_of_a_smooth_law(in_step["temperature"], in_step["error"]) < 1e-9
    assert _residual_of_a_smooth_law(lagging["temperature"], lagging["error"]) > 0.01


def test_rate_of_temperature_makes_it_single_valued_again():
    lagging = _one_rate_of_a_quiet_device()
    coil = lagging["temperature"] + 180.0 * lagging["temperature_rate"]
    many_valued = _residual_of_a_smooth_law(lagging["temperature"], lagging["error"])
    assert _residual_of_a_smooth_law(coil, lagging["error"]) < 1e-6 * many_valued


def test_effects_of_time_make_it_many_valued_even_without_a_lag():
    # At 25 degC, in runs that pass it early, late, cooling or warming.
    warming_up = _one_rate_of_a_quiet_device(thermometer_lag=0.0, warm_up_scale_factor=200.0)
    shupe = _one_rate_of_a_quiet_device(thermometer_lag=0.0, bias_temperature_rate=20.0)
    for data in (warming_up, shupe):
        assert _residual_of_a_smooth_law(data["temperature"], data["error"]) > 5e-4


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
        ({"preset": "mems"}, ValueError, "preset must be one of 'open_loop', 'linearised', 'pap"),
        ({"profile": "oven"}, ValueError, "profile must be one of 'constant', 'soaks', 'ramps'"),
        ({"rate_order": "up"}, ValueError, "rate_order must be one of 'random', 'sweep'"),
        ({"n_power_ups": 0}, ValueError, "n_power_ups == 0, must be >= 1"),
        ({"off_time": -1.0}, ValueError, "off_time == -1.0, must be >= 0"),
        ({"n_soaks": 1}, ValueError, "n_soaks == 1, must be >= 2"),
        ({"rates": []}, ValueError, "rates must be a list of finite rates"),
        ({"rates": 5.0}, ValueError, "rates must be a list of finite rates"),
        ({"rates": [0.0, float("nan")]}, ValueError, "rates must be a list of finite rates"),
        ({"rates": [-400.0]}, ValueError, r"largest of abs\(rates\) == 400.0, must be < 341"),
        ({"rates": [0.0], "max_rate": 5.0}, ValueError, r"together with \['max_rate'\]"),
        ({"preset": "linearised", "sampling_interval": -1}, ValueError, "must be > 0"),
    ],
)
def test_refuses_parameters_without_meaning(parameters, error, message):
    with pytest.raises(error, match=message):
        make_ofog(**parameters)
