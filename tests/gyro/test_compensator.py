"""GyroCompensator: what is applied on board, and how it is kept."""

import json
import warnings

import numpy as np
import pytest
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis import ANFISRegressor
from skanfis.datasets import make_ofog
from skanfis.gyro import GyroCompensator, OpenLoopArcsineRegressor, ResidualRegressor

INPUTS = ("time", "temperature", "temperature_rate", "output")
FACTOR = -27_000.0  # counts per deg/s


@pytest.fixture(scope="module")
def log():
    log = make_ofog(n_devices=1, n_runs=4, duration=1200.0, random_state=0)
    # A clock that goes on from run to run.
    log["time"] += 1e4 * log["run"]
    return log.assign(output=FACTOR * log["output"])


def fitted(log, **options):
    shell = GyroCompensator(None, INPUTS, scale_factor=FACTOR, output_unit="counts")
    X = shell.features(log)
    model = make_pipeline(StandardScaler(), ANFISRegressor([1, 2, 1, 3], **options))
    model.fit(X, shell.indicated(log) - log["rate"])
    return GyroCompensator(model, INPUTS, scale_factor=FACTOR, output_unit="counts")


@pytest.fixture(scope="module")
def compensator(log):
    return fitted(log)


def test_features_are_those_on_board(log, compensator):
    X = compensator.features(log)
    assert tuple(X) == INPUTS
    for run in log["run"].unique():
        rows = (log["run"] == run).to_numpy()
        time, temperature = log["time"][rows].to_numpy(), log["temperature"][rows].to_numpy()
        np.testing.assert_array_equal(X["time"][rows], time - time[0])
        rate, previous, expected = 0.0, temperature[0], []
        for k, now in enumerate(temperature):
            if k:
                step = time[k] - time[k - 1]
                rate += (1 - np.exp(-step / 60.0)) * ((now - previous) / step - rate)
            previous = now
            expected.append(rate)
        np.testing.assert_allclose(X["temperature_rate"][rows], expected, atol=1e-12)


def test_compensates(log, compensator):
    compensated = compensator.apply(log)
    assert (compensated["status"] == 0).all()
    before = compensated["rate_indicated"] - log["rate"]
    after = compensated["rate_compensated"] - log["rate"]
    assert after.std() < before.std() / 100
    np.testing.assert_allclose(compensated["rate_indicated"], log["output"] / FACTOR)


def test_the_true_rate_is_not_used(log, compensator):
    without = compensator.apply(log.drop(columns="rate"))
    assert without.equals(compensator.apply(log))


def test_blocks_of_rows_change_nothing(log, compensator, monkeypatch):
    whole = compensator.apply(log)
    monkeypatch.setattr("skanfis.gyro.compensator._BLOCK_ROWS", 7)
    parts = compensator.apply(log)
    np.testing.assert_allclose(parts, whole, rtol=1e-12)


@pytest.mark.parametrize("policy", ["clip", "linear", "nan"])
def test_rows_out_of_range_are_flagged_and_follow_the_policy(log, policy):
    compensator = fitted(log, out_of_bounds=policy)
    hotter = log.assign(temperature=log["temperature"] + 20.0)
    highest = log["temperature"].max()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        compensated = compensator.apply(hotter)
    outside = (hotter["temperature"] > highest).to_numpy()
    assert outside.any()
    assert not outside.all()
    status = compensated["status"].to_numpy()
    assert ((status & 1 != 0) >= outside).all()
    assert np.isnan(compensated["rate_compensated"]).equals(compensated["status"] & 8 != 0)
    if policy == "nan":
        assert (status[outside] & 8 != 0).all()
    if policy == "clip":
        low, high = compensator.features(log).min(), compensator.features(log).max()
        at_edge = compensator.features(hotter).clip(low, high, axis=1)
        expected = hotter["output"] / FACTOR - compensator.estimator.predict(at_edge)
        np.testing.assert_allclose(compensated["rate_compensated"], expected, rtol=1e-12)


def test_rows_hardly_covered_are_flagged(log):
    compensator = fitted(log)
    far = log.assign(temperature=log["temperature"] + 200.0)
    assert (compensator.apply(far)["status"] == 1 + 4).all()
    careless = GyroCompensator(compensator.estimator, INPUTS, scale_factor=FACTOR, min_coverage=0.0)
    assert (careless.apply(far)["status"] == 1).all()


def test_status_is_that_of_the_exported_c(log):
    from skanfis.export import export_c

    header = export_c(fitted(log).estimator, name="gyro").header
    for name, bit in {"OUT_OF_RANGE": 1, "NOT_FINITE": 2, "UNCOVERED": 4, "NO_OUTPUT": 8}.items():
        assert f"#define GYRO_{name} {bit}" in header


def test_physics_predicts_the_rate(log):
    shell = GyroCompensator(None, INPUTS, predicts="rate", scale_factor=FACTOR)
    law = OpenLoopArcsineRegressor("output", "temperature", warn_out_of_bounds=False)
    model = ResidualRegressor(law, ANFISRegressor([1, 2, 1, 1], warn_out_of_bounds=False))
    model.fit(shell.features(log), log["rate"])
    compensator = GyroCompensator(model, INPUTS, predicts="rate", scale_factor=FACTOR)
    compensated = compensator.apply(log)
    assert (compensated["rate_compensated"] - log["rate"]).std() < 0.02
    with pytest.raises(TypeError):
        compensator.write_json("never.json")


def test_json_gives_the_same_compensator(log, compensator, tmp_path):
    path = tmp_path / "compensator.json"
    compensator.write_json(path)
    read = GyroCompensator.read_json(path)
    shifted = log.assign(temperature=log["temperature"] + 5.0)
    one, two = compensator.apply(shifted), read.apply(shifted)
    np.testing.assert_allclose(two, one, rtol=1e-9, atol=1e-12)
    assert (read.inputs, read.scale_factor, read.output_unit) == (INPUTS, FACTOR, "counts")
    read.write_json(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_text() == path.read_text()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda document: [], '"format" is not'),
        (lambda document: document | {"format": "other"}, '"format" is not'),
        (lambda document: document | {"version": 2}, "version is 2, this reads 1"),
        (lambda document: document | {"more": 1}, "its keys are"),
        (lambda document: document | {"inputs": ["speed"]}, "inputs is"),
        (lambda document: document | {"inputs": ["time"]}, "its model has 4 inputs"),
        (lambda document: document | {"predicts": "phase"}, "predicts is 'phase'"),
        (lambda document: document | {"scale_factor": "1"}, "scale_factor is '1'"),
        (lambda document: document | {"time_constant": True}, "time_constant is True"),
        (lambda document: document | {"output_unit": 3}, "output_unit is no text"),
        (lambda document: document | {"model": {}}, "is no gyro compensator"),
    ],
)
def test_other_files_are_refused(compensator, tmp_path, change, message):
    path = tmp_path / "compensator.json"
    compensator.write_json(path)
    path.write_text(json.dumps(change(json.loads(path.read_text()))))
    with pytest.raises(ValueError, match=message):
        GyroCompensator.read_json(path)


def test_what_is_no_json_is_refused(tmp_path):
    path = tmp_path / "compensator.json"
    for content in (b"\xff", b"{", b"[" * 100_000):
        path.write_bytes(content)
        with pytest.raises(ValueError, match="is no gyro compensator"):
            GyroCompensator.read_json(path)
