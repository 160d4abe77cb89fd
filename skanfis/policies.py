"""What is answered outside the range of the training data: the policies, and what they say."""

import math
from numbers import Real

__all__ = [
    "FARTHEST",
    "MAX_EXTRAPOLATION",
    "OUT_OF_BOUNDS",
    "SILENT",
    "check_policy",
    "describe_out_of_bounds",
    "policy_in_words",
]

OUT_OF_BOUNDS = ("clip", "linear", "nan", "raise")
# Those that answer nothing.
SILENT = ("nan", "raise")
# How far the tangent is followed by default, in standard deviations of each input; and at most, by
# a line that leaves nothing of the target: no more than a row in 10,000 is that far from its mean
# (Chebyshev).
MAX_EXTRAPOLATION, FARTHEST = 0.5, 100.0


def policy_in_words(policy: str, max_extrapolation: float) -> str:
    """What is answered outside the range of the training data, as a clause."""
    if policy in SILENT:
        return "there is no value"
    if policy == "clip" or max_extrapolation == 0.0:
        return "the value at the edge is held"
    tangent = "the model goes on along its tangent"
    if math.isinf(max_extrapolation):
        return tangent
    return (
        f"{tangent}, for each input up to {max_extrapolation:g} of its standard deviations, and "
        "holds the value reached there"
    )


def check_policy(policy, max_extrapolation):
    """Raise ValueError where there is no such policy, or no such limit."""
    if policy not in OUT_OF_BOUNDS:
        raise ValueError(f"out_of_bounds={policy!r} must be one of {', '.join(OUT_OF_BOUNDS)}.")
    is_distance = isinstance(max_extrapolation, Real) and float(max_extrapolation) >= 0.0
    if not is_distance and max_extrapolation != "auto":
        raise ValueError(
            f"max_extrapolation={max_extrapolation!r} must be a number, zero or positive, or "
            "infinite, or 'auto'."
        )


def describe_out_of_bounds(X, minimum, maximum, names) -> str:
    """Say which columns of X leave their range, in how many rows, and how far."""
    parts = []
    for column, low, high, name in zip(X.T, minimum, maximum, names, strict=True):
        outside = (column < low) | (column > high)
        if outside.any():
            ends = _told_apart(low, high, column.min(), column.max())
            parts.append(
                f"{name!r} in {outside.sum()} of {column.size} rows (trained on "
                f"[{ends[0]}, {ends[1]}], found [{ends[2]}, {ends[3]}])"
            )
    return "X lies outside the training data: " + "; ".join(parts) + "."


def _told_apart(*values):
    """Numbers in six digits, or as many as tell them apart, as those of time stamps."""
    for n_digits in range(6, 18):
        texts = [f"{value:.{n_digits}g}" for value in values]
        if len(set(texts)) == len(set(values)):
            break
    return texts
