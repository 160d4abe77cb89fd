"""The command: what it writes, says and refuses."""

import io
import os
import re
import shutil
import sys
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("matplotlib")

from skanfis.datasets import make_ofog
from skanfis.gyro import GyroCompensator, _simpler, command
from skanfis.gyro._options import make_parser
from skanfis.gyro.command import main
from skanfis.gyro.compensator import features

from ..quick import quick
from .planted import with_few_rivals

pytestmark = pytest.mark.usefixtures("coarse_report", "no_report")

REPORT, KINDS = command.report_page, _simpler.kinds
RAW = "--columns time=t_ms temperature=T output=counts --units time=ms temperature=K output=counts"
FACTOR = -27_000.0
FILES = ["compensator.json", "report.html", "rules.txt"]
# A fit of the smallest kind, where it is not the question.
SMALL = "--inputs temperature output --terms 1,2"
PARTS = ["time", "temperature", "output", "rate"]
EVERY = ("time", "temperature", "temperature_rate", "output")


@pytest.fixture(scope="module")
def log():
    log = make_ofog(n_devices=1, n_runs=5, duration=900.0, random_state=0)
    return log[[*PARTS, "run"]]


@pytest.fixture
def run(tmp_path, say):
    """The same for a log, which is written first if it is a table."""

    def run(log, typed="", output=tmp_path / "out"):
        if isinstance(log, pd.DataFrame):
            log.to_csv(tmp_path / "log.csv", index=False)
            log = tmp_path / "log.csv"
        return say(log, *typed.split(), "--output", output)

    return run


def names_in(folder):
    return sorted(path.name for path in folder.iterdir())


def written(folder):
    """The compensator that a calibration has left there."""
    return GyroCompensator.read_json(folder / "out" / "compensator.json")


@pytest.fixture(scope="module")
def no_report(given_weights):
    """Without the report and what it compares with, which take longer than all else together."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(command, "report_page", lambda results, title: title)
        with_few_rivals(patch)
        yield


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory, log, no_report):
    """A folder after one calibration from columns in counts, milliseconds and kelvin."""
    folder = tmp_path_factory.mktemp("calibrated")
    raw = {"t_ms": 1000 * log["time"] + 5e6, "T": log["temperature"] + 273.15}
    raw |= {"counts": FACTOR * log["output"], "run": log["run"], "table": log["rate"]}
    pd.DataFrame(raw).to_csv(folder / "raw.csv", index=False)
    typed = f"{RAW} --columns rate=table --terms 1,2,1,3 --c c99 --write rules --outside nan"
    assert main([str(folder / "raw.csv"), *typed.split(), "--output", str(folder / "out")]) == 0
    return folder


def test_it_writes_what_it_says_and_the_compensator_knows_units_and_policy(calibrated, log):
    assert names_in(calibrated / "out") == sorted([*FILES, "compensator.c", "compensator.h"])
    assert "temperature_rate in degC/s" in (calibrated / "out" / "rules.txt").read_text("utf-8")
    compensator = written(calibrated)
    slope = np.polyfit(log["rate"], FACTOR * log["output"], 1)[0]
    assert compensator.scale_factor == pytest.approx(slope, rel=1e-9)
    assert compensator.output_unit == "counts"
    assert compensator.inputs == EVERY
    counts = log.assign(output=FACTOR * log["output"])
    assert (compensator.apply(counts)["rate_compensated"] - log["rate"]).std() < 0.01
    hot = compensator.apply(counts.assign(temperature=log["temperature"] + 100.0))
    assert hot["rate_compensated"].isna().all()
    assert (hot["status"] == 1 + 8).all()


def test_what_is_refused_once_there_is_a_compensator(calibrated, log, run):
    out = calibrated / "out"
    typed = f"--apply {out / 'compensator.json'} --units temperature=degC time=s"
    code, _, err = run(log, typed)
    assert (code, "calibrated for an output in counts; this is in deg/s" in err) == (2, True)
    before = (out / "report.html").stat().st_mtime_ns
    for typed, output, told in (
        ("", out, "exists already"),
        ("--force", out / "rules.txt", "is a file; --output is the folder"),
        (f"--apply {out / 'compensator.json'}", out / "rules.txt", "exists already"),
    ):
        code, _, err = run(calibrated / "raw.csv", f"{RAW} --columns rate=table {typed}", output)
        assert (code, told in err) == (4, True)
    assert (out / "report.html").stat().st_mtime_ns == before


@pytest.mark.parametrize(
    ("write", "kind", "c"),
    [
        ("recommended", "the arcsine law", "c99:float"),
        ("none", "no compensation", "c89"),
        ("cubic", "a cubic polynomial", "c89:float"),
        ("line", "a straight line", "c99"),
    ],
)
def test_what_is_recommended_or_asked_for_is_written(
    tmp_path, log, write, kind, c, run, monkeypatch
):
    if write in ("recommended", "cubic"):
        monkeypatch.setattr(_simpler, "kinds", KINDS)
    log = log[log["run"] < 4]
    code, said, _ = run(log, f"--inputs temperature output --terms 1,1 --c {c} --write {write}")
    assert (code, f"written is     {kind}, as" in said) == (0, True)
    out, compensator = tmp_path / "out", written(tmp_path)
    X, rate = log[["temperature", "output"]], log["rate"]
    # What each of them is: test_simpler.py.
    fits = {name: fit for name, _, fit in KINDS(tuple(X), "linear")}
    name = kind.removeprefix("the ").removeprefix("a ")
    model = fits[name](X, rate if write == "recommended" else log["output"] - rate)
    expected = model.predict(X) if write == "recommended" else log["output"] - model.predict(X)
    found = compensator.apply(log)
    np.testing.assert_allclose(found["rate_compensated"], expected, atol=1e-9)
    assert (found["status"] == 0).all()
    header = (out / "compensator.h").read_text(encoding="ascii")
    assert "Unit assumed: 'output' has no unit, taken as deg/s" in header
    assert "[0] temperature" in header
    assert f"; {c[:3].upper()}, {'float' if 'float' in c else 'double'}." in header
    # A law alone has no rules, and no edge that is held.
    goes_on = "Outside this range the law goes on as it is." in header
    assert goes_on == (write == "recommended")
    assert "the rules" not in header
    assert compensator.units["output"] == "deg/s"
    units, text = (out / "rules.txt").read_text(encoding="utf-8").split("\n\n", 1)
    assert units == "Units: rates and errors in deg/s, temperature in degC, output in deg/s."
    assert text.startswith("rate [deg/s] = arcsin(" if write == "recommended" else "rate = output")


def test_progress_and_summary(tmp_path, log, say, monkeypatch):
    monkeypatch.chdir(tmp_path)
    log[log["run"] < 3].to_csv("log.csv", index=False)
    limits = ["residual_rms=90deg/s", "residual_rms=1e-9deg/s"]
    (tmp_path / "log-compensator").mkdir()
    (tmp_path / "log-compensator" / "mine.txt").touch()
    # The folder is called after the first file of a pattern.
    code, out, err = say("l*.csv", "--inputs", "temperature", "output", "--limits", *limits)
    # All is written, and a limit is not kept.
    assert code == 6
    assert "specification  1 of 2 limits kept; not kept: residual rms" in out
    assert f"written to     log-compensator: {', '.join(FILES)}\n" in out
    for text in ("reading", "270 rows, 3 runs", "fold 3 of 3", "done"):
        assert text in err
    assert "whole runs held out (3 runs, 3 folds; rows of one run are alike)" in out
    assert "error before" in out
    assert "held-out rows in range" in out


def test_targets_are_written_or_refused_by_name(tmp_path, log, run, monkeypatch):
    log, out = log[log["run"] < 3], tmp_path / "out"
    both = "--inputs temperature output --terms 1,1 --physics --write rules --target rate-table"
    code, told, err = run(log, f"{both} px4:x")
    # Before the calibration.
    assert (code, "checking" in err) == (2, False)
    assert "--target px4:x needs --inputs temperature; the model would have temperature, out" in err
    code, told, err = run(log, f"{both} --quiet")
    assert (code, err) == (0, "")
    assert "target         rate-table: it differs from the model by " in told
    assert "THEN rate beyond the law is " in (out / "rules.txt").read_text(encoding="utf-8")
    assert written(tmp_path).predicts == "rate"
    assert names_in(out) == sorted([*FILES, "gyro_rate_table.c", "gyro_rate_table.h"])
    monkeypatch.setattr("skanfis.gyro.targets.write._MOST_TIMES", 0.5)
    code, told, _ = run(log, f"{both} --force")
    assert (code, "REFUSED        rate-table: it leaves " in told) == (5, True)
    # What an earlier run has written goes with it, what is not the command's stays.
    for name in ("compensator.c", "px4.params", "notes.txt"):
        (out / name).write_text("old")
    assert run(log, f"{SMALL} --quiet --write line --force")[0] == 0
    assert names_in(out) == sorted([*FILES, "notes.txt"])


def groups_apart(log):
    """Three runs, each warmest, coldest or fastest to warm from its first row on."""
    apart = log[log["run"] < 3].groupby("run").head(20).copy()
    apart["temperature"] = (20.0 * apart["run"]).where(apart["run"] < 2, 10.0)
    apart[["output", "rate"]] += 200.0 * (apart[["run"]] == 2).to_numpy()
    return apart


def largest_number(log):
    """A glitch that hides all else."""
    return log.assign(output=(1e4 * log["output"]).where(log.index != 100, 2**31 - 1))


HIDDEN = (
    r"log.csv, line 102, column 'output': does not follow the rate .* the wrong one\? No other row "
    r"supports the output of 2.147e\+09 at a rate of"
)


@pytest.mark.parametrize(
    ("spoil", "typed", "message"),
    [
        (groups_apart, f"{SMALL} --groups run", "lies outside the range of the other"),
        (largest_number, "--units output=counts", HIDDEN),
    ],
)
def test_bad_logs_are_refused_in_one_sentence(tmp_path, log, spoil, typed, message, run):
    code, _, err = run(spoil(log), f"{typed} --quiet")
    assert code == 3
    assert re.search(message, err)
    assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        ("--columns time", "'time' must be of the form PART=NAME."),
        ("--columns time=a time=b", "time is given twice"),
        ("--units time=year", "time has no unit 'year'"),
        ("--terms 2,x", "must be search, or numbers"),
        ("--terms 2,2", "has 2 numbers for 4 inputs: time, temperature, "),
        ("--physics --inputs temperature", "needs the output"),
        ("--write law-line --inputs temperature", "--write law-line: the arcsine law needs the"),
        ("--inputs rate", "invalid choice: 'rate'"),
        ("--terms 99999999,1,1,1", "'99999999,1,1,1' makes 99,999,999 rules; give at most 500"),
        (f"--terms {'9' * 9000}", "must be search, or numbers"),
        ("--inputs time time", "--inputs: time is given twice"),
        ("--scale-factor 131", "is only for a raw signal at one rate"),
        ("--target px4", "'px4' must be one of: table[:TYPE], in C"),
        ("--target ardupilot:x:0", "from 1 to 3"),
        ("--target table table:q15", "--target: table is given twice"),
        ("--apply m --terms 1 --write law", "--terms, --write: for a calibration only."),
        ("--apply m --scale-factor 3", "--scale-factor: for a calibration only."),
    ],
)
def test_options_that_make_no_sense(tmp_path, log, typed, message, run):
    code, _, err = run(log, typed)
    assert code == 2
    assert message in err
    assert names_in(tmp_path) == ["log.csv"]


def test_help_names_every_option(say):
    code, told, _ = say("--help")
    assert code == 0
    for text in ("exit codes", "--apply MODEL", *make_parser()._option_string_actions):
        assert text in told
    codes = (command.REFUSED, command.EXISTS, command.INCOMPLETE, command.NOT_KEPT, command.CLOSED)
    assert all(f"\n  {code}  " in told or f"    {code}  " in told for code in codes)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names of files are text")
@pytest.mark.parametrize("apply", [False, True])
def test_a_log_whose_name_is_not_utf8(calibrated, tmp_path, apply, monkeypatch, say):
    monkeypatch.chdir(tmp_path)
    path = os.fsdecode(b"raw\xff.csv")
    shutil.copy(calibrated / "raw.csv", path)
    how = f"--apply {calibrated / 'out' / 'compensator.json'}" if apply else SMALL
    code, *told = say(path, *f"{RAW} --columns rate=table {how}".split())
    told = "".join(told)
    assert (code, "raw\\udcff" in told) == (0, True)
    told.encode("utf-8")
    assert len(list(tmp_path.iterdir())) == 2


def test_an_output_that_cannot_be_written_is_found_out_first(tmp_path, log, run):
    code, _, err = run(log, output=tmp_path / "log.csv" / "out" / "x")
    assert code == 1
    assert "Not a directory" in err or "File exists" in err
    assert "reading" not in err


def test_a_failure_at_the_end_leaves_nothing_behind(tmp_path, log, monkeypatch, run):
    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(command, "rules_text", fail)
    log, out = log[log["run"] < 3], tmp_path / "new" / "out"
    code, _, err = run(log, f"{SMALL} --quiet", out)
    assert (code, err.count("\n")) == (1, 1)
    assert names_in(tmp_path) == ["log.csv"]
    # Files of before stay as they are, even with --force.
    out.mkdir(parents=True)
    (out / "report.html").write_text("old")
    assert run(log, f"{SMALL} --force", out)[0] == 1
    assert [(p.name, p.read_text()) for p in out.iterdir()] == [("report.html", "old")]


def test_a_failure_while_files_are_moved_leaves_those_of_before(tmp_path, log, monkeypatch, run):
    log, out = log[log["run"] < 3], tmp_path / "out"
    typed = f"{SMALL} --quiet --force --write line"
    assert run(log, f"{typed} --c c99")[0] == 0
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    move, moves = os.replace, []

    def fail(*places):
        moves.append(places)
        if len(moves) == 6:
            raise OSError(28, "No space left on device")
        move(*places)

    monkeypatch.setattr(os, "replace", fail)
    assert run(log, typed)[0] == 1
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


@pytest.mark.parametrize(
    ("where", "told"), [("rules_text", "nothing was written"), ("_say", "all is written to {}")]
)
def test_ctrl_c_says_whether_files_were_written(tmp_path, log, monkeypatch, run, where, told):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(command, where, interrupt)
    code, _, err = run(log[log["run"] < 3], f"{SMALL} --quiet")
    out = tmp_path / "out"
    assert (code, out.exists()) == (command.INTERRUPTED, where == "_say")
    assert err.endswith(f"interrupted; {told.format(out)}.\n")


@pytest.mark.skipif(sys.platform == "win32", reason="there a closed pipe is another error")
def test_a_reader_that_goes_away_ends_it_quietly(calibrated, tmp_path, monkeypatch):
    reader, writer = os.pipe()
    os.close(reader)
    model, rates = calibrated / "out" / "compensator.json", tmp_path / "rates.csv"
    typed = f"{calibrated / 'raw.csv'} --apply {model} {RAW} --columns rate=table --output {rates}"
    with open(writer, "w") as out, open(tmp_path / "err", "w", 1) as err:
        monkeypatch.setattr(sys, "stdout", out)
        monkeypatch.setattr(sys, "stderr", err)
        assert main(typed.split()) == command.CLOSED
    assert (tmp_path / "err").read_text().endswith(("done\n", f"writing {rates}\n"))
    assert rates.exists()


def test_a_backend_that_does_not_exist(fresh_process):
    found = fresh_process["backend_that_does_not_exist"]
    assert found["status"] == 1
    assert "Key backend: 'nonsense' is not a valid value" in found["told"]
    assert found["told"].count("\n") == 1
    assert found["made"] == []


def test_an_encoding_of_the_terminal_that_lacks_signs(tmp_path, log, monkeypatch):
    # As Python opens them there; what the one cannot say is an error, of the other it is spelt.
    told = io.TextIOWrapper(io.BytesIO(), "ascii", "backslashreplace", write_through=True)
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), "ascii", "strict"))
    monkeypatch.setattr(sys, "stderr", told)
    log[["time", "temperature", "output"]].to_csv(tmp_path / "log-°.csv", index=False)
    assert main([str(tmp_path / "log-°.csv")]) == 3
    assert rb"log-\xb0.csv" in told.buffer.getvalue()


def test_a_compensation_that_makes_it_worse_says_so(log, run):
    # Each of five runs has an offset, and their mean is zero: that of the others is minus a quarter
    # of one's own, and time tells nothing.
    offsets = log["run"].map(dict(enumerate([1.0, -1.0, 1.0, -1.0, 0.0])))
    typed = "--inputs time --groups run --terms 1 --write rules"
    code, out, err = run(log.assign(output=log["rate"] + offsets), typed)
    assert code == 0
    worse = "the compensation makes held-out rows in range worse, from 0.8944 to 1.118"
    assert f"WARNING        {worse}" in out
    assert err.endswith("done, but see the warnings\n")


def test_a_glitch_is_named_by_its_line(tmp_path, log, run, monkeypatch, no_pictures):
    monkeypatch.setattr(command, "report_page", REPORT)
    spoilt = log.assign(output=log["output"] + 140.0 * (log.index == 100))
    code, out, _ = run(spoilt, SMALL)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    warning = f"WARNING        {tmp_path / 'log.csv'}, line 102: the output of"
    assert (code, out.splitlines()[-1].startswith(warning)) == (0, True)
    # In the headline: before the first section, as are units that nobody has said.
    for told in ("line 102", "&#39;output&#39; has no unit, taken as deg/s"):
        assert page.index(told) < page.index("<section>")


def test_what_a_log_without_times_or_runs_lacks_is_told(log, run):
    code, said, _ = run(log.drop(columns="time"), SMALL)
    told = "no column of the time is found, so neither it nor the temperature's rate is an input"
    assert (code, told in said) == (0, True)
    code, said, _ = run(log.drop(columns="run"), f"{SMALL} --force")
    told = "is split into 5 runs, where the time begins anew or steps by more than"
    assert (code, told in said) == (0, True)
    assert "if that is no power-on, number the runs in a column" in said


def thermal_cycle(*turns, n_rows=300, lag=0.05):
    """A MEMS log: a bias that is a parabola of the temperature, and lags behind by its rate."""
    legs = [np.linspace(a, b, n_rows, endpoint=False) for a, b in pairwise(turns)]
    temperature = np.concatenate(legs)
    time = 10.0 * np.arange(temperature.size)
    bias = 0.2 + 0.01 * temperature + 1e-4 * temperature**2
    bias += lag * np.sign(np.gradient(temperature))
    noise = np.random.default_rng(0).normal(scale=1e-3, size=(2, time.size))
    table = {"Timestamp [ms]": 1000.0 * time, "Temp": temperature}
    return pd.DataFrame(table | {"gyro_x_dps": bias + noise[0], "gyro_y_dps": noise[1] - bias})


def test_a_thermal_cycle_at_rest(tmp_path, run):
    typed = "--terms 3,1 --write rules"
    code, said, _ = run(thermal_cycle(20, -20, 60, -20, 60, 20), typed)
    assert code == 0
    assert "whole legs between turning points of the temperature held out (5 legs" in said
    assert "taken as at rest" in said
    assert "time = 'Timestamp [ms]' in ms; temperature = 'Temp'" in said
    assert "output = 'gyro_x_dps' in deg/s ('gyro_y_dps' would do too)" in said
    assert written(tmp_path).inputs == ("temperature", "temperature_rate")
    log = pd.DataFrame({"time": [0.0, 1e4], "temperature": 10.0, "output": 0.31})
    # Neither warming nor cooling: between the two.
    assert written(tmp_path).apply(log)["rate_compensated"].abs().max() < 0.02


def test_a_small_rate_that_is_not_used_is_said_and_a_constant_is_no_output(run):
    log = thermal_cycle(20, -20, 60, 20).rename(columns={"gyro_y_dps": "rate [dps]"})
    log["rate [dps]"] *= 0.05
    code, said, _ = run(log, "--write constant --terms 1,1")
    told = f"is {log['rate [dps]'].abs().max():.3g} deg/s at most and not used (if it is the gyro's"
    assert (code, told in said) == (0, True)
    still = log.assign(gyro_x_dps=3)
    code, _, said = run(still, "--force")
    assert (code, "all values are 3" in said) == (3, True)
    assert "--columns output=NAME" in said
    code, _, said = run(still.drop(columns="rate [dps]"), "--force")
    assert code == 3
    assert "'gyro_x_dps' is taken for the output, no column for the true rate" in said
    assert "the output is 3 throughout: no gyro gives that." in said


def test_the_earth_s_rate_is_no_bias(tmp_path, run):
    log, found = thermal_cycle(20, -20, 60, 20).drop(columns="gyro_y_dps"), []
    for table, told in ((log, "no column"), (log.assign(rate_dps=0.003), "is 0.003 deg/s through")):
        code, said, _ = run(table, "--write constant --terms 1,1 --force")
        assert (code, told in said) == (0, True)
        row = pd.DataFrame({"time": [0.0], "temperature": 10.0, "output": 0.0})
        found.append(written(tmp_path).apply(row)["rate_compensated"].iloc[0])
    assert found[1] - found[0] == pytest.approx(0.003)


def test_one_cycle_in_counts_is_checked_by_pieces_and_needs_a_scale_factor(tmp_path, run):
    log = thermal_cycle(-20, 60, -20)
    log["gyro_x_lsb"] = (131.0 * log["gyro_x_dps"]).round()
    log = log.drop(columns=["gyro_x_dps", "gyro_y_dps"])
    code, _, said = run(log, "--terms 3,1")
    assert (code, "does not tell its scale factor" in said) == (3, True)
    code, said, _ = run(log, "--terms 3,1 --scale-factor 131")
    assert code == 0
    assert "pieces of the legs" in said
    assert "so few cycles cannot show whether they repeat" in said
    # What is safe is written, and pieces have one number.
    assert "Use a constant: one thermal cycle cannot show whether more would repeat" in said
    assert "record two more" in said
    assert "2 legs, 5 pieces of each" in said
    assert "written is     a constant, as recommended" in said
    compensator = written(tmp_path)
    assert compensator.estimator.model.n_rules == 1
    assert (compensator.scale_factor, compensator.output_unit) == (131.0, "counts")


def test_a_scale_factor_needs_rates_that_the_output_follows_whatever_the_inputs(tmp_path, log, run):
    steady = log.assign(rate=50.0, output=131.0 * (50.0 + 0.01 * log["temperature"]))
    jitter = 1e-3 * np.random.default_rng(0).normal(size=len(log))
    typed = "--inputs temperature --units output=counts --terms 2"
    code, _, said = run(steady.assign(rate=50.0 + jitter), typed)
    assert (code, "'output': does not follow the rate" in said) == (3, True)
    code, _, said = run(steady, typed)
    told = "one rate, as at rest, does not tell its scale factor"
    assert (code, told in said) == (3, True)
    assert run(steady, f"{typed} --scale-factor 131")[0] == 0
    assert written(tmp_path).scale_factor == 131.0
    rates = written(tmp_path).apply(steady)["rate_compensated"]
    assert (rates - 50.0).abs().max() < 0.5


def test_the_axis_of_an_autopilot_is_that_of_the_output(log, run):
    noise = np.random.default_rng(0).normal(size=len(log))
    table = log.drop(columns="output").assign(gyro_x=noise, gyro_y=log["output"])
    code, _, said = run(table, "--terms 1,1,2 --target table px4:x")
    assert (code, "px4:x: the output was taken from 'gyro_y'" in said) == (2, True)


@pytest.fixture(scope="module")
def two_runs():
    """On clocks that begin anew."""
    log = make_ofog(n_devices=1, n_runs=2, duration=600.0, sampling_interval=2.0, random_state=0)
    return log[[*PARTS, "run"]]


@pytest.fixture(scope="module")
def model(two_runs, tmp_path_factory):
    X = features(two_runs, EVERY, time_constant=60.0)
    estimator = quick([2, 2, 2, 1]).fit(X, two_runs["output"] - two_runs["rate"])
    path = tmp_path_factory.mktemp("model") / "compensator.json"
    GyroCompensator(estimator, EVERY).write_json(path)
    return path


@pytest.fixture
def applied(model, tmp_path, say):
    """What gives a log to the command, with the model: rates and status, and what is said."""

    def applied(table):
        path, target = tmp_path / "log.csv", tmp_path / "rates.csv"
        table.to_csv(path, index=False)
        code, said, _ = say("--apply", model, path, "--output", target, "--force")
        assert code == 0
        return pd.read_csv(target), said

    return applied


def test_runs_side_by_side_are_compensated_each_by_itself(two_runs, model, applied):
    # As one logger writes two devices.
    table = two_runs.sort_values(["time", "run"], kind="stable")
    rates = applied(table)[0]["rate_compensated"]
    # By the compensator itself, one run after the other.
    expected = GyroCompensator.read_json(model).apply(two_runs).loc[table.index]
    np.testing.assert_allclose(rates, expected["rate_compensated"], rtol=1e-9, atol=1e-11)


def test_time_counts_from_power_on_and_not_from_the_first_row_that_is_left(
    two_runs, model, applied
):
    is_last = two_runs["run"] == two_runs["run"].iloc[-1]
    lacking = is_last & (two_runs["time"] < 100.0)
    whole = two_runs.assign(output=two_runs["output"].mask(lacking))
    found, told = applied(whole)
    assert "power-on is taken to be where the clock begins, at 0 s" in told
    assert "note           units as in the calibration: 'temperature' has no unit" in told
    kept = whole.dropna()
    assert len(found) == len(kept)
    expected = GyroCompensator.read_json(model).apply(whole.bfill()).loc[kept.index]
    settled = (~is_last[kept.index] | (kept["time"] > 500.0)).to_numpy()
    after, due = (each["rate_compensated"].to_numpy()[settled] for each in (found, expected))
    np.testing.assert_allclose(after, due, rtol=1e-3)


def test_rows_without_the_true_rate_are_compensated(two_runs, applied):
    few = two_runs.assign(rate=two_runs["rate"].mask(two_runs.index < 99))
    pd.testing.assert_frame_equal(*(applied(table)[0] for table in (two_runs, few)))


def test_each_run_of_one_clock_counts_from_its_own_power_on(two_runs, applied):
    start, found = 9000.0 * two_runs["run"].astype(float), []
    for since, told in ((0.0, ", at 0 s"), (start, ", in each run, first at ")):
        rates, said = applied(two_runs.assign(time=two_runs["time"] + since))
        assert f"power-on is taken to be where the clock begins{told}" in said
        found.append(rates["rate_compensated"])
    np.testing.assert_allclose(*found, rtol=1e-9)
