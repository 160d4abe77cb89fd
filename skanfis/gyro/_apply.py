"""``--apply``: a compensator over logs, piece by piece, with a status for every row."""

from pathlib import Path

import joblib
import numpy as np
import pandas as pd

from ..export.c.status import STATUS
from ._checks import RowChecks
from ._columns import SIGNALS
from ._console import UsageError, refuse_existing, say, staged, usage_errors
from ._log_file import LogFile, RunFinder
from ._options import request_of
from .compensator import GyroCompensator, features
from .log import check_different, find_logs, pieces_of

__all__ = ["apply"]


def apply(options, tell):
    """Compensate the logs that the options name, and write the rates."""
    paths = find_logs(options.logs)
    if len(paths) > 1 and options.output is None:
        raise UsageError("--apply to several logs needs --output.")
    target = options.output or Path(f"{Path(paths[0]).stem}-compensated.csv")
    refuse_existing([target], options.force)
    compensator = load(options.apply, tell)
    needed = {"output"} | set(compensator.inputs) - {"temperature_rate"}
    if "temperature_rate" in compensator.inputs:
        needed |= {"time", "temperature"}
    if options.average is not None:
        needed.add("time")
    request = request_of(options, sorted(needed))
    check_different(paths)
    summary = _Summary(target)
    with staged(target.parent) as folder, usage_errors():
        with open(folder / target.name, "w", encoding="utf-8", newline="") as written:
            for number, path in enumerate(paths, start=1):
                tell(f"compensating {path} ({number} of {len(paths)})")
                file = LogFile(path, request)
                stem = Path(path).stem if len(paths) > 1 else ""
                for log, compensated in _compensated(
                    file, compensator, options.max_gap, stem, tell
                ):
                    labels = [name for name in ("device", "run", "time") if name in log]
                    table = log[labels].join(compensated)
                    # Twelve digits are beyond any gyro, and short beside the 17 of a double.
                    is_first = summary.n_rows == 0
                    table.to_csv(written, index=False, header=is_first, float_format="%.12g")
                    summary.add(log, compensated)
        tell(f"writing {target}")
    say(summary.lines())
    tell("done")


def _compensated(file, compensator, max_gap, stem, tell):
    """Pieces of a log, with labels of their runs, and what the compensator makes of them."""
    unit, due = file.layout.units["output"], compensator.output_unit
    if (unit if unit in SIGNALS else "deg/s") != due:
        raise UsageError(
            f"the model was calibrated for an output in {due}; this is in {unit} "
            f"(--units output={due})."
        )
    finder, checks = RunFinder(max_gap), RowChecks(file.layout.units)
    inputs_of = _Inputs(compensator.inputs, compensator.time_constant)
    for log in pieces_of(file, 0, finder, checks, tell):
        compensated = compensator._compensated(inputs_of(log), compensator.indicated(log))
        labels = finder.runs["run"]
        if "run" not in file.layout.places and stem:
            labels = labels.map(lambda number: stem if number in "1" else f"{stem} / {number}")
        log["run"] = labels.to_numpy()[log["run"]]
        yield log if any(labels) else log.drop(columns="run"), compensated
    for note in [*file.notes, *filter(None, [finder.note])]:
        tell(f"note: {note}")
    tell(f"{file.n_rows:,} rows")


class _Inputs:
    """Inputs of a compensator, piece by piece, whose runs go on from one piece to the next.

    A run that goes on begins with two rows made up: the second is its last one, and between them
    the temperature rises by what leaves the low-pass at the rate that it had there.
    """

    def __init__(self, inputs, time_constant):
        self._inputs, self._lag = inputs, time_constant
        self._ends = pd.DataFrame({"run": []})  # the last row of each run, and when it began

    def __call__(self, log):
        if not {"time", "temperature_rate"} & set(self._inputs):
            return features(log, self._inputs, self._lag)
        log = log.assign(temperature=log.get("temperature", 0.0))
        parts = ["time", "temperature", "output", "run"]
        ends = self._ends[self._ends["run"].isin(log["run"])]
        joined = log[parts]
        if len(ends):
            rise = ends["rate"] * self._lag / np.expm1(-1.0)
            before = ends.assign(
                time=ends["time"] - self._lag, temperature=ends["temperature"] + rise
            )
            joined = pd.concat([before[parts], ends[parts], joined])
        X = features(joined, self._inputs, self._lag).iloc[2 * len(ends) :].set_axis(log.index)
        begin = log.groupby("run")["time"].transform("first")
        if len(ends):
            begin = log["run"].map(ends.set_index("run")["begin"]).fillna(begin)
        if "time" in X:
            X["time"] = log["time"] - begin
        state = log[parts].assign(begin=begin, rate=X.get("temperature_rate", 0.0))
        ended = pd.concat([self._ends, state]) if len(self._ends) else state
        self._ends = ended.groupby("run").tail(1)
        return X


def load(path, tell):
    """The compensator of a file: of JSON, or else by its name a pickle, which may run any code."""
    try:
        return GyroCompensator.read_json(path)
    except ValueError as error:
        if Path(path).suffix.lower() != ".joblib":
            raise UsageError(str(error)) from error
        reason = str(error)
    tell(
        f"{reason} It is loaded as a pickle for its name ends in .joblib: loading it runs whatever "
        "code it holds. compensator.json runs nothing."
    )
    try:
        loaded = joblib.load(path)
    except Exception as error:
        # A damaged pickle may raise anything.
        raise UsageError(
            f"{path} cannot be loaded ({type(error).__name__}: {error}): it is damaged, or no "
            "compensator. Use compensator.json."
        ) from error
    if not isinstance(loaded, GyroCompensator):
        raise UsageError(f"{path} holds a {type(loaded).__name__}, not a GyroCompensator.")
    return loaded


class _Summary:
    """Counts and squares over all files."""

    def __init__(self, target):
        self._target = target
        self.n_rows = self._n_flagged = 0
        self._by_status = dict.fromkeys(STATUS, 0)
        # Squares before and after, and how many, of the rows where all is well and of others.
        self._squares = {False: np.zeros(3), True: np.zeros(3)}

    def add(self, log, compensated):
        """Count the rows of one file."""
        status = compensated["status"].to_numpy()
        self.n_rows += len(log)
        self._n_flagged += int(np.count_nonzero(status))
        for name, bit in STATUS.items():
            self._by_status[name] += int(np.count_nonzero(status & bit))
        if "rate" not in log:
            return
        before, after = (
            (compensated[name] - log["rate"]).to_numpy()
            for name in ("rate_indicated", "rate_compensated")
        )
        for flagged, sums in self._squares.items():
            rows = (status != 0) == flagged
            answered = rows & np.isfinite(after)
            sums += [np.sum(before[answered] ** 2), np.sum(after[answered] ** 2), answered.sum()]

    def lines(self):
        """The summary."""
        yield f"written        {self._target}: {self.n_rows:,} rows, {self._n_flagged:,} flagged"
        for name, bit in STATUS.items():
            if self._by_status[name]:
                count = self._by_status[name]
                yield f"status {bit}       {count:,} rows {name.lower().replace('_', ' ')}"
        for flagged, (before, after, n_answered) in self._squares.items():
            if n_answered:
                yield (
                    f"RMS error      {np.sqrt(before / n_answered):.4g} deg/s before, "
                    f"{np.sqrt(after / n_answered):.4g} after "
                    f"({'flagged' if flagged else 'all is well'})"
                )
