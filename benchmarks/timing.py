"""Processor time of this process, best of several; and where it goes."""

import cProfile
import pstats
from pathlib import Path
from time import process_time

from .report import Table

__all__ = ["best_of", "profile", "side_by_side"]


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


def profile(function, calls, title, longest=20):
    """The functions below that take longest by themselves; profiling makes quick ones look slow."""
    with cProfile.Profile() as profiler:
        for _ in range(calls):
            function()
    lines = []
    for place, (_, n_calls, own, total, _) in pstats.Stats(profiler).stats.items():
        lines.append([_name(*place), n_calls / calls, own / calls * 1e6, total / calls * 1e6])
    lines.sort(key=lambda line: -line[2])
    head = ["function", "calls", "itself [µs]", "with what it calls [µs]"]
    return Table(f"{title}: profile", head, lines[:longest])


def _name(file, line, function):
    path = Path(file)
    return function if file == "~" else f"`{path.parent.name}/{path.name}` {function}"
