"""What the parts of a calibration's report have in common."""

from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from ._budget import budget_of
from ._certain import certain_of
from ._columns import RATE_UNITS, in_rate_unit, label_texts
from ._dossier import Dossier
from ._figures_of_merit import FIGURES_OF_ALLAN
from ._reading import readability_of
from ._specification import check_limits
from .allan import ROWS_PER_TIME, allan_coefficients, allan_deviation
from .compensator import features
from .displays._style import SYMBOL, figures
from .metrics import rms
from .report import gyro_report

__all__ = ["COUNTS", "Results"]

COUNTS = ("rows", "rows_refused", "rows_outside")

_PER_MINUTE = 60.0
_SMALL = 0.05  # deg/s
# A line of the table for each: beyond, nobody reads it.
_MOST_GROUPS = 40
# Allan's variance asks for even steps: a part of the step that a logger's clock may jitter by.
_UNEVEN = 0.01
_CLEARLY = 0.05  # degC/min, below which a temperature neither rises nor falls


class Results:
    """What several parts of the report need.

    ``after`` is the held-out compensated rate where a row was in range, NaN elsewhere, and so is
    ``before``: a flagged row is not to be trusted, and has a figure of its own.
    """

    def __init__(self, calibration, dossier=None):
        self.calibration = calibration
        self.dossier = Dossier() if dossier is None else dossier
        self.log, self.rate = calibration.log, calibration.rate
        self.in_range = calibration.in_range
        self.after = np.where(self.in_range, calibration.after, np.nan)
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
        self.run = label_texts(self.log["run"]) if "run" in self.log else None

    @property
    def unit(self):
        """Unit for errors: as asked for, or that in which they are no long row of zeros."""
        if self.dossier.unit != "auto":
            return self.dossier.unit
        return "deg/s" if rms(self.error_before) > _SMALL else "deg/h"

    def shown(self, error):
        """An error [deg/s] in the unit for errors."""
        return figures(RATE_UNITS[self.unit] * error)

    @property
    def symbol(self):
        """That unit's sign."""
        return SYMBOL[self.unit]

    @cached_property
    def merit(self):
        """Figures of merit of all rows in range, and of each group where there are few."""
        whole = self._report(random_state=0)
        parts = [whole]
        if self.has_few_groups:
            # Their intervals, which would take the longest of all, are not shown.
            groups = self._report(groups=self.calibration.split.labels, n_resamples=0)
            parts.append(groups[groups["group"] != "all"])
        if not self.why_no_allan:
            parts.append(self._merit_of_allan())
        table = pd.concat(parts, ignore_index=True)
        table.attrs = whole.attrs
        return table

    def _report(self, **options):
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
            **options,
        )

    def _merit_of_allan(self):
        """Lines of N, B and K, read off the curves that are drawn."""
        lines = []
        for name, usual in FIGURES_OF_ALLAN.items():
            unit, factor = in_rate_unit(usual, self.unit)
            line = {"group": "all", "figure": name, "unit": unit, "note": ""}
            for side, curve in zip(("before", "after"), self.allan_curves, strict=True):
                value, reason = _read_off(curve, name)
                line[side] = factor * value
                if reason:
                    line["note"] += f"{'; ' if line['note'] else ''}{side}: {reason}"
            lines.append(line)
        return pd.DataFrame(lines)

    @cached_property
    def allan_curves(self):
        """Before and after, over the runs that are in range from end to end."""
        rows = self.in_whole_runs
        run = None if self.run is None else self.run[rows]
        return [
            allan_deviation((rates - self.rate)[rows], self.interval, run=run)
            for rates in (self.before, self.after)
        ]

    @property
    def has_few_groups(self):
        """Whether each held-out group gets a line."""
        return np.unique(self.calibration.split.labels.astype(str)).size <= _MOST_GROUPS

    @cached_property
    def checks(self):
        """The limits of the specification, and whether they are kept."""
        return check_limits(self.dossier.limits, self.merit)

    @cached_property
    def readability(self):
        """Whether the rules can be read one by one."""
        return readability_of(self.calibration)

    @cached_property
    def budget(self):
        """The parts of a row's uncertainty."""
        return budget_of(self.calibration)

    @cached_property
    def certain(self):
        """What is proven over the box that was asked for."""
        return certain_of(self.calibration)

    @cached_property
    def why_no_allan(self):
        """Why there is no Allan curve; empty where there is one."""
        try:
            import allantools  # noqa: F401
        except ImportError:
            return "allantools is not installed (pip install allantools)"
        if self.time is None:
            return "the log has no time"
        if self.calibration.is_thinned:
            return "only some of the rows are used"
        steps = self.steps
        if not steps.size or np.ptp(steps) > _UNEVEN * np.median(steps):
            return "the rows are not evenly spaced in time"
        rows = self.in_whole_runs
        if not rows.any():
            return "no run is in range from end to end"
        runs = np.zeros(rows.size) if self.run is None else self.run
        _, lengths = np.unique(runs[rows].astype(str), return_counts=True)
        is_enough = lengths.max() >= ROWS_PER_TIME
        return "" if is_enough else f"no run in range has {ROWS_PER_TIME} rows"

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


def _read_off(curve, name):
    """A coefficient of an Allan curve and "", or NaN and why there is none."""
    try:
        read = allan_coefficients(curve["averaging_time"], curve["deviation"])
    except ValueError as error:
        # Of a curve of too few points to have a slope, which is drawn all the same.
        return np.nan, str(error)
    value = getattr(read, name)
    return (np.nan, read.notes[name]) if value is None else (value, "")
