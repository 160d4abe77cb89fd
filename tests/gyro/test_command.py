"""The command: what it writes, says and refuses."""

import io
import json
import os
import pickle
import shutil
import sys
from functools import lru_cache

import joblib
import numpy as np
import pandas as pd
import pytest

pytest.importorskip("matplotlib")

from skanfis.datasets import make_ofog
from skanfis.export.c import CCode
from skanfis.gyro import GyroCompensator, _pictures, command
from skanfis.gyro.command import main

from ..export.c_compiler import COMPILER, evaluate_all

pytestmark = pytest.mark.usefixtures("given_weights", "coarse_report")

RENAMED = ["--columns", "time=t_ms", "temperature=T", "output=counts", "rate=table"]
UNITS = ["--units", "time=ms", "temperature=K", "output=counts"]
FACTOR = -27_000.0
FILES = ["compensator.joblib", "compensator.json", "report.html", "rules.txt"]


def simulated(**options):
    return make_ofog(n_devices=1, duration=900.0, random_state=0, **options)


# A fit of the smallest kind, where it is not the question.
SMALL = ["--inputs", "temperature", "output", "--terms", "1,2"]
MEASURED = ("time", "temperature", "output", "rate", "run")


def write_log(path, log, columns=MEASURED):
    log[list(columns)].to_csv(path, index=False)
    return str(path)


@pytest.fixture(scope="module")
def log():
    return simulated(n_runs=5)


@pytest.fixture
def no_report(monkeypatch, few_rivals):
    """Leave out the report and what it compares with, which take longer than all else together."""
    monkeypatch.setattr(
        "skanfis.gyro.command.report_page", lambda calibration, title, options: title
    )


@pytest.fixture
def no_pictures(monkeypatch):
    """A report of words and tables."""
    monkeypatch.setattr("skanfis.gyro.html_report.PICTURES", ())


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory, log, given_weights, coarse_report):
    """A folder after one calibration from counts, milliseconds and kelvin; without pictures."""
    folder = tmp_path_factory.mktemp("calibrated")
    raw = pd.DataFrame(
        {
            "t_ms": 1000 * log["time"] + 5e6,
            "T": log["temperature"] + 273.15,
            "counts": FACTOR * log["output"],
            "table": log["rate"],
            "run": log["run"],
        }
    )
    path = write_log(folder / "raw.csv", raw, raw.columns)
    arguments = [path, *RENAMED, *UNITS, "--output", str(folder / "out"), "--terms", "1,2,1,3"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("skanfis.gyro.html_report.PICTURES", ())
        assert main([*arguments, "--c", "c99", "--deviation", "--saturate"]) == 0
    return folder


def test_writes_what_it_says(calibrated):
    found = sorted(path.name for path in (calibrated / "out").iterdir())
    assert found == sorted([*FILES, "compensator.c", "compensator.h"])
    header = (calibrated / "out" / "compensator.h").read_text()
    assert "int compensator_deviation(const double x[" in header
    assert "saturated beyond limits" in header


def test_the_compensator_knows_units_and_scale_factor(calibrated, log):
    compensator = joblib.load(calibrated / "out" / "compensator.joblib")
    slope = np.polyfit(log["rate"], FACTOR * log["output"], 1)[0]
    assert compensator.scale_factor == pytest.approx(slope, rel=1e-9)
    assert compensator.output_unit == "counts"
    assert compensator.inputs == ("time", "temperature", "temperature_rate", "output")
    compensated = compensator.apply(log.assign(output=FACTOR * log["output"]))
    assert (compensated["rate_compensated"] - log["rate"]).std() < 0.01


def test_the_compensator_uses_nothing_unknown_on_board(calibrated):
    text = (calibrated / "out" / "rules.txt").read_text(encoding="utf-8")
    assert "error = " in text
    assert "table" not in text
    document = json.loads((calibrated / "out" / "compensator.json").read_text())
    assert "rate" not in document["inputs"]


def test_apply_by_json_and_by_joblib_is_the_same(calibrated, capsys):
    tables = []
    for model in ("compensator.json", "compensator.joblib"):
        target = calibrated / f"{model}.csv"
        arguments = [str(calibrated / "raw.csv"), *RENAMED, *UNITS, "--output", str(target)]
        assert main(["--apply", str(calibrated / "out" / model), *arguments]) == 0
        tables.append(pd.read_csv(target))
    np.testing.assert_allclose(tables[0], tables[1], rtol=1e-8, atol=1e-9)
    assert list(tables[0])[-4:] == ["rate_indicated", "rate_compensated", "coverage", "status"]
    assert (tables[0]["status"] == 0).all()
    assert "before" in capsys.readouterr().out


def test_apply_flags_what_is_out_of_range_and_needs_no_rate(calibrated, tmp_path, log, capsys):
    hot = pd.DataFrame(
        {
            "t_ms": 1000 * log["time"],
            "T": log["temperature"] + 293.15,
            "counts": FACTOR * log["output"],
            "run": log["run"],
        }
    )
    path = write_log(tmp_path / "hot.csv", hot, hot.columns)
    target = tmp_path / "hot-rates.csv"
    model = str(calibrated / "out" / "compensator.json")
    arguments = [path, *RENAMED[:-1], *UNITS, "--output", str(target)]
    assert main(["--apply", model, *arguments]) == 0
    outside = log["temperature"] + 20.0 > log["temperature"].max()
    assert (pd.read_csv(target)["status"].to_numpy() & 1 != 0)[outside.to_numpy()].all()
    out = capsys.readouterr().out
    assert "out of range" in out
    assert "before" not in out


def test_apply_refuses_another_unit_and_other_files(calibrated, tmp_path, log, capsys):
    path = write_log(tmp_path / "log.csv", log)
    model = str(calibrated / "out" / "compensator.json")
    with pytest.raises(SystemExit) as caught:
        main(["--apply", model, path])
    assert caught.value.code == 2
    assert "calibrated for an output in counts; this is in deg/s" in capsys.readouterr().err
    joblib.dump([1], tmp_path / "list.joblib")
    with pytest.raises(SystemExit):
        main(["--apply", str(tmp_path / "list.joblib"), path])
    assert "holds a list, not a GyroCompensator" in capsys.readouterr().err


def test_never_replaces_without_force(calibrated, capsys):
    arguments = [str(calibrated / "raw.csv"), *RENAMED, *UNITS, "--output", str(calibrated / "out")]
    before = (calibrated / "out" / "report.html").stat().st_mtime_ns
    assert main(arguments) == 4
    assert "exists already" in capsys.readouterr().err
    assert (calibrated / "out" / "report.html").stat().st_mtime_ns == before
    arguments[-1] = str(calibrated / "out" / "rules.txt")
    assert main([*arguments, "--force"]) == 4
    assert "is a file; --output is the folder" in capsys.readouterr().err
    model = str(calibrated / "out" / "compensator.json")
    assert main(["--apply", model, *arguments]) == 4


@pytest.mark.usefixtures("no_report")
def test_progress_and_summary(tmp_path, log, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = write_log(tmp_path / "log.csv", log[log["run"] < 3])
    assert main([path, "--max-rules", "2", "--inputs", "temperature", "output"]) == 0
    out, err = capsys.readouterr()
    assert (tmp_path / "log-compensator" / "report.html").exists()
    for text in ("reading", "270 rows, 3 runs", "choosing the terms", "fold 3 of 3", "done"):
        assert text in err
    assert "whole runs held out (3 runs, 3 folds; rows of one run are alike)" in out
    assert "error before" in out
    assert "held-out rows in range" in out


@pytest.mark.usefixtures("no_report", "law_of_degree_one")
def test_physics_and_policy(tmp_path, log, capsys):
    log = log[log["run"] < 3]
    path, out = write_log(tmp_path / "log.csv", log), tmp_path / "out"
    arguments = [path, "--physics", "--terms", "1,2,1,1", "--outside", "nan", "--quiet"]
    assert main([*arguments, "--output", str(out), "--c", "c99"]) == 0
    assert capsys.readouterr().err == ""
    assert sorted(path.name for path in out.iterdir()) == sorted(
        [*FILES, "compensator.c", "compensator.h"]
    )
    rules = (out / "rules.txt").read_text(encoding="utf-8")
    assert rules.startswith("rate [deg/s] = arcsin((output [deg/s]")
    assert "rate beyond the law = " in rules
    compensator = joblib.load(out / "compensator.joblib")
    assert compensator.predicts == "rate"
    hot = compensator.apply(log.assign(temperature=log["temperature"] + 100.0))
    assert hot["rate_compensated"].isna().all()
    assert (hot["status"] == 1 + 8).all()
    read = GyroCompensator.read_json(out / "compensator.json")
    np.testing.assert_allclose(read.apply(log), compensator.apply(log), rtol=1e-9, atol=1e-12)
    if COMPILER is not None:
        header, source = ((out / f"compensator.{end}").read_text() for end in "hc")
        code = CCode("compensator", header, source, None)
        hotter = log.assign(temperature=log["temperature"] + 5.0)
        X, applied = compensator.features(hotter), compensator.apply(hotter)
        [(y, status)] = evaluate_all([code], X.to_numpy(), tmp_path, "c99", [1])
        np.testing.assert_array_equal(status, applied["status"])
        np.testing.assert_allclose(y[:, 0], applied["rate_compensated"], rtol=1e-12, atol=1e-10)


@pytest.mark.theory
@pytest.mark.usefixtures("no_report")
def test_at_rest(tmp_path, capsys):
    log = simulated(n_runs=3, rates=[0.0], profile="ramps")
    path = write_log(tmp_path / "log.csv", log, ["time", "temperature", "output", "run"])
    arguments = [path, "--at-rest", "--max-rules", "2", "--output", str(tmp_path / "out")]
    assert main([*arguments, "--quiet"]) == 0
    compensator = GyroCompensator.read_json(tmp_path / "out" / "compensator.json")
    assert compensator.inputs == ("time", "temperature", "temperature_rate")
    assert main([path, "--output", str(tmp_path / "two"), "--max-rules", "2", "--quiet"]) == 0
    assert "note           there is no column for the rate" in capsys.readouterr().out


@pytest.mark.usefixtures("no_report")
def test_one_device_of_several(tmp_path, capsys):
    log = make_ofog(n_devices=3, n_runs=3, duration=600.0, random_state=0)
    path = write_log(tmp_path / "log.csv", log, [*MEASURED, "device"])
    arguments = [path, *SMALL, "--output", str(tmp_path / "out"), "--quiet"]
    assert main([*arguments, "--device", "1"]) == 0
    assert "whole runs held out (3 runs" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        main([*arguments, "--device", "7", "--force"])
    assert "--device 7: the log has 0, 1, 2" in capsys.readouterr().err


def without_value(log):
    return log.assign(rate=log["rate"].where(log.index != 7))


def one_run_without_levels(log):
    rate = log["output"] + np.random.default_rng(0).normal(size=len(log))
    warming = np.linspace(0.0, 40.0, len(log))
    return log.assign(run=1, time=10.0 * np.arange(len(log)), rate=rate, temperature=warming)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda log: log[["time", "output", "rate", "run"]], "no column 'temperature'"),
        (
            lambda log: log.assign(time=-log["time"]),
            "log.csv, line 3, column 'time': time does not increase",
        ),
        (
            lambda log: log.assign(temperature=20.0),
            "log.csv, column 'temperature': the temperature spans 0",
        ),
        (lambda log: log.assign(output=-log["output"]), "its sign is reversed"),
        (one_run_without_levels, "could not be checked: the log has 1 device(s), 1 run(s)"),
    ],
)
def test_bad_logs_are_refused_in_one_sentence(tmp_path, log, spoil, message, capsys):
    spoiled = spoil(log)
    path = write_log(tmp_path / "log.csv", spoiled, spoiled.columns)
    assert main([path, "--output", str(tmp_path / "out"), "--quiet"]) == 3
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_errors_name_the_columns_of_the_file(tmp_path, log, capsys):
    renamed = log.rename(columns={"temperature": "T"}).assign(T=300.0)
    parts = ["time", "T", "output", "rate", "run"]
    paths = [
        write_log(tmp_path / f"{name}.csv", renamed[start:], parts)
        for start, name in enumerate("ab")
    ]
    arguments = [
        "--columns",
        "temperature=T",
        "--units",
        "temperature=degC",
        "--output",
        str(tmp_path / "out"),
        "--quiet",
    ]
    assert main([paths[0], *arguments]) == 3
    assert "a.csv, line 2, column 'T' (temperature): 300.0 degC" in capsys.readouterr().err
    assert main([*paths, *arguments]) == 3
    assert (
        "a.csv, line 2, column 'T' (temperature): 300.0 degC is not plausible"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--columns", "time"], "'time' must be of the form PART=..."),
        (["--columns", "speed=v"], "columns: there is no 'speed'"),
        (["--columns", "time=a", "time=b"], "time is given twice"),
        (["--units", "time=year"], "time has no unit 'year'"),
        (["--saturate"], "--saturate is of the model in C: give --c"),
        (["--terms", "2,x"], "must be search, auto, or numbers"),
        (["--terms", "2,2"], "has 2 numbers for the 4 inputs"),
        (["--min-coverage", "2"], "must be a number from 0 to 1"),
        (["--fit-rows", "0"], "must be a whole number from 1 to"),
        (["--time-constant", "-1"], "must be a number from 1e-9 to 1e9"),
        (["--physics", "--inputs", "temperature"], "needs the output"),
        (["--inputs", "rate"], "invalid choice: 'rate'"),
        (["--device", "a"], "no column for the device"),
        (["--jobs", "0"], "must be a whole number, 1 or more, or -1"),
        (["--terms", "99999999,1,1,1"], "99999999,1,1,1 makes 99,999,999 rules; at most 500"),
        (["--terms", "9" * 9000], "must be search, auto, or numbers"),
        (["--inputs", "time", "time"], "--inputs: time is given twice"),
        (["--max-gap", "0"], "must be auto, a positive number, or inf"),
        (["--encoding", "klingon"], "'klingon' is no encoding of text that is known"),
        (["--axes", "../x"], "must be such as x or x=NAME"),
        (["--axes", "q"], "--axes q: no column for the output of this axis is found"),
        (["--scale-factor", "131"], "is for a raw signal at rest"),
        (["--terms", "9,9,9,9"], "9,9,9,9 makes 6,561 rules; at most 500"),
        (["--max-rules", "1000"], "must be a whole number from 1 to 500"),
        (["--inputs", "output", "output"], "--inputs: output is given twice"),
        (["--separator", "(("], "must be one character"),
        (["--separator", ""], "must be one character"),
        (["--decimal", ","], "separator and decimal are both ','"),
    ],
)
def test_options_that_make_no_sense(tmp_path, log, arguments, message, capsys):
    path = write_log(tmp_path / "log.csv", log)
    with pytest.raises(SystemExit) as caught:
        main([path, "--output", str(tmp_path / "out"), *arguments])
    assert caught.value.code == 2
    assert message in capsys.readouterr().err
    assert sorted(tmp_path.iterdir()) == [tmp_path / "log.csv"]


def test_a_file_that_is_not_there(tmp_path, capsys):
    assert main([str(tmp_path / "none.csv"), "--output", str(tmp_path / "out")]) == 1
    assert "none.csv" in capsys.readouterr().err


def test_help_says_what_comes_out(capsys):
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    told = capsys.readouterr().out
    for text in ("exit codes", "unpickling runs whatever code", "--apply MODEL", "outside the"):
        assert text in told


@pytest.mark.usefixtures("no_report")
def test_more_rows_than_it_fits_to(tmp_path, log):
    path = write_log(tmp_path / "log.csv", log)
    arguments = [path, "--terms", "1,1,1,3", "--fit-rows", "200", "--quiet"]
    assert main([*arguments, "--output", str(tmp_path / "out")]) == 0
    compensator = GyroCompensator.read_json(tmp_path / "out" / "compensator.json")
    # The ends of every input's range are among the rows fitted to.
    assert (compensator.apply(log)["status"] & 1 == 0).all()


# What broke under attack.


class Bomb:
    """A pickle that makes a folder where it is loaded."""

    def __init__(self, folder):
        self.folder = folder

    def __reduce__(self):
        return os.mkdir, (str(self.folder),)


@pytest.mark.parametrize(
    "name", ["model.JSON", "model.jso", "model.txt", "model", "model.pkl", "model.joblib.json"]
)
def test_apply_unpickles_nothing_that_is_not_called_joblib(tmp_path, name, capsys):
    (tmp_path / name).write_bytes(pickle.dumps(Bomb(tmp_path / "ran")))
    with pytest.raises(SystemExit) as caught:
        main(["--apply", str(tmp_path / name), str(tmp_path / "log.csv")])
    assert caught.value.code == 2
    assert "is no gyro compensator" in capsys.readouterr().err
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize(
    ("source", "name"),
    [("joblib", "model.JOBLIB"), ("json", "model.joblib"), ("json", "model.txt"), ("json", "m")],
)
def test_apply_takes_json_by_any_name_and_joblib_in_capitals(calibrated, tmp_path, source, name):
    model = tmp_path / name
    shutil.copy(calibrated / "out" / f"compensator.{source}", model)
    target = tmp_path / "rates.csv"
    arguments = [str(calibrated / "raw.csv"), *RENAMED, *UNITS, "--quiet", "--output", str(target)]
    assert main(["--apply", str(model), *arguments]) == 0
    assert (pd.read_csv(target)["status"] == 0).all()


@pytest.mark.parametrize("content", [b"", b"hello", b"\x80\x04\x95", None])
def test_a_damaged_joblib_is_refused(calibrated, tmp_path, content, capsys):
    model = tmp_path / "model.joblib"
    whole = (calibrated / "out" / "compensator.joblib").read_bytes()
    model.write_bytes(whole[:200] if content is None else content)
    with pytest.raises(SystemExit):
        main(["--apply", str(model), str(calibrated / "raw.csv")])
    err = capsys.readouterr().err
    assert "model.joblib cannot be loaded" in err
    assert err.count("\n") == 4  # why it is unpickled, usage in two lines, and one sentence
    assert "loading it runs whatever code it holds" in err


@pytest.mark.usefixtures("few_rivals")
def test_labels_of_all_kinds_are_drawn_and_told(tmp_path, log, capsys, monkeypatch):
    monkeypatch.setattr("skanfis.gyro.html_report.PICTURES", _pictures.PICTURES[5:6])
    labels = dict(enumerate([r"$\frac{0$", "$$", "\x1b[31mred", "a\nb", "\u202ecba"]))
    labelled = log.assign(run=log["run"].map(labels))
    path, out = write_log(tmp_path / "log.csv", labelled), tmp_path / "out"
    assert main([path, *SMALL, "--output", str(out)]) == 0
    told = "".join(capsys.readouterr())
    assert all(sign.isprintable() or sign == "\n" for sign in told)


@pytest.mark.usefixtures("no_report")
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names of files are text")
@pytest.mark.parametrize("apply", [False, True])
def test_a_log_whose_name_is_not_utf8(calibrated, tmp_path, apply, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    path = os.fsdecode(b"raw\xff.csv")
    shutil.copy(calibrated / "raw.csv", path)
    how = ["--apply", str(calibrated / "out" / "compensator.json")] if apply else SMALL
    assert main([path, *RENAMED, *UNITS, *how]) == 0
    told = "".join(capsys.readouterr())
    assert "raw\\udcff" in told
    told.encode("utf-8")
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("apply", [False, True])
def test_an_output_that_cannot_be_written_is_found_out_first(calibrated, tmp_path, apply, capsys):
    (tmp_path / "file").write_text("here")
    how = ["--apply", str(calibrated / "out" / "compensator.json")] if apply else []
    arguments = [str(calibrated / "raw.csv"), *RENAMED, *UNITS, *how]
    assert main([*arguments, "--output", str(tmp_path / "file" / "out" / "x")]) == 1
    err = capsys.readouterr().err
    assert "Not a directory" in err or "File exists" in err
    assert "reading" not in err
    assert sorted(tmp_path.iterdir()) == [tmp_path / "file"]


@pytest.mark.usefixtures("no_report")
def test_a_failure_at_the_end_leaves_nothing_behind(tmp_path, log, monkeypatch, capsys):
    errors = [OSError(28, "No space left on device"), ValueError("bad luck")]

    def fail(*_):
        raise errors.pop()

    # What is written is the question: one calibration serves every attempt.
    calibrate = lru_cache(maxsize=None)(lambda: real(*told, **options))
    real, told, options = command.calibrate, [], {}

    def once(*arguments, **others):
        told[:] = told or arguments
        options.update(others)
        return calibrate()

    monkeypatch.setattr(command, "calibrate", once)
    path, out = write_log(tmp_path / "log.csv", log), tmp_path / "new" / "out"
    arguments = [path, *SMALL, "--output", str(out), "--quiet"]
    with monkeypatch.context() as patch:
        patch.setattr(command, "rules_text", fail)
        assert main(arguments) == 1
        assert capsys.readouterr().err.count("\n") == 1
        assert sorted(tmp_path.iterdir()) == [tmp_path / "log.csv"]
        # Files of before stay as they are, even with --force.
        out.mkdir(parents=True)
        (out / "report.html").write_text("old")
        assert main([*arguments, "--force"]) == 1
        assert [(p.name, p.read_text()) for p in out.iterdir()] == [("report.html", "old")]
    monkeypatch.setattr(command, "report_page", lambda *told: "new")
    assert main([*arguments, "--force"]) == 0
    assert (out / "report.html").read_text() == "new"


def test_a_backend_that_does_not_exist(fresh_process):
    found = fresh_process["backend_that_does_not_exist"]
    assert found["status"] == 1
    assert "matplotlib cannot be imported: Key backend: 'nonsense'" in found["told"]
    assert found["told"].count("\n") == 1
    assert found["made"] == []


def test_an_encoding_of_the_terminal_that_lacks_signs(tmp_path, log, monkeypatch):
    # As Python opens them there; what the one cannot say is an error, of the other it is spelt.
    told = io.TextIOWrapper(io.BytesIO(), "ascii", "backslashreplace", write_through=True)
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), "ascii", "strict"))
    monkeypatch.setattr(sys, "stderr", told)
    path = write_log(tmp_path / "log-°.csv", log.drop(columns="rate"), MEASURED[:3])
    assert main([path]) == 3
    assert rb"log-\xb0.csv" in told.buffer.getvalue()


def test_every_row_a_run_is_refused(tmp_path, log, capsys):
    path = write_log(tmp_path / "log.csv", log.assign(run=np.arange(len(log))))
    assert main([path, "--output", str(tmp_path / "out"), "--quiet"]) == 3
    assert "450 runs in 450 rows are too many" in capsys.readouterr().err


def test_groups_that_never_overlap_cannot_be_checked(tmp_path, log, capsys):
    # Three runs, each warmest, coldest or fastest to warm from its first row on.
    apart = log[log["run"] < 3].groupby("run").head(20).copy()
    apart["temperature"] = (20.0 * apart["run"]).where(apart["run"] < 2, 10.0)
    apart["output"] += 200.0 * (apart["run"] == 2)
    apart["rate"] += 200.0 * (apart["run"] == 2)
    path, out = write_log(tmp_path / "log.csv", apart), tmp_path / "out"
    arguments = [path, "--terms", "1,1", "--inputs", "temperature", "output", "--groups", "run"]
    assert main([*arguments, "--output", str(out), "--quiet"]) == 3
    assert "every row lies outside the range" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.usefixtures("few_rivals")
def test_short_runs_are_reported(tmp_path, log):
    path = write_log(tmp_path / "log.csv", log.groupby("run").head(6))
    arguments = [path, "--terms", "1,2", "--inputs", "temperature", "output", "--quiet"]
    arguments += ["--min-temperature-span", "0.1", "--groups", "run"]
    assert main([*arguments, "--output", str(tmp_path / "out")]) == 0


@pytest.mark.usefixtures("no_report")
def test_a_compensation_that_makes_it_worse_says_so(tmp_path, log, capsys):
    # Each of five runs has an offset, and their mean is zero: that of the others is minus a quarter
    # of one's own, and time tells nothing.
    spoilt = log.copy()
    runs = spoilt["run"].unique()
    offsets = dict(zip(runs, [1.0, -1.0, 1.0, -1.0, 0.0], strict=True))
    spoilt["output"] = spoilt["rate"] + spoilt["run"].map(offsets)
    path = write_log(tmp_path / "log.csv", spoilt)
    arguments = ["--inputs", "time", "--groups", "run", "--output", str(tmp_path / "out")]
    assert main([path, *arguments, "--terms", "1"]) == 0
    out, err = capsys.readouterr()
    worse = "the compensation makes held-out rows in range worse, from 0.8944 to 1.118"
    assert f"WARNING        {worse}" in out
    assert err.endswith("done, but see the warnings\n")


@pytest.mark.usefixtures("no_pictures", "few_rivals")
def test_a_glitch_is_named_by_its_line(tmp_path, log, capsys):
    spoilt = log.copy()
    spoilt.loc[100, "output"] += 140.0
    path, out = write_log(tmp_path / "log.csv", spoilt), tmp_path / "out"
    assert main([path, *SMALL, "--output", str(out), "--quiet"]) == 0
    page = (out / "report.html").read_text(encoding="utf-8")
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith(f"WARNING        {path}, line 102: the output of")
    # In the headline: before the first section.
    assert page.index("line 102") < page.index("<section>")


def test_a_log_that_moves_is_not_at_rest(tmp_path, log, capsys):
    path = write_log(tmp_path / "log.csv", log, ["time", "temperature", "output", "run"])
    arguments = ["--at-rest", "--output", str(tmp_path / "out"), "--quiet"]
    assert main([path, *arguments]) == 3
    assert "the gyro was not at rest" in capsys.readouterr().err
