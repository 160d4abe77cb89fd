"""Legs of a thermal cycle: from one turning point of the temperature to the next."""

import numpy as np

__all__ = ["cut_legs", "find_legs", "name_legs"]

# Of the range of all temperatures: what a turn must come back by.
_TURN = 0.2
_SMALLEST_TURN = 3.0  # degC
# A turning point is looked for among so many means of each run.
_MOST_POINTS = 5_000
# As many folds as whole runs are held out in.
_PIECES = 5


def find_legs(temperature, run=None):
    """Number of each row's leg, from 0, anew in every run; rows of a run in the order of time.

    Parameters
    ----------
    temperature : ndarray of shape (n_rows,)
    run : ndarray of shape (n_rows,) or None
    """
    least = max(_TURN * float(np.ptp(temperature)), _SMALLEST_TURN)
    runs = np.zeros(temperature.size, dtype=int)
    if run is not None:
        runs = np.unique(run, return_inverse=True)[1]
    order = np.argsort(runs, kind="stable")
    legs = np.empty(temperature.size, dtype=int)
    n_legs = 0
    for rows in np.split(order, np.flatnonzero(np.diff(runs[order])) + 1):
        turns = _turns(temperature[rows], least)
        number = np.zeros(rows.size, dtype=int)
        number[turns] = 1
        legs[rows] = n_legs + np.cumsum(number)
        n_legs += turns.size + 1
    return legs


def _turns(temperature, least):
    """Rows at which the temperature turns, and comes back by ``least`` or more before the next."""
    width = -(-temperature.size // _MOST_POINTS)
    starts = np.arange(0, temperature.size, width)
    means = np.add.reduceat(temperature, starts) / np.diff(starts, append=temperature.size)
    turns, rising = [], 0
    low = high = 0  # places of the extremes since the last turn
    for place, value in enumerate(means.tolist()):
        low = place if value < means[low] else low
        high = place if value > means[high] else high
        if rising >= 0 and means[high] - value > least:
            turns += [high] if rising else []
            rising, low = -1, place
            if not turns and high > 0 and means[high] - means[:high].min() > least:
                turns.append(high)
        elif rising <= 0 and value - means[low] > least:
            turns += [low] if rising else []
            rising, high = 1, place
            if not turns and low > 0 and means[:low].max() - means[low] > least:
                turns.append(low)
    return starts[np.array(sorted(set(turns)), dtype=int)]


def cut_legs(legs):
    """Fold of each row: the pieces of every leg in turn, one leg's beside another's of the next.

    Every leg is cut into five pieces of as many rows; with a piece of a leg that warms goes one
    at another temperature of the next, which cools: the model has seen each temperature one way.
    """
    folds = np.empty(legs.size, dtype=int)
    for leg in np.unique(legs):
        rows = np.flatnonzero(legs == leg)
        piece = np.arange(rows.size) * _PIECES // rows.size
        folds[rows] = (piece + 2 * leg) % _PIECES
    return folds


def name_legs(legs, temperature):
    """A label for each row's leg, such as "2: 25 to 71 °C"."""
    names = np.empty(legs.max() + 1, dtype=object)
    for leg in np.unique(legs):
        values = temperature[legs == leg]
        names[leg] = f"{leg + 1}: {values[0]:.0f} to {values[-1]:.0f} °C"
    return names[legs]
