"""Reading a calibration log from CSV files, and refusing what no compensator should learn from.

The columns of a log play parts: ``time``, ``temperature``, ``output`` (the gyro's own signal),
``rate`` (the truth, from the rate table), ``run`` (from one power-on to the next) and ``device``.
A log that has been read has its columns by these names, in s, degC and deg/s.
"""

import csv
import difflib
import os
from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd

from ._units import CANONICAL, SIGNALS, convert, plausible_units, unit_named, units_of

__all__ = ["LogError", "check_log", "read_log"]

QUANTITIES = ("time", "temperature", "output", "rate")
LABELS = ("run", "device")
COLUMNS = (*QUANTITIES, *LABELS)

_PLAUSIBLE = {
    "temperature": (-100.0, 200.0),  # degC, wider than any gyro is specified for
    "rate": (-20_000.0, 20_000.0),  # deg/s, beyond any rate table
    "output": (-20_000.0, 20_000.0),
}
_LONGEST_RUN = 31 * 86_400.0  # s
_FASTEST_CHANGE = 100.0  # degC/min over a whole run: no chamber does that
_FEWEST_ROWS = 20
_FEWEST_ROWS_PER_RUN = 3
_LONGEST_FIELD = 2**31 - 1
# At rest, the earth's rate included.
_LARGEST_AT_REST = 0.1  # deg/s, with the noise of a rate table's encoder
_WIDEST_AT_REST = 10.0  # deg/s, a coarse gyro's bias from cold to hot
# Noise in 20 times its usual step is none; glitches are rare.
_JUMP, _FEWEST_JUMPS, _RARE = 20.0, 5, 2e-3
_LARGEST_SIGNAL = 1e30  # counts or volts, beyond any converter
_FOLLOWS = 0.9  # correlation of output with rate below which one of them is something else


class LogError(ValueError):
    """A log, or a column or row of it, from which no compensator should be learnt.

    Parameters
    ----------
    reason : str
        What was found and what would do.
    column : str, default=None
        The column's part in the log: "time", "temperature", "output", "rate", "run" or "device".
    row : int, default=None
        Position of the first bad row, counted from 0.

    Examples
    --------
    >>> from skanfis.gyro import LogError
    >>> print(LogError("is missing.", column="rate", row=7))
    column 'rate', row 7: is missing.
    """

    def __init__(self, reason, column=None, row=None):
        super().__init__(reason, column, row)
        self.reason = reason
        self.column = column
        self.row = row

    def __str__(self):
        place = [] if self.column is None else [f"column {self.column!r}"]
        place += [] if self.row is None else [f"row {self.row}"]
        return f"{', '.join(place)}: {self.reason}" if place else self.reason


def read_log(paths, *, columns=None, units=None, require=None, separator=",", decimal="."):
    r"""Read one log from one or several CSV files.

    Only the columns that play a part are read. Without a column for the run, each file is a run.
    A run never extends over two files or devices: two that only share a label are told apart.

    Parameters
    ----------
    paths : str, path, or sequence of these
        CSV files with a header line, in UTF-8.
    columns : dict of str to str, default=None
        Names in the file by part: keys "time", "temperature", "output", "rate", "run", "device".
        A part that is not named here has its own name in the file. Blanks around names, and
        capitals, do not matter where one column alone fits.
    units : dict of str to str, default=None
        Units in the file of "time" (s, ms, us, ns, min, h), "temperature" (degC, K, degF), "rate"
        and "output" (deg/s, deg/h, rad/s, mrad/s, rpm); "output" may also be a raw signal, in
        counts, V or mV. By default s, degC and deg/s.
    require : sequence of str, default=None
        Parts without which the log is refused; None stands for temperature, output and rate. The
        others are read where the file has them.
    separator : str, default=","
        Sign between columns.
    decimal : str, default="."
        Sign of the decimal fraction.

    Returns
    -------
    log : DataFrame of shape (n_rows, n_parts)
        Columns by their parts, in the order above: numbers in s, degC and deg/s (a raw signal in
        its own unit), run and device as categories of strings.

    Raises
    ------
    LogError
        If a file is empty, no such table, or there twice; if a column that is required is not
        there; if a value is missing or no number. The message names the file, its column and line.
    ValueError
        If ``columns``, ``units`` or ``require`` name an unknown part or unit, or if ``separator``
        or ``decimal`` is no single sign.
    OSError
        If a file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from skanfis.gyro import read_log
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "log.csv"
    ...     _ = path.write_text("t_s,temp,counts,table\n0,293.15,-190,10\n1,293.25,-380,20\n")
    ...     names = {"time": "t_s", "temperature": "temp", "output": "counts", "rate": "table"}
    ...     read_log(path, columns=names, units={"temperature": "K", "output": "counts"})
       time  temperature  output  rate
    0   0.0         20.0  -190.0  10.0
    1   1.0         20.1  -380.0  20.0
    """
    names = {part: part for part in COLUMNS} | _checked(columns or {}, "columns", COLUMNS)
    units = CANONICAL | declared_units(units)
    require = ("temperature", "output", "rate") if require is None else tuple(require)
    _checked(dict.fromkeys(require), "require", COLUMNS)
    shared = [name for name in names.values() if list(names.values()).count(name) > 1]
    if shared:
        raise LogError(f"two parts cannot be the same column of the file, {shared[0]!r}.")
    wanted = {*require, *(columns or {})}
    paths = [paths] if isinstance(paths, str | Path) else list(paths)
    _check_signs(separator, decimal)
    _check_different(paths)
    tables = [_read_table(path, names, units, wanted, separator, decimal) for path in paths]
    return _name_runs(_join(tables, paths))


def _check_signs(separator, decimal):
    """ValueError where either is no single sign, or both are the same."""
    for name, sign in (("separator", separator), ("decimal", decimal)):
        if not isinstance(sign, str) or len(sign) != 1 or sign.isalnum() or sign in '\r\n"':
            raise ValueError(f"{name}={sign!r} must be one sign, such as a comma.")
    if separator == decimal:
        raise ValueError(f"separator and decimal are both {separator!r}: numbers would be cut.")


def _check_different(paths):
    """LogError where one file is there twice: as two runs, each would be tested by the other."""
    seen: dict = {}
    for path in paths:
        try:
            status = os.stat(path)
        except OSError:
            continue  # said when it is read
        key = status.st_dev, status.st_ino
        if key in seen:
            raise LogError(f"{path}: is the same file as {seen[key]}; name every log once.")
        seen[key] = path


def declared_units(units):
    """``units`` with the usual name of each; ValueError where there is no such unit."""
    units = _checked(units or {}, "units", tuple(CANONICAL))
    return {quantity: unit_named(quantity, unit) for quantity, unit in units.items()}


def check_log(log, *, inputs=("temperature", "output"), units=None, min_temperature_span=10.0):
    """Check that a log is fit for calibrating a compensator, and refuse it otherwise.

    Parameters
    ----------
    log : DataFrame of shape (n_rows, n_parts)
        As :func:`read_log` returns it. A column "run" tells power-ups apart; without it all rows
        are one run.
    inputs : sequence of str, default=("temperature", "output")
        What the compensator is to learn from: of "time", "temperature", "temperature_rate" and
        "output". They must change enough. Without any, the log is not to be learnt from, and its
        ranges do not matter.
    units : dict of str to str, default=None
        Units that the file was declared to be in, as for :func:`read_log`. They tell a raw signal
        from a rate, and serve the messages.
    min_temperature_span : float, default=10.0
        Smallest range of the temperature [degC], if it is an input.

    Returns
    -------
    log : DataFrame of shape (n_rows, n_parts)
        The same log.

    Raises
    ------
    LogError
        If values are missing, infinite or implausible in their unit; if time does not increase
        within a run; if the temperature's or the rate's range is too small; if the output does not
        follow the rate, or by a factor that tells of a wrong unit. The message names column and
        row, what was found, and what would do.

    Examples
    --------
    >>> from skanfis.datasets import make_ofog
    >>> from skanfis.gyro import check_log
    >>> log = make_ofog(n_devices=1, n_runs=3, random_state=0).round({"temperature": 1})
    >>> check_log(log) is log
    True
    >>> check_log(log.assign(temperature=log["temperature"] + 273.15))
    Traceback (most recent call last):
        ...
    skanfis.gyro.log.LogError: column 'temperature', row 0: ... degC is not plausible ...
    """
    units = CANONICAL | declared_units(units)
    if len(log) < (_FEWEST_ROWS if len(inputs) else 1):
        raise LogError(f"{len(log)} rows are too few; at least {_FEWEST_ROWS} are needed.")
    for part in QUANTITIES:
        if part in log:
            _check_finite(log[part], part)
    for part in _PLAUSIBLE:
        if part in log and units[part] not in SIGNALS:
            _check_plausible(log[part].to_numpy(), part, units[part])
    if "output" in log and units["output"] in SIGNALS:
        _check_signal(log["output"].to_numpy(), units["output"])
    if "run" in log and len(inputs):
        _check_runs(log["run"])
    if "time" in log:
        _check_time(log, units["time"])
    if {"temperature", "temperature_rate"} & set(inputs):
        _check_temperature_span(log["temperature"], min_temperature_span)
    if "output" in inputs and "rate" in log:
        _check_output_follows_rate(log, units)
    return log


def check_at_rest(log, unit):
    """Refuse a log of a gyro that has turned; ``unit`` is that of the output.

    A raw signal, whose scale is not known, is told by its jumps alone, those of a rate table.
    """
    if "rate" in log:
        rate = log["rate"].to_numpy()
        row = int(np.argmax(np.abs(rate)))
        if abs(rate[row]) > _LARGEST_AT_REST:
            raise LogError(f"{rate[row]:.4g} deg/s: the gyro was not at rest.", "rate", row)
    output = log["output"].to_numpy()
    if unit not in SIGNALS:
        low, high = np.quantile(output, [0.01, 0.99])
        if high - low > _WIDEST_AT_REST:
            raise LogError(
                f"spans {low:.4g} to {high:.4g} deg/s: no bias does, the gyro was not at rest.",
                "output",
            )
    steps = np.abs(np.diff(output))
    if "run" in log:
        run = log["run"].to_numpy()
        steps = steps[run[1:] == run[:-1]]
    if not steps.any():
        return
    usual = max(np.median(steps), steps[steps > 0.0].min())
    jumps = np.count_nonzero(steps > _JUMP * usual)
    if jumps > max(_FEWEST_JUMPS, _RARE * steps.size):
        raise LogError(
            f"jumps {jumps} times by more than {_JUMP:g} times its usual step: the gyro was not at "
            "rest, or moved from level to level.",
            "output",
        )


def _checked(given, what, allowed):
    """``given`` itself; ValueError where a key is not allowed."""
    for key in given:
        if key not in allowed:
            raise ValueError(f"{what}: there is no {key!r}; it may be one of {', '.join(allowed)}.")
    return given


def _read_table(path, names, units, wanted, separator, decimal):
    """The parts of one file, converted; LogError with the file's name, column and line."""
    header = _header(path, separator)
    taken = [name for name in names.values() if name in header]
    found = {part: _place(path, header, names[part], taken) for part in COLUMNS}
    for part in COLUMNS:
        if part in wanted and found[part] is None:
            raise LogError(f"{path}: {_no_column(part, names[part], header)}")
    places = {part: place for part, place in found.items() if place is not None}
    names = names | {part: header[place] for part, place in places.items()}
    parts = list(places)
    quantities = [part for part in QUANTITIES if part in parts]
    if len(set(places.values())) < len(parts):
        raise LogError(f"{path}: two parts cannot be the same column of the file.")
    dtypes = {part: float if part in quantities else "category" for part in parts}
    _check_lengths(path, separator, len(header))
    # By place: a name may stand twice among the columns that play no part.
    by_place = {place: part for part, place in places.items()}
    options = _options(separator) | {
        "decimal": decimal,
        "header": 0,
        "names": [by_place.get(place, place) for place in range(len(header))],
        "usecols": list(dtypes),
    }
    try:
        table = pd.read_csv(path, dtype=dtypes, **options)[parts]
    except pd.errors.ParserError as error:
        raise LogError(f"{path}: is no table: {error}") from error
    except ValueError as error:
        text = pd.read_csv(path, dtype=str, **options)
        raise _no_number(text, path, names, separator, decimal, error) from error
    try:
        for part in quantities:
            _check_finite(table[part], part)
            table[part] = convert(table[part], part, units[part])
        for part in [part for part in LABELS if part in parts]:
            _check_label(table[part], part)
            # pandas makes numbers of labels that look like such.
            table[part] = table[part].cat.rename_categories(str)
    except LogError as error:
        raise _located(path, names, error, separator) from error
    return table


def _header(path, separator):
    """Names of the columns of a file; LogError where it has none."""
    for _, values in _records(path, separator):
        return values
    raise LogError(f"{path}: is empty.")


def _place(path, header, name, taken=()):
    """Position of a column by its name, or by that but for blanks around it and capitals."""
    if name in header:
        found = [place for place, other in enumerate(header) if other == name]
    else:
        plain = name.strip().casefold()
        found = [
            place
            for place, other in enumerate(header)
            if other.strip().casefold() == plain and other not in taken
        ]
    if len(found) > 1:
        names = " and ".join(repr(header[place]) for place in found)
        raise LogError(f"{path}: the header has {names}; which is meant? Rename one of them.")
    return found[0] if found else None


def _check_lengths(path, separator, n_columns):
    """Refuse rows longer than the header, such as those of a decimal comma beside commas.

    pandas cuts them without a word where it reads some columns only.
    """
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            # Counting is fast, and right as long as there are no quotes.
            if all(line.count(separator) < n_columns and '"' not in line for line in file):
                return
    except UnicodeDecodeError as error:
        raise _no_text(path) from error
    for line, values in _records(path, separator):
        if any(value.strip() for value in values[n_columns:]):
            raise LogError(
                f"{path}, line {line}: has {len(values)} values, more than the {n_columns} columns "
                "of the header."
            )


def _records(path, separator):
    """First line, from 1, and values of every record that is not blank; quotes may hide line ends.

    LogError where the file is no such table.
    """
    limit = csv.field_size_limit(_LONGEST_FIELD)
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file, delimiter=separator, skipinitialspace=True)
            line = 1
            for values in reader:
                if len(values) > 1 or "".join(values).strip():
                    yield line, values
                line = reader.line_num + 1
    except UnicodeDecodeError as error:
        raise _no_text(path) from error
    except csv.Error as error:
        raise LogError(f"{path}, line {reader.line_num}: is no table: {error}.") from error
    finally:
        csv.field_size_limit(limit)


def _no_text(path):
    return LogError(f"{path}: is not text in UTF-8; save it as such.")


def _options(separator):
    """What is the same for every reading of a file."""
    return {
        "sep": separator,
        "encoding": "utf-8-sig",
        "compression": None,
        "skipinitialspace": True,
        "index_col": False,
    }


def _no_column(part, name, header):
    found = ", ".join(map(repr, header[:20])) + (", ..." if len(header) > 20 else "")
    close = difflib.get_close_matches(name, header, n=1, cutoff=0.4)
    advice = f"{part}={close[0]}" if close else f"{part}=NAME"
    hint = ""
    for sign in ";\t|":
        if len(header) == 1 and sign in header[0]:
            hint = f" The separator seems to be {sign!r}."
    return (
        f"there is no column {name!r} for the {part}; the file has {found}. Say which it is "
        f"(columns: {advice}).{hint}"
    )


def _no_number(text, path, names, separator, decimal, error):
    """The error for the first value in a table of strings that is no number."""
    for part in [part for part in QUANTITIES if part in text]:
        column = text[part]
        numbers = pd.to_numeric(column.str.replace(decimal, ".", regex=False), errors="coerce")
        bad = np.flatnonzero(numbers.isna() & column.notna())
        if bad.size:
            reason = f"{column.iloc[bad[0]]!r} is not a number."
            return _located(path, names, LogError(reason, part, int(bad[0])), separator)
    return LogError(f"{path}: {error}")


def _located(path, names, error, separator):
    """An error of one part and row as one of the file's column and line."""
    place = "" if error.row is None else f", line {line_of(path, error.row, separator)}"
    part = "" if names[error.column] == error.column else f" ({error.column})"
    column = f", column {names[error.column]!r}{part}"
    return LogError(f"{path}{place}{column}: {error.reason}")


def located(error, columns, path=None, separator=","):
    """An error of :func:`check_log` in the names of the file's columns, and by its line.

    Without ``path``, where rows are not one file's, the row stays.
    """
    if error.column is None:
        return error
    names = {part: part for part in COLUMNS} | columns
    if path is not None:
        return _located(path, names, error, separator)
    return LogError(error.reason, names[error.column], error.row)


def line_of(path, row, separator):
    """Line of the file, from 1, on which a row starts."""
    lines = (line for line, _ in _records(path, separator))
    return next(islice(lines, row + 1, None), row + 2)


def _join(tables, paths):
    if not tables:
        raise ValueError("paths: at least one file is needed.")
    for path, table in zip(paths, tables, strict=True):
        if list(table) != list(tables[0]):
            missing = set(tables[0]) ^ set(table)
            raise LogError(f"{path}: the files differ in having {', '.join(sorted(missing))}.")
    if len(tables) == 1:
        return tables[0]
    labels = [name for name in LABELS if name in tables[0]]
    for table in tables:
        table[labels] = table[labels].astype(object)
    log = pd.concat(tables, ignore_index=True)
    log[labels] = log[labels].astype("category")
    stems = [Path(path).stem for path in paths]
    if len(set(stems)) < len(stems):
        stems = [str(path) for path in paths]
    codes = np.repeat(np.arange(len(tables)), [len(table) for table in tables])
    return log.assign(file=pd.Categorical.from_codes(codes, categories=pd.Index(stems)))


def _name_runs(log):
    """The run of every row as one label that no other file or device has too."""
    owners = [name for name in ("file", "device", "run") if name in log]
    if "file" not in log and "run" not in log:
        return log
    runs = log.groupby(owners, observed=True, sort=False).ngroup().to_numpy()
    _, first = np.unique(runs, return_index=True)
    labels = log[owners].iloc[first].astype(str)
    # The shortest label that tells them apart.
    for parts in (["run"], ["file"], ["device", "run"], ["file", "run"], owners):
        if set(parts) <= set(owners) and not labels.duplicated(parts).any():
            break
    names = labels[parts].agg(" / ".join, axis=1)
    log["run"] = pd.Categorical.from_codes(runs, categories=pd.Index(names))
    return log[[part for part in COLUMNS if part in log]]


def _check_finite(values, part):
    bad = ~np.isfinite(values.to_numpy())
    if bad.any():
        row = int(np.argmax(bad))
        kind = "is missing" if np.isnan(values.iloc[row]) else "is infinite"
        raise LogError(
            f"the value {kind} ({bad.sum()} such in {bad.size} rows); drop these rows.", part, row
        )


def _check_label(labels, part):
    bad = labels.isna().to_numpy()
    if bad.any():
        raise LogError(f"no label ({bad.sum()} such rows).", part, int(np.argmax(bad)))


def _check_plausible(values, part, unit):
    low, high = _PLAUSIBLE[part]
    bad = (values < low) | (values > high)
    if bad.any():
        row = int(np.argmax(bad))
        others = plausible_units(values, part, unit, low, high)
        advice = f"; is it in {' or '.join(others)}?" if others and bad.mean() > 0.5 else "."
        # More than half: the unit; few: glitches of the measurement.
        raise LogError(
            f"{values[row]:.1f} {CANONICAL[part]} is not plausible ({bad.sum()} of {bad.size} rows "
            f"are outside {low:g} to {high:g}){advice}",
            part,
            row,
        )


def _check_signal(values, unit):
    largest = np.abs(values).max()
    if not 1.0 / _LARGEST_SIGNAL < largest < _LARGEST_SIGNAL:
        raise LogError(f"signals up to {largest:.3g} {unit} are not plausible.", "output")


def _check_runs(run):
    n_runs = run.nunique()
    if n_runs * _FEWEST_ROWS_PER_RUN > len(run):
        raise LogError(
            f"{n_runs} runs in {len(run)} rows are too many; is it a counter of rows? A run lasts "
            f"from one power-on to the next; at least {_FEWEST_ROWS_PER_RUN} rows of each are due.",
            "run",
        )


def _check_time(log, unit):
    time = log["time"].to_numpy()
    runs = log["run"] if "run" in log else pd.Series(np.zeros(len(log), dtype=int), log.index)
    by_run = log.groupby(runs.to_numpy(), observed=True)
    step = by_run["time"].diff().to_numpy()
    bad = step <= 0
    if bad.any():
        row = int(np.argmax(bad))
        cure = (
            "Rows must be in the order of time."
            if "run" in log
            else "If several runs follow each other, say which column tells them apart (run=NAME)."
        )
        raise LogError(
            f"time does not increase within a run: {time[row]:.10g} s after "
            f"{time[row] - step[row]:.10g} s ({bad.sum()} such rows). {cure}",
            "time",
            row,
        )
    spans = by_run[["time", "temperature"]].agg(["min", "max"])
    duration = (spans["time"]["max"] - spans["time"]["min"]).to_numpy()
    heating = (spans["temperature"]["max"] - spans["temperature"]["min"]).to_numpy()
    if duration.max() > _LONGEST_RUN:
        raise LogError(
            f"a run of {duration.max() / 86_400:.3g} days is not plausible; is time in a smaller "
            f"unit than {unit}?",
            "time",
        )
    fast = heating > _FASTEST_CHANGE / 60.0 * duration
    # A rest of a few rows may change by the thermometer's noise.
    fast &= heating > 5.0
    if fast.any():
        first = int(np.argmax(fast))
        raise LogError(
            f"the temperature changes by {heating[first]:.3g} degC within {duration[first]:.3g} s, "
            f"which is not plausible; is time in a larger unit than {unit}?",
            "time",
        )


def _check_temperature_span(temperature, least):
    low, high = temperature.min(), temperature.max()
    if high - low < least:
        raise LogError(
            f"the temperature spans {high - low:.3g} degC only ({low:.4g} to {high:.4g}); "
            f"at least {least:g} degC are needed to learn from it. Log over a wider range, or "
            "leave temperature and temperature_rate out of the inputs.",
            "temperature",
        )


def _check_output_follows_rate(log, units):
    output, rate = log["output"].to_numpy(), log["rate"].to_numpy()
    for part, values in (("rate", rate), ("output", output)):
        if values.max() == values.min():
            raise LogError(
                f"all values are {values[0]:g}; a scale factor cannot be learnt from a log at one "
                "rate. Log at several rates, or learn the bias alone: leave output out of the "
                "inputs.",
                part,
            )
    if np.array_equal(output, rate):
        raise LogError("equals the column of the rate: one of them is the wrong one.", "output")
    correlation = np.corrcoef(output, rate)[0, 1]
    if abs(correlation) < _FOLLOWS:
        raise LogError(
            f"does not follow the rate (correlation {correlation:.3f}); is it, or that of the "
            "rate, the wrong column?",
            "output",
        )
    slope = np.polyfit(rate, output, 1)[0]
    if units["output"] not in SIGNALS and not 0.5 < slope < 2.0:
        raise LogError(
            f"changes by {slope:.4g} deg/s per deg/s of rate: {_diagnosis(slope, units)} A raw "
            "signal with a scale factor of its own is declared as counts.",
            "output",
        )


def _diagnosis(slope, units):
    """What a slope far from 1 tells."""
    if -2.0 < slope < -0.5:
        return "its sign is reversed."
    found = []
    for part, power in (("output", 1), ("rate", -1)):
        for unit in units_of("rate"):
            ratio = convert(1.0, part, unit) / convert(1.0, part, units[part])
            if 0.7 < slope * ratio**power < 1.4:
                found.append(f"the {part} in {unit}")
    return f"is {' or '.join(found)}?" if found else "are the units right?"
