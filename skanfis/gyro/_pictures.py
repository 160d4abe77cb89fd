"""The pictures of a calibration's report, each drawn on a figure of its own.

The figures are not pyplot's: no screen is asked for, and none stays open.
"""

import re
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
from .displays.groups import MOST_LINES

__all__ = ["PICTURES", "Picture", "draw_coverage", "draw_memberships"]

_FORMULA = re.compile(r"^[=+\-@\t\r](?![\d.]+$)")
# Points beyond cover one another.
_MOST_ROWS_SHOWN = 20_000


class Picture(NamedTuple):
    """A matplotlib figure, what it shows for those who cannot see it, and its caption.

    ``files`` are the data behind it, text in CSV by the name of a file.
    """

    figure: Any
    alt: str
    caption: str
    files: dict[str, str]


def draw_error_by_time(results):
    """None where the log has no time."""
    if results.time is None:
        return None
    caption = "Error against time. Bands reach from the smallest to the largest error."
    return _error_by("time", results, results.since_power_on, "time since power-on [s]", caption)


def draw_error_by_temperature(results):
    caption = "Error against temperature."
    return _error_by("temperature", results, results.temperature, "temperature [°C]", caption)


def _error_by(what, results, position, position_label, caption):
    figure, axes = _panels(2)
    display = ErrorDisplay.from_predictions(
        *_rates(results),
        position=position,
        position_label=position_label,
        unit=results.unit,
        ax=axes,
    )
    alt = f"Error against {what}, before and after"
    return Picture(figure, alt, caption, _files(f"error-by-{what}", display.tables()))


def draw_scale_factor_error(results):
    """None for a log at one rate."""
    if np.ptp(results.rate) == 0:
        return None
    figure, axes = _panels(2)
    display = ScaleFactorErrorDisplay.from_predictions(
        *_rates(results), temperature=results.temperature, ax=axes
    )
    alt = "Scale-factor error against rate at three temperatures, before and after"
    caption = "Scale-factor error against rate, in three bands of temperature."
    return Picture(figure, alt, caption, _files("scale-factor-error", display.tables()))


def draw_hysteresis(results):
    """None where the temperature does not both rise and fall."""
    if not results.warms_and_cools:
        return None
    figure, axes = _panels(2)
    display = HysteresisDisplay.from_predictions(
        *_rates(results),
        temperature=results.temperature,
        temperature_rate=results.temperature_rate,
        unit=results.unit,
        ax=axes,
    )
    alt = "Bias against temperature, warming and cooling apart, before and after"
    caption = (
        "Bias while warming and while cooling; what depends on the rate is taken off, other than "
        "in the table. Temperature alone cannot close a loop."
    )
    return Picture(figure, alt, caption, _files("hysteresis", display.tables()))


def draw_surface(results):
    """None for a log at one rate."""
    if np.ptp(results.rate) == 0:
        return None
    figure = _figure(7.0, 3.4)
    display = ResidualSurfaceDisplay.from_predictions(
        *_rates(results),
        temperature=results.temperature,
        unit=results.unit,
        ax=figure.subplots(1, 2, sharey=True),
    )
    alt = "Mean residual and number of rows over temperature and rate"
    caption = "What is left over temperature and rate (left), and where there are data (right)."
    return Picture(figure, alt, caption, _files("residual-surface", display.tables()))


def draw_groups(results):
    groups = results.calibration.split.labels
    n_lines = min(np.unique(groups.astype(str)).size, MOST_LINES)
    figure, axes = _panels(1, height=1.6 + 0.2 * n_lines)
    display = GroupResidualDisplay.from_predictions(
        *_rates(results), groups=groups, unit=results.unit, ax=axes
    )
    alt = "RMS error of every held-out group, before and after"
    files = _files("held-out-groups", display.tables())
    return Picture(figure, alt, "Every held-out group, the worst at the top.", files)


def draw_allan(results):
    """None where there is a reason against it."""
    if results.why_no_allan:
        return None
    figure, axes = _panels(1)
    before, after = results.allan_curves
    display = AllanDisplay(before=before, after=after).plot(axes, unit=results.unit)
    caption = "Allan deviation of the error, over the runs that are in range from end to end."
    alt = "Allan deviation before and after"
    return Picture(figure, alt, caption, _files("allan-deviation", display.tables()))


PICTURES = (
    draw_error_by_time,
    draw_error_by_temperature,
    draw_scale_factor_error,
    draw_hysteresis,
    draw_surface,
    draw_groups,
    draw_allan,
)


def draw_coverage(calibration):
    """None where temperature or output is no input."""
    if not {"temperature", "output"} <= set(calibration.X):
        return None
    figure, axes = _panels(1, height=4.0)
    display = CoverageDisplay.from_estimator(
        calibration.compensator.estimator,
        calibration.X,
        min_coverage=calibration.compensator.min_coverage,
        units={"output": calibration.recipe.output_unit, "temperature_rate": "degC/s"},
        ax=axes,
    )
    alt = "Coverage over temperature and output, with the range of the calibration"
    caption = (
        "Coverage by the calibration data; other inputs at their medians. Hatched cells hold no "
        "row: what is said there is a guess from their neighbours. Rows outside the dashed line "
        "are flagged, and within it those beyond the dotted line, where there is one."
    )
    return Picture(figure, alt, caption, _files("coverage", display.tables()))


def draw_memberships(calibration):
    """None where no input has terms."""
    n_inputs = len({term["input"] for term in calibration.rules[-1].memberships_})
    if not n_inputs:
        return None
    figure, axes = _panels(n_inputs, height=0.6 + 1.9 * n_inputs, sharex=False)
    rows = evenly_chosen(len(calibration.X), _MOST_ROWS_SHOWN)
    display = MembershipDisplay.from_estimator(
        calibration.rules, calibration.X.iloc[rows], ax=list(np.atleast_1d(axes))
    )
    alt = "Membership functions before and after training, over histograms of the data"
    caption = "Fuzzy terms before training (dashed) and after, over the data."
    return Picture(figure, alt, caption, _files("fuzzy-terms", _tables_of_terms(display)))


def _rates(results):
    return results.rate, results.before, results.after


def _tables_of_terms(display):
    """What a MembershipDisplay has drawn."""
    terms = [
        pd.DataFrame(
            {
                "input": each.input_name,
                "term": term,
                "value": each.grid,
                "truth before": before,
                "truth after": after,
            }
        )
        for each in display.inputs
        for term, before, after in zip(each.term_names, each.before, each.after, strict=True)
    ]
    return {"terms": pd.concat(terms, ignore_index=True)}


def _files(subject, tables):
    """Tables as CSV: nine digits, names that any program reads, no cell that a program runs."""
    return {
        f"{subject}{f'-{name}' if len(tables) > 1 else ''}.csv": _harmless(table)
        .rename(columns=lambda column: column.replace("°C", "degC").replace("°", "deg"))
        .to_csv(index=False, float_format="%.9g", lineterminator="\n")
        for name, table in tables.items()
    }


def _harmless(table):
    """Text that a spreadsheet would take for a formula gets an apostrophe in front."""
    words = table.select_dtypes(exclude="number")
    return table.assign(
        **{name: [_FORMULA.sub(r"'\g<0>", str(value)) for value in words[name]] for name in words}
    )


def _panels(n_axes, height=4.2, sharex=True):
    figure = _figure(6.2, height)
    return figure, figure.subplots(n_axes, 1, sharex=sharex)


def _figure(width, height):
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")
