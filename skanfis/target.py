"""What the target was in training, and the limits within which outputs are held by it."""

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
    """What the target was in training.

    Attributes
    ----------
    minimum, maximum : ndarray of shape (n_outputs,)
    spread : ndarray of shape (n_outputs,)
        Weighted standard deviation, positive.
    """

    minimum: np.ndarray
    maximum: np.ndarray
    spread: np.ndarray

    def change_units(self, offset, scale):
        """The same in units y = offset + scale * y_now, with positive scales."""
        low, high = (offset + scale * end for end in (self.minimum, self.maximum))
        return TargetRange(low, high, scale * self.spread)

    def limits(self, max_extrapolation, is_line):
        """Lowest and highest output, of a line or of what bends, (2, n_outputs).

        They are infinite where the tangent is followed without end.
        """
        margin = max_extrapolation * self.spread
        if not is_line and np.isfinite(max_extrapolation):
            margin = np.minimum(margin, _MOST_OF_RANGE * (self.maximum - self.minimum))
        margin = np.maximum(margin, _LEAST_MARGIN * self.spread)
        return np.stack([self.minimum - margin, self.maximum + margin])
