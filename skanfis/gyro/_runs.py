"""The runs of a log: by their labels, by the files, and by gaps of the time."""

import numpy as np
import pandas as pd

__all__ = ["FEWEST_ROWS", "LostRows", "Splitter", "lost_rows", "name_runs", "split_runs"]

# A rest without power is longer than what a logger drops, and than a few of its steps.
_SHORTEST_GAP = 60.0  # s
_STEPS = 50.0
# Shorter pieces are no runs, but a logger that stutters.
FEWEST_ROWS = 20
# Part of a run at whose beginning a clock is again that has been set anew.
_BEGINNING = 0.1
# A logger is even if so many of its steps are within a part of the usual one.
_REGULAR, _EVEN = 0.1, 0.9
# From here on a row is nearer to being missing than to being late.
_LOST = 1.5


def split_runs(log, max_gap):
    """Number of each row's run where the time tells several, and why; None where it does not.

    ``log`` has no labels of runs; "file" and "device" tell sequences apart. ``max_gap`` [s] is the
    longest step within a run, or "auto".
    """
    if "time" not in log:
        return None, ""
    sequence = _sequences(log)
    order = np.argsort(sequence, kind="stable")
    time = log["time"].to_numpy()[order]
    same = np.diff(sequence[order], prepend=-1) == 0
    steps = np.where(same, np.diff(time, prepend=time[:1]), 0.0)
    forward = steps[steps > 0.0]
    if forward.size == 0:
        return None, ""
    usual = float(np.median(forward))
    longest = _longest(max_gap, usual)
    gaps = steps > longest
    restarts = _restarts(time, steps, ~same)
    begins = ~same | gaps | restarts
    n_new = int((gaps | restarts).sum())
    if n_new == 0:
        return None, ""
    lengths = np.diff(np.flatnonzero(begins), append=time.size)
    if max_gap == "auto" and np.median(lengths) < FEWEST_ROWS:
        return None, ""
    number = np.empty(time.size, dtype=int)
    number[order] = np.cumsum(begins) - 1
    return number, _why(int(begins.sum()), int(gaps.sum()), int(restarts.sum()), longest)


def _longest(max_gap, usual):
    """The longest step of the time within a run."""
    return max(_SHORTEST_GAP, _STEPS * usual) if max_gap == "auto" else max_gap


def _why(n_runs, n_gaps, n_restarts, longest):
    parts = []
    if n_gaps:
        parts.append(f"at {_times(n_gaps, 'gap')} of the time longer than {longest:.4g} s")
    if n_restarts:
        parts.append(f"where the time begins anew ({_times(n_restarts, 'time')})")
    why = f"the log is split into {_times(n_runs, 'run')}, {' and '.join(parts)}"
    return f"{why}; --max-gap says otherwise, inf for no such gap"


def _times(n, noun):
    return f"{n} {noun}{'s' if n > 1 else ''}"


def _restarts(time, steps, first):
    """Rows at which the clock is back at the beginning of its run."""
    found = np.zeros(time.size, dtype=bool)
    starts = np.flatnonzero(first)
    begin = starts[0]
    for row in np.flatnonzero(first | (steps < 0.0)).tolist():
        if first[row]:
            begin = row
            continue
        span = time[row - 1] - time[begin]
        if time[row] <= time[begin] + _BEGINNING * span:
            found[row], begin = True, row
    return found


def _sequences(log):
    owners = [name for name in ("file", "device") if name in log]
    if not owners:
        return np.zeros(len(log), dtype=int)
    return log.groupby(owners, observed=True, sort=False).ngroup().to_numpy()


def lost_rows(log, n_known):
    """How many rows a logger has lost, by its own even steps, in words; empty where none.

    ``n_known`` is how many are known to have been left out.
    """
    if "time" not in log or len(log) < FEWEST_ROWS:
        return ""
    run = log["run"].cat.codes.to_numpy() if "run" in log else np.zeros(len(log), dtype=int)
    order = np.argsort(run, kind="stable")
    lost = LostRows()
    lost.add_steps(np.diff(log["time"].to_numpy()[order])[np.diff(run[order]) == 0])
    return lost.sentence(n_known)


def name_runs(log, number=None):
    """The log with the run of every row as one label that no other file or device has too.

    ``number`` is that of the run where the time told it.
    """
    if number is not None:
        log = log.assign(run=_numbered(log, number))
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
    return log.drop(columns="file", errors="ignore")


def _numbered(log, number):
    """Numbers of the runs, from 1, anew in every file or device."""
    _, first = np.unique(number, return_index=True)
    sequence = _sequences(log)[first]
    begins = np.maximum.accumulate(
        np.where(np.diff(sequence, prepend=-1) != 0, np.arange(sequence.size), 0)
    )
    labels = [str(place + 1) for place in np.arange(sequence.size) - begins]
    names = sorted(set(labels), key=int)
    codes = pd.Index(names).get_indexer(labels)[number]
    return pd.Categorical.from_codes(codes, categories=pd.Index(names))


class Splitter:
    """As :func:`split_runs`, of a log that comes in pieces.

    The usual step of the time is that of the first piece.
    """

    def __init__(self, max_gap, longest=None):
        self._max_gap, self._longest = max_gap, longest
        # By sequence: when its run began, its last time, the number of its run.
        self._open: dict = {}
        self._lengths: dict = {}
        self._n_gaps = self._n_restarts = 0

    def again(self):
        """For the same log from the beginning."""
        return Splitter(self._max_gap, self._longest)

    def numbers(self, sequence, time, owner=None):
        """Number of every row's run in its sequence, from 1; ``sequence`` are labels or None.

        What has another ``owner``, such as a file, is another sequence.
        """
        codes, names = pd.factorize(np.zeros(time.size) if sequence is None else sequence)
        numbers = np.empty(time.size, dtype=int)
        for code, name in enumerate(names):
            rows = np.flatnonzero(codes == code)
            numbers[rows] = own = self._of_one((owner, name), time[rows])
            for number, count in zip(*np.unique(own, return_counts=True), strict=True):
                key = owner, name, number
                self._lengths[key] = self._lengths.get(key, 0) + int(count)
        return numbers

    def _of_one(self, name, time):
        begin, last, number = self._open.get(name, (time[0], time[0], 1))
        steps = np.diff(time, prepend=last)
        gaps = steps > self._limit(steps)
        first = np.zeros(time.size + 2, dtype=bool)
        first[0] = True
        path = np.concatenate([[begin, last], time])
        restarts = _restarts(path, np.concatenate([[0.0, 0.0], steps]), first)[2:]
        numbers = number + np.cumsum(gaps | restarts)
        if restarts.any():
            begin = time[np.flatnonzero(restarts)[-1]]
        self._open[name] = begin, time[-1], int(numbers[-1])
        self._n_gaps += int(gaps.sum())
        self._n_restarts += int(restarts.sum())
        return numbers

    def _limit(self, steps):
        if self._longest is None:
            forward = steps[steps > 0.0]
            if forward.size == 0:
                return np.inf
            self._longest = _longest(self._max_gap, float(np.median(forward)))
        return self._longest

    @property
    def is_split(self):
        """Whether the time tells several runs."""
        if self._n_gaps + self._n_restarts == 0:
            return False
        return self._max_gap != "auto" or np.median(list(self._lengths.values())) >= FEWEST_ROWS

    @property
    def why(self):
        """What told them apart, in words."""
        return _why(len(self._lengths), self._n_gaps, self._n_restarts, self._longest)


class LostRows:
    """As :func:`lost_rows`, of a log that comes in pieces; its usual step is the first piece's."""

    def __init__(self):
        self._usual = 0.0
        self.n_steps = self._n_even = self._n_long = self._n_lost = 0

    def add(self, time, last=None):
        """Times of one run, and the last one before them."""
        self.add_steps(np.diff(time, prepend=time[0] if last is None else last))

    def add_steps(self, steps):
        """Steps of the time within runs."""
        steps = steps[steps > 0.0]
        if steps.size == 0:
            return
        self._usual = self._usual or float(np.median(steps))
        long = steps[steps > _LOST * self._usual]
        self.n_steps += steps.size
        self._n_even += int(np.sum(np.abs(steps - self._usual) < _REGULAR * self._usual))
        self._n_long += long.size
        self._n_lost += int(np.sum(np.round(long / self._usual) - 1))

    def sentence(self, n_known):
        """How many rows are missing, in words; empty where none."""
        n_lost = self._n_lost - n_known
        if self._n_even < _EVEN * self.n_steps or n_lost <= 0:
            return ""
        return (
            f"about {n_lost:,} rows are missing: at {self._n_long:,} places the time steps by "
            f"more than {_LOST:g} times its usual {self._usual:.4g} s"
        )
