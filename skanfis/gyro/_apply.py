"""``--apply``: a compensator over logs, file by file, with a status for every row."""

from pathlib import Path

import joblib
import numpy as np

from ..export.c.status import STATUS
from ._carried import Carried
from ._columns import SIGNALS
from ._console import UsageError, refuse_existing, say, usage_errors
from ._files import check_different, find_logs
from ._logs import request_of
from ._staging import Staging
from ._stream import LogStream
from .compensator import GyroCompensator

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
    check_different(paths)
    summary = _Summary(target)
    with Staging(target.parent) as staging:
        with open(staging.path / target.name, "w", encoding="utf-8", newline="") as file:
            for number, path in enumerate(paths, start=1):
                stream = _open(path, options, sorted(needed), compensator, tell)
                tell(f"compensating {path} ({number} of {len(paths)})")
                carried = Carried(compensator.inputs, compensator.time_constant)
                for log in stream.pieces():
                    if len(paths) > 1 and "run" not in log:
                        log["run"] = Path(path).stem
                    X, indicated = carried.features(log), compensator.indicated(log)
                    compensated = compensator._compensated(X, indicated)
                    labels = [name for name in ("device", "run", "time") if name in log]
                    table = log[labels].join(compensated)
                    # Twelve digits are beyond any gyro, and short beside the 17 of a double.
                    is_first = summary.n_rows == 0
                    table.to_csv(file, index=False, header=is_first, float_format="%.12g")
                    summary.add(log, compensated)
        tell(f"writing {target}")
        staging.publish()
    say(summary.lines())
    tell("done")


def _open(path, options, needed, compensator, tell):
    """The log of one file, checked: read once, piece by piece, and to be read again."""
    with usage_errors():  # characters that do not go together
        request = request_of(options, needed)
        stream = LogStream(path, request, options.max_gap, options.device)
    unit, due = stream.units["output"], compensator.output_unit
    if (unit if unit in SIGNALS else "deg/s") != due:
        raise UsageError(
            f"the model was calibrated for an output in {due}; this is in {unit} "
            f"(--units output={due})."
        )
    for note in stream.scan(tell):
        tell(f"note: {note}")
    tell(f"{stream.n_rows:,} rows")
    return stream


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
