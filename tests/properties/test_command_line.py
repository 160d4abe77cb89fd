"""The command line: whatever is typed, an exit code and sentences, never a traceback."""

import os
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("matplotlib")

from skanfis.gyro import command
from skanfis.gyro.command import main

_NUMBERS = ["0", "-1", "1", "2", "1e-300", "1e300", "nan", "-inf", "9" * 5000, "1e9", "", "x"]
_WORDS = ["", " ", "time", "time=", "=", "time=a", "rate=output", "x=gyro", "é", "\udcff", "a\nb"]
_VALUES = {
    "--columns": _WORDS,
    "--units": ["time=ms", "time=year", "temperature=K", "output=counts", "rate=", "=", "run=s"],
    "--inputs": ["time", "temperature", "temperature_rate", "output", "rate", ""],
    "--terms": ["search", "auto", "1,2", "99999999,1,1,1", "0", "1,1,1,1", "9" * 5000, ",", ""],
    "--groups": ["auto", "run", "device", "level", "run+level", "leg", "piece", "week"],
    "--outside": ["clip", "linear", "nan", "error"],
    "--c": ["c99", "c89", "c23"],
    "--scale-factor": _NUMBERS,
}
_FLAGS = ["--physics", "--force"]
_FILES = {
    "good.csv": None,
    "empty.csv": b"",
    "header.csv": b"time,temperature,output,rate\n",
    "binary.csv": bytes(range(256)),
    "huge.csv": b"time,temperature,output,rate\n" + b"1e308,1e308,1e308,1e308\n" * 30,
    "same.csv": b"time,temperature,output,rate\n" + b"1,20,5,5\n" * 30,
    "text.csv": b"time,temperature,output,rate\na,b,c,d\n" * 20,
    "wide.csv": b"time,temperature,output,rate\n1,2,3\n1,2,3,4,5\n",
    os.fsdecode(b"odd\xff.csv"): None,
    "log.parquet": b"PAR1PAR1",
}


@pytest.fixture(scope="module", autouse=True)
def stubs():
    """What comes after the log has been read and the options have been weighed is not fuzzed."""
    patch = pytest.MonkeyPatch()
    patch.setattr(command, "report_page", lambda calibration, title, dossier: title)
    patch.setattr(command, "calibrate", _no_calibration)
    yield
    patch.undo()


def _no_calibration(log, split, recipe, tell, name_row, n_rows):
    assert np.isfinite(log[["temperature", "output", "rate"]].to_numpy()).all()
    assert split.folds
    assert n_rows == len(log)
    name_row(len(log) - 1)
    raise ValueError("as far as the fuzz goes")


def _logs():
    time = np.arange(0.0, 600.0, 5.0)
    rate = np.repeat([-50.0, -20.0, 0.0, 20.0, 50.0, 10.0], 20)
    table = pd.DataFrame({"time": time, "temperature": 20.0 + time / 20.0, "rate": rate})
    table["output"] = 1.01 * rate + 0.1 * np.sin(time)
    return table.to_csv(index=False).encode()


_OPTIONS = st.sampled_from(sorted(_VALUES)).flatmap(
    lambda option: st.lists(
        st.sampled_from(_VALUES[option]) | st.text(max_size=5), min_size=1, max_size=2
    ).map(lambda values: [option, *values])
) | st.sampled_from(_FLAGS).map(lambda flag: [flag])
_NAMES = [*_FILES, "*.csv", "none.csv", "*.none", ".", "folder", "a" * 300, "a\x00b"]
_PATHS = st.lists(st.sampled_from(_NAMES) | st.text(max_size=5), min_size=1, max_size=3)


@given(
    _PATHS, st.lists(_OPTIONS, max_size=3), st.sampled_from([None, "good.csv", "none.json", "."])
)
def test_whatever_is_typed_ends_in_sentences(paths, options, model):
    here = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            (Path(folder) / "folder").mkdir()
            for number, (name, content) in enumerate(_FILES.items()):
                good = _logs() + b"\n" * number
                Path(name).write_bytes(good if content is None else content)
            typed = [*paths, *(word for option in options for word in option)]
            typed += [] if model is None else ["--apply", model]
            try:
                code = main([*typed, "--output", "out"])
            except SystemExit as stop:
                code = stop.code
            assert code in (0, 1, 2, 3, 4)
        finally:
            os.chdir(here)
