"""The runs of a log: by their labels, by the files, and by gaps of the time."""

import numpy as np
import pandas as pd

__all__ = ["lost_rows", "name_runs", "split_runs"]

# A rest without power is longer than what a logger drops, and than a few of its steps.
_SHORTEST_GAP = 60.0  # s
_STEPS = 50.0
# Shorter pieces are no runs, but a logger that stutters.
_FEWEST_ROWS = 20
# Part of a run at whose beginning a clock is again that has been set anew.
_BEGINNING = 0.1
# Part of the step by which even steps may differ.
_REGULAR = 0.1
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
    longest = max(_SHORTEST_GAP, _STEPS * usual) if max_gap == "auto" else max_gap
    gaps = steps > longest
    restarts = _restarts(time, steps, ~same)
    begins = ~same | gaps | restarts
    n_new = int((gaps | restarts).sum())
    if n_new == 0:
        return None, ""
    lengths = np.diff(np.flatnonzero(begins), append=time.size)
    if max_gap == "auto" and np.median(lengths) < _FEWEST_ROWS:
        return None, ""
    number = np.empty(time.size, dtype=int)
    number[order] = np.cumsum(begins) - 1
    parts = []
    if gaps.any():
        parts.append(f"at {_times(gaps, 'gap')} of the time longer than {longest:.4g} s")
    if restarts.any():
        parts.append(f"where the time begins anew ({_times(restarts, 'time')})")
    s = "s" if begins.sum() > 1 else ""
    why = f"the log is split into {int(begins.sum())} run{s}, {' and '.join(parts)}"
    return number, f"{why}; --max-gap says otherwise, inf for no such gap"


def _times(flags, noun):
    n = int(flags.sum())
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
    if "time" not in log or len(log) < _FEWEST_ROWS:
        return ""
    run = log["run"].cat.codes.to_numpy() if "run" in log else np.zeros(len(log), dtype=int)
    order = np.argsort(run, kind="stable")
    steps = np.diff(log["time"].to_numpy()[order])[np.diff(run[order]) == 0]
    steps = steps[steps > 0.0]
    if steps.size == 0:
        return ""
    usual = float(np.median(steps))
    if np.mean(np.abs(steps - usual) < _REGULAR * usual) < 0.9:
        return ""  # not even
    long = steps[steps > _LOST * usual]
    if long.size == 0:
        return ""
    lost = int(np.sum(np.round(long / usual) - 1))
    if lost <= n_known:
        return ""
    return (
        f"about {lost - n_known:,} rows are missing: at {long.size:,} places the time steps by "
        f"more than {_LOST:g} times its usual {usual:.4g} s"
    )


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
