"""What is known of the target, and the limits within which outputs are held by it."""

from dataclasses import dataclass

import numpy as np

__all__ = ["TargetRange"]

# Of the target, in standard deviations, whatever the limit of inputs: what a peak between rows may
# take beyond the range that was seen. The range has two deviations at least, so that this is a
# quarter of it at most.
_LEAST_MARGIN = 0.5
# Of the range of the target: what rules that bend may say beyond it, however far their tangent is
# followed. A line has no peaks between rows.
_MOST_OF_RANGE = 0.25


@dataclass(frozen=True, eq=False)
class TargetRange:
    """What the target was in training, and what else is known of it.

    Attributes
    ----------
    minimum, maximum : ndarray of shape (n_outputs,)
    spread : ndarray of shape (n_outputs,)
        Weighted standard deviation, positive.
    lower, upper : ndarray of shape (n_outputs,), or float
        Limits that were asked for; infinite where none was.
    """

    minimum: np.ndarray
    maximum: np.ndarray
    spread: np.ndarray
    lower: np.ndarray | float = -np.inf
    upper: np.ndarray | float = np.inf

    def within(self, lower, upper, values):
        """The same where limits are known too, and some values (n_values, n_outputs).

        A value that is known is as good as one that was seen; a limit that all that was seen
        lies beyond shows how far the target goes.
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
        """Lowest and highest output, of a line or of what bends, (2, n_outputs).

        They are those that were asked for, or infinite, where the tangent is followed without end.
        """
        margin = max_extrapolation * self.spread
        if not is_line and np.isfinite(max_extrapolation):
            margin = np.minimum(margin, _MOST_OF_RANGE * (self.maximum - self.minimum))
        margin = np.maximum(margin, _LEAST_MARGIN * self.spread)
        low, high = self.minimum - margin, self.maximum + margin
        return np.stack([np.maximum(low, self.lower), np.minimum(high, self.upper)])
