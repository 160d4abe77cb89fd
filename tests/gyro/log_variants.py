"""Three clean logs, written in a thousand ways: as instruments, spreadsheets and people do.

A variant is *determined* where its header names the columns, and header or values settle units,
order of rows and separator; else it is *ambiguous*, and an option settles it.
"""

import csv
import io
from typing import NamedTuple

import numpy as np
import pandas as pd

from skanfis.datasets import make_ofog

# Of each part: names without a unit, and what a name with one is made of.
NAMES = {
    "time": ["time", "Time", "t", "Timestamp", "Elapsed", "_time", "Zeit"],
    "temperature": ["101 <Gyro temp>", "Temperature", "T", "Temperatur", "thermistor", "imu_temp"],
    "output": ["gyro", "Kreisel", "102 <Gyro output>", "FOG", "Output", "adc_gyro"],
    "rate": ["rate", "rate_true", "encoder", "Ref rate", "reference_rate", "Drehtisch", "Stage"],
}
UNITS = {
    "time": {"s": (1.0, 0.0), "ms": (1e3, 0.0), "us": (1e6, 0.0), "min": (1 / 60, 0.0)},
    "temperature": {"degC": (1.0, 0.0), "K": (1.0, 273.15), "degF": (1.8, 32.0)},
    "output": {"deg/s": (1.0, 0.0), "rad/s": (np.pi / 180, 0.0), "deg/h": (3600.0, 0.0),
               "counts": (-27_000.0, 0.0), "mV": (8.0, 0.0), "mdeg/s": (1e3, 0.0)},
    "rate": {"deg/s": (1.0, 0.0), "rad/s": (np.pi / 180, 0.0), "deg/h": (3600.0, 0.0)},
}  # fmt: skip
SPELT = {
    "s": ["s", "sec"], "ms": ["ms"], "us": ["us", "US"], "min": ["min"], "K": ["K"],
    "degC": ["degC", "°C", "C", "celsius"],
    "degF": ["degF", "°F"], "deg/s": ["deg/s", "dps", "°/s"], "rad/s": ["rad/s", "rad_s", "radps"],
    "deg/h": ["deg/h", "deg/hr"], "counts": ["counts", "LSB"], "mV": ["mV"], "mdeg/s": ["mdps"],
}  # fmt: skip
PREAMBLES = [
    ["Bench 7", "Operator: A. Jones"],
    ["Serial,1234", "Start,2026-03-01 10:00:00", ""],
    ["# made by a logger, version 2.1", "# fs = 0.1"],
    ["Device;FOG-1;7", "Range;100;200", "", "Data"],
    ["#datatype,dateTime:RFC3339,double", "#default,,"],
    ["// General information:", "//  Sample rate: 100.0 Hz"],
]
EXTRAS = ["PacketCounter", "chamber_set", "supply_V", "vdd_mV", "pressure", "status"]


def clean_logs():
    """On a rate table with runs; on one at levels, a single run; at rest over two cycles."""
    runs = make_ofog(n_devices=1, n_runs=4, duration=1200.0, sampling_interval=10.0,
                     random_state=1)  # fmt: skip
    levels = make_ofog(n_devices=1, n_runs=1, profile="ramps", duration=7200.0, random_state=2,
                       sampling_interval=20.0, rates=np.arange(-90.0, 91.0, 15.0))  # fmt: skip
    time = np.arange(0.0, 14_400.0, 40.0)
    heat = 20.0 - 40.0 * np.sin(2.0 * np.pi * time / 7200.0)
    bias = 0.4 + 0.01 * heat + 1e-4 * heat**2
    bias += 1e-3 * np.random.default_rng(0).normal(size=time.size)
    rest = pd.DataFrame({"time": time, "temperature": heat, "output": bias})
    runs = runs[[*NAMES, "run"]].astype({"run": str})
    return {"runs": runs, "levels": levels[list(NAMES)], "rest": rest}


class Variant(NamedTuple):
    """What is written, under which suffix, and what is to be found in it."""

    source: str
    suffix: str
    content: bytes
    is_determined: bool
    rows: np.ndarray  # of the clean log that are there, in their order
    story: str


def variant(number, logs, seed=0):
    """The variant of a number; the same for the same seed."""
    rng = np.random.default_rng([seed, number])
    source = str(rng.choice(list(logs)))
    log = logs[source]
    parts = [part for part in NAMES if part in log]
    units = {part: str(rng.choice(list(UNITS[part]))) for part in parts}
    if source == "rest":
        units["output"] = str(rng.choice(["deg/s", "rad/s", "deg/h"]))
    told = {part: rng.random() < 0.75 for part in parts}
    # Values may tell a clock in min, or not: see test_units.py.
    told["time"] |= units["time"] in ("min", "us")
    told["output"] |= source == "rest" or units["output"] in ("counts", "mV", "mdeg/s")
    nameless = rng.random() < 0.08
    headless = not nameless and rng.random() < 0.05
    table, header = {}, {}
    for part in parts:
        factor, offset = UNITS[part][units[part]]
        table[part] = log[part].to_numpy() * factor + offset
        header[part] = _name(part, units[part], told[part], rng)
    _time_form(log, table, header, units, told, rng)
    if "run" in log and rng.random() < 0.6:
        table["run"], header["run"] = log["run"].to_numpy(), str(rng.choice(["run", "Cycle"]))
    if nameless:
        header = {part: f"A{k}" for k, part in enumerate(header)}
    frame = pd.DataFrame(table)
    if source != "rest" and rng.random() < 0.2 and not nameless and told["output"]:
        _add_axes(frame, header, rng)
    for name in rng.choice(EXTRAS, rng.integers(0, 3), replace=False):
        frame[name], header[name] = rng.integers(0, 5, len(frame)), str(name)
    frame, rows = _rows(frame, rng)
    frame = frame[list(rng.permutation(list(frame)))]
    is_determined = not nameless and not headless and _is_settled(log, units, told, source)
    suffix, content = _written(frame, [header[name] for name in frame], headless, rng)
    return Variant(source, suffix, content, is_determined, rows, f"units {units}; told {told}")


def _name(part, unit, is_told, rng):
    name = str(rng.choice(NAMES[part]))
    if not is_told:
        return name
    spelt = str(rng.choice(SPELT[unit]))
    form = str(rng.choice(["{} [{}]", "{} ({})", "{}_{}"]))
    return form.format(name, spelt.replace("/", "_per_") if form == "{}_{}" else spelt)


def _time_form(log, table, header, units, told, rng):
    """The clock as numbers or as a date; runs follow one another on one clock or begin anew."""
    seconds = log["time"].to_numpy()
    if "run" in log and rng.random() < 0.5:
        seconds = seconds + 7200.0 * log["run"].astype(float).to_numpy()
        table["time"] = seconds * UNITS["time"][units["time"]][0]
    dates = ["%Y-%m-%d %H:%M:%S", "%d.%m.%Y %H:%M:%S", "%Y-%m-%dT%H:%M:%S.%f+01:00"]
    form = str(rng.choice(["", "", *dates, "%m/%d/%y %I:%M:%S %p", "%H:%M:%S"]))
    if form:
        moments = pd.Timestamp("2026-03-01 20:00") + pd.to_timedelta(seconds, unit="s")
        table["time"], units["time"], told["time"] = moments.strftime(form), "clock", True
        header["time"] = str(rng.choice(["Time", "Timestamp", "Uhrzeit"]))


def _add_axes(frame, header, rng):
    stem = str(rng.choice(["gyro_x", "Gyr_X", "GyrX"]))
    axes = [stem[:-1] + axis for axis in ("xyz" if stem.islower() else "XYZ")]
    tail = header["output"].partition("[")[2]
    if not tail:
        return
    true, size = str(rng.choice(axes)), frame["output"].abs().max()
    header["output"] = f"{true} [{tail}"
    for other in axes:
        if other != true:
            frame[other] = 1e-3 * size * rng.normal(size=len(frame))
            header[other] = f"{other} [{tail}"


def _rows(frame, rng):
    """Values that are missing, rows that are lost, occur twice, or begin with the last."""
    kind = str(rng.choice(["", "", "", "cells", "lost", "twice", "reversed"]))
    frame, rows = frame.astype(object), np.arange(len(frame))
    if kind == "cells":
        lacking = rng.choice(np.arange(5, len(frame) - 5), 6, replace=False)
        begin = int(rng.integers(5, len(frame) // 3))
        lacking = np.union1d(lacking, np.arange(begin, begin + 8))
        frame.loc[lacking, "output"] = str(rng.choice(["", "NaN", "---", "ERR"]))
        rows = np.setdiff1d(rows, lacking)
    elif kind == "lost":
        lost = rng.choice(np.arange(5, len(frame) - 5), 5, replace=False)
        frame, rows = frame.drop(index=lost), np.setdiff1d(rows, lost)
    elif kind == "twice":
        begin = int(rng.integers(10, 60))
        frame = frame.iloc[np.r_[0 : begin + 30, begin : len(frame)]].reset_index(drop=True)
    elif kind == "reversed" and "run" not in frame:
        time = frame["time"]
        numbers = time if time.map(type).ne(str).all() else pd.Series(range(len(time)))
        if (np.diff(numbers.astype(float)) > 0).all() and ":" not in str(time.iloc[0])[2:3]:
            frame = frame[::-1]
    return frame, rows


def _is_settled(log, units, told, source):
    """Whether names or values tell every unit, by the rules that the documentation states."""
    heat = log["temperature"]
    factor, offset = UNITS["temperature"][units["temperature"]]
    low, high = heat.min() * factor + offset, heat.max() * factor + offset
    sure = told["temperature"] or low > 150.0 or high > 130.0 or (low <= 30.0 and high < 86.0)
    # degF that look like degC are in no log here.
    if not told["temperature"] and units["temperature"] == "degF":
        sure = high > 130.0
    if source == "rest" or (told["output"] and told["rate"]):
        return bool(sure)
    signal = units["output"] in ("counts", "mV")
    if told["rate"] or (told["output"] and not signal):
        return bool(sure)
    # The slope of one against the other tells two units apart, not one.
    if not signal and units["output"] != units["rate"]:
        return bool(sure)
    size = log["rate"].abs().max() * UNITS["rate"][units["rate"]][0]
    return bool(sure and (size > 38.4 or (source == "levels" and units["rate"] != "deg/s")))


def _written(frame, header, headless, rng):
    """The suffix and bytes of a file."""
    if not headless and rng.random() < 0.05:
        table = frame.set_axis(header, axis=1)
        if not any(table[name].map(type).eq(str).any() for name in table):
            buffer = io.BytesIO()
            table.astype(float).to_parquet(buffer)
            return ".parquet", buffer.getvalue()
    separator = str(rng.choice([",", ",", ";", "\t", "|"]))
    decimal = "," if separator != "," and rng.random() < 0.4 else "."
    encoding = str(rng.choice(["utf-8", "utf-8", "utf-8-sig", "utf-16", "cp1252"]))
    end = str(rng.choice(["\n", "\r\n"]))
    is_below = not headless and rng.random() < 0.4
    lines = PREAMBLES[int(rng.integers(len(PREAMBLES)))] if is_below else []
    buffer = io.StringIO(newline="")
    quoting = csv.QUOTE_ALL if rng.random() < 0.15 else csv.QUOTE_MINIMAL
    # Some programs end every line with the separator, and begin the header like a comment.
    tail = separator if separator == ";" and rng.random() < 0.3 else ""
    writer = csv.writer(buffer, delimiter=separator, lineterminator=end, quoting=quoting)
    if not headless:
        buffer.write("% " if quoting == csv.QUOTE_MINIMAL and rng.random() < 0.1 else "")
        writer.writerow(header)
    for row in frame.itertuples(index=False):
        writer.writerow([_cell(value, decimal) for value in row])
    text = "".join(line + end for line in lines) + buffer.getvalue().replace(end, tail + end)
    return str(rng.choice([".csv", ".txt", ".dat"])), text.encode(encoding, "replace")


def _cell(value, decimal):
    return value if isinstance(value, str) else f"{float(value):.10g}".replace(".", decimal)
