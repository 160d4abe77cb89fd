"""The runs of a log that comes in pieces: by labels, else by its clock; and by files."""

import numpy as np
import pandas as pd

__all__ = ["RunFinder"]

# A rest without power is longer than what a logger drops, and than a few of its steps.
_SHORTEST_GAP = 60.0  # s
_STEPS = 50.0
_FEWEST_ROWS = 20  # shorter pieces are no runs, but a logger that stutters
_BEGINNING = 0.1  # part of a run, where a clock is again that has been set anew


class RunFinder:
    """Finds the runs of a log that comes in pieces.

    With ``by_clock``, a file without labels is split at long steps of its time, and where it begins
    anew. ``runs`` are the files, devices and labels of the runs, in the order in which they came.
    """

    def __init__(self, by_clock):
        self._by_clock = by_clock
        self._longest = None  # step of the time within a run [s]
        self._codes: dict = {}
        # By file and device: when its clock began, its last time, the number of its run.
        self._open: dict = {}
        self._n_gaps = self._n_restarts = 0

    @property
    def runs(self):
        return pd.DataFrame(list(self._codes), columns=["file", "device", "run"])

    def codes(self, piece, file):
        """Position of each row's run among ``runs``; ``file`` tells files apart."""
        device = piece["device"] if "device" in piece else pd.Series("", piece.index)
        if "run" in piece:
            run = piece["run"]
        elif "time" in piece and self._by_clock:
            run = self._split(device, piece["time"], file).astype(str)
        else:
            run = pd.Series("", piece.index)
        groups = pd.DataFrame({"device": device, "run": run}).groupby(["device", "run"], sort=False)
        own = [
            self._codes.setdefault((file, *key), len(self._codes))
            for key in groups.head(1).itertuples(index=False, name=None)
        ]
        return np.array(own)[groups.ngroup().to_numpy()]

    def _split(self, device, time, file):
        if self._longest is None:
            self._longest = _longest_step(time, device)
        number = pd.Series(1, time.index)
        for name, values in time.groupby(device, sort=False):
            begin, last, before = self._open.get((file, name), (values.iloc[0],) * 2 + (1,))
            steps = np.diff(values, prepend=last)
            gaps = steps > self._longest
            restarts = np.zeros(steps.size, dtype=bool)
            for row in np.flatnonzero(steps < 0.0).tolist():
                restart = values.iloc[row]
                if restart <= begin + _BEGINNING * (restart - steps[row] - begin):
                    restarts[row], begin = True, restart
            number[values.index] = before + np.cumsum(gaps | restarts)
            self._open[file, name] = begin, values.iloc[-1], int(number[values.index[-1]])
            self._n_gaps += int(gaps.sum())
            self._n_restarts += int(restarts.sum())
        return number

    @property
    def note(self):
        """What the clock has told, in words; empty where it tells one run."""
        parts = []
        if self._n_gaps:
            gaps = _counted(self._n_gaps, "gap")
            parts.append(f"at {gaps} of the time longer than {self._longest:.4g} s")
        if self._n_restarts:
            times = _counted(self._n_restarts, "time")
            parts.append(f"where the time begins anew ({times})")
        if not parts:
            return ""
        return f"the log is split into {_counted(len(self._codes), 'run')}, {' and '.join(parts)}"

    def names(self, file_names, has_labels):
        """The shortest label of each run that tells it from all others; None of a single run."""
        keys: dict = dict(
            zip(("file", "device", "run"), zip(*self._codes, strict=True), strict=False)
        )
        owners = ["file"] if len(file_names) > 1 else []
        owners += ["device"] if any(keys.get("device", ())) else []
        owners += ["run"] if has_labels or self.note else []
        if not keys or not {"file", "run"} & set(owners):
            return None
        keys["file"] = [file_names[file] for file in keys["file"]]
        for parts in (["run"], ["file"], ["device", "run"], ["file", "run"], owners):
            if set(parts) <= set(owners):
                names = [" / ".join(row) for row in zip(*map(keys.get, parts), strict=True)]
                if len(set(names)) == len(names):
                    break
        return names


def _longest_step(time, device):
    """The longest step of the time within a run, by the first piece of a log."""
    order = np.argsort(pd.factorize(device)[0], kind="stable")
    device, time = device.to_numpy()[order], time.to_numpy()[order]
    steps = np.diff(time, prepend=time[0])
    is_first = np.append(True, device[1:] != device[:-1])
    forward = steps[(steps > 0.0) & ~is_first]
    if forward.size == 0:
        return np.inf
    longest = max(_SHORTEST_GAP, _STEPS * float(np.median(forward)))
    lengths = np.diff(np.flatnonzero(is_first | (steps > longest)), append=time.size)
    return longest if np.median(lengths) >= _FEWEST_ROWS else np.inf


def _counted(n, noun):
    return f"{n} {noun}{'s' if n > 1 else ''}"
