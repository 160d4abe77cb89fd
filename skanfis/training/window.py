"""The latest rows, kept as they are: sums that old rows leave are taken anew of those that stay.

To subtract what leaves from the sums would lose digits, all of them where large rows leave small
ones behind; and blocks of sums that are dropped whole would tie the window to how rows were
divided into calls. A pass over the rows of the window does neither, in memory that does not grow.
"""

from dataclasses import dataclass
from numbers import Integral

import numpy as np

__all__ = ["Window", "check_window", "latest_rows"]


@dataclass(frozen=True, eq=False)
class Window:
    """Rows with weight: X (n_rows, n_inputs), y (n_rows, n_outputs), weights or None."""

    X: np.ndarray
    y: np.ndarray
    sample_weight: np.ndarray | None

    @property
    def rows(self):
        """Inputs, targets, weights."""
        return self.X, self.y, self.sample_weight

    def plus(self, X, y, sample_weight, n_rows):
        """The last so many rows of these and newer ones, copied."""
        n_old = max(min(n_rows - X.shape[0], self.X.shape[0]), 0)
        old, new = slice(self.X.shape[0] - n_old, None), slice(max(X.shape[0] - n_rows, 0), None)
        weight = None
        if self.sample_weight is not None or sample_weight is not None:
            weight = np.concatenate(
                [_ones(self.sample_weight, self.X)[old], _ones(sample_weight, X)[new]]
            )
        inputs = np.concatenate([self.X[old], X[new]])
        return Window(inputs, np.concatenate([self.y[old], y[new]]), weight)


def _ones(sample_weight, X):
    return np.ones(X.shape[0]) if sample_weight is None else sample_weight


def check_window(window, forgetting):
    """Raise ValueError where a window is none, or is given beside forgetting."""
    if window is None:
        return
    if isinstance(window, bool) or not isinstance(window, Integral) or window < 2:
        raise ValueError(
            f"window={window!r} must be a whole number of 2 or more, the number of rows that count,"
            " or None for all."
        )
    if forgetting != 1.0:
        raise ValueError(
            f"window={window} and forgetting={forgetting:g} are two ways to let old rows go: give "
            "one of them."
        )


def latest_rows(before, has_sums, X, y, sample_weight, window):
    """The rows of a window after a chunk; None without a window.

    ``before`` is the window of the call before or None, ``has_sums`` whether there was a call.
    ValueError where earlier rows are in the sums alone.
    """
    if window is None:
        return None
    if before is None:
        if has_sums:
            raise ValueError(
                f"window={window}: the rows of the calls before were given without a window, and "
                "are sums that no row can leave. Give window from the first partial_fit on, or "
                "start anew from a clone."
            )
        before = Window(np.empty((0, X.shape[1])), np.empty((0, y.shape[1])), None)
    return before.plus(X, y, sample_weight, window)
