"""GyroCompensator: what is applied on board, and how it is kept."""

import json
import warnings
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from sklearn.compose import make_column_transformer
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis.datasets import make_ofog
from skanfis.export import export_c
from skanfis.gyro import GyroCompensator, OpenLoopArcsineRegressor, ResidualRegressor
from skanfis.gyro.c_code import export_c_physics
from skanfis.gyro.compensator import features

from ..quick import quick

INPUTS = ("time", "temperature", "temperature_rate", "output")
FACTOR = -27_000.0  # counts per deg/s
LAG = 60.0  # s


@pytest.fixture(scope="module")
def log():
    log = make_ofog(n_devices=1, n_runs=4, duration=1200.0, random_state=0)
    # A clock that goes on from run to run.
    log["time"] += 1e4 * log["run"]
    return log.assign(output=FACTOR * log["output"])


def fitted(log, **options):
    X = features(log, INPUTS, LAG)
    # Next to no weights, for data next to without noise.
    rules = quick([1, 2, 1, 3], agreement=1e-8, alpha=1e-9, **options)
    model = make_pipeline(StandardScaler(), rules)
    model.fit(X, log["output"] / FACTOR - log["rate"])
    return GyroCompensator(model, INPUTS, scale_factor=FACTOR, output_unit="counts")


@pytest.fixture(scope="module")
def compensator(log):
    return fitted(log)


@pytest.mark.parametrize("policy", ["clip", "linear", "nan"])
def test_rows_out_of_range_are_flagged_and_follow_the_policy(log, policy):
    compensator = fitted(log, out_of_bounds=policy)
    hotter = log.assign(temperature=log["temperature"] + 20.0)
    highest = log["temperature"].max()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        compensated = compensator.apply(hotter)
    np.testing.assert_allclose(compensated["rate_indicated"], hotter["output"] / FACTOR)
    outside = (hotter["temperature"] > highest).to_numpy()
    assert 0.0 < outside.mean() < 1.0
    status = compensated["status"].to_numpy()
    assert ((status & 1 != 0) >= outside).all()
    assert np.isnan(compensated["rate_compensated"]).equals(compensated["status"] & 8 != 0)
    assert (status[outside] & 8 != 0).all() == (policy == "nan")
    if policy == "clip":
        known = features(log, INPUTS, LAG)
        at_edge = features(hotter, INPUTS, LAG).clip(known.min(), known.max(), axis=1)
        expected = hotter["output"] / FACTOR - compensator.estimator.predict(at_edge)
        np.testing.assert_allclose(compensated["rate_compensated"], expected, rtol=1e-12)


def test_rows_hardly_covered_are_flagged(log, compensator):
    far = log.assign(temperature=log["temperature"] + 200.0)
    assert (compensator.apply(far)["status"] == 1 + 4).all()
    careless = replace(compensator, min_coverage=0.0)
    assert (careless.apply(far)["status"] == 1).all()


def with_physics(log, **parameters):
    """Law and rules; the rules on chosen columns, in another order than the inputs."""
    law = OpenLoopArcsineRegressor("output", **{"temperature": "temperature"} | parameters)
    chosen = make_column_transformer((StandardScaler(), ["output", "time"]))
    rules = make_pipeline(chosen, quick([1, 2]))
    model = ResidualRegressor(law, rules).fit(features(log, INPUTS, LAG), log["rate"])
    return GyroCompensator(model, INPUTS, predicts="rate", scale_factor=FACTOR)


@pytest.mark.parametrize(
    ("parameters", "inputs"),
    [
        (None, INPUTS),  # rules alone
        ({}, ("time", "temperature", "output")),
        ({"temperature_rate": "temperature_rate", "amplitude_degree": 3}, INPUTS),
        ({"temperature": None, "max_phase": 0.5, "out_of_bounds": "nan"}, ("time", "output")),
        ({"max_phase": 0.5, "out_of_bounds": "linear"}, ("time", "temperature", "output")),
    ],
)
def test_json_gives_the_same_compensator(log, compensator, parameters, inputs, tmp_path):
    if parameters is not None:
        log = log.assign(output=log["output"] * (-1.0 if "temperature" in parameters else 1.0))
        compensator = with_physics(log, **parameters)
    path = tmp_path / "compensator.json"
    compensator.write_json(path)
    read = GyroCompensator.read_json(path)
    shifted = log.assign(temperature=log["temperature"] + 5.0, output=1.5 * log["output"])
    one, two = compensator.apply(shifted), read.apply(shifted)
    assert set(one["status"]) > {0}
    np.testing.assert_allclose(two, one, rtol=1e-9, atol=1e-12)
    read.write_json(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_text() == path.read_text()
    assert (read.inputs, read.scale_factor) == (inputs, FACTOR)
    if parameters is None:
        with pytest.raises(TypeError, match=r"got FrozenRules.* Its model is one\.$"):
            export_c(read.estimator, name="gyro")
        code = export_c(read.estimator.model, name="gyro")
        assert code.source == export_c(compensator.estimator, name="gyro").source
        return
    # What was read can be written as C too.
    codes = [export_c_physics(part.estimator, name="gyro") for part in (compensator, read)]
    assert codes[0] == codes[1]


def test_a_rate_that_is_not_finite_is_none(log):
    class Infinite:
        def predict(self, X):
            return np.full(len(X), np.inf)

        def in_bounds(self, X):
            return np.full(len(X), False)

        def coverage(self, X):
            return np.zeros(len(X))

    compensated = GyroCompensator(Infinite(), INPUTS).apply(log)
    assert (compensated["status"] == 1 + 8).all()
    assert compensated["rate_compensated"].isna().all()


def of_law(**changes):
    return lambda document: document | {"law": document["law"] | changes}


def of_cubic(**changes):
    """The same of a cubic polynomial in the place of the law."""
    cubic = {"center": [0.0] * 2, "scale": [1.0] * 2, "coefficients": [0.0] * 10} | changes
    return lambda document: (
        document | {"law": None, "inputs": document["columns"], "polynomial": cubic}
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda document: [], '"format" is not'),
        (lambda document: document | {"format": "other"}, '"format" is not'),
        (lambda document: document | {"version": 2}, "version is 2, this reads 1"),
        (lambda document: document | {"more": 1}, "its keys are"),
        (lambda document: document | {"inputs": ["speed"]}, "inputs is"),
        (lambda document: document | {"inputs": ["time"]}, "columns is"),
        (lambda document: document | {"columns": ["time"]}, "its model has 2 inputs"),
        (lambda document: document | {"predicts": "phase"}, "predicts is 'phase'"),
        (lambda document: document | {"scale_factor": 0}, "scale_factor, in size: 0.0 is not a"),
        (lambda document: document | {"scale_factor": 10**60}, "scale_factor: 10.*is not a number"),
        (lambda document: document | {"time_constant": 0.0}, "time_constant: 0.0 is not a number"),
        (lambda document: document | {"min_coverage": 1.5}, "min_coverage: 1.5 is not a .* 0 to 1"),
        (lambda document: document | {"output_unit": "\x1b[2J"}, r"output_unit: '\\x1b\[2J"),
        (lambda document: document | {"model": {}}, "is no gyro compensator"),
        (of_law(more=1), "its law must be an object with the keys"),
        (of_law(columns=["output", "speed"]), "the law's columns are"),
        (of_law(columns="output"), "the law's columns are"),
        (of_law(columns=["output"]), r"law\.amplitude: .* must be a list of numbers, 1 at most"),
        (of_law(amplitude=[1.0] * 7), r"law\.amplitude: .* must be a list of numbers, 6 at most"),
        (of_law(sagnac_factor=[float("nan")]), r"law\.sagnac_factor\[0\]: nan is not a number"),
        (of_law(sagnac_factor=[0.0, 1.0]), r"law\.sagnac_factor\[0\], in size: 0.0 is not"),
        (of_law(thermometer_lag=True), r"law\.thermometer_lag: True is not a number"),
        (of_law(minimum=[0.0]), r"law\.minimum: .* is not a list of 2\."),
        (of_law(minimum=[1e30, 0.0]), "the law's minimum is above its maximum"),
        (of_law(thermometer_lag=5.0), "no column for the temperature's rate"),
        (of_law(max_phase="1"), r"law\.max_phase: '1' is not a number from 0 to 1.57"),
        (of_law(out_of_bounds="hold"), "out_of_bounds='hold' must be one of"),
        (of_cubic(more=1), "must be an object of center, scale"),
        (of_cubic(scale=[0.0, 1.0]), r"polynomial.scale\[0\]"),
        (of_cubic(coefficients=[0.0] * 11), "is not a list of 10"),
        (lambda document: document | {"units": {"output": "mph"}}, "output has no unit 'mph'"),
        (lambda document: document | {"assumed": ["x"]}, "assumed is .* must be an object of text"),
    ],
)
def test_other_files_are_refused(physics_json, tmp_path, change, message):
    path = tmp_path / "compensator.json"
    path.write_text(json.dumps(change(json.loads(physics_json))))
    with pytest.raises(ValueError, match=message):
        GyroCompensator.read_json(path)


@pytest.fixture(scope="module")
def physics_json(log, tmp_path_factory):
    path = tmp_path_factory.mktemp("physics") / "compensator.json"
    with_physics(log).write_json(path)
    return path.read_text()


def test_what_could_not_be_read_is_not_written(compensator, tmp_path):
    path = tmp_path / "never.json"
    for estimator in (LinearRegression(), ResidualRegressor(LinearRegression(), quick(1))):
        estimator.fit(np.random.default_rng(0).random((30, 4)), np.arange(30.0))
        with pytest.raises(TypeError):
            GyroCompensator(estimator, INPUTS).write_json(path)
    assert not path.exists()


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("inputs", ("temprature",), "inputs is"),
        ("scale_factor", 0.0, "scale_factor, in size: 0"),
        ("time_constant", np.int64(0), "time_constant: 0 is not a number from 1e-50"),
        ("min_coverage", 2, "min_coverage: 2 is not a number from 0 to 1"),
    ],
)
def test_a_parameter_that_makes_no_sense_is_refused(compensator, name, value, told):
    with pytest.raises(ValueError, match=told):
        replace(compensator, **{name: value})


def test_numbers_of_numpy_are_written_too(compensator, tmp_path):
    of_numpy = replace(compensator, scale_factor=np.float32(-2.0), time_constant=np.int64(30))
    of_numpy.write_json(tmp_path / "compensator.json")
    read = GyroCompensator.read_json(tmp_path / "compensator.json")
    assert (read.scale_factor, read.time_constant) == (-2.0, 30.0)


def test_what_is_no_json_is_refused(tmp_path):
    path = tmp_path / "compensator.json"
    for content in (b"\xff", b"{", b"[" * 100_000):
        path.write_bytes(content)
        with pytest.raises(ValueError, match="is no gyro compensator") as refused:
            GyroCompensator.read_json(path)
        assert ("it is not the JSON that" in str(refused.value)) == (len(content) == 1)


@pytest.mark.parametrize("part", ["time", "temperature", "output"])
def test_a_log_that_lacks_what_it_takes_is_refused_by_name(log, compensator, part):
    with pytest.raises(ValueError, match=f"the log has no {part}, which the compensator takes"):
        compensator.apply(log.drop(columns=part))


def test_dates_are_no_times_in_seconds(log):
    compensator = fitted(log)
    assert "time" in compensator.inputs
    dates = log.assign(time=pd.to_datetime(log["time"], unit="s"))
    with pytest.raises(ValueError, match="time must hold numbers, not "):
        compensator.apply(dates)
    with pytest.raises(ValueError, match="time must hold numbers, not "):
        features(dates, ("time",), 60.0)
