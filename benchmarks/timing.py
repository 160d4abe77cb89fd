"""Processor time of this process, best of several."""

from time import process_time

__all__ = ["best_of", "side_by_side"]


def side_by_side(functions, rounds=5):
    """Least seconds that each of several functions takes, by name; they run in turn.

    What else the machine does so meets all of them, and ratios of the figures mean something.
    """
    best = dict.fromkeys(functions, float("inf"))
    for _ in range(rounds):
        for name, function in functions.items():
            start = process_time()
            function()
            best[name] = min(best[name], process_time() - start)
    return best


def best_of(function, rounds=3):
    """Least seconds that a function takes, and what it returned last."""
    kept = []
    seconds = side_by_side({"": lambda: kept.append(function())}, rounds)[""]
    return seconds, kept[-1]
