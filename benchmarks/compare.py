"""Two runs of one benchmark side by side: ``python -m benchmarks.compare A.json B.json``.

The files are what ``evaluate`` wrote. Cases in both are compared: every figure by its means, and
the cases in which the ratio to the rivals changed most.
"""

import argparse

import numpy as np

from .cases import kept
from .report import Results, Table, markdown
from .scores import geometric_mean

__all__ = ["compared"]

# Not what a fit is judged by.
_LEFT_OUT = ("number", "rows", "inputs")
# Counts, of which it matters in how many cases there are any.
_COUNTS = ("beyond", "false", "alike")


def compared(first, second, n_shown=10):
    """Tables of two files' contents."""
    names = [name for name in second["cases"] if name in first["cases"]]
    pairs = [(first["cases"][name], second["cases"][name]) for name in names]
    failed = [sum("failed" in case for case in cases) for cases in _columns(pairs)]
    pairs = [pair for pair in pairs if not any("failed" in case for case in pair)]
    lines = [["cases in both", len(names), len(names), "", ""], ["failed", *failed, "", ""]]
    lines += [_line(key, pairs) for key in _keys(pairs)]
    lines += [_cases_with(key, pairs) for key in _keys(pairs) if key in _COUNTS]
    head = ["figure", "A", "B", "B / A, geometric mean", "median"]
    return [Table("Mean; ratios by their geometric mean", head, lines), *_changes(pairs, n_shown)]


def _columns(pairs):
    """The cases of each file."""
    return [[pair[k] for pair in pairs] for k in range(2)]


def _keys(pairs):
    return [
        key
        for key, value in (pairs[0][1] if pairs else {}).items()
        if isinstance(value, int | float) and key not in _LEFT_OUT and key in pairs[0][0]
    ]


def _line(key, pairs):
    a, b = np.array([[case[key] for case in pair] for pair in pairs], dtype=float).T
    mean = geometric_mean if key in ("ratio", "over mean") else np.mean
    both = (a > 0) & (b > 0)
    change = b[both] / a[both]
    changes = [geometric_mean(change), float(np.median(change))] if both.any() else ["", ""]
    return [key, float(mean(a)), float(mean(b)), *changes]


def _cases_with(key, pairs):
    counts = [sum(case[key] > 0 for case in cases) for cases in _columns(pairs)]
    return [f"cases with {key}", *counts, "", ""]


def _changes(pairs, n_shown):
    """The cases that gained and lost most."""
    judged = [pair for pair in pairs if "ratio" in pair[0]]
    judged.sort(key=lambda pair: pair[1]["ratio"] / pair[0]["ratio"])
    head = ["case", "ratio in A", "ratio in B", "rules in A", "rules in B"]
    for title, some in (("gained", judged[:n_shown]), ("lost", judged[::-1][:n_shown])):
        lines = [
            [b["case"], a["ratio"], b["ratio"], a.get("rules", ""), b.get("rules", "")]
            for a, b in some
        ]
        if lines:
            yield Table(f"What {title} most", head, lines)


def main():
    parser = argparse.ArgumentParser(prog="python -m benchmarks.compare", description=__doc__)
    parser.add_argument("files", nargs=2, metavar="FILE")
    contents = [kept(file) for file in parser.parse_args().files]
    facts = [
        f"{letter}: {content['benchmark']} of {content['commit']}, "
        f"parameters {content['estimator_params']}, {content['wall']:.0f} s"
        for letter, content in zip("AB", contents, strict=True)
    ]
    print(markdown(Results(tables=compared(*contents)), facts))


if __name__ == "__main__":
    main()
