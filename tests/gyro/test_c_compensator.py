"""A compensator as C: what its header says of the output, the units, and how inputs are made."""

from skanfis.gyro import GyroCompensator, ResidualRegressor
from skanfis.gyro.c_compensator import export_c_compensator
from skanfis.gyro.compensator import features

from ..export.c_compiler import told
from ..quick import quick
from .test_c_code import COUNTS, LAW, simulated


def test_header_of_a_compensator_says_units_and_how_inputs_are_made(tmp_path):
    log = simulated()
    inputs = ("time", "temperature", "temperature_rate", "output")
    X = features(log, inputs, 25.0)
    rules = quick([1, 2, 1, 1]).fit(X, log["output"] / COUNTS - log["rate"])
    compensator = GyroCompensator(rules, inputs, "error", COUNTS, "counts", 25.0)
    text = told(export_c_compensator(compensator, tmp_path / "gyro", std="c89").header)
    (time_0, *_, time_1) = sorted(X["time"])
    for part in (
        "subtract y[0] from the raw rate. The raw rate [deg/s] is the output of the gyro [counts] "
        "divided by -27000.",
        "time is that since power-on: zero at the first sample.",
        "temperature_rate is low-passed, with a time constant of 25 s. At power-on: "
        "temperature_rate = 0, previous = temperature.",
        "temperature_rate += (1 - exp(-h / 25)) * ((temperature - previous) / h - "
        "temperature_rate); then previous = temperature.",
        f"[0] time [s]: {time_0:g} to {time_1:g}",
        "[1] temperature [degC]: ",
        "[2] temperature_rate [degC/s]: 0 to ",
        "[3] output [counts]: ",
        "[0] y [deg/s]: ",
        "MISRA C:2012",
    ):
        assert part in text
    model = ResidualRegressor(LAW, quick([1, 1, 1, 1])).fit(X, log["rate"])
    compensator = GyroCompensator(model, inputs, "rate", COUNTS, "counts", 25.0)
    text = told(export_c_compensator(compensator, tmp_path / "gyro", std="c99").header)
    assert "compensated rate: take it in the place of the raw rate" in text
    assert "[0] rate, in deg/s" in text
    assert "Largest cost of an evaluation: an arcsine, " in text
