"""Policies outside the range of the training data: names, words and checks; limits of outputs."""

import math
from dataclasses import dataclass
from numbers import Real

import numpy as np

from .digits import told_apart

# A column that varies by less than this part of its size varies by rounding errors only.
ROUNDING = 16.0 * np.finfo(float).eps
# ``TSKModel`` answers by these names; docs/layers.rst says what else does, and needs a new one.
OUT_OF_BOUNDS = ("clip", "linear", "nan", "raise")
# The policies that give no value.
SILENT = ("nan", "raise")
# How far the tangent is followed, in standard deviations of each input. The first holds if the
# noise is not known. The second is the limit if there is next to no noise: at most one row in
# 10,000 lies that far from its mean (Chebyshev).
MAX_EXTRAPOLATION, FARTHEST = 0.5, 100.0
# Rows further off, in standard deviations, count as this far, so that nothing overflows.
FARTHEST_ROW = 1e100
# For each deviation that the tangent is followed for, and at least as many as if the noise were not
# known, a prediction may leave the range of the target: that of a single line by a deviation of the
# target, that of several rules, which may peak between rows, by this part of the range.
_PER_DEVIATION = 0.05


@dataclass(frozen=True, eq=False)
class TargetRange:
    """The range of every output in training, and the limits that the user has set."""

    minimum: np.ndarray
    maximum: np.ndarray
    spread: np.ndarray  # weighted standard deviation, positive
    lower: np.ndarray | float = -np.inf  # the user's limits; infinite if there are none
    upper: np.ndarray | float = np.inf

    def within(self, lower, upper, values):
        """The same with the user's limits, and with some known values (n_values, n_outputs).

        Known values extend the range as seen ones do. So does a limit, if all seen values lie
        beyond it.
        """
        low = np.vstack([self.minimum, upper, values]).min(axis=0)
        high = np.vstack([self.maximum, lower, values]).max(axis=0)
        return TargetRange(low, high, self.spread, lower, upper)

    def change_units(self, offset, scale):
        """The same in units y = offset + scale * y_now, with positive scales."""
        ends = (self.minimum, self.maximum, self.lower, self.upper)
        low, high, lower, upper = (offset + scale * end for end in ends)
        return TargetRange(low, high, scale * self.spread, lower, upper)

    def limits(self, max_extrapolation, is_line):
        """Lowest and highest output, of one line or of several rules, (2, n_outputs).

        If the tangent is followed without end, only the user's limits count.
        """
        width = self.maximum - self.minimum
        # No deviation is more than half of the range: that of a constant, stored as one, is zero.
        unit = np.minimum(self.spread, 0.5 * width) if is_line else _PER_DEVIATION * width
        is_endless = np.isinf(max_extrapolation)
        margin = np.inf if is_endless else max(max_extrapolation, MAX_EXTRAPOLATION) * unit
        low, high = self.minimum - margin, self.maximum + margin
        return np.stack([np.maximum(low, self.lower), np.minimum(high, self.upper)])

    def supported_extrapolation(self, noise) -> float:
        """The target's deviation over that of the noise, the least of all outputs.

        For so many deviations of an input the tangent is followed. This assumes that over one of
        them, the target bends by at most the noise.
        """
        of_noise = self.spread / np.maximum(noise, self.spread / FARTHEST)
        return float(f"{of_noise.min():.3g}")


def policy_in_words(policy: str, max_extrapolation: float) -> str:
    """What the model does outside the range of the training data, as a clause."""
    if policy in SILENT:
        return "there is no value"
    if policy == "clip" or max_extrapolation == 0.0:
        return "the value at the edge is held"
    if math.isinf(max_extrapolation):
        return "the model goes on along its tangent"
    return (
        "the model goes on along its tangent, for each input up to "
        f"{max_extrapolation:g} of its standard deviations, and holds the value reached there"
    )


def check_policy(policy, max_extrapolation="auto"):
    """Raise ValueError where there is no such policy, or no such limit."""
    if policy not in OUT_OF_BOUNDS:
        raise ValueError(f"out_of_bounds={policy!r} must be one of {', '.join(OUT_OF_BOUNDS)}.")
    is_distance = isinstance(max_extrapolation, Real) and float(max_extrapolation) >= 0.0
    if not is_distance and max_extrapolation != "auto":
        raise ValueError(
            f"max_extrapolation={max_extrapolation!r} must be a number of 0 or more (inf for no "
            "limit) or 'auto'."
        )


def is_outside(X, minimum, maximum):
    """Which entries of X, (n_rows, n_inputs), lie outside the ranges by more than rounding."""
    room = ROUNDING * np.maximum(np.abs(minimum), np.abs(maximum))
    return ~((minimum - room <= X) & (maximum + room >= X))


def describe_out_of_bounds(X, minimum, maximum, names) -> str:
    """Say which columns of X leave their range, in how many rows, and how far."""
    parts = []
    every = is_outside(X, minimum, maximum).T
    for column, outside, low, high, name in zip(X.T, every, minimum, maximum, names, strict=True):
        if outside.any():
            ends = told_apart([low, high, column.min(), column.max()], 6)
            parts.append(
                f"{name!r} in {outside.sum()} of {column.size} rows (trained on "
                f"[{ends[0]}, {ends[1]}], found [{ends[2]}, {ends[3]}])"
            )
    return "X lies outside the training data: " + "; ".join(parts) + "."
