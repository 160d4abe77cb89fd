"""Logs as they come: what a logger, a spreadsheet or a bench writes is read as it was meant."""

import sys
import time

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from skanfis.datasets import make_ofog
from skanfis.gyro import LogError
from skanfis.gyro._guess import Request
from skanfis.gyro.log import find_logs, read

ASKED = {"require": ("temperature", "output"), "guess": True}
PARTS = ["time", "temperature", "output", "rate"]


@pytest.fixture(scope="module")
def truth():
    """Five runs, an hour from one to the next, on one clock."""
    log = make_ofog(n_devices=1, n_runs=5, duration=600.0, random_state=0)
    log = log.round({"temperature": 3, "output": 6})
    return log.assign(clock=log["time"] + 3600.0 * log["run"].astype(float) + 79_200.0)


def found(path, **options):
    paths = path if isinstance(path, list) else [path]
    return read(paths, Request(**(ASKED | options)))


def found_in(folder, table, **options):
    """What is read of a table as a spreadsheet writes it."""
    table.to_csv(folder / "log.csv", index=False)
    return found(folder / "log.csv", **options)


def same(reading, truth, parts=PARTS[1:]):
    for part in parts:
        np.testing.assert_allclose(reading.log[part], truth[part], rtol=1e-9, atol=1e-9)


def test_files_of_a_logger_that_begins_a_new_one_now_and_then(tmp_path, truth):
    """A run that is cut is one run; one from zero on is another, and one a while later too."""
    parts = [rows.iloc[k : k + 20] for _, rows in truth.groupby("run") for k in (0, 20, 40)]
    for clock in ("time", "clock"):
        paths = [tmp_path / f"{clock}{number}.csv" for number in range(15)]
        for path, part in zip(paths, parts, strict=True):
            part[[clock, *PARTS[1:]]].to_csv(path, index=False)
        reading = found(paths, columns={"time": clock})
        same(reading, truth)
        assert (pd.factorize(reading.log["run"])[0] == pd.factorize(truth["run"])[0]).all()
        start = reading.log.groupby("run", observed=True)["time"].transform("first")
        assert (reading.log["power_on"] == start).all()
        assert any("the run goes on in 10 files, first" in note for note in reading.notes)
        # Out of their order none goes on.
        assert found(paths[::-1], columns={"time": clock}).log["run"].nunique() == 15


@pytest.mark.parametrize(("told", "done"), [("rate_cmd", "rate_enc"), ("setpoint", "actual")])
def test_the_rate_is_what_the_table_did_not_what_it_was_told(tmp_path, truth, told, done):
    rates = {f"{told}_dps": 0.0, f"{done}_dps": truth["rate"]}
    same(found_in(tmp_path, truth[PARTS[:3]].assign(**rates)), truth)


def test_rows_that_lack_a_value_are_counted_and_lines_stay_right(tmp_path, truth):
    table = truth[PARTS].astype(object)
    table.loc[5, "output"], table.loc[9, "temperature"], table.loc[200, "rate"] = "---", "", "NaN"
    table.loc[210] = PARTS  # the header again
    reading = found_in(tmp_path, table)
    kept = truth.drop(index=[5, 9, 200, 210])
    same(reading, kept, PARTS)
    told = "4 of 300 rows lack a value ('time' in 1, 'temperature' in 2, 'output' in 2, 'rate' in 2"
    assert any(told in note and "line 7" in note for note in reading.notes)
    for row in (4, 5, 7, 8, 250):
        assert reading.name_row(row).endswith(f"line {kept.index[row] + 2}")
    with pytest.raises(LogError, match="line 212, column 'time': the value is missing"):
        found(tmp_path / "log.csv", guess=False)
    # A run of which nothing is left is named.
    labels = {"run": truth["run"] + 1, "device": "A"}
    for part, lost, run in (("output", table, "2"), ("time", table.assign(**labels), "A / 2")):
        lost = lost.assign(**{part: lost[part].mask(labels["run"] == 2)})
        told = f"; left out, first at line 7; no row is left of run {run!r}"
        assert found_in(tmp_path, lost).notes[-1].endswith(told)
    table.loc[100:, "rate"] = ""
    with pytest.raises(LogError, match=r"rows lack a value .* too many to leave out"):
        found_in(tmp_path, table)


def test_the_columns_of_a_rate_table_with_all_that_confuses(tmp_path, truth):
    pytest.importorskip("pyarrow")
    names = {"temperature": "temp_c", "rate": "rate_true_deg_s"}
    table = truth[["temperature", "rate"]].rename(columns=names)
    table.insert(0, "rate_true_rad_s", np.radians(truth["rate"]))
    table.insert(0, "gyro_counts", -27_000.0 * truth["output"])
    table = table.assign(seq=range(len(truth)), temp_trend=np.where(truth.index % 2, 1, -1))
    table = table.assign(sweep_start_temp_c=20.5, author_fit_residual_rad_s=1e-4)
    table.to_parquet(tmp_path / "log.parquet")
    for reading in (found_in(tmp_path, table), found(tmp_path / "log.parquet")):
        assert list(reading.log) == ["temperature", "output", "rate"]
        same(reading, truth, ["temperature", "rate"])
        assert reading.units["output"] == "counts"
        np.testing.assert_allclose(reading.log["output"], -27_000.0 * truth["output"])


@pytest.mark.parametrize("name", ["temperature_rate", "Temp rate", "rate_of_temperature"])
def test_the_rate_of_a_temperature_is_no_rate_of_the_table(tmp_path, truth, name):
    slope = np.gradient(truth["temperature"], 10.0)
    noise = truth["rate_random_walk"]
    table = truth[PARTS[:3]].assign(**{name: slope}, random_walk_rate=noise)
    assert "rate" not in found_in(tmp_path, table).log
    # Nor where the column of the rate is none of numbers: that is what is said.
    commas = truth["rate"].map("{:.6f}".format).str.replace(".", ",")
    with pytest.raises(LogError, match=r"line 2, column 'rate': '-?\d+,\d{6}' is not a number"):
        found_in(tmp_path, table.assign(rate=commas))
    thousands = (3600.0 * truth["rate"]).map("{:,.1f}".format)
    with pytest.raises(LogError, match=r"column 'table \[deg/h\]' \(rate\): '\S+' is not a number"):
        found_in(tmp_path, table.assign(**{"table [deg/h]": thousands}))


@pytest.mark.parametrize("decimal", [".", ","])
def test_numbers_with_a_true_minus_sign(tmp_path, truth, decimal):
    text = truth[PARTS].to_csv(index=False, sep=";", decimal=decimal)
    (tmp_path / "log.csv").write_text(text.replace("-", "\u2212"), encoding="utf-8")
    same(found(tmp_path / "log.csv"), truth)


@pytest.mark.parametrize("name", ["U_mV", "gyro_mV", "U [mV]"])
def test_a_raw_signal_is_no_rate(tmp_path, truth, name):
    """The lone rate of a log is the gyro's own, but not where a voltage follows it."""
    table = truth[["time", "temperature"]].assign(rate_dps=truth["rate"])
    table[name] = -8.0 * truth["output"]
    reading = found_in(tmp_path, table, require=("temperature", "output", "rate", "time"))
    layout = reading.files[0].layout
    assert (layout.name("output"), layout.name("rate")) == (name, "rate_dps")
    assert reading.units["output"] == "mV"


def test_many_files_a_pattern_and_headers_that_nearly_agree(tmp_path, truth):
    folder = tmp_path / "logs"
    folder.mkdir()
    spelt = {2: {"Temp": " temp"}, 3: {"Temp": "TEMP"}}
    for number, (_, part) in zip((1, 2, 3), truth.groupby("run"), strict=False):
        table = part.rename(columns={"temperature": "Temp"})[["time", "Temp", "output", "rate"]]
        table.rename(columns=spelt.get(number, {})).to_csv(folder / f"r{number}.csv", index=False)
    paths = find_logs([f"{folder}/r*.csv"])
    assert [path[-6:] for path in paths] == ["r1.csv", "r2.csv", "r3.csv"]
    assert find_logs([*paths, f"{folder}/x*.csv"]) == [*paths, f"{folder}/x*.csv"]
    reading = found(paths)
    same(reading, truth[truth["run"].astype(int) < 3])
    assert list(reading.log["run"].cat.categories) == ["r1", "r2", "r3"]
    assert reading.name_row(60).endswith("r2.csv, line 2")
    table.rename(columns={"output": "gyro_counts"}).to_csv(folder / "r4.csv", index=False)
    with pytest.raises(LogError, match=r"r4.csv: the output is in counts, in .* in deg/s"):
        found([*paths, str(folder / "r4.csv")])


@pytest.mark.parametrize(
    ("times", "runs"),
    [
        (np.r_[0:100, 0:100, 0:50], [1] * 100 + [2] * 100 + [3] * 50),  # set anew
        (np.r_[0:100, 100 + 500 : 700], [1] * 100 + [2] * 100),  # a rest
        (np.r_[0:100, 130:230], None),  # half a minute lost
    ],
)
def test_runs_are_told_by_the_time(tmp_path, times, runs):
    output = 0.01 * np.arange(times.size)
    table = pd.DataFrame({"time": times, "temperature": 20.0, "output_dps": output})
    log = found_in(tmp_path, table).log
    assert ("run" in log) == (runs is not None)
    if runs is not None:
        assert log["run"].astype(int).tolist() == runs
    # A row out of order is no run.
    table.loc[60, "time"] = table.loc[58, "time"]
    with pytest.raises(LogError, match="line 62, column 'time': time does not increase"):
        found_in(tmp_path, table)
    # That of a run turned round is named.
    table = table.assign(run=np.arange(len(table)) // 20, time=np.arange(len(table)))
    table.loc[20:39, "time"] = table.loc[39:20:-1, "time"].to_numpy()
    with pytest.raises(LogError, match=r"line 23, column 'time': time does not .* within run '1':"):
        found_in(tmp_path, table)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\n\n  \n", "is empty"),
        (b"Time [h],Temp (F),FOG (deg/h)\n", "has no rows with values"),
        (b"1,2,3\n4,5,6\n", "log.csv: has numbers where names are due"),
        (bytes(range(256)), "is not text .* or unpack it"),
        (b"temp,gyro\n20,1\n21,\x81\n", "is not text"),
        (b"time,temp,gyro\n10:00:00,20,2\nnoon,21,2\n10:00:02,22,3\n", "line 3, column 'time': 'n"),
        (b"temp,gyro\n20,1\n21,1e999\n22,3\n", "line 3, column 'gyro' .output.: .* (inf|not a n)"),
        (",".join(f"c{k}" for k in range(10**6)).encode(), "line 1: is longer than"),
        (b"a,b\n1,2\n" + b"," * 2**22, "line 3: is longer than"),
        (b"," * 20_000 + b"\n1,2\n", "line 1: has 20,001 columns"),
        ((b"," * 999 + b"\n") * 1000, "has no row of numbers in its first 60 lines"),
    ],
)  # fmt: skip
def test_what_is_no_log_is_refused_in_words_and_at_once(tmp_path, content, message):
    (tmp_path / "log.csv").write_bytes(content)
    begin = time.perf_counter()
    with pytest.raises(LogError, match=message):
        found(tmp_path / "log.csv")
    assert time.perf_counter() - begin < 1.0


@pytest.mark.parametrize(
    ("suffix", "library", "length", "end"),
    [
        *((suffix, library, 0, b"MATLAB 5.0 and no more" * 20)
          for suffix, library in (("parquet", "pyarrow"), ("xlsx", "openpyxl"), ("mat", "scipy"))),
        *(("mat", "scipy", *kept) for kept in ((4, b""), (-9, b""), (-9, bytes(9)))),
    ],
)  # fmt: skip
def test_a_file_that_was_cut_or_damaged_is_refused(tmp_path, truth, suffix, library, length, end):
    pytest.importorskip(library)
    savemat(tmp_path / "log.mat", {"output": truth["output"].to_numpy()}, do_compression=True)
    sound, path = (tmp_path / "log.mat").read_bytes(), tmp_path / f"log.{suffix}"
    path.write_bytes(sound[:length] + end)
    kind = "MATLAB file" if suffix == "mat" else ".*"
    with pytest.raises(LogError, match=rf"is no {kind} that can be read"):
        found(path)


@pytest.mark.parametrize("form", ["%Y-%m-%d", "%d.%m.%Y", "%d-%b-%Y", "%d-%m-%Y"])
def test_dates_and_hours_in_two_columns_are_one_time(tmp_path, truth, form):
    """Runs a day apart, by whose hours alone each would go on from the one before."""
    clock = 36_000 + 10 * np.arange(300) + 86_400 * truth["run"].astype(int)
    moment = pd.Timestamp("2024-02-27") + pd.to_timedelta(clock, unit="s")
    told = {"Date": moment.dt.strftime(form), "Time": moment.dt.strftime("%H:%M:%S")}
    table = truth[PARTS[1:]].assign(Remark="", **told)
    reading = found_in(tmp_path, table)
    same(reading, truth)
    np.testing.assert_array_equal(np.diff(reading.log["time"]), np.diff(clock))
    assert (reading.log["run"].astype(int) == truth["run"].astype(int) + 1).all()
    assert "time = 'Time' on 'Date'; " in "; ".join(reading.notes)


@pytest.mark.parametrize(
    ("start", "form", "told"),
    [
        # What ends before the 13th leaves it open; a midnight at the end may tell it.
        ("2024-06-01", "%d/%m/%Y", "the form %m/%d/%Y %H:%M:%S"),
        ("2024-06-12", "%d/%m/%Y", "the form %d/%m/%Y %H:%M:%S"),
        ("2024-06-12", "%m/%d/%y", "the form %m/%d/%y %H:%M:%S"),
        ("2024-06-13", "%d/%m/%y", "the form %d/%m/%y %H:%M:%S"),
    ],
)
def test_whether_month_or_day_comes_first_is_told(tmp_path, truth, start, form, told):
    clock = np.arange(300) + (0.0 if start == "2024-06-01" else 86_400 - 250)
    moment = pd.Timestamp(start) + pd.to_timedelta(clock, unit="s")
    table = truth[PARTS[1:]].assign(Time=moment.strftime(f"{form} %H:%M:%S"))
    reading = found_in(tmp_path, table)
    assert (np.diff(reading.log["time"]) == 1.0).all()
    notes = "; ".join(reading.notes)
    assert told in notes
    assert ("dates are read month first" in notes) == ("%m/%d" in told)


LVM = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t.
Date\t2026/03/01
Time\t10:00:00.5
***End_of_Header***\t
\t
Channels\t3\t\t\t
Samples\t300\t300\t300\t
Date\t2026/03/01\t2026/03/01\t2026/03/01\t
Time\t10:00:00.5\t10:00:00.5\t10:00:00.5\t
X_Dimension\tTime\tTime\tTime\t
X0\t0.0E+0\t0.0E+0\t0.0E+0\t
Delta_X\t10.0\t10.0\t10.0\t
***End_of_Header***\t\t\t\t
X_Value\tTemp [degC]\tGyro [deg/s]\tTable [deg/s]\tComment
"""


def test_a_file_of_labview(tmp_path, truth):
    table = truth[["clock", *PARTS[1:]]].assign(comment="")
    lines = table.to_csv(sep="\t", header=False, index=False)
    (tmp_path / "log.lvm").write_text(LVM + lines)
    reading = found(tmp_path / "log.lvm")
    same(reading, truth)
    np.testing.assert_allclose(reading.log["time"], truth["clock"])
    assert "the header is line 17; what is above it is skipped" in reading.notes
    assert (reading.units["time"], "time" in reading.assumed) == ("s", False)


@pytest.mark.parametrize("separator", [",", "  "])
def test_units_in_a_line_of_their_own_below_numbers(tmp_path, truth, separator):
    lines = ["Serial,1234", "Operator,7", "", "t,Temp,Gyro,Table", "ms,K,(rad/s),deg/s"]
    rows = zip(1000 * truth["time"], truth["temperature"] + 273.15, np.radians(truth["output"]),
               truth["rate"], strict=True)  # fmt: skip
    lines += [",".join(map(repr, map(float, row))) for row in rows]
    (tmp_path / "log.csv").write_text("\n".join(lines).replace(",", separator))
    reading = found(tmp_path / "log.csv")
    same(reading, truth)
    assert reading.assumed == {}
    assert reading.name_row(3).endswith("line 9")


@pytest.mark.parametrize("how", ["variables", "struct", "7.3"])
def test_a_file_of_matlab(tmp_path, truth, how):
    names = {"temp_c": truth["temperature"], "gyro_dps": truth["output"], "rate_dps": truth["rate"]}
    names |= {"t_ms": 1000 * truth["clock"], "other": np.arange(7.0)}
    values = {name: np.asarray(column)[:, None] for name, column in names.items()} | {"fs": 10.0}
    path = tmp_path / "log.mat"
    if how == "7.3":
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as file:
            for name, column in values.items():
                file[f"log/{name}"] = np.transpose(column)
    else:
        savemat(path, values if how == "variables" else {"log": values, "who": "me"})
    reading = found(path)
    same(reading, truth)
    np.testing.assert_allclose(reading.log["time"], truth["clock"])
    assert "variables of another length are skipped: fs, other" in "; ".join(reading.notes)
    assert reading.name_row(3).endswith("row 4")


def test_a_file_of_excel_with_lines_above_the_header(tmp_path, truth):
    pytest.importorskip("openpyxl")
    names = ["Time", "Temp [°C]", "Gyro [°/s]", "Table [°/s]"]
    moments = pd.Timestamp("2026-02-27") + pd.to_timedelta(truth["clock"], unit="s")
    table = truth[PARTS].assign(time=moments).astype(object)
    rows = [["Bench", 7, None, None], ["Serial", 1234, None, None], names, *table.to_numpy()]
    with pd.ExcelWriter(tmp_path / "log.xlsx", engine="openpyxl") as writer:
        pd.DataFrame(rows).to_excel(writer, sheet_name="data", header=False, index=False)
        pd.DataFrame([["notes"]]).to_excel(writer, sheet_name="notes", index=False)
    reading = found(tmp_path / "log.xlsx")
    same(reading, truth)
    np.testing.assert_allclose(np.diff(reading.log["time"]), np.diff(truth["clock"]), atol=1e-5)
    assert reading.name_row(0).endswith("row 4")
    assert reading.assumed == {}
    for told in ("of 2 sheets 'data' is read", "the header is row 3; what is above it is skipped"):
        assert told in reading.notes


@pytest.mark.parametrize(("name", "library"), [("log.xlsx", "openpyxl"), ("log.mat", "h5py")])
def test_a_library_that_is_missing_is_named(tmp_path, name, library, monkeypatch):
    monkeypatch.setitem(sys.modules, library, None)
    (tmp_path / name).write_bytes(b"\x89HDF" + 600 * b" ")
    with pytest.raises(ImportError, match=rf"needs {library}: pip install 'skanfis\[logs\]'; or"):
        found(tmp_path / name)


def test_a_gap_in_one_column_is_no_power_on(tmp_path, truth):
    table = truth[truth["run"] < 2][[*PARTS]].assign(time=10.0 * np.arange(120))
    table.loc[40:89, "output"] = np.nan
    reading = found_in(tmp_path, table)
    assert "run" not in reading.log
    assert "50 of 120 rows lack a value" in "; ".join(reading.notes)
    # Where the clock stops as well, one was.
    assert found_in(tmp_path, table.drop(index=range(40, 90))).log["run"].nunique() == 2


@pytest.mark.parametrize(
    ("name", "unit", "steps", "bits", "places"),
    [
        ("t_us", 1e-6, 2e7, 32, "2 places"),
        ("t_ms", 1e-3, 6e5, 32, "1 place"),
        ("t_ms", 1e-3, 78_125.0, 24, "2 places"),
        ("t_ms", 1e-3, 305.0, 16, "2 places"),
    ],
)
def test_a_counter_that_begins_again_goes_on(tmp_path, truth, name, unit, steps, bits, places):
    """One of microseconds does every 72 minutes: no run begins there."""
    clock = (steps * np.arange(-15.5, 284.0)) % 2**bits
    reading = found_in(tmp_path, truth[PARTS[1:]].assign(**{name: clock}))
    np.testing.assert_allclose(np.diff(reading.log["time"]), steps * unit)
    assert "run" not in reading.log
    told = f"back by the range of its {bits} bits in {places}, first at line 18; the time goes"
    assert told in "; ".join(reading.notes)


def test_a_counter_that_begins_again_in_a_pause_needs_labels_of_runs(tmp_path, truth):
    table = truth[PARTS[1:]].assign(t_us=2e7 * np.arange(300) % 2**32).drop(index=range(100, 240))
    with pytest.raises(LogError, match=r"line 102.*if a counter begins again.*need .* labels"):
        found_in(tmp_path, table)
    assert found_in(tmp_path, table.assign(run=table.index // 100)).log["run"].nunique() == 2


@pytest.mark.parametrize("n_runs", [1, 5])
def test_rows_from_the_last_to_the_first_are_turned_round(tmp_path, truth, n_runs):
    """Also where the clock of every run begins anew: it jumps up from one to the next then."""
    table = truth[PARTS].assign(time=10.0 * np.tile(np.arange(300 // n_runs), n_runs))
    reading = found_in(tmp_path, table[::-1])
    same(reading, table, PARTS)
    assert reading.name_row(0).endswith("line 301")
    assert ("run" in reading.log) == (n_runs > 1)


@pytest.mark.parametrize(
    ("last", "n_rows", "told"),
    [
        ("0,21.5,1.0,1.0", 300, "the clock jumps; what follows, 1 row, is left out"),
        ("9e6,21.5,1.0,1.0", 300, "the clock jumps; what follows, 1 row, is left out"),
        ("3000,21.", 300, "1 of 301 rows lacks a value"),
        ("{same}", 300, "1 repeated row left out"),
    ],
)
def test_a_last_row_that_is_a_glitch_is_no_run(tmp_path, truth, last, n_rows, told):
    table = pd.concat([pd.Series(10.0 * np.arange(300), name="time_s"), truth[PARTS[1:]]], axis=1)
    text = table.to_csv(index=False)
    same_row = text.strip().rpartition("\n")[2]
    (tmp_path / "log.csv").write_text(f"{text}{last.format(same=same_row)}\n")
    reading = found(tmp_path / "log.csv")
    assert (len(reading.log), "run" in reading.log) == (n_rows, False)
    assert told in "; ".join(reading.notes)


@pytest.mark.parametrize("label", ["12-034", ""])
def test_a_gyro_s_column_of_no_numbers_is_refused_and_the_rate_not_taken(tmp_path, truth, label):
    """The rate would be the bias of a gyro at rest; a label that begins like a number is none."""
    counts = [f"{1000 * value:,.0f}" for value in truth["output"]]
    table = truth[[*PARTS, "run"]].assign(output=counts, imu_serial=label)
    with pytest.raises(LogError, match=r"column 'counts' \(output\): '-?[0-9]+,[0-9]+' is not a"):
        found_in(tmp_path, table.rename(columns={"output": "counts"}))


def test_a_supply_voltage_that_never_changes_is_no_output(tmp_path, truth):
    names = {"output": "Drehrate [°/s]", "rate": "Drehtisch"}
    table = truth[[*PARTS, "run"]].rename(columns=names)
    same(found_in(tmp_path, table.assign(**{"Spannung [V]": 3.3})), truth)


def test_labels_have_german_names_too(tmp_path, truth):
    table = truth[[*PARTS, "run"]].rename(columns={"run": "Lauf-Nr."}).assign(Gerät="A")
    reading = found_in(tmp_path, table.drop(columns="time"))
    assert reading.log[["run", "device"]].nunique().tolist() == [5, 1]


def test_a_name_with_blanks_is_given_as_a_shell_takes_it(tmp_path, truth):
    table = truth[["time", "output", "temperature"]].rename(columns={"temperature": "Part A"})
    with pytest.raises(LogError, match=r"--columns 'temperature=Part A'; columns= in Python"):
        found_in(tmp_path, table)


@pytest.mark.parametrize(("unit", "is_told"), [("deg/s", True), ("rpm", False)])
def test_a_unit_that_is_not_that_of_the_name_is_told(tmp_path, truth, unit, is_told):
    table = truth[PARTS].rename(columns={"rate": "rate [rpm]"})
    notes = found_in(tmp_path, table, units={"rate": unit}).notes
    assert ("'rate [rpm]' is read in deg/s as told, not in rpm" in notes) == is_told


def test_a_column_that_is_no_time_is_named_unless_it_is_used(tmp_path, truth):
    table = truth[PARTS[1:]].rename(columns={"temperature": "T (°C)"})
    assert "is not used" not in "; ".join(found_in(tmp_path, table).notes)
    notes = found_in(tmp_path, table.assign(t=truth["output"])).notes
    assert "'t' is not used: no time goes up and down" in notes


def test_the_thermometer_of_the_gyro_goes_before_another(tmp_path, truth):
    table = truth[PARTS].rename(columns={"temperature": "temp_gyro"})
    table.insert(0, "temp_case", truth["temperature"] - 5.0)
    same(found_in(tmp_path, table), truth)


def test_of_axes_that_all_feel_the_table_that_along_it_is_taken(tmp_path, truth):
    """No gyro is mounted square: of a degree off the others follow the rate as well."""
    table = truth[[*PARTS, "run"]].rename(columns={"output": "gyro_z"})
    table.insert(0, "gyro_x", 0.02 * table["gyro_z"])
    table.insert(1, "gyro_y", -0.3 * table["gyro_z"])
    same(found_in(tmp_path, table), truth)
    # As it stands askew, none is.
    reading = found_in(tmp_path, table.assign(gyro_y=table["gyro_z"]))
    assert "('gyro_y', 'gyro_z' would do too)" in reading.notes[0]
