"""Logs as they come: what a logger, a spreadsheet or a bench writes is read as it was meant."""

import numpy as np
import pandas as pd
import pytest

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


def same(reading, truth, parts=PARTS[1:]):
    for part in parts:
        np.testing.assert_allclose(reading.log[part], truth[part], rtol=1e-9, atol=1e-9)


def moments(truth, form):
    start = pd.Timestamp("2026-02-27")
    return (start + pd.to_timedelta(truth["clock"], unit="s")).dt.strftime(form)


WRITTEN = {
    "ISO 8601, UTF-16, semicolons, decimal commas": (
        "%Y-%m-%dT%H:%M:%S.%f+01:00",
        ("Zeit", "Temperatur [°C]", "Kreisel", "Drehtisch soll [deg/s]"),
        {"sep": ";", "decimal": ",", "encoding": "utf-16"},
    ),
    "clock over midnight, Windows": (
        "%H:%M:%S.%f",
        ("Time", "Temp (°C)", "gyro_dps", "rate_true_deg_s"),
        {"encoding": "cp1252"},
    ),
    "day first, tabs": (
        "%d.%m.%Y %H:%M:%S",
        ("Logged", "T[degC]", "Output", "table"),
        {"sep": "\t"},
    ),
    "month first, halves of the day": (
        "%m/%d/%Y %I:%M:%S %p",
        ("date_time", "thermistor_C", "GYRO", "Ref_Rate"),
        {},
    ),
}


@pytest.mark.parametrize("kind", WRITTEN)
def test_a_log_of_one_kind_is_read_as_it_was_meant(tmp_path, truth, kind):
    form, names, how = WRITTEN[kind]
    columns = [moments(truth, form), truth["temperature"], truth["output"], truth["rate"]]
    table = pd.DataFrame(dict(zip(names, columns, strict=True))).assign(
        temp_trend=1, seq=range(300)
    )
    table.to_csv(tmp_path / "log.csv", index=False, **how)
    reading = found(tmp_path / "log.csv")
    same(reading, truth)
    steps = np.diff(reading.log["time"]) - np.diff(truth["clock"])
    np.testing.assert_allclose(steps, 0.0, atol=1e-5)
    # The hour without power between runs of ten minutes.
    assert (reading.log["run"].astype(int) == truth["run"].astype(int) + 1).all()
    told = "; ".join(reading.notes)
    for said in (f"temperature = {names[1]!r}", "split into 5 runs", "--columns"):
        assert said in told
    assert not set(reading.assumed) & {"time", "temperature"}


def test_lines_above_the_header_and_a_clock_past_midnight(tmp_path, truth):
    lines = ["Bench 7;operator X", "", "Datum;Uhrzeit;Temp [°C];Gyro [mrad/s];Table"]
    days, clocks = moments(truth, "%Y-%m-%d"), moments(truth, "%H:%M:%S")
    output = truth["output"] * np.pi / 0.18
    rows = zip(days, clocks, truth["temperature"], output, truth["rate"], strict=True)
    lines += [";".join(map(str, row)) for row in rows]
    (tmp_path / "log.txt").write_text("\n".join(lines), encoding="utf-8")
    reading = found(tmp_path / "log.txt")
    same(reading, truth)
    np.testing.assert_allclose(np.diff(reading.log["time"]), np.diff(truth["clock"]))
    assert reading.units["output"] == "mrad/s"
    assert reading.name_row(10) == f"{tmp_path / 'log.txt'}, line 14"


def test_rows_that_lack_a_value_are_counted_and_lines_stay_right(tmp_path, truth):
    table = truth[PARTS].astype(object)
    table.loc[5, "output"], table.loc[9, "temperature"], table.loc[200, "rate"] = "---", "", "NaN"
    table.to_csv(tmp_path / "log.csv", index=False)
    reading = found(tmp_path / "log.csv")
    kept = truth.drop(index=[5, 9, 200])
    same(reading, kept, PARTS)
    said = "3 of 300 rows lack a value ('temperature' in 1, 'output' in 1, 'rate' in 1)"
    assert any(said in note and "line 7" in note for note in reading.notes)
    for row in (4, 5, 7, 8, 250):
        line = int(kept.index[row]) + 2
        assert reading.name_row(row).endswith(f"line {line}")
    with pytest.raises(LogError, match="line 11, column 'temperature': the value is missing"):
        found(tmp_path / "log.csv", guess=False)
    table.loc[100:, "rate"] = ""
    table.to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(LogError, match=r"rows lack a value .* too many to go on"):
        found(tmp_path / "log.csv")


def test_the_columns_of_a_rate_table_with_all_that_confuses(tmp_path, truth):
    pytest.importorskip("pyarrow")
    table = pd.DataFrame(
        {
            "seq": range(len(truth)),
            "sweep_start_temp_c": 20.5,
            "gyro_counts": -27_000.0 * truth["output"],
            "temp_c": truth["temperature"],
            "rate_true_rad_s": np.radians(truth["rate"]),
            "rate_true_deg_s": truth["rate"],
            "author_fit_residual_rad_s": 1e-4,
            "temp_trend": np.where(truth.index % 2, 1, -1),
        }
    )
    table.to_csv(tmp_path / "log.csv", index=False)
    table.to_parquet(tmp_path / "log.parquet")
    for path in (tmp_path / "log.csv", tmp_path / "log.parquet"):
        reading = found(path)
        assert list(reading.log) == ["temperature", "output", "rate"]
        same(reading, truth, ["temperature", "rate"])
        assert reading.units["output"] == "counts"
        np.testing.assert_allclose(reading.log["output"], -27_000.0 * truth["output"])


def test_columns_whose_names_say_nothing_are_asked_for(tmp_path, truth):
    table = pd.DataFrame({"a": truth["temperature"], "b": truth["output"], "d": truth["rate"]})
    table.to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(LogError, match=r"Say which it is .--columns temperature=NAME"):
        found(tmp_path / "log.csv")
    told = found(tmp_path / "log.csv", columns={"temperature": "a", "output": "D ", "rate": "b"})
    np.testing.assert_allclose(told.log["output"], truth["rate"])


@pytest.mark.parametrize("name", ["U_mV", "gyro_mV", "U [mV]"])
def test_a_raw_signal_is_no_rate(tmp_path, truth, name):
    """The lone rate of a log is the gyro's own, but not where a voltage follows it."""
    table = truth[["time", "temperature"]].assign(
        **{name: -8.0 * truth["output"], "rate_dps": truth["rate"]}
    )
    table.to_csv(tmp_path / "log.csv", index=False)
    reading = found(tmp_path / "log.csv", require=("temperature", "output", "rate", "time"))
    layout = reading.files[0].layout
    assert (layout.name("output"), layout.name("rate")) == (name, "rate_dps")
    assert reading.units["output"] == "mV"


def test_units_are_told_by_values_where_no_name_does(tmp_path, truth):
    table = pd.DataFrame(
        {
            "time": 1_770_000_000_000 + 1000 * truth["clock"],
            "temperature": truth["temperature"] + 273.15,
            "gyro": (27_000 * truth["output"]).round(),
            "rate": truth["rate"],
        }
    )
    table.to_csv(tmp_path / "log.csv", index=False)
    reading = found(tmp_path / "log.csv")
    same(reading, truth, ["temperature", "rate"])
    assert {reading.units[part] for part in ("time", "temperature", "output")} == {
        "ms", "K", "counts",
    }  # fmt: skip
    np.testing.assert_allclose(np.diff(reading.log["time"]), np.diff(truth["clock"]), atol=1e-6)


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
    (folder / "r4.csv").write_bytes((folder / "r2.csv").read_bytes())
    with pytest.raises(LogError, match=r"r4.csv: holds the same bytes as .*r2.csv"):
        found([*paths, str(folder / "r4.csv")])
    table.rename(columns={"output": "gyro_counts"}).to_csv(folder / "r4.csv", index=False)
    with pytest.raises(LogError, match=r"r4.csv: the output is in counts, in .* in deg/s"):
        found([*paths, str(folder / "r4.csv")])


def test_of_too_many_rows_every_kth_of_a_run_is_held(tmp_path, monkeypatch, truth):
    monkeypatch.setattr("skanfis.gyro.log._ROWS", 37)
    table = truth[[*PARTS, "run"]].sort_values("time", kind="stable").reset_index(drop=True)
    table.to_csv(tmp_path / "log.csv", index=False)
    request = Request(**ASKED)
    some = read([tmp_path / "log.csv"], request, most_rows=100)
    place = table.groupby("run").cumcount()
    expected = table[place % 4 == 0]
    assert (some.n_rows, len(some.log)) == (300, 75)
    same(some, expected, PARTS)
    assert some.log["run"].astype(int).tolist() == expected["run"].astype(int).tolist()
    assert some.notes[1:] == ["of 300 rows 75 are used, one in 4 of each run"]
    assert some.name_row(7).endswith(f"line {expected.index[7] + 2}")
    # A row that would not be held is checked all the same.
    table.loc[290, "time"] = 0.0
    table.to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(LogError, match=r"line 292, column 'time': time does not increase"):
        read([tmp_path / "log.csv"], request, most_rows=100)


@pytest.mark.parametrize(
    ("times", "runs"),
    [
        (np.r_[0:100, 0:100, 0:50], [1] * 100 + [2] * 100 + [3] * 50),  # set anew
        (np.r_[0:100, 100 + 500 : 700], [1] * 100 + [2] * 100),  # a rest
        (np.r_[0:100, 130:230], None),  # half a minute lost
    ],
)
def test_runs_are_told_by_the_time(tmp_path, times, runs):
    table = pd.DataFrame({"time": times, "temperature": 20.0, "output_dps": 1.0})
    table.to_csv(tmp_path / "log.csv", index=False)
    log = found(tmp_path / "log.csv").log
    assert ("run" in log) == (runs is not None)
    if runs is not None:
        assert log["run"].astype(int).tolist() == runs
    # A row out of order is no run.
    table.loc[60, "time"] = table.loc[58, "time"]
    table.to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(LogError, match="line 62, column 'time': time does not increase"):
        found(tmp_path / "log.csv")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\n\n  \n", "is empty"),
        (b"1,2,3\n4,5,6\n", "line 1: has numbers where the names of the columns are due"),
        (bytes(range(256)), "is not text"),
        (b"temp,gyro\n20,1\n21,\x81\n", "is not text"),
        (b"PAR1 and nothing else", "is no Parquet that can be read"),
        (b"time,temp,gyro\n10:00:00,20,2\nnoon,21,2\n10:00:02,22,3\n", "line 3, column 'time': 'n"),
        (b"temp,gyro\n20,1\n21,1e999\n22,3\n", "line 3, column 'gyro' .output.: .* (inf|not a n)"),
    ],
)  # fmt: skip
def test_what_is_no_log_is_refused_in_words(tmp_path, content, message):
    path = tmp_path / ("log.parquet" if content.startswith(b"PAR1") else "log.csv")
    path.write_bytes(content)
    if path.suffix == ".parquet":
        pytest.importorskip("pyarrow")
    with pytest.raises(LogError, match=message):
        found(path)
