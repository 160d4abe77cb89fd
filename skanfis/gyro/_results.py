"""What the parts of a calibration's report have in common."""

from typing import Any

import numpy as np

from .compensator import features
from .displays._style import PER_UNIT, figures

__all__ = ["Results", "rms", "rules_of"]

_PER_MINUTE = 60.0
_SMALL = 0.05  # deg/s
_CLEARLY = 0.05  # degC/min, below which a temperature neither rises nor falls


class Results:
    """What several parts of the report need.

    ``after`` is the held-out compensated rate where a row was in range, NaN elsewhere, and so is
    ``before``: a flagged row is not to be trusted, and has a figure of its own.
    """

    def __init__(self, calibration):
        self.calibration = calibration
        self.log, self.rate = calibration.log, calibration.rate
        self.after = np.where(calibration.inside, calibration.after, np.nan)
        self.in_range = np.isfinite(self.after)
        self.beyond = ~calibration.inside & np.isfinite(calibration.after)
        self.before = np.where(self.in_range, calibration.before, np.nan)
        self.error_before = (self.before - self.rate)[self.in_range]
        self.error_after = (self.after - self.rate)[self.in_range]
        inputs = calibration.X
        self.temperature = self.log["temperature"].to_numpy()
        self.temperature_rate = (
            _PER_MINUTE * inputs["temperature_rate"].to_numpy()
            if "temperature_rate" in inputs
            else None
        )
        self.time: Any = self.log["time"].to_numpy() if "time" in self.log else None
        self.since_power_on = (
            features(self.log, ("time",), time_constant=1.0)["time"].to_numpy()
            if self.time is not None
            else None
        )
        self.run = self.log["run"].astype(str).to_numpy(dtype=object) if "run" in self.log else None

    @property
    def unit(self):
        """Unit for errors: that in which they are no long row of zeros."""
        return "deg/s" if rms(self.error_before) > _SMALL else "deg/h"

    def shown(self, error):
        """An error [deg/s] in the unit for errors."""
        return figures(PER_UNIT[self.unit] * error)

    @property
    def gain(self):
        """Reduction factor over the rows in range."""
        return rms(self.error_before) / rms(self.error_after)

    @property
    def steps(self):
        """Times between the rows of a run [s]."""
        steps = np.diff(self.time)
        return steps if self.run is None else steps[self.run[1:] == self.run[:-1]]

    @property
    def interval(self):
        """Their median."""
        return float(np.median(self.steps))

    @property
    def in_whole_runs(self):
        """Rows of the runs that are in range from end to end."""
        if self.run is None:
            return np.full(self.in_range.size, self.in_range.all())
        lost = np.unique(self.run[~self.in_range].astype(str))
        return ~np.isin(self.run.astype(str), lost)

    @property
    def warms_and_cools(self):
        """Whether the temperature both rises and falls."""
        rates = self.temperature_rate
        return rates is not None and rates.min() < -_CLEARLY < _CLEARLY < rates.max()


def rules_of(calibration):
    """The ANFIS at the end of a calibration's estimator."""
    estimator = calibration.compensator.estimator
    return getattr(estimator, "residual_", estimator)[-1]


def rms(errors):
    """Root mean square."""
    return float(np.sqrt(np.mean(errors**2)))
