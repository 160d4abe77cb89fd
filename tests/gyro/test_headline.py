"""What is proven of a compensation, against what was planted; the formula printed is the law."""

import re
from functools import cache

import numpy as np
import pandas as pd
import pytest

from skanfis.datasets import make_ofog
from skanfis.gyro import OpenLoopArcsineRegressor
from skanfis.gyro._calibration import Recipe, calibrate
from skanfis.gyro._headline import flagged_text, law_text, proven_bounds, rules_text
from skanfis.gyro._split import choose_split

pytestmark = pytest.mark.usefixtures("given_weights", "few_rivals")

N_RUNS, N_ROWS = 12, 40
NOISE, SCATTER = 2e-4, 5e-4


def calibrated(error, gain=1.0, scatter=SCATTER, **options):
    """Runs that are off by a bias each, of a gyro with an error of temperature and rate."""
    rng = np.random.default_rng(3)
    run = np.repeat(np.arange(N_RUNS), N_ROWS)
    temperature = rng.uniform(0.0, 50.0, run.size)
    rate = rng.uniform(-100.0, 100.0, run.size)
    off = scatter * rng.normal(size=N_RUNS)[run] + NOISE * rng.normal(size=run.size)
    output = gain * rate + error(temperature) + off
    columns = {"run": run, "temperature": temperature, "rate": rate, "output": output}
    log = pd.DataFrame(columns)
    recipe = Recipe(("temperature", "output"), write="rules", terms=(1, 1), **options)
    return calibrate(log, choose_split(log, "run"), recipe, lambda text: None)


@cache
def a_line():
    return calibrated(lambda t: 0.005 + 1e-3 * t, gain=1.001, scatter=0.0)


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


def test_flagged_rows_are_counted_by_the_input_to_blame():
    calibration = a_line()
    X, labels, counts = calibration.X, calibration.split.labels, {}
    for name in X:
        # The rows beyond all that the other folds' runs reach.
        folds = [(np.isin(labels, labels[test]), test) for _, test in calibration.split.folds]
        ends = [(X[name][~own].min(), X[name][~own].max(), test) for own, test in folds]
        counts[name] = sum((~X[name].iloc[test].between(*at)).sum() for *at, test in ends)
    named = ", ".join(
        f"{name} in {counts[name]}" for name in sorted(counts, key=lambda name: -counts[name])
    )
    assert min(counts.values()) > 0
    assert f"were flagged ({named})." in flagged_text(calibration)


@pytest.mark.parametrize(("unit", "gain"), [("deg/s", -0.5), ("counts", -131.0)])
def test_rate_goes_with_the_output_or_is_not_proven(unit, gain):
    """An axis mounted the other way round: its scale factor's sign is found of counts alone."""
    calibration = calibrated(lambda t: 1e-3 * t, gain=gain, output_unit=unit)
    assert proven_bounds(calibration)[1] is (unit == "counts")


def computed(text, columns):
    """What a reader of the first line computes."""
    formula, _, temperature = text.splitlines()[0].partition(", t = ")
    t, right = 0.0, formula.split(" = ")[1]

    def evaluate(expression):
        plain = re.sub(r" \[[^]]*\]| s (?=\*)", lambda unit: " " * (unit[0] == " s "), expression)
        plain = re.sub(r"(?<=[0-9]) t", " * t", plain).replace("^", "**")
        return eval(plain, {"arcsin": np.arcsin, "t": t, **columns})

    if temperature:
        t = evaluate(temperature)
    return evaluate(right)


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
