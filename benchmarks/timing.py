"""Processor time of this process."""

from time import process_time

__all__ = ["best_of", "side_by_side", "timed"]


def timed(function, *args, **params):
    """What a function returns, and the seconds that it takes."""
    start = process_time()
    found = function(*args, **params)
    return found, process_time() - start


def best_of(rounds, function, *args):
    """What a function returns, and the least seconds that it takes in several rounds."""
    found, seconds = zip(*(timed(function, *args) for _ in range(rounds)), strict=True)
    return found[-1], min(seconds)


def side_by_side(functions, rounds=5):
    """The least seconds that each of several functions takes, by name.

    They run in turn: what else the machine does then slows all of them, and ratios of the figures
    mean something.
    """
    best = dict.fromkeys(functions, float("inf"))
    for _ in range(rounds):
        for name, function in functions.items():
            best[name] = min(best[name], timed(function)[1])
    return best
