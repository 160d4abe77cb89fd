"""``--apply``: a compensator over logs, piece by piece, with a status for every row."""

from pathlib import Path

import numpy as np
import pandas as pd

from ..export.c.status import STATUS
from ._checks import RowChecks
from ._columns import SIGNALS
from ._console import refuse_existing, say, staged, usage_errors
from ._log_file import LogFile
from ._options import request_of
from ._runs import RunFinder
from .compensator import GyroCompensator, features
from .errors import UsageError
from .log import check_different, find_logs, pieces_of

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
    request = request_of(options, sorted(needed))
    check_different(paths)
    tallies: list = []
    with staged(target.parent) as folder, usage_errors():
        with open(folder / target.name, "w", encoding="utf-8", newline="") as written:
            for number, path in enumerate(paths, start=1):
                tell(f"compensating {path} ({number} of {len(paths)})")
                file, stem = LogFile(path, request), Path(path).stem if len(paths) > 1 else ""
                for log, rates in _compensated(file, compensator, stem, tell):
                    labels = [name for name in ("device", "run", "time") if name in log]
                    # Twelve digits are beyond any gyro, and short beside the 17 of a double.
                    log[labels].join(rates).to_csv(
                        written, index=False, header=not tallies, float_format="%.12g"
                    )
                    tallies.append(_tally(log, rates))
        tell(f"writing {target}")
    say(_summary(target, tallies))
    tell("done")


def _compensated(file, compensator, stem, tell):
    """Pieces of a log, with labels of their runs, and what the compensator makes of them."""
    unit, due = file.layout.units["output"], compensator.output_unit
    if (unit if unit in SIGNALS else "deg/s") != due:
        raise UsageError(
            f"the model was calibrated for an output in {due}; this is in {unit} "
            f"(--units output={due})."
        )
    finder, checks = RunFinder(by_clock=True), RowChecks(file.layout.units)
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


def _tally(log, rates):
    """Numbers of rows by status; where the true rate is known, sums of squared errors too."""
    tally = pd.DataFrame({"rows": 1}, index=rates.index)
    if "rate" in log:
        for name in ("indicated", "compensated"):
            tally[name] = (rates[f"rate_{name}"] - log["rate"]) ** 2
    return tally.groupby(rates["status"]).sum()


def _summary(target, tallies):
    counts = pd.concat(tallies).groupby(level=0).sum() if tallies else pd.DataFrame({"rows": []})
    rows, status = counts["rows"], counts.index
    n_flagged = rows[status != 0].sum()
    yield f"written        {target}: {rows.sum():,} rows, {n_flagged:,} flagged"
    for name, bit in STATUS.items():
        if len(rows) and (count := rows[(status & bit) != 0].sum()):
            yield f"status {bit}       {count:,} rows {name.lower().replace('_', ' ')}"
    if "compensated" in counts and 0 in status:
        before, after = np.sqrt(counts.loc[0, ["indicated", "compensated"]] / rows.loc[0])
        yield f"RMS error      {before:.4g} deg/s before, {after:.4g} after (rows with status 0)"
