"""The formula that is printed is the law that is fitted."""

import re

import numpy as np
import pytest

from skanfis.datasets import make_ofog
from skanfis.gyro import OpenLoopArcsineRegressor
from skanfis.gyro._calibration import Recipe
from skanfis.gyro._formulas import law_text


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
