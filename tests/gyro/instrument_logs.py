"""The clean logs as one instrument or program each writes them, in that one's own manner.

Beside log_variants.py, whose forms are drawn part by part; files of LabVIEW, MATLAB and Excel, and
last lines that are cut, are read in test_natural_logs.py. Where neither the header nor the values
settle the units, a log is ambiguous.
"""

import re
from typing import NamedTuple

import numpy as np
import pandas as pd

from .log_variants import Variant


class Instrument(NamedTuple):
    """How a log looks: lines above, the header, and a row; what is in «» is not there at rest.

    A row has its number n, the clock t and the moment, the temperature T, the output y, that of
    axes that do not turn (a, b), and the rate r.
    """

    encoding: str
    end: str
    text: str
    is_determined_at_rest: bool = True
    decimal: str = "."


INSTRUMENTS = {
    # A data logger that scans channels: facts above, a scan number, alarms beside values.
    "scan logger": Instrument("utf-16", "\r\n", """\
Name:,Bench 3
Acquisition Date:,3/1/2026 8:00:00 AM
Instrument:,34970A

Total Channels:,3

Scan,Elapsed (s),101 <Gyro temp> (C),102 <Gyro output> (deg/s),«Table rate (deg/s),»Alarm
{n},{t[s]:.10g},{T[C]:.10g},{y[deg/s]:.10g},«{r[deg/s]:.10g},»0"""),
    # A title, quoted names with commas, dates with AM and PM.
    "temperature logger": Instrument("utf-8-sig", "\n", """\
"Plot Title: gyro 7"
"#","Date Time, GMT+00:00","Temp, °C","Gyro, deg/s"«,"Ref rate, deg/s"»
{n},{moment:%m/%d/%y %I:%M:%S %p},{T[C]:.10g},{y[deg/s]:.10g}«,{r[deg/s]:.10g}»"""),
    "MATLAB table": Instrument("utf-8", "\n", """\
t_s,T_degC,gyro_radps«,rate_ref_radps»
{t[s]:.15g},{T[C]:.15g},{y[rad/s]:.15g}«,{r[rad/s]:.15g}»"""),
    # Comment lines with two slashes, three axes, tabs; a counter that begins anew.
    "inertial tool": Instrument("utf-8", "\r\n", """\
// General information:
//  Device ID: 0168
//  Sample rate: 100.0 Hz
PacketCounter\tTime [s]\t«Gyr_X [rad/s]\t»Gyr_Y [rad/s]\t«Gyr_Z [rad/s]\t»Temp [°C]«\tTable [deg/s]»
{counter}\t{t[s]:.10g}\t«{a:.10g}\t»{y[rad/s]:.10g}\t«{b:.10g}\t»{T[C]:.10g}«\t{r[deg/s]:.10g}»"""),
    # Whole microseconds, axes, no units but in the name of the clock; the rate tells the other.
    "flight controller": Instrument("utf-8", "\n", """\
TimeUS,Gyr«X,GyrY,GyrZ»,T«,table_deg_s»
{t[us]:.0f},{y[rad/s]:.14g}«,{a:.14g},{b:.14g}»,{T[C]:.14g}«,{r[deg/s]:.14g}»""", False),
    # Blanks between numbers in full, the names behind the sign of a comment.
    "array program": Instrument("utf-8", "\n", """\
% time_s temp_degC gyro_deg_s« rate_deg_s»
{t[s]:.18e} {T[C]:.18e} {y[deg/s]:.18e}« {r[deg/s]:.18e}»"""),
    # Columns aligned by blanks, units on a line of their own.
    "aligned": Instrument("utf-8", "\n", """\
            Time     Temperature            Gyro«            Rate»
             [s]          [degC]         [deg/s]«         [deg/s]»
{t[s]:16.7f}{T[C]:16.7f}{y[deg/s]:16.7f}«{r[deg/s]:16.7f}»"""),
    # A sign between columns at the end of each line too.
    "German spreadsheet": Instrument("cp1252", "\r\n", """\
Zeit [s];Temperatur [°C];Kreisel [°/h]«;Drehtisch [°/s]»;
{t[s]:.10g};{T[C]:.10g};{y[deg/h]:.10g}«;{r[deg/s]:.10g}»;""", True, ","),
    "German logger": Instrument("utf-16", "\n", """\
Zeit;Temperatur [°C];Kreisel«;Drehtisch soll [deg/s]»
{moment:%Y-%m-%dT%H:%M:%S.%f+01:00};{T[C]:.10g};{y[deg/s]:.10g}«;{r[deg/s]:.10g}»""", False, ","),
    # Times of day past midnight; columns that are of no part.
    "Windows logger": Instrument("cp1252", "\n", """\
Time,Temp (°C),gyro_dps«,rate_true_deg_s»,temp_trend,seq
{moment:%H:%M:%S.%f},{T[C]:.10g},{y[deg/s]:.10g}«,{r[deg/s]:.10g}»,1,{n}"""),
    # Minutes and degrees Fahrenheit; a set point beside the temperature.
    "American chamber": Instrument("utf-8", "\r\n", """\
Elapsed (min),Gyro Temp (°F),Gyro (deg/hr)«,Stage (deg/s)»,Chamber Setpoint (°F)
{t[min]:.12g},{T[F]:.12g},{y[deg/h]:.12g}«,{r[deg/s]:.12g}»,{T[F]:.0f}"""),
    # Moments by ISO 8601, lines of kinds above, empty first columns.
    "database": Instrument("utf-8", "\r\n", """\
#datatype,dateTime:RFC3339,double,double«,double»
#default,,,«,»
,_time,temperature_celsius,gyro_mdps«,reference_rate_mdps»
,{moment:%Y-%m-%dT%H:%M:%SZ},{T[C]:.10g},{y[mdeg/s]:.10g}«,{r[mdeg/s]:.10g}»"""),
    # Counts of a board, and the truth with its unit: the scale factor is learnt.
    "raw board": Instrument("utf-8", "\n", """\
ms,temp_raw_C,adc_gyro«,encoder_dps»,vdd_mV
{t[ms]:.12g},{T[C]:.12g},{y[counts]:.0f}«,{r[deg/s]:.12g}»,{vdd:.12g}"""),
}  # fmt: skip


def variant(number, logs, seed=0):
    """The variant of a number; the same for the same seed."""
    n_instruments, noise = len(INSTRUMENTS), np.random.default_rng([seed, 77, number])
    name = list(INSTRUMENTS)[number % n_instruments]
    source = list(logs)[(number + number // n_instruments) % len(logs)]
    log, instrument = logs[source], INSTRUMENTS[name]
    is_at_rest = "rate" not in log
    text = re.sub("«.*?»" if is_at_rest else "[«»]", "", instrument.text)
    above, _, form = text.rpartition("\n")
    rows = [form.format(**row).replace(".", instrument.decimal) for row in rows_of(log, noise)]
    content = instrument.end.join([*above.split("\n"), *rows]).encode(instrument.encoding)
    is_determined = instrument.is_determined_at_rest or not is_at_rest
    return Variant(number, source, ".csv", content, is_determined, np.arange(len(log)), name)


RATES = {"deg/s": 1.0, "rad/s": np.pi / 180, "deg/h": 3600.0, "mdeg/s": 1e3, "counts": -27e5}


def rows_of(log, noise):
    """What a row of an instrument may be made of, in every unit."""
    start = 7200.0 * log["run"].astype(float) if "run" in log else 0.0
    time = log["time"] + start  # runs tell themselves apart by long gaps
    moments = pd.Timestamp("2026-03-01 19:58") + pd.to_timedelta(time, "s")
    rates = log["rate"] if "rate" in log else np.zeros(len(log))
    columns = time, moments, log["temperature"], log["output"], rates
    for n, (t, moment, heat, output, rate) in enumerate(zip(*columns, strict=True), 1):
        a, b = 1e-4 * noise.normal(size=2)
        yield {
            "n": n,
            "counter": (n + 65_000) % 65_536,
            "moment": moment,
            "t": {"s": t, "ms": 1e3 * t, "us": 1e6 * t + 4.2e7, "min": t / 60.0},
            "T": {"C": heat, "F": 1.8 * heat + 32.0},
            "y": {unit: factor * output for unit, factor in RATES.items()},
            "a": a,
            "b": b,
            "r": {unit: factor * rate for unit, factor in RATES.items()},
            "vdd": 3300.0 + 1e4 * a,
        }
