"""The simulated experiment as a whole: what a user meets in the table."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.datasets import make_ofog
from skanfis.datasets._ofog import _POPULATION

SYSTEMATIC = [
    *("nonlinearity", "scale_factor", "wavelength", "amplitude", "warm_up_scale_factor"),
    *("bias", "bias_temperature", "warm_up", "bias_temperature_rate"),
]
RANDOM = [
    *("bias_repeatability", "bias_instability", "rate_random_walk", "angle_random_walk"),
    "quantisation",
]


def test_rates_are_the_levels_asked_for_in_every_run_or_of_one_dwell_alone():
    for _, run in make_ofog(rates=[30.0, 0.0, -2.5], random_state=0).groupby("run"):
        assert_array_equal(np.unique(run["rate"]), [-2.5, 0.0, 30.0])
    data = make_ofog(random_state=0)
    assert set(data.groupby("rate")["run"].nunique()) == {1}
    assert (data["rate"].groupby(data["run"]).agg(np.ptp) > 180.0).all()


def test_counts_obey_the_sine_of_the_gyro_measured():
    none = ("warm_up", "warm_up_scale_factor", "bias_temperature", "bias_temperature_curvature")
    own = dict.fromkeys((*none, "bias_temperature_rate"), 0.0)
    own |= {"self_heating": 15.0, "thermal_time": 1e-3}
    still = {"noise": 0.0, "device_spread": 0.0, "max_residual_heat": 0.0}
    one = {"n_devices": 1, "n_runs": 1, "ambient_range": (10.0, 10.0), "random_state": 0}
    data = make_ofog(**one, **still, coefficients=own)
    # Warm at once: at 25 degC from the second row on.
    data = data[data["time"] > 0]
    expected = 6.29e6 * np.sin(0.2536 * np.deg2rad(data["rate"]))
    assert_allclose(data["counts"], expected, rtol=1e-9)


def test_power_ups_are_numbered_without_repeats_and_begin_at_time_zero():
    data = make_ofog(n_devices=2, n_runs=3, n_power_ups=4, duration=900.0, random_state=0)
    power_ups = data.groupby("power_up")
    for run in (power_ups["run"].min(), power_ups["run"].max()):
        assert_array_equal(run, np.arange(24) // 4)
    assert set(power_ups["time"].min()) == {0.0}
    assert_array_equal(power_ups.size(), [90] * 24)
    # One turn-on bias each, and one ambient temperature for a run.
    assert power_ups["bias_repeatability"].median().nunique() == 24
    assert set(data.groupby("run")["ambient"].nunique()) == {1}


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
    assert not quiet[[*RANDOM, "noise"]].any(axis=None)
    given = ["time", "temperature", "rate"]
    assert_array_equal(noisy[given], quiet[given])
    # The noise within the sine moves the gain of the other biases by far less than itself.
    assert_allclose(noisy[SYSTEMATIC], quiet[SYSTEMATIC], atol=1e-8)
    louder = make_ofog(**small, noise=3.0)
    assert_allclose(louder["angle_random_walk"], 3 * noisy["angle_random_walk"], rtol=1e-12)
    nominal = make_ofog(**small, device_spread=0.0, coefficients={"warm_up": 0.0})
    assert_array_equal(nominal["rate"], noisy["rate"])
    assert not nominal["warm_up"].any()


def test_documentation_lists_every_coefficient_with_its_nominal_value():
    page = Path(__file__).parents[2] / "docs" / "gyro_simulator.rst"
    rows = [line.split() for line in page.read_text(encoding="utf-8").splitlines()]
    listed = {row[0]: row[1] for row in reversed(rows) if len(row) > 3}
    for name, (nominal, *_) in _POPULATION.items():
        assert float(listed[name]) == nominal


def test_devices_fill_their_tolerances_and_not_more():
    many = {"n_devices": 400, "n_runs": 1, "duration": 10.0, "random_state": 3, "rates": [100.0]}
    data = make_ofog(**many, coefficients={"scale_factor": 1000.0})
    known = make_ofog(**many, device_spread=0.0, noise=0.0)
    scale = 1e6 * data["scale_factor"] / (100.0 + data["nonlinearity"])
    assert_allclose([scale.min(), scale.max()], [500.0, 1500.0], atol=10.0)
    bias = 3600 * data["bias"] / (data["bias"] / (10 / 3600)).abs().max()
    assert_allclose([bias.min(), bias.max()], [-10, 10], rtol=0.05)
    assert abs(np.corrcoef(scale, bias)[0, 1]) < 0.15
    assert known["scale_factor"].nunique() == 1


def test_each_part_of_the_ambient_range_holds_one_run_of_each_device():
    data = make_ofog(n_runs=7, duration=10.0, random_state=3)
    for _, device in data.groupby("device"):
        ambients = device.groupby("run")["ambient"].first()
        assert sorted((ambients + 20) // 10) == list(range(7))
        assert not ambients.is_monotonic_increasing


def dwells_of(**options):
    small = {"n_devices": 1, "n_runs": 1, "sampling_interval": 1.0, "dwell_time": 4.0}
    rate = make_ofog(**small, random_state=0, **options)["rate"].to_numpy()
    assert_array_equal(np.repeat(rate[::4], 4)[: rate.size], rate)
    return rate[::4]


def test_every_rate_is_held_once_before_any_comes_again():
    levels = np.linspace(-100, 100, 5)
    order = dwells_of(duration=51.0, rates=levels)
    assert_array_equal(np.sort(order[:10].reshape(2, 5), axis=1), [levels, levels])
    assert not np.array_equal(order[:5], order[5:10])
    # Without levels they fill the range and never come again.
    order = dwells_of(duration=160.0)
    assert sorted((order + 100) // 5) == list(range(40))
    assert not np.array_equal(order, np.sort(order))


def test_phase_is_refused_exactly_where_a_device_reaches_a_quarter_turn():
    small = {"n_devices": 1, "n_runs": 1, "duration": 10.0}
    nominal = {"device_spread": 0.0, "coefficients": {"sagnac_temperature": 0.0}}
    limit = 90.0 / 0.2536
    make_ofog(**small, **nominal, max_rate=np.nextafter(limit, 0) - 1e-9)
    with pytest.raises(ValueError, match=r"must be < 354\.9 deg/s: .*arcsine is not defined"):
        make_ofog(**small, **nominal, max_rate=limit)
    with pytest.raises(ValueError, match=r"must be < 341\.7 deg/s"):
        make_ofog(**small, max_rate=400.0)


def test_sampling_keeps_to_the_durations_asked_for():
    short = {"duration": 0.3, "sampling_interval": 0.1, "dwell_time": 0.1}
    data = make_ofog(n_devices=1, n_runs=1, **short, random_state=0)
    assert_allclose(data["time"], [0.0, 0.1, 0.2])


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"n_devices": 0}, r"'n_devices' .* int in the range \[1, inf\). Got 0"),
        ({"duration": 5.0}, r"duration=5.0 must be at least the sampling_interval, 10.0 s"),
        ({"max_rate": 350.0}, "arcsine is not defined"),
        ({"dwell_time": 1.0}, "dwell_time=1.0 must be at least"),
        ({"ambient_range": 20.0}, "ambient_range=20.0 must be two temperatures"),
        ({"ambient_range": ("a", "b")}, r"=\('a', 'b'\) must be two temperatures"),
        ({"ambient_range": (30.0, 20.0)}, r"=\(30.0, 20.0\) must be .* that do not fall"),
        ({"ambient_range": (-200.0, 20.0)}, "from -60 or more to 100 degC"),
        ({"max_residual_heat": 1.1}, r"in the range \[0.*, 1.*\]. Got 1.1"),
        ({"noise": float("nan")}, "'noise' .* Got nan"),
        ({"coefficients": {"gain": 1}}, r"unknown names \['gain'\]; known are .*'warm_up'"),
        ({"coefficients": {"warm_up": "1"}}, "'warm_up' parameter of make_ofog's coefficients"),
        ({"coefficients": {"sagnac_temperature": -3000}}, "Got -3000"),
        ({"random_state": "seed"}, "cannot be used to seed"),
        ({"profile": "oven"}, "'profile' .* must be a str among"),
        ({"rates": [0.0, float("nan")]}, "rates must be a list of finite rates"),
        ({"rates": [-400.0]}, "largest rate is 400.0 and must be < 341"),
        ({"rates": [0.0], "max_rate": 5.0}, "together with max_rate"),
    ],
)
def test_refuses_parameters_without_meaning(parameters, message):
    with pytest.raises(ValueError, match=message):
        make_ofog(**parameters)
