"""The contents of a calibration's report: errors, figures of merit, limits and pictures."""

import base64
import io
import re
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd

from ..inspection import MembershipDisplay
from ._columns import RATE_UNITS, evenly_chosen
from ._options import check_limit
from .c_compensator import input_units
from .compensator import features
from .displays import AllanDisplay, ErrorDisplay, GroupResidualDisplay, signs, three_digits
from .metrics import SLOWEST, allan_deviation, rms
from .report import gyro_report
from .thermal_displays import (
    CoverageDisplay,
    HysteresisDisplay,
    ResidualSurfaceDisplay,
    ScaleFactorErrorDisplay,
)

_PER_MINUTE = 60.0
_SMALL = 0.05  # deg/s RMS, up to which errors are shown in deg/h
_DOTS_PER_INCH = 160  # sharp in print
_FORMULA = re.compile(r"^[=+\-@\t\r](?![\d.]+$)")
_MOST_ROWS_SHOWN = 20_000  # more rows would hide one another
# Display and caption by name of the files; a caption's first sentence is also the alternative text.
_PICTURES = {
    "error-by-time": (ErrorDisplay, "Error against time, before and after."),
    "error-by-temperature": (ErrorDisplay, "Error against temperature, before and after."),
    "scale-factor-error": (
        ScaleFactorErrorDisplay,
        "Scale-factor error against rate, in three bands of temperature. It is IEEE 528's and "
        "1780's scale factor error, of the mean over a rate.",
    ),
    "hysteresis": (
        HysteresisDisplay,
        "Bias against temperature, while warming and while cooling. The gap is IEEE 528's "
        "hysteresis error; what depends on the rate is taken off. Temperature alone cannot close "
        "a loop.",
    ),
    "residual-surface": (
        ResidualSurfaceDisplay,
        "Mean residual and number of rows over temperature and rate.",
    ),
    "held-out-groups": (GroupResidualDisplay, "RMS error by held-out group. No dot: out of range."),
    "allan-deviation": (
        AllanDisplay,
        "Allan deviation of the error, over stretches in range without a gap. It is the root of "
        "IEEE 952's Allan variance.",
    ),
}
_COVERAGE = (
    "Coverage over temperature and output; other inputs at their medians. Hatched cells hold no "
    "row: what is said there is a guess from their neighbours. Rows outside the dashed line are "
    "flagged, and within it those beyond the dotted line, where there is one."
)


class Picture(NamedTuple):
    """A picture on the page: PNG image, alternative text, caption and CSV files, in base64.

    ``is_tall`` is whether it is higher than wide, for its place on paper.
    """

    image: str
    alt: str
    caption: str
    files: dict[str, str]
    is_tall: bool

    @classmethod
    def of(cls, subject, figure, tables, caption):
        """Render a figure as an image, and its tables as CSV files."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        file = io.BytesIO()
        # Without software and date, reports on one log are equal. savefig would draw it twice.
        FigureCanvasAgg(figure).print_png(file, metadata={"Software": None})
        files = {}
        for name, table in tables.items():
            # An apostrophe keeps a spreadsheet from taking a text for a formula.
            texts = table.select_dtypes(exclude="number").map(str)
            table = table.assign(**texts.replace(_FORMULA, r"'\g<0>", regex=True))
            text = table.to_csv(index=False, float_format="%.9g", lineterminator="\n")
            ending = f"-{name}" if len(tables) > 1 else ""
            files[f"{subject}{ending}.csv"] = _base64(text.encode("utf-8"))
        width, height = figure.get_size_inches()
        alt = caption.partition(".")[0]
        return cls(_base64(file.getvalue()), alt, caption, files, height > width)


class Results:
    """Data for the sections of the report.

    ``rows`` is a table of the log and its compensation, which is NaN on rows out of range.
    All of these are optional: limits; the command line as typed; name, size [bytes] and SHA-256 of
    files; entries of the page's own table.
    """

    def __init__(self, calibration, *, limits=(), typed="", files=(), **entries):
        self.calibration, self.limits = calibration, limits
        self.typed, self.files, self.entries = typed, files, entries
        log, inside = calibration.log, calibration.inside
        known = [name for name in ("rate", "temperature", "time", "run") if name in log]
        after = np.where(inside, calibration.after, np.nan)
        self.rows = log[known].assign(before=calibration.before, after=after)
        if "time" in log:
            # Needed even if it is no input: it shows what temperature alone cannot compensate.
            change = features(log, ("temperature_rate",), calibration.compensator.time_constant)
            self.rows["temperature_rate"] = _PER_MINUTE * change["temperature_rate"]
        # The unit in which errors do not begin with many zeros.
        is_large = rms((calibration.before - calibration.rate)[inside]) > _SMALL
        self.unit = "deg/s" if is_large else "deg/h"
        self.symbol = signs(self.unit)

    def shown(self, error):
        """An error [deg/s] as a number in the unit for errors; a dash if it is not known."""
        return three_digits(RATE_UNITS[self.unit] * error)

    @cached_property
    def merit(self):
        return gyro_report(
            **self.rows,
            # At rest there is no scale factor; any full scale will do.
            full_scale=self.rows["rate"].abs().max() or 1.0,
            rate_unit=self.unit,
            allan=not self.no_allan,
            random_state=0,
        )

    @cached_property
    def no_allan(self):
        """Why there is no Allan deviation; empty if there is one."""
        if "time" not in self.rows:
            return "the log has no time"
        error, run = self.rows["after"] - self.rows["rate"], self.rows.get("run")
        try:
            allan_deviation(error.to_numpy(), self.rows["time"].to_numpy(), run)
        except (ImportError, ValueError) as reason:
            return str(reason)
        return ""

    @cached_property
    def checks(self):
        lines = self.merit.set_index("figure")
        return [check_limit(limit, lines) for limit in self.limits]

    @cached_property
    def pictures(self):
        """The pictures of the held-out rows that make sense for this log, by name."""
        rows = self.rows
        rates = rows["rate"], rows["before"].where(rows["after"].notna()), rows["after"]
        heat, label = rows[["temperature"]], "temperature [degC]"
        found: dict = {
            "error-by-temperature": {"position": rows["temperature"], "position_label": label},
            "held-out-groups": {"groups": self.calibration.split.labels.astype(str)},
        }
        if "time" in rows:
            label = "time since power-on [s]"
            time = features(self.calibration.log, ("time",), time_constant=1.0)["time"]
            found["error-by-time"] = {"position": time, "position_label": label}
            change = rows["temperature_rate"]
            if change.min() < -SLOWEST < SLOWEST < change.max():
                found["hysteresis"] = rows[["temperature", "temperature_rate"]]
        if np.ptp(rows["rate"]):
            found["scale-factor-error"] = found["residual-surface"] = heat
        if not self.no_allan:
            found["allan-deviation"] = rows[[name for name in ("time", "run") if name in rows]]
        pictures = {}
        for subject, (kind, caption) in _PICTURES.items():
            if subject not in found:
                continue
            unit = None if kind is ScaleFactorErrorDisplay else self.unit
            figure = _figure()
            display = kind.from_predictions(*rates, unit=unit, ax=figure, **found[subject])
            pictures[subject] = Picture.of(subject, figure, display.tables(), caption)
        return pictures

    def coverage(self):
        """The picture of the coverage; none if temperature or output is no input."""
        calibration = self.calibration
        X = calibration.X[list(calibration.compensator.inputs)]
        if not {"temperature", "output"} <= set(X):
            return
        figure = _figure()
        display = CoverageDisplay.from_estimator(
            calibration.compensator.estimator,
            X,
            min_coverage=calibration.compensator.min_coverage,
            output_unit=calibration.recipe.output_unit,
            ax=figure,
        )
        yield Picture.of("coverage", figure, display.tables(), _COVERAGE)

    def memberships(self):
        """The picture of the membership functions; none if no input has terms."""
        rules, X = self.calibration.rules, self.calibration.X
        n_inputs = len({term["input"] for term in rules[-1].memberships_})
        if not n_inputs:
            return
        figure = _figure(figsize=(6.2, 0.6 + 1.9 * n_inputs))
        axes = list(figure.subplots(n_inputs, squeeze=False).ravel())
        shown = X.iloc[evenly_chosen(len(X), _MOST_ROWS_SHOWN)]
        display = MembershipDisplay.from_estimator(rules, shown, ax=axes)
        parts, units = [], input_units(self.calibration.compensator)
        for panel, each in zip(axes, display.inputs, strict=True):
            panel.set_xlabel(f"{panel.get_xlabel()} [{signs(units[each.input_name])}]")
            for term, before, after in zip(each.term_names, each.before, each.after, strict=True):
                truths = {"value": each.grid, "truth before": before, "truth after": after}
                parts.append(pd.DataFrame({"input": each.input_name, "term": term} | truths))
        caption = "Membership functions before training (dashed) and after, over the data."
        yield Picture.of("fuzzy-terms", figure, {"terms": pd.concat(parts)}, caption)


def _figure(**options):
    """A figure made without pyplot, which would look for a screen."""
    from matplotlib.figure import Figure

    return Figure(layout="constrained", dpi=_DOTS_PER_INCH, **options)


def _base64(data):
    return base64.b64encode(data).decode("ascii")
