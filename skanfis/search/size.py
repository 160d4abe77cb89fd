"""How many terms and rules: what the user asked for, and what fits into memory."""

from math import prod
from numbers import Integral
from typing import Any

import numpy as np
from sklearn import get_config

# Parameters of one term, at most: the limit on memory assumes this for every family.
_MOST_PREMISE_PARAMETERS = 4
# Square matrices over all consequent parameters that exist at one time: the Gram matrix, its
# moments, local form and factor; the disagreement, the parts of the penalty, and copies of these.
_SQUARES = 14
# Rows for which the products of all pairs of columns are held at one time.
_ROWS_OF_PAIRS = 128


def n_bytes(n_rules: int, n_terms: int, n_basis: int, n_outputs: int) -> int:
    """Bytes that training takes; ``n_terms`` is the number of terms on all inputs together."""
    n_columns, n_premise = n_rules * n_basis, _MOST_PREMISE_PARAMETERS * n_terms
    squares = _SQUARES * (n_columns + n_outputs) ** 2 + 4 * n_premise**2
    return 8 * (squares + n_terms * n_rules + 2 * n_premise * n_columns)


def _fits(needed):
    """Whether training may take ``needed`` bytes."""
    return needed <= get_config()["working_memory"] * 2**20


def _check(needed, what, advice):
    """Raise ValueError where ``what`` needs more bytes than the limit allows."""
    if not _fits(needed):
        raise ValueError(
            f"{what} would take {_count(1 + needed // 2**20)} MiB of memory, but the limit is "
            f"{get_config()['working_memory']:,} MiB (sklearn.set_config(working_memory=...) sets "
            f"it). {advice}"
        )


def check_columns_fit(n_inputs):
    """Raise ValueError where products of all pairs of columns need too much memory."""
    _check(
        8 * _ROWS_OF_PAIRS * (1 + n_inputs) ** 2 // 2,
        f"X has {n_inputs:,} columns: the products of all pairs of them",
        "Select some of them first, for example by make_pipeline(SelectKBest(f_regression, k=50), "
        "ANFISRegressor()).",
    )


def check_rules_fit(what, n_rules, n_terms, n_basis, n_outputs, advice):
    """Raise ValueError where training the rules that ``what`` names needs too much memory."""
    made = f"{_count(n_rules)} rules with {_count(n_rules * n_basis)} consequent parameters"
    needed = n_bytes(n_rules, n_terms, n_basis, n_outputs)
    _check(needed, f"{what} {made}; training them", advice)


def check_grid_fits(n_mfs, counts, n_basis, n_outputs):
    """The same check for a grid of ``counts``, which ``n_mfs`` has asked for."""
    n_inputs = len(counts)
    of_two = n_bytes(2**n_inputs, 2 * n_inputs, 1 + n_inputs, 1)
    hint = f" (n_mfs=2 makes {2**n_inputs:,} rules)" if _fits(of_two) else ""
    check_rules_fit(
        f"n_mfs={n_mfs!r} on {n_inputs} inputs makes a grid of",
        prod(counts),
        sum(count for count in counts if count > 1),
        n_basis,
        n_outputs,
        f"Use fewer terms{hint}, or give one number per input, with 1 for inputs that need no "
        "fuzzy terms. Or use scattered rules, whose number does not grow with the inputs: "
        "partition=KMeans(n_clusters=...).",
    )


def _count(number):
    """A count in words; of a hopelessly large one, the order of magnitude suffices."""
    return f"{number:,}" if number < 10**15 else "more than 10^15"


def term_counts(n_mfs, names):
    """``n_mfs`` as one count per input, or ValueError or TypeError that says what it must be."""
    is_number = isinstance(n_mfs, Integral) and not isinstance(n_mfs, bool)
    given: Any = [n_mfs] * len(names) if is_number else n_mfs
    if np.ndim(given) != 1:
        raise TypeError(
            f"n_mfs={n_mfs!r} must be 'auto', a whole number, or one whole number per input."
        )
    if len(given) != len(names):
        raise ValueError(
            f"n_mfs={n_mfs!r} has the length {len(given)}, and the columns of X are "
            f"{', '.join(names)}: give one number of terms per column."
        )
    if not all(isinstance(count, Integral) and not isinstance(count, bool) for count in given):
        raise TypeError(f"n_mfs={n_mfs!r} must hold whole numbers only.")
    if min(given) < 1:
        raise ValueError(
            f"n_mfs={n_mfs!r} must be 1 or more for every input; 1 means that the input gets no "
            "fuzzy terms and is used only in the consequents."
        )
    return [int(count) for count in given]
