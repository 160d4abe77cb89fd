"""Limits between which exported code holds its outputs."""

import numpy as np

from .._numbers import rounded_within

__all__ = ["read_limits"]


def read_limits(saturate, numbers):
    """Limits (n_outputs, 2) in the type of the code, none beyond what is given; or None."""
    if saturate is None:
        return None
    if hasattr(saturate, "lower") and hasattr(saturate, "upper"):
        given = np.stack([saturate.lower, saturate.upper], axis=-1).astype(float)
    else:
        given = np.array(saturate, dtype=float)
    n_outputs = numbers.offset.size
    if given.shape != (n_outputs, 2):
        raise ValueError(
            f"saturate must have (low, high) for each of the {n_outputs} outputs, or be what "
            f"skanfis.bounds.bounds returns for this model; got an array of shape {given.shape}."
        )
    if not (np.isfinite(given).all() and (given[:, 0] < given[:, 1]).all()):
        raise ValueError(f"saturate={given.tolist()} must be finite, each low below its high.")
    return rounded_within(given.T, numbers.dtype).T
