"""How many terms and rules: what the user asked for, what fits into memory, what data hold."""

from collections.abc import Sequence
from math import prod
from numbers import Integral

import numpy as np

__all__ = ["GridSize", "RuleBaseSize", "term_counts"]

# Of one term, whatever its family: what a limit on memory reckons with.
_MOST_PREMISE_PARAMETERS = 4
# Square matrices over all consequent parameters that exist at one time.
_SQUARES = 14


class RuleBaseSize:
    """What a rule base amounts to, found without building any of it.

    Parameters
    ----------
    n_rules, n_terms : int
        Rules, and terms of all inputs.
    n_basis, n_outputs : int
        Coefficients per rule and output; outputs.
    """

    def __init__(self, n_rules: int, n_terms: int, n_basis: int, n_outputs: int = 1):
        self.n_rules = n_rules
        self.n_columns = n_rules * n_basis
        side = self.n_columns + n_outputs
        n_premise = _MOST_PREMISE_PARAMETERS * n_terms
        # The Gram matrix, its moments, local form and factor; the disagreement, the three parts of
        # the penalty and their sum, and copies of these; the table of terms against rules; the
        # same for the premises, and their products with the design.
        self.n_bytes = 8 * (
            _SQUARES * side**2
            + n_terms * n_rules
            + 4 * n_premise**2
            + 2 * n_premise * self.n_columns
        )

    def check_fits(self, what, limit):
        """Raise ValueError where training would need more than ``limit`` bytes."""
        if self.n_bytes > limit:
            raise ValueError(
                f"{what} makes {_count(self.n_rules)} rules with {_count(self.n_columns)} "
                f"consequent parameters; training them would take {_bytes(self.n_bytes)}, and the "
                f"limit is {_bytes(limit)} (sklearn.set_config(working_memory=...), in MiB). Use "
                "fewer clusters, or constants as consequents (order=0)."
            )


class GridSize(RuleBaseSize):
    """What a full grid amounts to.

    Parameters
    ----------
    counts : sequence of int
        Terms per input.
    n_basis, n_outputs : int
        Coefficients per rule and output; outputs.
    """

    def __init__(self, counts: Sequence[int], n_basis: int, n_outputs: int = 1):
        n_terms = sum(count for count in counts if count > 1)
        super().__init__(prod(counts), n_terms, n_basis, n_outputs)

    def check_grid_fits(self, n_mfs, limit, names):
        """Raise ValueError where training would need more than ``limit`` bytes."""
        if self.n_bytes <= limit:
            return
        smallest = GridSize([2] * len(names), 1 + len(names))
        hint = f"n_mfs=2 makes {smallest.n_rules:,} rules; " if smallest.n_bytes <= limit else ""
        raise ValueError(
            f"n_mfs={n_mfs!r} on {len(names)} inputs makes a grid of {_count(self.n_rules)} rules "
            f"with {_count(self.n_columns)} consequent parameters; training it would take "
            f"{_bytes(self.n_bytes)}, and the limit is {_bytes(limit)} "
            "(sklearn.set_config(working_memory=...), in MiB). Use fewer terms: "
            f"{hint}give one number per input, 1 for an input that needs no fuzzy terms; or use "
            "scattered rules, whose number does not grow with the inputs: partition=KMeans("
            "n_clusters=...)."
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
