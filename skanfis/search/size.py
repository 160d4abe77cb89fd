"""How many terms and rules: what the user asked for, and what fits into memory."""

from math import prod
from numbers import Integral

import numpy as np

# Of one term, whatever its family: what a limit on memory reckons with.
_MOST_PREMISE_PARAMETERS = 4
# Square matrices over all consequent parameters that exist at one time: the Gram matrix, its
# moments, local form and factor; the disagreement, the parts of the penalty, and copies of these.
_SQUARES = 14


# Of the products of all pairs of columns, rows that are worked out at one time.
_ROWS_OF_PAIRS = 128


def n_bytes(n_rules: int, n_terms: int, n_basis: int, n_outputs: int) -> int:
    """What training so many rules takes, of ``n_terms`` of all inputs."""
    n_columns, n_premise = n_rules * n_basis, _MOST_PREMISE_PARAMETERS * n_terms
    squares = _SQUARES * (n_columns + n_outputs) ** 2 + 4 * n_premise**2
    return 8 * (squares + n_terms * n_rules + 2 * n_premise * n_columns)


def check_columns_fit(n_inputs, limit):
    """Raise ValueError where products of all pairs of columns need more than ``limit`` bytes."""
    needed = 8 * _ROWS_OF_PAIRS * (1 + n_inputs) ** 2 // 2
    if needed > limit:
        raise ValueError(
            f"X has {n_inputs:,} columns: products of all their pairs would take {_bytes(needed)}, "
            f"and the limit is {_bytes(limit)} (sklearn.set_config(working_memory=...), in MiB). "
            "Choose some of them first, as by make_pipeline(SelectKBest(f_regression, k=50), "
            "ANFISRegressor())."
        )


def check_clusters_fit(what, n_rules, n_premise_inputs, n_basis, n_outputs, limit):
    """Raise ValueError where training scattered rules would need more than ``limit`` bytes."""
    needed = n_bytes(n_rules, n_rules * n_premise_inputs, n_basis, n_outputs)
    if needed > limit:
        raise ValueError(
            f"{what} makes {_too_large(n_rules, n_basis, 'them', needed, limit)} Use fewer "
            "clusters, or constants as consequents (order=0)."
        )


def check_grid_fits(n_mfs, counts, n_basis, n_outputs, limit, names):
    """Raise ValueError where training a grid of ``counts`` would need more than ``limit`` bytes."""
    needed = _bytes_of_grid(counts, n_basis, n_outputs)
    if needed <= limit:
        return
    smallest = [2] * len(names)
    fits = _bytes_of_grid(smallest, 1 + len(names), 1) <= limit
    hint = f"n_mfs=2 makes {prod(smallest):,} rules; " if fits else ""
    size = _too_large(prod(counts), n_basis, "it", needed, limit)
    raise ValueError(
        f"n_mfs={n_mfs!r} on {len(names)} inputs makes a grid of {size} Use fewer terms: "
        f"{hint}give one number per input, 1 for an input that needs no fuzzy terms; or use "
        "scattered rules, whose number does not grow with the inputs: partition=KMeans("
        "n_clusters=...)."
    )


def _bytes_of_grid(counts, n_basis, n_outputs):
    return n_bytes(prod(counts), sum(c for c in counts if c > 1), n_basis, n_outputs)


def _too_large(n_rules, n_basis, what, needed, limit):
    return (
        f"{_count(n_rules)} rules with {_count(n_rules * n_basis)} consequent parameters; training "
        f"{what} would take {_bytes(needed)}, and the limit is {_bytes(limit)} "
        "(sklearn.set_config(working_memory=...), in MiB)."
    )


def _count(number):
    """A count for people; beyond any hope, its order of magnitude suffices."""
    return f"{number:,}" if number < 10**15 else "more than 10^15"


def _bytes(number):
    if number >= 10**18:
        return "more than 10^18 bytes"
    exponent = 0
    while number >= 1000 ** (exponent + 1):
        exponent += 1
    return f"{number / 1000**exponent:.3g} {('bytes', 'kB', 'MB', 'GB', 'TB', 'PB')[exponent]}"


def term_counts(n_mfs, names):
    """``n_mfs`` as one count per input, or ValueError or TypeError that says what it must be."""
    if isinstance(n_mfs, Integral) and not isinstance(n_mfs, bool):
        counts = [int(n_mfs)] * len(names)
    else:
        if isinstance(n_mfs, str | bytes | bool) or np.ndim(n_mfs) != 1:
            raise TypeError(
                f"n_mfs={n_mfs!r} must be 'auto', a whole number, or one whole number per input."
            )
        if len(n_mfs) != len(names):
            raise ValueError(
                f"n_mfs={n_mfs!r} has {len(n_mfs)} entries, but X has {len(names)} columns "
                f"({', '.join(names)}): give one number of terms per column."
            )
        if not all(isinstance(count, Integral) and not isinstance(count, bool) for count in n_mfs):
            raise TypeError(f"n_mfs={n_mfs!r} must hold whole numbers only.")
        counts = [int(count) for count in n_mfs]
    if min(counts) < 1:
        raise ValueError(
            f"n_mfs={n_mfs!r} must be 1 or more everywhere; 1 means that an input has no fuzzy "
            "terms and takes part in the consequents alone."
        )
    return counts
