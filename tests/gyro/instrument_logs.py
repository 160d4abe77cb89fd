"""The clean logs as one instrument or program each writes them, in that one's own manner.

Beside log_variants.py, whose forms are drawn part by part; files of LabVIEW, MATLAB and Excel, and
last lines that are cut, are read in test_natural_logs.py. Where neither the header nor the values
settle the units, a log is ambiguous.
"""

import io

import numpy as np
import pandas as pd

from .log_variants import Variant

EXACT = {"rad/s": np.pi / 180.0, "deg/h": 3600.0, "mdeg/s": 1e3, "counts": 131.0, "mV": -12.5}


class Case:
    """A clean log to be written, and what is drawn for it."""

    def __init__(self, source, log, rng):
        self.source, self.rng = source, rng
        start = 7200.0 * log["run"].astype(float) if "run" in log else 0.0
        self.time = (log["time"] + start).to_numpy()  # runs tell themselves apart by long gaps
        self.heat, self.gyro = (log[part].to_numpy() for part in ("temperature", "output"))
        self.rate = log["rate"].to_numpy() if "rate" in log else None
        self.rows = np.arange(len(log))

    def pick(self, *choices):
        return choices[int(self.rng.integers(len(choices)))]

    def moments(self, form):
        return (pd.Timestamp("2026-03-01 07:58:00") + pd.to_timedelta(self.time, "s")).strftime(
            form
        )

    def columns(self, time, heat, gyro, rate):
        """Pairs of a name and values; without a rate table none of it."""
        found = [time, heat, gyro, *([rate] if self.rate is not None else [])]
        return dict(found)

    def noise(self, size=1.0):
        return size * self.rng.normal(size=self.time.size)


def lines_of(columns, separator, decimal=".", digits=10, quote="", tail=""):
    """Header and rows of a table as text."""
    texts = []
    for values in columns.values():
        if isinstance(values[0], str):
            texts.append(list(values))
        else:
            texts.append([f"{value:.{digits}g}".replace(".", decimal) for value in values])
    header = separator.join(f"{quote}{name}{quote}" for name in columns) + tail
    return [header, *(separator.join(row) + tail for row in zip(*texts, strict=True))]


def scan_logger(c):
    """A data logger that scans channels: facts above, a scan number, alarms beside values."""
    columns = c.columns(
        ("Elapsed (s)", c.time),
        ("101 <Gyro temp> (C)", c.heat),
        ("102 <Gyro output> (deg/s)", c.gyro),
        ("Table rate (deg/s)", c.rate),
    )
    columns = {"Scan": np.arange(1.0, c.time.size + 1.0)} | columns | {"Alarm": 0.0 * c.time}
    above = ["Name:,Bench 3", "Acquisition Date:,3/1/2026 8:00:00 AM", "Instrument:,34970A", "",
             "Total Channels:,3", ""]  # fmt: skip
    return ".csv", "\r\n".join([*above, *lines_of(columns, ",")]), "utf-16", True


def temperature_logger(c):
    """A title, quoted names with serial numbers, dates with AM and PM."""
    form = c.pick("%m/%d/%y %I:%M:%S %p", "%m/%d/%Y %H:%M:%S")
    columns = c.columns(("Date Time, GMT+00:00", list(c.moments(form))), ("Temp, °C", c.heat),
                        ("Gyro, deg/s", c.gyro), ("Ref rate, deg/s", c.rate))  # fmt: skip
    columns = {"#": np.arange(1.0, c.time.size + 1.0)} | columns
    text = "\n".join(['"Plot Title: gyro 7"', *lines_of(columns, ",", quote='"')])
    return ".csv", text, "utf-8-sig", True


def matlab_table(c):
    unit = c.pick("rad/s", "deg/s")
    factor, word = EXACT.get(unit, 1.0), unit.replace("/s", "ps").replace("degps", "dps")
    columns = c.columns(
        ("t_s", c.time),
        ("T_degC", c.heat),
        (f"gyro_{word}", factor * c.gyro),
        (f"rate_ref_{word}", None if c.rate is None else factor * c.rate),
    )
    return ".txt", "\n".join(lines_of(columns, c.pick(",", "\t"), digits=15)), "utf-8", True


def inertial_tool(c):
    """Comment lines with two slashes, three axes, tabs."""
    factor, axis = EXACT["rad/s"], c.pick("X", "Y", "Z")
    gyro = {f"Gyr_{other} [rad/s]": 1e-4 * c.noise() for other in "XYZ"}
    gyro[f"Gyr_{axis} [rad/s]"] = factor * c.gyro
    if c.rate is None:
        gyro = {f"Gyr_{axis} [rad/s]": factor * c.gyro}
    columns = {"PacketCounter": np.arange(c.time.size) % 65536.0, "Time [s]": c.time, **gyro,
               "Temperature [°C]": c.heat}  # fmt: skip
    if c.rate is not None:
        columns["Turntable [deg/s]"] = c.rate
    above = ["// General information:", "//  Device ID: 0168", "//  Sample rate: 100.0 Hz"]
    return ".txt", "\r\n".join([*above, *lines_of(columns, "\t")]), "utf-8", True


def flight_controller(c):
    """Whole microseconds, axes, no units but in the name of the clock; the rate tells the other."""
    unit = c.pick("rad/s", "deg/s")
    axis, factor = c.pick("X", "Y", "Z"), EXACT.get(unit, 1.0)
    columns = {"TimeUS": np.round(1e6 * c.time + 4.2e7)}
    columns |= {f"Gyr{other}": 1e-4 * c.noise() for other in "XYZ"}
    columns[f"Gyr{axis}"] = factor * c.gyro
    columns["T"] = c.heat
    if c.rate is None:
        columns = {name: values for name, values in columns.items() if name[:3] != "Gyr"}
        columns["Gyr"] = factor * c.gyro
    else:
        columns["table_deg_s"] = c.rate
    return ".csv", "\n".join(lines_of(columns, ",", digits=14)), "utf-8", c.rate is not None


def array_program(c):
    """Blanks between numbers in full, the names behind a hash."""
    columns = c.columns(("time_s", c.time), ("temp_degC", c.heat), ("gyro_deg_s", c.gyro),
                        ("rate_deg_s", c.rate))  # fmt: skip
    table = pd.DataFrame(columns)
    file = io.StringIO()
    form = c.pick("%.18e", "%12.6f")
    np.savetxt(
        file, table.to_numpy(), fmt=form, header=" ".join(columns), comments=c.pick("# ", "% ", "")
    )
    return ".txt", file.getvalue(), "utf-8", True


def aligned(c):
    """Columns aligned by blanks, units on a line of their own."""
    columns = c.columns(
        ("Time", c.time), ("Temperature", c.heat), ("Gyro", c.gyro), ("Rate", c.rate)
    )
    units = ["[s]", "[degC]", "[deg/s]", "[deg/s]"][: len(columns)]
    rows = ["".join(f"{name:>16}" for name in columns), "".join(f"{unit:>16}" for unit in units)]
    rows += ["".join(f"{v:16.7f}" for v in row) for row in zip(*columns.values(), strict=True)]
    return ".dat", "\n".join(rows), "utf-8", True


def german_spreadsheet(c):
    unit, factor = c.pick(("°/s", 1.0), ("°/h", 3600.0))
    columns = c.columns(
        ("Zeit [s]", c.time),
        ("Temperatur [°C]", c.heat),
        (f"Kreisel [{unit}]", factor * c.gyro),
        ("Drehtisch [°/s]", c.rate),
    )
    tail = c.pick("", ";")
    return ".csv", "\r\n".join(lines_of(columns, ";", ",", tail=tail)), "cp1252", True


def american_chamber(c):
    """Minutes and degrees Fahrenheit; a set point beside the temperature."""
    columns = c.columns(("Elapsed (min)", c.time / 60.0), ("Gyro Temp (°F)", 1.8 * c.heat + 32.0),
                        ("Gyro (deg/hr)", 3600.0 * c.gyro), ("Stage (deg/s)", c.rate))  # fmt: skip
    columns["Chamber Setpoint (°F)"] = np.round(1.8 * c.heat + 32.0, -1)
    return ".csv", "\r\n".join(lines_of(columns, ",", digits=12)), "utf-8", True


def database(c):
    """Moments by ISO 8601, lines of kinds above, empty first columns."""
    columns = c.columns(
        ("_time", list(c.moments("%Y-%m-%dT%H:%M:%SZ"))),
        ("temperature_celsius", c.heat),
        ("gyro_mdps", 1e3 * c.gyro),
        ("reference_rate_mdps", None if c.rate is None else 1e3 * c.rate),
    )
    above = ["#datatype," + ",".join(["dateTime:RFC3339", *["double"] * (len(columns) - 1)]),
             "#default" + "," * len(columns)]  # fmt: skip
    rows = lines_of(columns, ",")
    return ".csv", "\r\n".join([*above, *("," + row for row in rows)]), "utf-8", True


def raw_board(c):
    """Counts of a board, and the truth with its unit: the scale factor is learnt."""
    if c.rate is None:
        return matlab_table(c)
    columns = {"ms": 1e3 * c.time, "temp_raw_C": c.heat, "adc_gyro": np.round(-27e3 * c.gyro),
               "encoder_dps": c.rate, "vdd_mV": 3300.0 + c.noise()}  # fmt: skip
    return ".log", "\n".join(lines_of(columns, ",", digits=12)), "utf-8", True


MAKERS = [
    scan_logger,
    temperature_logger,
    matlab_table,
    inertial_tool,
    flight_controller,
    array_program,
    aligned,
    german_spreadsheet,
    american_chamber,
    database,
    raw_board,
]


def variant(number, logs, seed=0):
    """The variant of a number; the same for the same seed."""
    rng = np.random.default_rng([seed, 77, number])
    maker, source = MAKERS[number % len(MAKERS)], str(rng.choice(list(logs)))
    case = Case(source, logs[source], rng)
    suffix, content, encoding, is_determined = maker(case)
    content = content.encode(encoding) if isinstance(content, str) else content
    return Variant(number, source, suffix, content, is_determined, case.rows, maker.__name__)
