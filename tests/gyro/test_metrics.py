"""Every figure of merit against planted truth, in its unit."""

import numpy as np
import pytest

from skanfis.gyro.metrics import figures_of_merit, hysteresis, input_error, scale_factor

HOUR = 3600.0


def figure(name, full_scale=100.0, **columns):
    """A figure of the table, of these columns."""
    found = next(each for each in figures_of_merit(full_scale) if each.name == name)
    return found.value({key: np.asarray(column) for key, column in columns.items()})


@pytest.fixture
def table(rng):
    """A rate table's log: 21 rates at 5 temperatures, in random order."""
    rate, temperature = np.meshgrid(np.linspace(-100.0, 100.0, 21), np.linspace(-10.0, 50.0, 5))
    order = rng.permutation(rate.size)
    return rate.ravel()[order], temperature.ravel()[order]


def test_scale_factor_of_either_sign(table):
    rate, temperature = table
    assert scale_factor(rate, 62_018.6 * rate + 800.0) == pytest.approx(62_018.6)
    assert scale_factor(rate, -5.0 * rate) == pytest.approx(-5.0)
    output = np.where(rate > 0, 1.0002, 0.9998) * rate + 0.3
    assert figure("scale_factor_asymmetry", rate=rate, output=output) == pytest.approx(400.0)
    # The mean temperature is 20 degC, so that the slope is relative to the factor there.
    columns = {"rate": rate, "temperature": temperature}
    columns["output"] = 2.0 * (1 - 410e-6 * (temperature - 20.0)) * rate + 0.01 * temperature
    found = figure("scale_factor_temperature_sensitivity", **columns)
    assert found == pytest.approx(-410.0)


def test_nonlinearity_of_a_sine():
    """A sine of phase p, densely: by Legendre's expansion its cubic part is 2/5 of p^2/6 off.

    x - x^3 p^2/6 has the best line x (1 - p^2/10) and the largest deviation at x = 1,
    p^2 (1/6 - 1/10) = p^2/15, relative to the line there. P3 has the mean square 1/7.
    """
    phase, x = 0.05, np.linspace(-1.0, 1.0, 20_001)
    columns = {"rate": 100.0 * x, "output": np.sin(phase * x)}
    expected = 1e6 * phase**2 / 15
    # The outermost of 101 bins has its mean at 1 - 1/101, where the cubic falls six times as fast.
    found = figure("scale_factor_nonlinearity", **columns)
    assert found == pytest.approx(expected * (1 - 6 / 101), rel=0.005)
    root = figure("scale_factor_nonlinearity_rms", **columns)
    assert root == pytest.approx(expected / np.sqrt(7), rel=0.02)
    assert figure("scale_factor_nonlinearity", 200.0, **columns) == pytest.approx(found / 2)


def test_repeatability_is_the_spread_over_runs(table):
    rate, _ = table
    factors = np.array([1.0, 1.0002, 0.9995, 1.0001])
    output = (factors[:, None] * rate + [[0.1], [0.2], [-3.0], [0.0]]).ravel()
    run = np.repeat(["a", "b", "c", "d"], rate.size)
    columns = {"rate": np.tile(rate, 4), "output": output, "run": run}
    found = figure("scale_factor_repeatability", **columns)
    assert found == pytest.approx(1e6 * factors.std(ddof=1) / factors.mean())
    means, sizes = np.array([1.0, -2.0, 4.0]), (3, 5, 9)  # deg/h
    error, run = np.repeat(means, sizes) / HOUR, np.repeat([7, 3, 5], sizes)
    found = figure("bias_repeatability", error=error, run=run, rate=error)
    assert found == pytest.approx(means.std(ddof=1))


def test_input_error_takes_the_scale_factor_out(table):
    rate, temperature = table
    error = 0.002 + 1e-4 * (temperature - 20.0)
    np.testing.assert_allclose(input_error(rate, 3.0 * (rate + error)), error, atol=1e-13)
    at_rest = input_error(np.array([5.0, 5.0]), np.array([5.25, 4.75]))
    np.testing.assert_array_equal(at_rest, [0.25, -0.25])


def test_sensitivities_found_together_do_not_count_for_each_other():
    """On a warm-up temperature and its rate go together; alone, the one takes the other's part."""
    time = np.linspace(0.0, 3.0, 200)
    temperature, ramp = 1.0 - np.exp(-time), 0.7 * np.exp(-time) + 0.1 * np.sin(9 * time)
    error = 5.0 * ramp / HOUR
    columns = {"error": error, "temperature": temperature}
    name = "bias_temperature_sensitivity"
    assert figure(name, **columns) < -2.0
    columns["temperature_rate"] = ramp
    assert figure(name, **columns) == pytest.approx(0.0, abs=1e-9)
    assert figure("bias_ramp_sensitivity", **columns) == pytest.approx(5.0)


def test_bias_stability_of_planted_means():
    """Means over 10 s of 1, 2 and 3 deg/h, and noise within each that the means take away."""
    means, within = np.array([1.0, 2.0, 3.0]), np.tile([1.0, -1.0], 5)
    error = (means[:, None] + within).ravel() / HOUR
    time = 100.0 + np.arange(30.0)
    name, rate = "bias_stability_10s", np.zeros(30)
    assert figure(name, error=error, time=time, rate=rate) == pytest.approx(1.0)
    # Two runs: each is taken about its own mean.
    columns = {"error": np.concatenate([error, error + 1.0]), "time": np.tile(time, 2)}
    found = figure(name, **columns, run=np.repeat([0, 1], 30), rate=np.zeros(60))
    assert found == pytest.approx(1.0)


def test_hysteresis_of_a_planted_loop(rng):
    """An ellipse about a curve: its gap is largest in the middle."""
    phase = np.linspace(0.0, 2 * np.pi, 4000, endpoint=False)
    temperature, ramp = 20.0 - 30.0 * np.cos(phase), np.sin(phase)
    curve = 0.02 * temperature**2 + 0.05 * rng.normal(size=4000)
    # Bins of 3 degC: within one, the curve 0.02 T^2 and the ellipse cost less than 0.1.
    found = hysteresis((curve + 4.0 * ramp) / HOUR, temperature, ramp)
    assert found == pytest.approx(8.0, abs=0.15)
    assert hysteresis(curve / HOUR, temperature, ramp) < 0.1


INDEPENDENT = "do not change independently"
AT_REST = {"rate": [0.0, 0.0]}


@pytest.mark.parametrize(
    ("name", "columns", "message"),
    [
        ("scale_factor_error", {"rate": [1, 1], "output": [1, 2]}, "the rate is 1 deg/s in all"),
        ("scale_factor_asymmetry", {"rate": [1, 2], "output": [1, 2]}, "different negative rates"),
        (
            "scale_factor_temperature_sensitivity",
            {"rate": [1, 2, 3], "output": [1, 2, 3], "temperature": [5, 5, 5]},
            INDEPENDENT,
        ),
        (
            "bias_ramp_sensitivity",
            {"error": [1, 2, 3], "temperature_rate": [1, 2, 3], "temperature": [2, 4, 6]},
            INDEPENDENT,
        ),
        ("bias_temperature_sensitivity", {"error": [1, 2], "temperature": [5, 5]}, "never changes"),
        ("bias_repeatability", {"error": [1, 2], "run": [0, 0], **AT_REST}, "There is 1 run"),
        ("bias_stability_10s", {"error": [1, 2], "time": [1, 1], **AT_REST}, "time must increase"),
        ("bias_stability_10s", {"error": [1, 2], "time": [0, 60], **AT_REST}, "are 60 s apart"),
        ("bias_stability_10s", {"error": [1, 2], "time": [0, 1], **AT_REST}, "as long as two"),
        (
            "hysteresis",
            {"error": [1, 2], "temperature": [1, 2], "temperature_rate": [1, 1]},
            "does not both rise and fall",
        ),
        (
            "hysteresis",
            {"error": [1, 2], "temperature": [1, 2], "temperature_rate": [1, -1]},
            "share no temperature",
        ),
    ],
)
def test_what_cannot_be_found_is_said(name, columns, message):
    with pytest.raises(ValueError, match=message):
        figure(name, **columns)
