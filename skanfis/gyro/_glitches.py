"""Rows that no other row supports: a glitch of the output, of the rate table or of the thermometer.

Least squares bends the whole model towards one such row, and its value widens the range in which
rows count as known.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

__all__ = ["Glitch", "find_glitches"]

# More than so many rows of a kind support one another.
_MOST = 3
# Times the deviation of the next row: none of a bell-shaped noise comes near, nor of Student's with
# three degrees of freedom in a thousand logs.
_ALONE = 5.0
# Their median is the row's surroundings, and stands one other glitch among them.
_N_NEIGHBOURS = 8
# The rows farthest off: neighbours are sought of these alone, whatever the log's length.
_MOST_CANDIDATES = 2_000
# Rows among which the neighbours of candidates are looked for; more tell nothing new.
_MOST_NEIGHBOURS = 200_000
# A temperature moves slowly: a part of its range is a lot from one row to the next.
_SMOOTH = 0.2


@dataclass(frozen=True)
class Glitch:
    """A row, by its position, and what is odd about it."""

    row: int
    reason: str


def find_glitches(log, error):
    """The glitches of a log, as :func:`read_log` gives it; ``error`` is the indicated rate's.

    Two things are looked at: the error, beside that of the rows nearest in temperature, rate and
    order, and the temperature, beside that of the rows before and after.
    """
    temperature, rate = (log[part].to_numpy() for part in ("temperature", "rate"))
    runs = np.zeros(len(log), dtype=int)
    if "run" in log:
        runs = log["run"].astype("category").cat.codes.to_numpy()
    beside_time = temperature - _median_around(temperature, runs)
    found = {
        row: f"the temperature of {temperature[row]:.4g} degC"
        for row in _alone(beside_time, _SMOOTH * _spread(temperature))
    }
    # What is far from its neighbours by more than all errors spread is far from the middle too.
    far = np.argsort(-np.abs(error - np.median(error)), kind="stable")[:_MOST_CANDIDATES]
    place = np.column_stack([temperature, rate, np.arange(len(log))])
    beside_place = error[far] - _median_nearby(place, error, far)
    for row in far[_alone(beside_place, _spread(error))].tolist():
        output = log["output"].iloc[row]
        found.setdefault(row, f"the output of {output:.4g} at a rate of {rate[row]:.4g} deg/s")
    return [Glitch(row, reason) for row, reason in sorted(found.items())]


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


def _median_around(values, runs):
    """Median of the two rows before and the two after each, of its own run; else its own value."""
    columns = []
    for shift in (-2, -1, 1, 2):
        moved = np.roll(values, shift)
        is_other = np.roll(runs, shift) != runs
        edge = np.s_[shift:] if shift < 0 else np.s_[:shift]
        is_other[edge] = True
        columns.append(np.where(is_other, values, moved))
    return np.median(columns, axis=0)


def _median_nearby(places, values, rows):
    """Median of the values nearest to some rows, these themselves left out."""
    scale = _spread(places)
    points = places / np.where(scale > 0.0, scale, 1.0)
    # Many rows share rate and temperature: a tree that halves space, not rows, is faster then.
    step = -(-len(values) // _MOST_NEIGHBOURS)
    tree = cKDTree(points[::step], balanced_tree=False)
    _, nearest = tree.query(points[rows], min(_N_NEIGHBOURS + 1, tree.n))
    nearest = step * nearest
    # Itself, or else the farthest.
    own = nearest == rows[:, None]
    own[~own.any(axis=1), -1] = True
    others = nearest[~own].reshape(len(rows), -1)
    return np.median(values[others], axis=1)
