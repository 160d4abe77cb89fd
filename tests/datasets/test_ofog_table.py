"""Table 1: the facts that its description states about it."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.datasets import load_ofog


@pytest.fixture
def frame():
    return load_ofog().frame


def test_nineteen_rows_every_twenty_seconds(frame):
    assert_array_equal(frame["time"], np.arange(0, 361, 20))


def test_column_sums_of_the_printed_table(frame):
    # Summed from the paper's text by another program, in units of the last printed digit.
    assert round(frame["temperature"].sum() * 100) == 39588
    assert round(frame["rate"].sum() * 10_000) == 7360549
    assert round(frame["output"].sum() * 10_000) == 7590233


def test_rate_column_is_damaged_as_described(frame):
    units, fractions = np.divmod(frame["rate"].to_numpy(), 1)
    assert fractions.std() < 0.0055
    assert np.ptp(fractions) < 0.02
    assert set(units) == {37, 38, 39}
    # The output does not know of the jumps.
    assert abs(np.corrcoef(units, frame["output"])[0, 1]) < 0.2
    assert (np.diff(units) != 0).sum() > len(frame) / 2


def test_two_outputs_stand_apart(frame):
    output = frame["output"].to_numpy()
    distance = np.abs(output - np.median(output))
    assert set(output[distance > 0.15]) == {39.5906, 39.7843}
    assert output[distance <= 0.15].std() < 0.04


def test_temperatures_lie_in_one_degree(frame):
    assert (frame["temperature"].min(), frame["temperature"].max()) == (20.47, 21.32)


def test_description_states_the_defects():
    description = load_ofog().DESCR
    for fact in ("19 are printed", "rate column is damaged", "39.5906", "39.7843", "1 degC"):
        assert fact in description


def test_bunch_holds_one_table_in_all_its_forms(frame):
    bunch = load_ofog()
    pd.testing.assert_frame_equal(bunch.data.assign(output=bunch.target), bunch.frame)
    assert bunch.feature_names == list(bunch.data)
    assert bunch.target_names == [bunch.target.name]
    arrays = load_ofog(as_frame=False)
    assert arrays.frame is None
    assert_array_equal(np.column_stack([arrays.data, arrays.target]), frame.to_numpy())
    X, y = load_ofog(return_X_y=True)
    pd.testing.assert_frame_equal(X, bunch.data)
    pd.testing.assert_series_equal(y, bunch.target)
    X, y = load_ofog(return_X_y=True, as_frame=False)
    assert isinstance(X, np.ndarray)
    assert_allclose(y, bunch.target)


def test_changing_what_was_loaded_changes_nothing_for_the_next():
    first = load_ofog()
    first.frame.iloc[0, 0] = -1.0
    first.feature_names.clear()
    second = load_ofog()
    assert second.frame.iloc[0, 0] == 0.0
    assert second.feature_names == ["time", "temperature", "rate"]
