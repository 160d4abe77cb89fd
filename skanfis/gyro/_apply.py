"""``--apply``: a compensator over logs, piece by piece, with a status for every row."""

from pathlib import Path

import numpy as np
import pandas as pd

from ..export.c.status import STATUS
from ._checks import RowChecks
from ._columns import SIGNALS
from ._console import UsageError, refuse_existing, say, staged, usage_errors
from ._log_file import LogFile, RunFinder
from ._options import request_of
from .compensator import GyroCompensator, features
from .log import check_device, check_different, find_logs, pieces_of

__all__ = ["apply"]


def apply(options, tell):
    """Compensate the logs that the options name, and write the rates."""
    paths = find_logs(options.logs)
    if len(paths) > 1 and options.output is None:
        raise UsageError("--apply to several logs needs --output.")
    target = options.output or Path(f"{Path(paths[0]).stem}-compensated.csv")
    refuse_existing([target], options.force)
    with usage_errors():
        compensator = GyroCompensator.read_json(options.apply)
    needed = {"output"} | set(compensator.inputs) - {"temperature_rate"}
    if "temperature_rate" in compensator.inputs:
        needed |= {"time", "temperature"}
    if options.average is not None:
        needed.add("time")
    request = request_of(options, sorted(needed))
    check_different(paths)
    summary, files = _Summary(target), []
    with staged(target.parent) as folder, usage_errors():
        with open(folder / target.name, "w", encoding="utf-8", newline="") as written:
            for number, path in enumerate(paths, start=1):
                tell(f"compensating {path} ({number} of {len(paths)})")
                files.append(file := LogFile(path, request))
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
        check_device(files, request)
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


class _Summary:
    """Counts and squared errors over all rows."""

    def __init__(self, target):
        self._target = target
        self.n_rows = 0
        self._by_status = pd.Series(dtype=int)
        # Squares before and after, and how many, of the rows where all is well and of others.
        self._squares = {False: np.zeros(3), True: np.zeros(3)}

    def add(self, log, compensated):
        status = compensated["status"]
        self.n_rows += len(log)
        self._by_status = self._by_status.add(status.value_counts(), fill_value=0)
        if "rate" not in log:
            return
        errors = compensated[["rate_indicated", "rate_compensated"]].sub(log["rate"], axis=0)
        errors = (errors.dropna() ** 2).assign(count=1.0)
        for is_flagged, sums in errors.groupby(status[errors.index] != 0):
            self._squares[is_flagged] += sums.sum().to_numpy()

    def lines(self):
        """The summary."""
        counts = self._by_status.astype(int)
        n_flagged = counts[counts.index != 0].sum()
        yield f"written        {self._target}: {self.n_rows:,} rows, {n_flagged:,} flagged"
        for name, bit in STATUS.items():
            if count := counts[(counts.index & bit) != 0].sum():
                yield f"status {bit}       {count:,} rows {name.lower().replace('_', ' ')}"
        for is_flagged, (before, after, n_rows) in self._squares.items():
            if n_rows:
                kind = "flagged" if is_flagged else "all is well"
                yield (
                    f"RMS error      {np.sqrt(before / n_rows):.4g} deg/s before, "
                    f"{np.sqrt(after / n_rows):.4g} after ({kind})"
                )
