"""What is answered outside the range of the training data: the policies, and what they say."""

import math

__all__ = ["MAX_EXTRAPOLATION", "OUT_OF_BOUNDS", "SILENT", "policy_in_words"]

OUT_OF_BOUNDS = ("clip", "linear", "nan", "raise")
# Those that answer nothing.
SILENT = ("nan", "raise")
# How far the tangent is followed by default, in standard deviations of each input.
MAX_EXTRAPOLATION = 0.5


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
