"""The pictures of a calibration's report, each drawn on a figure of its own.

The figures are not pyplot's: no screen is asked for, and none stays open.
"""

from typing import Any, NamedTuple

import numpy as np

from ..inspection import MembershipDisplay
from ._results import rules_of
from .allan import ROWS_PER_TIME
from .displays import (
    AllanDisplay,
    CoverageDisplay,
    ErrorDisplay,
    GroupResidualDisplay,
    HysteresisDisplay,
    ResidualSurfaceDisplay,
    ScaleFactorErrorDisplay,
)

__all__ = ["PICTURES", "Picture", "draw_coverage", "draw_memberships", "why_no_allan"]

_UNEVEN = 0.01
_MOST_ROWS_SHOWN = 20_000
_MOST_LINES = 30


class Picture(NamedTuple):
    """A matplotlib figure, what it shows for those who cannot see it, and its caption."""

    figure: Any
    alt: str
    caption: str


def draw_error_by_time(results):
    """None where the log has no time."""
    if results.time is None:
        return None
    figure, axes = _panels(2)
    ErrorDisplay.from_predictions(
        *_rates(results),
        position=results.since_power_on,
        position_label="time since power-on [s]",
        unit=results.unit,
        ax=axes,
    )
    caption = "Error against time. Bands reach from the smallest to the largest error."
    return Picture(figure, "Error against time, before and after", caption)


def draw_error_by_temperature(results):
    figure, axes = _panels(2)
    ErrorDisplay.from_predictions(
        *_rates(results),
        position=results.temperature,
        position_label="temperature [°C]",
        unit=results.unit,
        ax=axes,
    )
    alt = "Error against temperature, before and after"
    return Picture(figure, alt, "Error against temperature.")


def draw_scale_factor_error(results):
    """None for a log at one rate."""
    if np.ptp(results.rate) == 0:
        return None
    figure, axes = _panels(2)
    ScaleFactorErrorDisplay.from_predictions(
        *_rates(results), temperature=results.temperature, ax=axes
    )
    alt = "Scale-factor error against rate at three temperatures, before and after"
    caption = "Scale-factor error against rate, in three bands of temperature."
    return Picture(figure, alt, caption)


def draw_hysteresis(results):
    """None where the temperature does not both rise and fall."""
    if not results.warms_and_cools:
        return None
    figure, axes = _panels(2)
    HysteresisDisplay.from_predictions(
        *_rates(results),
        temperature=results.temperature,
        temperature_rate=results.temperature_rate,
        ax=axes,
    )
    alt = "Bias against temperature, warming and cooling apart, before and after"
    caption = (
        "Bias while warming and while cooling; what depends on the rate is taken off, other than "
        "in the table. Temperature alone cannot close a loop."
    )
    return Picture(figure, alt, caption)


def draw_surface(results):
    """None for a log at one rate."""
    if np.ptp(results.rate) == 0:
        return None
    figure = _figure(7.0, 3.4)
    ResidualSurfaceDisplay.from_predictions(
        *_rates(results),
        temperature=results.temperature,
        unit=results.unit,
        ax=figure.subplots(1, 2, sharey=True),
    )
    alt = "Mean residual and number of rows over temperature and rate"
    caption = "What is left over temperature and rate (left), and where there are data (right)."
    return Picture(figure, alt, caption)


def draw_groups(results):
    groups = results.calibration.split.labels
    n_lines = min(np.unique(groups.astype(str)).size, _MOST_LINES)
    figure, axes = _panels(1, height=1.6 + 0.2 * n_lines)
    GroupResidualDisplay.from_predictions(
        *_rates(results), groups=groups, unit=results.unit, ax=axes
    )
    alt = "RMS error of every held-out group, before and after"
    return Picture(figure, alt, "Every held-out group, the worst at the top.")


def draw_allan(results):
    """None where :func:`why_no_allan` has a reason."""
    if why_no_allan(results):
        return None
    rows = results.in_whole_runs
    figure, axes = _panels(1)
    AllanDisplay.from_predictions(
        *(rates[rows] for rates in _rates(results)),
        sampling_interval=results.interval,
        run=None if results.run is None else results.run[rows],
        ax=axes,
    )
    caption = "Allan deviation of the error, over the runs that are in range from end to end."
    return Picture(figure, "Allan deviation before and after", caption)


def why_no_allan(results):
    """Why there is no Allan curve; empty where there is one."""
    try:
        import allantools  # noqa: F401
    except ImportError:
        return "allantools is not installed (pip install allantools)"
    if results.time is None:
        return "the log has no time"
    steps = results.steps
    if not steps.size or np.ptp(steps) > _UNEVEN * np.median(steps):
        return "the rows are not evenly spaced in time"
    rows = results.in_whole_runs
    if not rows.any():
        return "no run is in range from end to end"
    runs = np.zeros(rows.size) if results.run is None else results.run
    _, lengths = np.unique(runs[rows].astype(str), return_counts=True)
    is_enough = lengths.max() >= ROWS_PER_TIME
    return "" if is_enough else f"no run in range has {ROWS_PER_TIME} rows"


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
    CoverageDisplay.from_estimator(
        calibration.compensator.estimator,
        _some_rows(calibration.X),
        units={"output": calibration.recipe.output_unit, "temperature_rate": "degC/s"},
        ax=axes,
    )
    alt = "Coverage over temperature and output, with the range of the calibration"
    caption = "Coverage by the calibration data; other inputs at their medians."
    return Picture(figure, alt, caption)


def draw_memberships(calibration):
    """None where no input has terms."""
    n_inputs = len({term["input"] for term in rules_of(calibration).memberships_})
    if not n_inputs:
        return None
    figure, axes = _panels(n_inputs, height=0.6 + 1.9 * n_inputs, sharex=False)
    estimator = calibration.compensator.estimator
    MembershipDisplay.from_estimator(
        getattr(estimator, "residual_", estimator),
        _some_rows(calibration.X),
        ax=list(np.atleast_1d(axes)),
    )
    alt = "Membership functions before and after training, over histograms of the data"
    caption = "Fuzzy terms before training (dashed) and after, over the data."
    return Picture(figure, alt, caption)


def _rates(results):
    return results.rate, results.before, results.after


def _panels(n_axes, height=4.2, sharex=True):
    figure = _figure(6.2, height)
    return figure, figure.subplots(n_axes, 1, sharex=sharex)


def _figure(width, height):
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def _some_rows(X):
    places = np.linspace(0, len(X) - 1, min(len(X), _MOST_ROWS_SHOWN)).astype(int)
    return X.iloc[np.unique(places)]
