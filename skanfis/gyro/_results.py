"""What the sections and pictures of a calibration's report have in common."""

from functools import cached_property

import numpy as np

from ._columns import RATE_UNITS, label_texts
from ._headline import readability_of
from ._options import ReportOptions, check_limit
from .allan import rows_for_allan
from .compensator import features
from .displays._base import figures, signs
from .metrics import rms
from .report import gyro_report

__all__ = ["Results"]

_PER_MINUTE = 60.0
_SMALL = 0.05  # deg/s


class Results:
    """What several parts of the report need; rates are NaN where a row was out of range."""

    def __init__(self, calibration, options=None):
        self.calibration = calibration
        self.options = ReportOptions() if options is None else options
        self.log, self.rate = calibration.log, calibration.rate
        self.in_range = calibration.in_range
        self.before = np.where(self.in_range, calibration.before, np.nan)
        self.after = np.where(self.in_range, calibration.after, np.nan)
        self.error_before = (self.before - self.rate)[self.in_range]
        self.error_after = (self.after - self.rate)[self.in_range]
        self.temperature = self.log["temperature"].to_numpy()
        self.temperature_rate = self.time = self.since_power_on = self.run = None
        if "temperature_rate" in calibration.X:
            self.temperature_rate = _PER_MINUTE * calibration.X["temperature_rate"].to_numpy()
        if "time" in self.log:
            self.time = self.log["time"].to_numpy()
            times = features(self.log, ("time",), time_constant=1.0)
            self.since_power_on = times["time"].to_numpy()
        if "run" in self.log:
            self.run = label_texts(self.log["run"])
        self.unit = self.options.unit
        if self.unit == "auto":
            # That in which errors are no long row of zeros.
            self.unit = "deg/s" if rms(self.error_before) > _SMALL else "deg/h"
        self.symbol = signs(self.unit)

    def shown(self, error):
        """An error [deg/s] in the unit for errors, without it; a dash where it is not known."""
        return figures(RATE_UNITS[self.unit] * error) if np.isfinite(error) else "–"

    @cached_property
    def merit(self):
        """Figures of merit of all rows in range."""
        return gyro_report(
            self.rate,
            self.calibration.before,
            self.after,
            temperature=self.temperature,
            temperature_rate=self.temperature_rate,
            # Of some rows, means over a time are not those of all.
            time=None if self.calibration.is_thinned else self.time,
            run=self.run,
            # At rest there is no scale factor; any full scale will do.
            full_scale=np.abs(self.rate).max() or 1.0,
            rate_unit=self.unit,
            allan=isinstance(self.of_allan, dict),
            random_state=0,
        )

    @cached_property
    def of_allan(self):
        """Arguments of an AllanDisplay, or why there is none."""
        try:
            import allantools  # noqa: F401
        except ImportError:
            return "allantools is not installed (pip install allantools)"
        if self.time is None:
            return "the log has no time"
        if self.calibration.is_thinned:
            return "only some of the rows are used"
        try:
            rows, interval = rows_for_allan(self.time, self.run, self.in_range)
        except ValueError as reason:
            return str(reason)
        run = None if self.run is None else self.run[rows]
        return {"rows": rows, "sampling_interval": interval, "run": run}

    @cached_property
    def checks(self):
        """The limits of the specification, and whether they are kept."""
        lines = self.merit.set_index("figure")
        return [check_limit(limit, lines) for limit in self.options.limits]

    @cached_property
    def readability(self):
        """Whether the rules can be read one by one."""
        return readability_of(self.calibration)
