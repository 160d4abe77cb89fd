"""What is known on board, of a log that comes in pieces."""

import numpy as np
import pandas as pd

from ._stream import rows_before
from .compensator import features

__all__ = ["Carried"]


class Carried:
    """Inputs of a compensator, piece by piece, whose runs go on from one piece to the next.

    A run that goes on begins with two rows made up: the second is its last one, and between them
    the temperature rises by what leaves the low-pass at the rate that it had there.
    """

    def __init__(self, inputs, time_constant):
        self._inputs, self._lag = inputs, time_constant
        self._state: dict = {}  # by run: first time, last time, temperature and its rate there

    def features(self, log):
        """The inputs of the next rows; "run" tells them apart, where it is a column."""
        if not {"time", "temperature_rate"} & set(self._inputs):
            return features(log, self._inputs, self._lag)
        runs = log["run"].astype(object) if "run" in log else pd.Series(None, log.index, object)
        known = [run for run in runs.unique() if run in self._state]
        before = [row for run in known for row in self._before(run, "run" in log)]
        columns = [part for part in ("time", "temperature", "output", "run") if part in log]
        own = log[columns].assign(run=runs) if "run" in log else log[columns]
        X = features(rows_before(before, own), self._inputs, self._lag)
        X = X.iloc[len(before) :].set_axis(log.index)
        if "time" in X:
            began = {run: self._state[run][1] - self._lag - self._state[run][0] for run in known}
            X["time"] += runs.map(began).fillna(0.0).astype(float)
        self._remember(log, runs, X)
        return X

    def _before(self, run, has_run):
        _, time, temperature, rate = self._state[run]
        earlier = temperature + rate * self._lag / np.expm1(-1.0)
        rows = [
            {"time": time - self._lag, "temperature": earlier, "output": 0.0},
            {"time": time, "temperature": temperature, "output": 0.0},
        ]
        return [row | {"run": run} for row in rows] if has_run else rows

    def _remember(self, log, runs, X):
        ends = ~runs.duplicated(keep="last").to_numpy()
        begins = ~runs.duplicated().to_numpy()
        for run, time in zip(runs[begins], log["time"][begins], strict=True):
            self._state.setdefault(run, (time, None, None, None))
        for place in np.flatnonzero(ends):
            run = runs.iloc[place]
            self._state[run] = (
                self._state[run][0],
                log["time"].iloc[place],
                log["temperature"].iloc[place] if "temperature" in log else 0.0,
                X["temperature_rate"].iloc[place] if "temperature_rate" in X else 0.0,
            )
