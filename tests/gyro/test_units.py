"""Units that no name tells: settled where one reading is plausible, asked for where two are."""

import numpy as np
import pandas as pd
import pytest

from skanfis.datasets import make_ofog
from skanfis.digits import range_in_digits
from skanfis.gyro import check_log
from skanfis.gyro._guess import Request
from skanfis.gyro.errors import LogError, UsageError
from skanfis.gyro.log import read

PARTS = ("temperature", "output", "rate")


@pytest.fixture(scope="module")
def truth():
    return make_ofog(n_devices=1, n_runs=4, duration=900.0, random_state=3)


def read_table(tmp_path, table, require=PARTS, paths=1):
    found = [tmp_path / f"log{number}.csv" for number in range(paths)]
    for path, rows in zip(found, np.array_split(np.arange(len(table)), paths), strict=True):
        table.iloc[rows].to_csv(path, index=False)
    return read(found, Request(require=require, guess=True))


NAMES = ("time", "temp", "gyro", "rate")


def reading(tmp_path, truth, scales=(1, 1, 1, 1), offsets=(0, 0, 0, 0), names=NAMES, paths=1):
    """What is read of time, temp, gyro and rate in other units, without a word on them."""
    table = truth[["time", *PARTS]] * list(scales) + list(offsets)
    return read_table(tmp_path, table.set_axis(names, axis=1), paths=paths)


@pytest.mark.parametrize(
    ("scales", "offsets", "units"),
    [
        ((1, 1, 1, 1), (0, 0, 0, 0), ("s", "degC", "deg/s", "deg/s")),
        ((1000, 1, 1, 1), (0, 0, 0, 0), ("ms", "degC", "deg/s", "deg/s")),
        ((1e6, 1, 1, 1), (1.7e15, 0, 0, 0), ("us", "degC", "deg/s", "deg/s")),
        # Dates from 2000 on, and a clock that has run for thirty hours.
        ((1, 1, 1, 1), (9.467e8, 0, 0, 0), ("s", "degC", "deg/s", "deg/s")),
        ((1000, 1, 1, 1), (1.1e8, 0, 0, 0), ("ms", "degC", "deg/s", "deg/s")),
        ((1, 1, 1, 1), (0, 273.15, 0, 0), ("s", "K", "deg/s", "deg/s")),
        # 40 to 59 degC in degF is 104 to 139.
        ((1, 1.8, 1, 1), (0, 50, 0, 0), ("s", "degF", "deg/s", "deg/s")),
        ((1, 1, 3600, 3600), (0, 0, 0, 0), ("s", "degC", "deg/h", "deg/h")),
        # The output follows the rate, one to one, in one unit.
        ((1, 1, np.pi / 180, 1), (0, 0, 0, 0), ("s", "degC", "rad/s", "deg/s")),
        ((1, 1, -27_000, 1), (0, 0, 0, 0), ("s", "degC", "counts", "deg/s")),
    ],
)
def test_one_plausible_reading_is_taken_and_said(tmp_path, truth, scales, offsets, units):
    found = reading(tmp_path, truth, scales, offsets)
    parts = ("time", *PARTS)
    assert tuple(found.units[part] for part in parts) == units
    assert set(found.assumed) == set(parts)
    for part, name, unit in zip(parts, NAMES, units, strict=True):
        signal = "a raw signal" if unit == "counts" else unit
        assert f"{name!r} has no unit, taken as {signal} (" in found.assumed[part]
    np.testing.assert_allclose(found.log["rate"], truth["rate"], rtol=1e-9)
    for part, scale, offset in zip(parts, scales, offsets, strict=True):
        ends = sorted(truth[part].agg(["min", "max"]) * scale + offset)
        assert f"({range_in_digits(*ends, 4)}" in found.assumed[part]


def test_rad_per_s_without_a_word_is_asked_for_with_the_line_to_copy(tmp_path, truth):
    turn, options = np.pi / 180, "output=deg/s rate=deg/s or --units output=rad/s rate=rad/s"
    with pytest.raises(UsageError, match=rf"may be in deg/s \(-1\..* {options}"):
        reading(tmp_path, truth, (1, 1, turn, turn))
    # The name of one column tells the other.
    found = reading(tmp_path, truth, (1, 1, turn, turn), names=(*NAMES[:3], "rate_rad_s"))
    assert (found.units["output"], found.units["rate"]) == ("rad/s", "rad/s")
    assert "rate" not in found.assumed


def test_a_wrong_unit_of_the_output_is_not_made_good_by_a_rate_that_no_gyro_has(tmp_path, truth):
    found = reading(tmp_path, truth, names=("time", "temp", "gyro_rad_s", "rate"))
    assert (found.units["output"], found.units["rate"]) == ("rad/s", "deg/s")
    with pytest.raises(LogError, match=r"changes by 56.* is the output in deg/s\?"):
        check_log(found.log, units=found.units, inputs=PARTS[:2])


@pytest.mark.parametrize(("slower", "ways"), [(60, "time=s or .*time=min"), (0.03, "s or .*=ms")])
def test_a_clock_that_may_be_two_is_asked_for(tmp_path, truth, slower, ways):
    with pytest.raises(UsageError, match=ways):
        reading(tmp_path, truth, (1 / slower, 1, 1, 1))


# As warm as a room in degF alone, in degC alone, and in either.
@pytest.mark.parametrize(("low", "high"), [(32.0, 80.0), (20.0, 95.0), (60.0, 80.0)])
def test_a_temperature_in_either_scale_is_asked_for(tmp_path, truth, low, high):
    heat = np.linspace(low, high, len(truth))
    with pytest.raises(UsageError, match="temperature=degC or --units temperature=degF"):
        reading(tmp_path, truth.assign(temperature=heat))


@pytest.mark.parametrize("mark", [9999.0, -9999.0])
def test_marks_of_no_value_tell_no_unit_and_are_refused(tmp_path, truth, mark):
    heat = truth["temperature"].where(np.arange(len(truth)) % 20 != 7, mark)
    told = rf"line 9, column 'temp' .*: {mark} degC .*; leave cells that hold no value empty"
    with pytest.raises(LogError, match=told):
        reading(tmp_path, truth.assign(temperature=heat))


def test_round_levels_of_a_rate_table_tell_its_unit(tmp_path, truth):
    rate = np.repeat([-20.0, -10.0, 0.0, 10.0, 20.0], len(truth) // 5)
    log = truth.iloc[: rate.size].assign(rate=rate, output=1.01 * rate)
    turn = np.pi / 180
    for scale, unit in ((1.0, "deg/s"), (turn, "rad/s")):
        found = reading(tmp_path, log, (1, 1, scale, scale))
        assert (found.units["output"], found.units["rate"]) == (unit, unit)
    with pytest.raises(UsageError, match="output=rad/s rate=rad/s"):
        reading(tmp_path, log.assign(rate=1.03 * rate))


def test_all_files_tell_what_the_first_leaves_open(tmp_path, truth):
    """A first file that is hot throughout, and a last one that is cold."""
    log = truth.assign(temperature=np.linspace(50.0, 10.0, len(truth)))
    found = reading(tmp_path, log, paths=4)
    assert found.units["temperature"] == "degC"
    assert "taken as degC (10 to 50; degF?" in found.assumed["temperature"]
    # The last one hot: all is read again, in another unit than that of the first.
    hotter = log.assign(temperature=log["temperature"].to_numpy()[::-1] + 5.0)
    fahrenheit = reading(tmp_path, hotter, (1, 1.8, 1, 1), (0, 32, 0, 0), paths=4)
    assert fahrenheit.units["temperature"] == "degF"
    assert "taken as degF (59 to 131; degC?" in fahrenheit.assumed["temperature"]
    np.testing.assert_allclose(fahrenheit.log["temperature"], hotter["temperature"], atol=1e-9)


@pytest.mark.parametrize(
    ("output", "readings"),
    [
        (0.005, "output=deg/s or --units output=rad/s"),
        (15.0, "output=deg/s or --units output=deg/h"),
        ([-300, 400], "output=deg/h or --units output=counts"),
    ],
)
def test_a_bias_alone_tells_no_unit(tmp_path, output, readings):
    heat = np.linspace(20.0, 60.0, 200)
    table = pd.DataFrame({"temp_c": heat, "gyro": np.resize(output, 200)})
    with pytest.raises(UsageError, match=readings):
        read_table(tmp_path, table, require=("temperature", "output"))


def test_the_rate_of_the_earth_is_known(tmp_path):
    heat = np.linspace(20.0, 60.0, 200)
    table = pd.DataFrame({"temp_c": heat, "gyro_deg_h": 15.0 + 0.1 * heat, "rate": 15.041})
    assert read_table(tmp_path, table).units["rate"] == "deg/h"


@pytest.mark.parametrize("rows", [1, 2])
def test_a_row_or_two_and_columns_without_numbers_tell_nothing(tmp_path, rows):
    table = {"time": [1.0, 2.0], "temp": ["", ""], "gyro": [1.0, ""], "rate": [2.0, 3.0]}
    with pytest.raises((LogError, UsageError)):
        read_table(tmp_path, pd.DataFrame(table)[:rows], require=("output",))


def test_a_first_run_without_temperatures_tells_no_unit_of_the_time(tmp_path, truth):
    """Its clock restarts; warnings of NumPy are errors here."""
    table = truth[["time", "temperature", "output", "rate"]].copy()
    table.loc[truth["run"] == 0, "temperature"] = np.nan
    reading = read_table(tmp_path, table)
    assert (reading.units["time"], len(reading.log)) == ("s", (truth["run"] > 0).sum())


def test_a_bias_in_degrees_an_hour_is_asked_whether_it_is_in_degrees_a_second(tmp_path):
    wide = np.linspace(-98.0, 99.0, 101)
    table = pd.DataFrame({"temperature": np.linspace(-20.0, 60.0, 101), "output": wide})
    told = read_table(tmp_path, table, ("temperature", "output")).assumed["output"]
    assert told.endswith("taken as deg/h (-98 to 99; deg/s? give --units output=deg/s)")
