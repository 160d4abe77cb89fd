"""A log too long to be held: kept are rows of the whole, evenly, with what all rows made."""

import numpy as np
import pytest

from skanfis.datasets import make_ofog
from skanfis.gyro import _table
from skanfis.gyro._layout import Request
from skanfis.gyro._results import Results
from skanfis.gyro._thinned import read_thinned
from skanfis.gyro.command import main
from skanfis.gyro.compensator import features
from skanfis.gyro.html_report import _check
from skanfis.gyro.log import read

COLUMNS = ["time", "temperature", "output", "rate"]
MOST, LAG = 150, 30.0


@pytest.fixture(scope="module")
def log():
    """Two devices of two runs, on clocks that begin anew with each; 1,204 rows."""
    return make_ofog(n_devices=2, n_runs=2, duration=600.0, sampling_interval=2.0, random_state=0)


def interleaved(log):
    """The devices side by side in one file, as one logger writes them; a value is missing."""
    table = log[[*COLUMNS, "device", "run"]].sort_values(["run", "time", "device"], kind="stable")
    table = table.reset_index(drop=True)
    table.loc[11, "output"] = np.nan
    return [table]


def files_told_by_the_clock(log):
    """No labels: a file per device, within which the clock begins anew."""
    return [part[COLUMNS] for _, part in log.groupby("device")]


@pytest.mark.parametrize(
    ("kind", "device"), [(interleaved, None), (interleaved, 1), (files_told_by_the_clock, None)]
)
def test_rows_that_are_kept_are_those_of_the_whole(log, kind, device, tmp_path, monkeypatch):
    paths = []
    for number, table in enumerate(kind(log)):
        paths.append(str(tmp_path / f"log{number}.csv"))
        table.to_csv(paths[-1], index=False)
    request = Request(drop_missing=True)
    whole = read(paths, request, max_gap="auto")
    name = None
    if device:
        name = whole.log["device"].cat.categories[device]
        whole = whole.of_device(name)
    monkeypatch.setattr(_table, "_ROWS", 67)
    told = []
    options = {"max_gap": "auto", "most_rows": MOST, "time_constant": LAG, "tell": told.append}
    some = read_thinned(paths, request, device=name, **options)
    n_rows = len(whole.log)
    assert some.n_rows == n_rows
    assert f"of {n_rows:,} rows {len(some.log)} are kept, drawn at random" in some.notes[-1]
    assert some.notes[:-1] == [note for note in whole.notes if "missing" not in note]
    # Their places in the files, and by these in the whole.
    every = some.places if name is None else np.searchsorted(_of_device(paths, name), some.places)
    expected = whole.log.iloc[every].reset_index(drop=True)
    for part in expected:
        assert some.log[part].astype(object).tolist() == expected[part].astype(object).tolist()
    lines = {some.name_row(row) for row in (0, 9, len(some.log) - 1)}
    if name is None:
        assert lines == {whole.name_row(every[row]) for row in (0, 9, len(some.log) - 1)}
    made = features(whole.log, ("time", "temperature_rate"), LAG)
    np.testing.assert_allclose(
        some.made["temperature_rate"], made["temperature_rate"].iloc[every], atol=1e-12
    )
    np.testing.assert_allclose(
        features(some.log, ("time",), LAG)["time"], made["time"].iloc[every], atol=1e-9
    )
    _assert_even(whole.log, every)


def _of_device(paths, name):
    """Places of a device's rows among all that are kept of the files."""
    return np.flatnonzero(read(paths, Request(drop_missing=True)).log["device"] == name)


def _assert_even(whole, kept):
    """One of every stretch of each run, its first, and the ends; next to nothing else."""
    assert MOST - 4 <= len(kept) <= MOST + 40
    place = whole.groupby("run", observed=True).cumcount().to_numpy()
    length = len(whole) / MOST
    within = []
    for run in whole["run"].unique():
        every = place[(whole["run"] == run).to_numpy()]
        own = place[kept][(whole["run"].iloc[kept] == run).to_numpy()]
        assert own[0] == 0
        ends = np.arange(1, int(every.size / length) + 1) * length
        counts = np.histogram(own, np.append(0.0, ends) - 1e-9)[0]
        assert counts.min() >= 1
        within += (own % length).astype(int).tolist()
    # Not the same one each time: all places in a stretch are about as frequent.
    assert np.bincount(within).min() > 0.3 * len(kept) / length
    for part in ("temperature", "output", "rate"):
        values = whole[part].to_numpy()
        assert (values[kept].min(), values[kept].max()) == (values.min(), values.max())


@pytest.mark.usefixtures("given_weights", "few_rivals")
def test_the_command_on_some_rows_finds_what_it_finds_on_all(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    found = []
    monkeypatch.setattr(
        "skanfis.gyro.command.report_page", lambda calibration, *_: found.append(calibration) or ""
    )
    log = make_ofog(n_devices=1, n_runs=4, duration=900.0, sampling_interval=1.0, random_state=0)
    log[[*COLUMNS, "run"]].to_csv(tmp_path / "log.csv", index=False)
    arguments = [str(tmp_path / "log.csv"), "--terms", "1,2,1,2", "--force"]
    arguments += ["--output", str(tmp_path / "out")]
    for most in ("10000", "1500"):
        assert main([*arguments, "--check-rows", most]) == 0
    said = capsys.readouterr().out
    assert said.count("are kept, drawn at random, evenly over every run") == 1
    whole, some = found
    assert (whole.is_thinned, some.is_thinned) == (False, True)
    assert some.n_rows == len(whole.log) == len(log)
    for one, other in zip(_errors(some), _errors(whole), strict=True):
        # Of 1,500 rows in 3,604, few of them beside the start of a run.
        assert one == pytest.approx(other, rel=0.1)
    results = Results(some)
    _, blocks = _check(results)
    assert any(f"Of the log's {len(log):,} rows" in str(block.content) for block in blocks)
    assert "bias_stability" not in str(results.merit["figure"].tolist())
    assert "bias_stability" in str(Results(whole).merit["figure"].tolist())
    assert "only some of the rows" in results.of_allan


def _errors(calibration):
    for rates in (calibration.before, calibration.after):
        yield np.sqrt(np.mean((rates - calibration.rate)[calibration.in_range] ** 2))
