"""Rows that no other row supports: a glitch of the output, of the rate table or of the thermometer.

Least squares bends the whole model towards one such row, and its value widens the range in which
rows count as known.
"""

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

__all__ = ["find_glitches"]

# More than so many rows of a kind support one another.
_MOST = 3
# Times the deviation of the next row: none of a bell-shaped noise comes near, nor of Student's with
# three degrees of freedom in a thousand logs.
_ALONE = 5.0
# Their median is the row's surroundings, and stands one other glitch among them.
_N_NEIGHBOURS = 8
# The rows farthest off, and rows among which their neighbours are sought, at most.
_MOST_CANDIDATES, _MOST_NEIGHBOURS = 2_000, 200_000
# A temperature moves slowly: a part of its range is a lot from one row to the next.
_SMOOTH = 0.2


def find_glitches(log, error):
    """Positions of the glitches of a log, and what is odd about each; ``error`` is of every row.

    Two things are looked at: the error, beside that of the rows nearest in temperature, rate and
    order, and the temperature, beside that of the rows before and after in the run.
    """
    temperature, rate = (log[part].to_numpy() for part in ("temperature", "rate"))
    runs = log["run"].to_numpy() if "run" in log else np.zeros(len(log), dtype=int)
    by_run = pd.Series(temperature).groupby(runs)
    around = pd.concat([by_run.shift(step) for step in (-2, -1, 1, 2)], axis=1)
    around = around.T.fillna(log["temperature"].reset_index(drop=True)).T
    found = {
        row: f"the temperature of {temperature[row]:.4g} degC"
        for row in _alone(temperature - np.median(around, axis=1), _SMOOTH * _spread(temperature))
    }
    # What is far from its neighbours by more than all errors spread is far from the middle too.
    far = np.argsort(-np.abs(error - np.median(error)), kind="stable")[:_MOST_CANDIDATES]
    places = np.column_stack([temperature, rate, np.arange(len(log))])
    scale = _spread(places)
    places /= np.where(scale > 0.0, scale, 1.0)
    # Many rows share rate and temperature: a tree that halves space, not rows, is faster then.
    step = -(-len(log) // _MOST_NEIGHBOURS)
    tree = cKDTree(places[::step], balanced_tree=False)
    nearest = step * tree.query(places[far], min(_N_NEIGHBOURS + 1, tree.n))[1]
    # Not itself, or else not the farthest.
    own = nearest == far[:, None]
    own[~own.any(axis=1), -1] = True
    others = np.median(error[nearest[~own].reshape(len(far), -1)], axis=1)
    for row in far[_alone(error[far] - others, _spread(error))].tolist():
        output = log["output"].iloc[row]
        found.setdefault(row, f"the output of {output:.4g} at a rate of {rate[row]:.4g} deg/s")
    return sorted(found.items())


def _alone(deviations, least):
    """Rows, three at most, whose deviation is above the least and far beyond that of all others."""
    sizes = np.abs(deviations)
    order = np.argsort(-sizes, kind="stable")[: _MOST + 1]
    for count in range(len(order) - 1, 0, -1):
        if sizes[order[count - 1]] > max(_ALONE * sizes[order[count]], least):
            return order[:count].tolist()
    return []


def _spread(values):
    low, high = np.quantile(values, [0.05, 0.95], axis=0)
    return high - low
