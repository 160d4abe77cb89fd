"""The pictures of a calibration's report, each drawn on a figure of its own.

The figures are not pyplot's: no screen is asked for, and none stays open.
"""

import base64
import io
import re
from collections.abc import Callable
from typing import Any, NamedTuple

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

__all__ = ["PICTURES", "Picture", "draw", "draw_coverage", "draw_memberships"]

_DOTS_PER_INCH = 160  # sharp in print
_FORMULA = re.compile(r"^[=+\-@\t\r](?![\d.]+$)")
_MOST_ROWS_SHOWN = 20_000  # rows beyond cover one another
_CLEARLY = 0.05  # degC/min, below which a temperature neither rises nor falls


class Picture(NamedTuple):
    """What a page shows: the image, what those who cannot see it are told, and the data behind it.

    ``image`` is PNG, and the values of ``files`` are CSV, all in base64; ``is_tall`` tells how the
    picture stands on paper.
    """

    image: str
    alt: str
    caption: str
    files: dict[str, str]
    is_tall: bool


class Plan(NamedTuple):
    """A display, and what makes its arguments of results; these give None where it has no sense.

    The first sentence of the caption is read to those who cannot see the picture.
    """

    subject: str
    display: Any
    arguments: Callable
    caption: str


def _by_time(results):
    if results.time is None:
        return None
    label = "time since power-on [s]"
    return {"position": results.since_power_on, "position_label": label, "unit": results.unit}


def _by_temperature(results):
    label = "temperature [degC]"
    return {"position": results.temperature, "position_label": label, "unit": results.unit}


def _over_rates(results):
    return {"temperature": results.temperature} if np.ptp(results.rate) else None


def _surface(results):
    arguments = _over_rates(results)
    return arguments and arguments | {"unit": results.unit}


def _loop(results):
    change = results.temperature_rate
    if change is None or not change.min() < -_CLEARLY < _CLEARLY < change.max():
        return None
    temperatures = {"temperature": results.temperature, "temperature_rate": change}
    return temperatures | {"unit": results.unit}


def _groups(results):
    return {"groups": results.calibration.split.labels.astype(str), "unit": results.unit}


def _allan(results):
    if isinstance(results.of_allan, str):
        return None
    return results.of_allan | {"unit": results.unit}


PICTURES = (
    Plan(
        "error-by-time",
        ErrorDisplay,
        _by_time,
        "Error against time, before and after. Bands reach from the smallest to the largest error.",
    ),
    Plan(
        "error-by-temperature",
        ErrorDisplay,
        _by_temperature,
        "Error against temperature, before and after.",
    ),
    Plan(
        "scale-factor-error",
        ScaleFactorErrorDisplay,
        _over_rates,
        "Scale-factor error against rate, in three bands of temperature.",
    ),
    Plan(
        "hysteresis",
        HysteresisDisplay,
        _loop,
        "Bias against temperature, while warming and while cooling. What depends on the rate is "
        "taken off, other than in the table. Temperature alone cannot close a loop.",
    ),
    Plan(
        "residual-surface",
        ResidualSurfaceDisplay,
        _surface,
        "Mean residual and number of rows over temperature and rate.",
    ),
    Plan(
        "held-out-groups",
        GroupResidualDisplay,
        _groups,
        "RMS error of every held-out group, the worst at the top.",
    ),
    Plan(
        "allan-deviation",
        AllanDisplay,
        _allan,
        "Allan deviation of the error, over the runs that are in range from end to end.",
    ),
)


def draw(plan, results):
    """The picture of a plan; None where it has no sense."""
    from matplotlib.figure import Figure

    arguments = plan.arguments(results)
    if arguments is None:
        return None
    rows = arguments.pop("rows", slice(None))
    rates = (each[rows] for each in (results.rate, results.before, results.after))
    display = plan.display.computed(*rates, **arguments)
    display.plot(display.panels(Figure))
    return _picture(plan.subject, display.figure_, display.tables(), plan.caption)


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
