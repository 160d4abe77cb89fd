"""Whether the rules of a calibration can be read, for its report."""

import numpy as np

from ..inspection import readability
from ._columns import evenly_chosen

__all__ = ["readability_of"]

# Evenly chosen; what is greatest on a row hardly grows with more of them.
_MOST_ROWS = 100_000


def readability_of(calibration):
    """Measure the rules on the rows of the log, against what they were taught.

    Beside the arcsine law that is what the law leaves of the rate, otherwise the gyro's error.
    """
    places = evenly_chosen(len(calibration.X), _MOST_ROWS)
    X, estimator = calibration.X.iloc[places], calibration.compensator.estimator
    if not calibration.recipe.physics:
        return readability(estimator, X, (calibration.before - calibration.rate)[places])
    left = calibration.rate[places] - estimator.base_.predict(X)
    # Rows that the law refuses are no business of the rules.
    known = np.isfinite(left)
    return readability(calibration.rules, X[known], left[known])
