"""Logs: whatever a spreadsheet writes is read as it was, anything else is refused as a log."""

import csv
import io
import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from skanfis.gyro import LogError, read_log
from skanfis.inspection.labels import as_label, printable

numbers = st.floats(-1e6, 1e6, allow_subnormal=False)
# Blanks at the ends of a label are none of it, and some words are missing values.
labels = st.text(
    st.characters(
        codec="utf-8", exclude_categories=["Cc"], include_characters="\n", exclude_characters=",;|"
    ),
    max_size=20,
).map(lambda text: f"r{text}".strip())
COLUMNS = ("time", "temperature", "output", "rate")


def read(text):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
        return read_log(path)


@st.composite
def logs(draw):
    """Rows of numbers and a label, and how they are written."""
    rows = draw(st.lists(st.tuples(*[numbers] * 4, labels), min_size=1, max_size=8))
    separator = draw(st.sampled_from(",;\t|"))
    decimal = draw(st.sampled_from(".,".replace(separator, "")))
    case = draw(st.sampled_from([str.lower, str.upper, str.title]))
    blanks = draw(st.sampled_from(["", " ", "  "]))
    quoting = draw(st.sampled_from([csv.QUOTE_MINIMAL, csv.QUOTE_ALL, csv.QUOTE_NONNUMERIC]))
    file = io.StringIO(newline="")
    writer = csv.writer(file, delimiter=separator, quoting=quoting)
    writer.writerow([case(name) + blanks for name in (*COLUMNS, "run")])
    for *values, label in rows:
        writer.writerow([*(repr(value).replace(".", decimal) for value in values), label])
        if draw(st.booleans()):
            file.write("\r\n")
    return rows, file.getvalue()


@given(logs())
def test_a_log_is_read_as_it_was_written(log):
    rows, text = log
    found = read(text)
    np.testing.assert_allclose(found[list(COLUMNS)], [row[:4] for row in rows], rtol=1e-12)
    # A run's label is its own, or that of its place where two would be the same.
    assert list(found["run"]) == [row[4] for row in rows]


@given(st.text() | st.binary() | logs().map(lambda log: log[1]), st.data())
def test_anything_else_is_refused_as_a_log(text, data):
    content = text if isinstance(text, bytes) else text.encode("utf-8")
    place = data.draw(st.integers(0, len(content)), label="place")
    content = content[:place] + data.draw(st.binary(max_size=5), label="put in") + content[place:]
    try:
        found = read(content)
    except LogError:
        return
    assert np.isfinite(found.select_dtypes("number").to_numpy()).all()


@given(st.text(st.characters()))
def test_labels_are_harmless(text):
    shown = printable(text)
    assert "\n" not in shown
    assert "\x1b" not in shown
    shown.encode("utf-8")
    # An even number of dollars that are not escaped makes mathematics.
    label = as_label(text)
    assert label.count("$") == label.count(r"\$")
