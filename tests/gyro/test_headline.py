"""What is proven of a compensation, against what was planted; the formula printed is the law."""

import re
from functools import cache

import numpy as np
import pytest

from skanfis.datasets import make_ofog
from skanfis.gyro import OpenLoopArcsineRegressor, _headline
from skanfis.gyro._calibration import Recipe
from skanfis.gyro._headline import flagged_text, law_text, proven_bounds, rules_text

from .planted import NOISE, calibrated, evaluated, log_of

pytestmark = pytest.mark.usefixtures("given_weights", "few_rivals")


@cache
def a_line(gain=1.001, **options):
    """Rules for an error that is a line of the temperature, and a scale factor."""
    log = log_of(lambda t, r: 0.005 + 1e-3 * t + (gain - 1.0) * r, n_runs=12, n_rows=40, seed=3)
    return calibrated(log, n_folds=4, write="rules", terms=(1, 1), **options)


def test_largest_compensation_of_a_line_is_that_of_its_corner():
    """Within the range of the calibration, a line is largest at a corner of the box."""
    calibration = a_line()
    largest, rate_rises = proven_bounds(calibration)
    # error = output - rate, as a line in temperature and output.
    heat, output = np.meshgrid(*calibration.X.agg(["min", "max"]).to_numpy().T)
    corner = np.abs(output - (output - 0.005 - 1e-3 * heat) / 1.001).max()
    assert largest == pytest.approx(corner, rel=1e-3)
    assert rate_rises is True


def test_the_text_of_the_rules_gives_what_they_give():
    """Read with a pencil: off by less than a hundredth of the noise."""
    calibration = a_line()
    text = rules_text(calibration)
    sentence = " ".join(text[text.index("THEN error") :].partition("\n\n")[0].split())
    value = float(re.search(r"is about (\S+?)[:.]? ", f"{sentence} ")[1])
    for slope, name, place in re.findall(r"([+-]\S+) per (\w+) from ([-.e\d]*\d)", sentence):
        value = value + float(slope) * (calibration.X[name] - float(place))
    off = value - calibration.model.predict(calibration.X)
    assert np.sqrt(np.mean(off**2)) < 0.01 * NOISE
    assert "digits" not in text


@pytest.mark.parametrize("write", ["rules", "constant"])
def test_the_text_says_how_the_rate_follows_from_the_output_even_if_it_is_no_input(write):
    log = log_of(lambda t, r: -132.0 * r + 7.0)
    options = {"write": write, "terms": (1,), "output_unit": "counts"}
    calibration = calibrated(log, inputs=("temperature",), **options)
    units, text = rules_text(calibration).split("\n\n", 1)
    assert units.endswith("temperature in degC, output in counts.")
    factor = calibration.compensator.scale_factor
    assert text.startswith(f"rate = output / {factor:.9g} - error\n")
    assert ("The rules give the error:" in text) == (write == "rules")


def test_what_speaks_against_reading_is_told_in_lines_that_fit(monkeypatch):
    found = ["Rules go different ways: " + "by temperature up in rule 0, " * 9]
    monkeypatch.setattr(_headline, "against_reading", lambda calibration: found)
    text = rules_text(a_line())
    assert "What speaks against reading" in text
    assert max(map(len, text.split("\n"))) <= 100


def test_flagged_rows_are_counted_by_the_input_to_blame():
    calibration = a_line()
    X, counts = calibration.X, dict.fromkeys(calibration.X, 0)
    for train, test in calibration.split.folds:
        for name in X:
            reached = X[name].iloc[train]
            counts[name] += (~X[name].iloc[test].between(reached.min(), reached.max())).sum()
    most_first = sorted(counts, key=counts.get, reverse=True)
    named = ", ".join(f"{name} in {counts[name]}" for name in most_first)
    assert min(counts.values()) > 0
    assert f"were flagged ({named})." in flagged_text(calibration)


@pytest.mark.parametrize(("unit", "gain"), [("deg/s", -0.5), ("counts", -131.0)])
def test_rate_goes_with_the_output_or_is_not_proven(unit, gain):
    """An axis mounted the other way round: its scale factor's sign is found of counts alone."""
    assert proven_bounds(a_line(gain, output_unit=unit))[1] is (unit == "counts")


def computed(text, columns):
    """What a reader of the law's first line computes, units aside."""
    plain = re.sub(r" \[[^]]*\]| s(?= \*)", "", text.splitlines()[0])
    rate, _, t = re.sub(r"(?<=\d) t", " * t", plain).partition(", t = ")
    return evaluated(f"t = {t or 0}\n{rate}", columns)["rate"]


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"temperature": None},
        {"amplitude_degree": 3, "bias_degree": 0},
        {"temperature_rate": "thermal_rate"},
    ],
)
def test_the_formula_is_the_law(options):
    log = make_ofog(n_devices=1, n_runs=4, duration=1800, sampling_interval=30, random_state=0)
    X = log.assign(thermal_rate=np.gradient(log["temperature"]) / 30.0)
    X = X[["time", "output", "temperature", "thermal_rate"]]
    law = OpenLoopArcsineRegressor("output", **{"temperature": "temperature"} | options)
    law.fit(X, log["rate"])
    text = law_text(law, Recipe(tuple(X), "counts"))
    assert text.startswith("rate [deg/s] = arcsin(output [counts]")
    assert ("s * thermal_rate [degC/s]" in text) == ("temperature_rate" in options)
    assert text.endswith("Beyond a phase (the arcsin) of 1.2 rad the phase is held there.")
    values = {name: X[name].to_numpy() for name in X}
    np.testing.assert_allclose(computed(text, values), law.predict(X), rtol=1e-6, atol=1e-5)
