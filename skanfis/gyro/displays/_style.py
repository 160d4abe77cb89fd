"""What all pictures share: colours that the colour-blind can tell apart, units, axes."""

import numpy as np

__all__ = [
    "AFTER",
    "BEFORE",
    "COOLING",
    "SYMBOL",
    "WARMING",
    "dress",
    "figures",
    "make_axes",
    "mark_decades",
    "symmetric_limit",
]

BEFORE, AFTER = "#d55e00", "#0072b2"
WARMING, COOLING = "#c8443c", "#3a6ea5"
NO_DATA = "#e9e9e6"

SYMBOL = {"deg/s": "°/s", "deg/h": "°/h"}

_LEAST_ROOM = 0.14  # between two marks, as a part of the axis
# From a hundred to a million, figures are written as whole numbers; else to three digits.
_WHOLE, _LONGEST = 100.0, 1e6


def make_axes(ax, n_axes, size, **options):
    """``n_axes`` axes: those given, or of a new figure; ValueError where their number is wrong."""
    if ax is None:
        from matplotlib import pyplot

        figure, ax = pyplot.subplots(figsize=size, layout="constrained", **options)
        return figure, np.atleast_1d(ax).ravel()
    axes = np.atleast_1d(np.asarray(ax, dtype=object)).ravel()
    if axes.size != n_axes:
        raise ValueError(f"ax has {axes.size} axes; this picture needs {n_axes}.")
    return axes[0].figure, axes


def dress(axes, xlabel=None, ylabel=None, title=None):
    """Labels, a light grid, no box."""
    axes.grid(True, color="0.9", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    if xlabel is not None:
        axes.set_xlabel(xlabel)
    if ylabel is not None:
        axes.set_ylabel(ylabel)
    if title is not None:
        axes.set_title(title, loc="left", fontsize="medium")


def figures(value):
    """A number with three digits that count, without an exponent where it can be."""
    if value == 0 or not np.isfinite(value):
        return f"{value:g}"
    decimals = max(2 - int(np.floor(np.log10(abs(value)))), 0)
    return f"{value:,.{decimals}f}" if decimals < 8 else f"{value:.2e}"


def mark_decades(axis, low, high):
    """Numbers on a logarithmic axis as they are spoken: 0.01, 0.1, 1, not powers of ten.

    Whole decades first, then 2 and 5 of each, then the others, as far as there is room between.
    """
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    room = _LEAST_ROOM * np.log(high / low)
    shown: list[float] = []
    for digit in (1, 2, 5, 3, 4, 6, 7, 8, 9):
        for place in (digit * 10.0**decade for decade in decades):
            is_free = all(abs(np.log(place / other)) >= room for other in shown)
            if low <= place <= high and is_free:
                shown.append(place)
    axis.set_major_locator(FixedLocator(sorted(shown) if len(shown) > 1 else [low, high]))
    axis.set_major_formatter(FuncFormatter(lambda value, _: plain(value)))
    axis.set_minor_formatter(NullFormatter())


def plain(value):
    """A mark of an axis, three digits, without an exponent where zeros do not hide its size."""
    return f"{value:,.0f}" if _WHOLE <= value < _LONGEST else f"{value:.3g}"


def symmetric_limit(values, share=0.995):
    """Largest size of nearly all values, for a colour scale that one outlier does not flatten."""
    sizes = np.abs(values[np.isfinite(values)])
    if not sizes.size or sizes.max() == 0:
        return 1.0
    return float(np.quantile(sizes, share))
