"""The pictures of a calibration's report, each drawn on a figure of its own, not pyplot's."""

import base64
import io
import re
from typing import NamedTuple

import numpy as np
import pandas as pd

from ..inspection import MembershipDisplay
from ._columns import evenly_chosen
from .displays import (
    AllanDisplay,
    CoverageDisplay,
    ErrorDisplay,
    GroupResidualDisplay,
    HysteresisDisplay,
    ResidualSurfaceDisplay,
    ScaleFactorErrorDisplay,
)

__all__ = ["PICTURES", "draw", "draw_coverage", "draw_memberships"]

_DOTS_PER_INCH = 160  # sharp in print
_FORMULA = re.compile(r"^[=+\-@\t\r](?![\d.]+$)")
_MOST_ROWS_SHOWN = 20_000  # rows beyond cover one another
_CLEARLY = 0.05  # degC/min, below which a temperature neither rises nor falls


class Picture(NamedTuple):
    """What a page shows: a PNG image, what those who cannot see it are told, CSV files; in base64.

    ``is_tall`` tells how the picture stands on paper.
    """

    image: str
    alt: str
    caption: str
    files: dict[str, str]
    is_tall: bool


# Name of the files, display, and caption, whose first sentence is read to those who cannot see.
PICTURES = (
    ("error-by-time", ErrorDisplay, "Error against time, before and after."),
    ("error-by-temperature", ErrorDisplay, "Error against temperature, before and after."),
    (
        "scale-factor-error",
        ScaleFactorErrorDisplay,
        "Scale-factor error against rate, in three bands of temperature.",
    ),
    (
        "hysteresis",
        HysteresisDisplay,
        "Bias against temperature, while warming and while cooling. What depends on the rate is "
        "taken off, other than in the table. Temperature alone cannot close a loop.",
    ),
    (
        "residual-surface",
        ResidualSurfaceDisplay,
        "Mean residual and number of rows over temperature and rate.",
    ),
    ("held-out-groups", GroupResidualDisplay, "RMS error of every held-out group."),
    (
        "allan-deviation",
        AllanDisplay,
        "Allan deviation of the error, over the runs that are in range from end to end.",
    ),
)


def draw(plan, results):
    """The picture of one line of PICTURES; None where it has no sense."""
    from matplotlib.figure import Figure

    subject, kind, caption = plan
    arguments = _arguments(results).get(subject)
    if arguments is None:
        return None
    rows = arguments.pop("rows", slice(None))
    rates = (each[rows] for each in (results.rate, results.before, results.after))
    unit = None if kind is ScaleFactorErrorDisplay else results.unit
    display = kind.computed(*rates, unit, **arguments)
    display.plot(display.panels(Figure))
    return _picture(subject, display.figure_, display.tables(), caption)


def _arguments(results):
    """What each display is made of, where it has a sense."""
    temperature, change = results.temperature, results.temperature_rate
    label = "temperature [degC]"
    found = {
        "error-by-temperature": {"position": temperature, "position_label": label},
        "held-out-groups": {"groups": results.calibration.split.labels.astype(str)},
    }
    if results.time is not None:
        label = "time since power-on [s]"
        found["error-by-time"] = {"position": results.since_power_on, "position_label": label}
    if np.ptp(results.rate):
        found["scale-factor-error"] = found["residual-surface"] = {"temperature": temperature}
    if change is not None and change.min() < -_CLEARLY < _CLEARLY < change.max():
        found["hysteresis"] = {"temperature": temperature, "temperature_rate": change}
    if isinstance(results.of_allan, dict):
        found["allan-deviation"] = dict(results.of_allan)
    return found


def draw_coverage(calibration):
    """None where temperature or output is no input."""
    from matplotlib.figure import Figure

    if not {"temperature", "output"} <= set(calibration.X):
        return None
    display = CoverageDisplay.from_estimator(
        calibration.compensator.estimator,
        calibration.X,
        min_coverage=calibration.compensator.min_coverage,
        units={"output": calibration.recipe.output_unit, "temperature_rate": "degC/s"},
        ax=Figure(figsize=(6.2, 4.0), layout="constrained").subplots(),
    )
    caption = (
        "Coverage over temperature and output; other inputs at their medians. Hatched cells hold "
        "no row: what is said there is a guess from their neighbours. Rows outside the dashed line "
        "are flagged, and within it those beyond the dotted line, where there is one."
    )
    return _picture("coverage", display.figure_, display.tables(), caption)


def draw_memberships(calibration):
    """None where no input has terms."""
    from matplotlib.figure import Figure

    n_inputs = len({term["input"] for term in calibration.rules[-1].memberships_})
    if not n_inputs:
        return None
    rows = evenly_chosen(len(calibration.X), _MOST_ROWS_SHOWN)
    figure = Figure(figsize=(6.2, 0.6 + 1.9 * n_inputs), layout="constrained")
    axes = list(figure.subplots(n_inputs, squeeze=False).ravel())
    display = MembershipDisplay.from_estimator(calibration.rules, calibration.X.iloc[rows], ax=axes)
    parts = []
    for each in display.inputs:
        for term, before, after in zip(each.term_names, each.before, each.after, strict=True):
            truths = {"value": each.grid, "truth before": before, "truth after": after}
            parts.append(pd.DataFrame({"input": each.input_name, "term": term} | truths))
    caption = "Membership functions before training (dashed) and after, over the data."
    return _picture("fuzzy-terms", figure, {"terms": pd.concat(parts)}, caption)


def _picture(subject, figure, tables, caption):
    """The figure painted, and its tables as files."""
    file = io.BytesIO()
    # Software and date would make two reports on the same log differ.
    figure.savefig(file, format="png", dpi=_DOTS_PER_INCH, metadata={"Software": None})
    files = {}
    for name, table in tables.items():
        texts = {
            column: [_FORMULA.sub(r"'\g<0>", str(value)) for value in table[column]]
            for column in table.select_dtypes(exclude="number")
        }
        # What a spreadsheet would take for a formula has an apostrophe in front.
        text = table.assign(**texts).to_csv(index=False, float_format="%.9g", lineterminator="\n")
        ending = f"-{name}" if len(tables) > 1 else ""
        files[f"{subject}{ending}.csv"] = _base64(text.encode("utf-8"))
    width, height = figure.get_size_inches()
    alt = caption.partition(".")[0]
    return Picture(_base64(file.getvalue()), alt, caption, files, height > width)


def _base64(data):
    return base64.b64encode(data).decode("ascii")
