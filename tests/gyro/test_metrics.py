"""Every figure of merit against planted truth, in its unit; N, B and K of known noise."""

import sys
from importlib.util import find_spec

import numpy as np
import pytest

from skanfis.gyro import _options, html_report
from skanfis.gyro.metrics import (
    ALLAN_FIGURES,
    LARGEST_VALUES,
    SIZES_WITH_NOISE,
    allan_deviation,
    allan_figures,
    figures_of_merit,
    hysteresis,
    input_error,
    rows_of_bias,
    scale_factor,
)

HOUR = 3600.0
TAU = 2.0 ** np.arange(16)
needs_allantools = pytest.mark.skipif(not find_spec("allantools"), reason="it is not installed")


def figure(name, full_scale=100.0, **columns):
    """A figure of the table, of these columns."""
    found = next(each for each in figures_of_merit(full_scale) if each.name == name)
    if "error" in columns:
        columns.setdefault("of_bias", np.ones(len(columns["error"]), dtype=bool))
    return found.value({key: np.asarray(column) for key, column in columns.items()})


@pytest.fixture
def table(rng):
    """A rate table's log: 21 rates at 5 temperatures, in random order."""
    rate, temperature = np.meshgrid(np.linspace(-100.0, 100.0, 21), np.linspace(-10.0, 50.0, 5))
    order = rng.permutation(rate.size)
    return rate.ravel()[order], temperature.ravel()[order]


def test_what_is_said_of_a_figure_by_its_name_is_said_of_one_that_there_is():
    said = {*LARGEST_VALUES, *SIZES_WITH_NOISE, *_options._AT_LEAST}
    said |= {*html_report._FIRST, *html_report._TERMS}
    assert said <= {each.name for each in figures_of_merit()} | ALLAN_FIGURES.keys()


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
    # A run without rows at rest has no bias beside that of the others.
    error, run, of_bias = np.append(error, 9.0), np.append(run, 8), np.arange(18) < 17
    columns = {"rate": error, "error": error, "run": run}
    found = figure("bias_repeatability", **columns, of_bias=of_bias)
    assert found == pytest.approx(means.std(ddof=1))
    with pytest.raises(ValueError, match="it takes two runs or more"):
        figure("bias_repeatability", **columns, of_bias=~of_bias)


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
    # A scale factor that changes with temperature, and its cube, are no bias.
    rate = rng.uniform(-100.0, 100.0, size=4000)
    curve += HOUR * (1e-4 * temperature * rate - 1e-6 * rate**3)
    # Bins of 3 degC: within one, the curve 0.02 T^2 and the ellipse cost less than 0.1.
    found = hysteresis(rate, (curve + 4.0 * ramp) / HOUR, temperature, ramp)
    assert found == pytest.approx(8.0, abs=0.15)
    assert hysteresis(rate, curve / HOUR, temperature, ramp) < 0.1


def read(tau, deviation):
    """Values, and notes where there are such."""
    found = allan_figures(*np.array([tau, deviation], dtype=float))
    values = {name: value for name, (value, _) in found.items()}
    return values, {name: note for name, (_, note) in found.items() if note}


def test_planted_curve_is_read_back():
    """sigma^2 = N^2/tau + (0.664 B)^2 + K^2 tau/3, with the parts far apart."""
    n, b, k = 0.05, 0.1, 0.5  # deg/sqrt(h), deg/h, deg/h/sqrt(h)
    tau_h = TAU / HOUR
    variance = n**2 / tau_h + 2 * np.log(2) / np.pi * b**2 + k**2 * tau_h / 3
    values, notes = read(TAU, np.sqrt(variance))
    # Neighbouring parts lift the points of a slope a little.
    assert values["angle_random_walk"] == pytest.approx(n, rel=0.01)
    assert values["rate_random_walk"] == pytest.approx(k, rel=0.01)
    assert values["allan_minimum"] == pytest.approx(np.sqrt(variance.min()))
    flicker = np.sqrt(2 * np.log(2) / np.pi)
    assert values["bias_instability"] == pytest.approx(values["allan_minimum"] / flicker)
    assert notes == {}


def test_the_random_walk_of_white_noise_is_right_on_average(rng):
    walks = []
    for noise in 0.01 * rng.normal(size=(20, 3600)):  # deg/s, every second
        curve = allan_deviation(noise, np.arange(3600.0))
        tau, deviation = (curve[name].to_numpy() for name in ("averaging_time", "deviation"))
        walks.append(allan_figures(tau, HOUR * deviation)["angle_random_walk"][0])
    assert np.mean(walks) == pytest.approx(0.6, rel=0.01)


def test_what_falls_behind_a_hump_is_no_white_noise():
    """White noise beside steps, which lift the curve at the time of a dwell and fall behind it."""
    white, steps = 180.0 / TAU, np.zeros(TAU.size)
    steps[5:] = 4e4 / (TAU[5:] / TAU[5]) ** 1.0
    values, _ = read(TAU, np.sqrt(white + steps))
    assert values["angle_random_walk"] == pytest.approx(np.sqrt(180.0) / 60.0, rel=1e-9)
    values, notes = read(TAU[4:], np.sqrt(white + steps)[4:])
    assert np.isnan(values["angle_random_walk"])
    assert notes["angle_random_walk"] == "no slope of -1/2"


def test_pure_slopes_are_exact_and_a_figure_that_is_not_there_is_said():
    values, notes = read(TAU, 60.0 * 0.05 / np.sqrt(TAU))
    assert values.pop("angle_random_walk") == pytest.approx(0.05, rel=1e-12)
    assert np.isnan(list(values.values())).all()
    assert "still falls at its longest averaging time, 32768 s" in notes["bias_instability"]
    assert notes["rate_random_walk"] == "no slope of +1/2"
    values, notes = read(TAU, 3.0 * np.sqrt(TAU / HOUR / 3))
    assert values.pop("rate_random_walk") == pytest.approx(3.0, rel=1e-12)
    assert np.isnan(list(values.values())).all()
    assert "rises from its shortest averaging time, 1 s" in notes["allan_minimum"]
    assert np.isnan(read(TAU, TAU)[0]["rate_random_walk"])
    with pytest.raises(ValueError, match="has 2 points"):
        read([1, 2], [1, 2])
    with pytest.raises(ValueError, match="deviation must be positive; its smallest value is 0"):
        read([1, 2, 4], [1, 0, 3])


def test_without_allantools_the_way_to_get_it_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "allantools", None)
    with pytest.raises(ImportError, match="pip install allantools"):
        allan_deviation(np.zeros(10), np.arange(10.0))


@needs_allantools
def test_the_allan_deviation_is_that_of_its_definition(rng):
    """sigma^2(m h) = mean (y_{k+m} - y_k)^2 / 2 over all means y_k of m neighbours."""
    drift = rng.normal(size=300).cumsum()
    curve = allan_deviation(drift, 0.5 * np.arange(300))
    np.testing.assert_array_equal(curve["averaging_time"], [0.5, 1.0, 2.0, 4.0, 8.0])
    for m, deviation in zip((1, 2, 4, 8, 16), curve["deviation"], strict=True):
        means = np.convolve(drift, np.ones(m) / m, mode="valid")
        differences = means[m:] - means[:-m]
        assert deviation == pytest.approx(np.sqrt(np.mean(differences**2) / 2))


@needs_allantools
def test_runs_are_not_joined_by_the_allan_deviation(rng):
    """A step between two runs is no noise; their curve is the mean of the variances."""
    one, other = rng.normal(size=(2, 512))
    run = np.repeat([0, 1], 512)
    time = np.arange(1024.0)
    joined = allan_deviation(np.concatenate([one, other + 100.0]), time, run)
    single = [allan_deviation(each, time[:512])["deviation"] for each in (one, other)]
    np.testing.assert_allclose(joined["deviation"], np.hypot(*single) / np.sqrt(2))


@needs_allantools
@pytest.mark.parametrize("n_runs", [1, 4])
def test_the_error_of_an_allan_deviation_is_its_spread(n_runs, rng):
    """Over 200 logs of white noise, at the shortest and at the longest time."""
    run = np.repeat(np.arange(n_runs), 640)
    time = np.arange(float(run.size))
    curves = [allan_deviation(rng.normal(size=run.size), time, run) for _ in range(200)]
    spread = np.std([curve["deviation"] for curve in curves], axis=0)
    told = np.sqrt(np.mean([curve["error"] ** 2 for curve in curves], axis=0))
    np.testing.assert_allclose(told / spread, 1.0, atol=0.4)


@needs_allantools
def test_runs_too_short_for_an_allan_deviation_are_refused():
    with pytest.raises(ValueError, match="nowhere do 10 rows in range follow evenly"):
        allan_deviation(np.zeros(18), np.arange(18.0), np.repeat([0, 1], 9))


RISING = {name: [1, 2] for name in ("rate", "output", "error", "temperature")}
STILL = {"rate": [0, 0]}


@pytest.mark.parametrize(
    ("name", "columns", "message"),
    [
        ("scale_factor_error", {"rate": [1, 1]}, "the rate is 1 deg/s in all"),
        ("scale_factor_asymmetry", {}, "different negative rates"),
        ("scale_factor_temperature_sensitivity", {"temperature": [5, 5]}, "change independently"),
        ("bias_ramp_sensitivity", {"temperature_rate": [1, 2]}, "do not change independently"),
        ("bias_temperature_sensitivity", {"temperature": [5, 5]}, "never changes"),
        ("bias_stability_10s", {"time": [1, 1]} | STILL, "time must increase"),
        ("bias_stability_10s", {"time": [0, 60]} | STILL, "are 60 s apart"),
        ("bias_stability_10s", {"time": [0, 1]} | STILL, "too long for a run"),
        ("hysteresis", {"temperature_rate": [1, 1]} | STILL, "does not both rise and fall"),
        ("hysteresis", {"temperature_rate": [1, -1]} | STILL, "share no temperature"),
    ],
)
def test_what_cannot_be_found_is_said(name, columns, message):
    with pytest.raises(ValueError, match=message):
        figure(name, **RISING | columns)


def test_the_bias_is_of_the_rows_at_rest_where_there_are_some():
    rate = np.repeat([-100.0, -50.0, 0.0, 50.0, 100.0], 10)
    output = np.where(rate > 0.0, 1.0015, 1.0005) * rate + 5.0 / HOUR
    error = input_error(rate, output)
    # An asymmetry moves the line, not the output at rest.
    found = figure("bias", error=error, of_bias=rows_of_bias(rate))
    assert found == pytest.approx(5.0, rel=1e-2)
    moving = rate != 0.0
    # Nor do errors of the scale factor at other temperatures change those of the bias.
    columns = {"temperature": np.tile(np.arange(10.0), 5), "of_bias": rows_of_bias(rate)}
    columns["error"] = (1e-6 * rate**2 + 2.0 / HOUR) * columns["temperature"]
    assert figure("bias_temperature_sensitivity", **columns) == pytest.approx(2.0)
    # Rows at rest at one temperature tell no slope: those of all have the mean 5000 of rate**2.
    columns["of_bias"] &= columns["temperature"] < 1.0
    assert figure("bias_temperature_sensitivity", **columns) == pytest.approx(20.0)
    of_line = figure("bias", error=error[moving], of_bias=rows_of_bias(rate[moving]))
    assert of_line == pytest.approx(HOUR * error[moving].mean(), rel=1e-12)
    assert of_line > 50.0
