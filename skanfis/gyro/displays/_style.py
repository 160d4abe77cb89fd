"""What all pictures share: colours that the colour-blind can tell apart, units, axes."""

import numpy as np

__all__ = [
    "AFTER",
    "BEFORE",
    "COOLING",
    "PER_UNIT",
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
PER_UNIT = {"deg/s": 1.0, "deg/h": 3600.0}

_FEWEST_MARKS, _MOST_DECADES = 3, 8
_WHOLE, _LONGEST = 100.0, 1e7


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

    At whole decades, or where that makes fewer than three marks at 1, 2 and 5 of each, or at all
    nine.
    """
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

    first, last = (int(np.floor(np.log10(value))) for value in (low, high))
    every = -(-(last - first + 1) // _MOST_DECADES)
    shown: list[float] = []
    for digits in ((1,), (1, 2, 5), range(1, 10)):
        places = [m * 10.0**d for d in range(first, last + 2, every) for m in digits]
        shown = [place for place in places if low <= place <= high]
        if len(shown) >= _FEWEST_MARKS:
            break
    axis.set_major_locator(FixedLocator(shown if len(shown) > 1 else [low, high]))
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
