"""What the command never does: replace what it reads, run a file unasked, hang, leave things."""

import io
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import joblib
import numpy as np
import pandas as pd
import pytest

pytest.importorskip("matplotlib")

from skanfis.datasets import make_ofog
from skanfis.gyro import GyroCompensator, _source

from ..quick import quick


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A log and a compensator of a constant."""
    monkeypatch.chdir(tmp_path)
    log = make_ofog(n_devices=1, n_runs=3, duration=300.0, random_state=0)
    log[["time", "temperature", "output"]].to_csv("log.csv", index=False)
    constant = quick(1, order=0).fit(log[["temperature"]], np.full(len(log), 0.5))
    GyroCompensator(constant, ("temperature",)).write_json("model.json")
    return log


@pytest.mark.parametrize("target", ["log.csv", "model.json", "../{here}/log.csv"])
def test_apply_never_replaces_what_it_reads(files, tmp_path, target, say):
    before = [(tmp_path / name).read_bytes() for name in ("log.csv", "model.json")]
    target = target.format(here=tmp_path.name)
    for force in ([], ["--force"]):
        code, _, err = say("--apply", "model.json", "log.csv", "--output", target, *force)
        assert (code, "is read, and never replaced" in err) == (4, True)
    assert [(tmp_path / name).read_bytes() for name in ("log.csv", "model.json")] == before
    (tmp_path / "log-compensated.csv").write_text("old")
    code, out, _ = say("--apply", "model.json", "log.csv", "--force")
    # Without the true rate there are no errors to tell.
    assert (code, "before" in out) == (0, False)
    assert "old" not in (tmp_path / "log-compensated.csv").read_text()


@pytest.mark.parametrize("name", ["rules.txt", "px4.params"])
def test_a_calibration_never_replaces_its_log(files, tmp_path, name, say):
    (tmp_path / "out").mkdir()
    (tmp_path / "log.csv").rename(tmp_path / "out" / name)
    code, _, err = say(f"out/{name}", "--output", "out", "--force")
    assert (code, f"{name} is read, and never replaced" in err) == (4, True)


class RunsCode:
    def __reduce__(self):
        return Path.touch, (Path("ran"),)


def test_a_pickle_is_refused_and_not_loaded(files, say):
    joblib.dump(RunsCode(), "model.joblib")
    code, _, told = say("--apply", "model.joblib", "log.csv", "--quiet")
    assert (code, "is no gyro compensator: it is not the JSON" in told) == (2, True)
    assert not Path("ran").exists()


def test_apply_tells_errors_of_flagged_rows_apart(files, tmp_path, say):
    # The model takes 0.5 off; three rows are hotter than all that it has seen.
    hot = np.arange(len(files)) < 3
    log = files.assign(temperature=files["temperature"] + 99 * hot)
    log["rate"] = files["output"] - np.where(hot, 2.5, 1.5)
    log.to_csv(tmp_path / "new.csv", columns=["temperature", "output", "rate"], index=False)
    code, out, _ = say("--apply", "model.json", "new.csv")
    assert code == 0
    assert "1.5 deg/s before, 1 after (rows with status 0)" in out
    assert "2.5 deg/s before, 2 after (the flagged rows)" in out
    assert "3 rows out of range (temperature in 3)" in out
    assert ((pd.read_csv("new-compensated.csv")["status"] & 1 != 0) == hot).all()


class Interrupted(io.StringIO):
    def read(self, *_):
        signal.raise_signal(signal.SIGINT)
        return ""


def test_an_interrupt_while_pandas_reads_is_one(tmp_path, monkeypatch):
    """pandas makes a broken table of it."""
    path = tmp_path / "log.csv"
    path.write_text("time,x\n1,2\n3,4\n")
    source = _source._TextSource(path)
    monkeypatch.setattr(_source, "open", lambda *_, **__: Interrupted("time,x\n1,2"), raising=False)
    # What runs in the background is deaf to it.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            source.table([0, 1])
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.skipif(os.name != "posix", reason="signals of another kind")
@pytest.mark.parametrize("during", ["imports", "fold 1"])
def test_ctrl_c_leaves_no_traceback_and_no_folder(tmp_path, during):
    log = make_ofog(n_devices=1, n_runs=8, duration=900.0, random_state=0)
    parts = ["time", "temperature", "output", "rate", "run"]
    log[parts].to_csv(tmp_path / "log.csv", index=False)
    command = [sys.executable, "-m", "skanfis.gyro", "log.csv", "--output", "out"]
    process = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    if during == "imports":
        time.sleep(0.3)
    else:
        assert any(during in line for line in process.stderr)
    process.send_signal(signal.SIGINT)
    try:
        told = process.communicate(timeout=60)[1]
    except subprocess.TimeoutExpired:
        # Seen once under load, the cause is not known: an interrupt was lost. People press again.
        process.send_signal(signal.SIGINT)
        told = process.communicate(timeout=60)[1]
    assert process.returncode in (130, -signal.SIGINT)
    # What Python loses, in a destructor say, it tells with the place.
    assert "Traceback" not in told or "Exception ignored" in told
    assert [path.name for path in tmp_path.iterdir()] == ["log.csv"]
