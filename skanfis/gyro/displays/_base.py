"""What the pictures of a compensation have in common: tables, units, colours, axes."""

from collections.abc import Callable
from typing import Any, ClassVar, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from .._columns import RATE_UNITS
from ..report import table_of

__all__ = ["SIDES", "GyroDisplay", "bins_of", "dress", "figures", "mark_decades", "signs"]

# Colours that the colour-blind can tell apart.
SIDES = (("before", "#d55e00"), ("after", "#0072b2"))
_SIGNS = (("degC", "°C"), ("deg/", "°/"), ("sqrt(h)", "√h"))
_BESIDE = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0), "frameon": False}


class GyroDisplay:
    """A picture drawn from tables; ``figure_``, ``axes_`` and ``ax_``, the first, once drawn.

    Parameters
    ----------
    tables : dict of str to DataFrame
        As :meth:`tables` gives them.
    """

    # Options with a value per row, which from_estimator also takes as the name of a column of X.
    _PER_ROW: ClassVar[tuple[str, ...]] = ()
    _OPTIONAL: ClassVar[tuple[str, ...]] = ()
    # The first is that of from_predictions unless another is given.
    _UNITS: ClassVar[tuple[str, ...]] = ("deg/s", "deg/h")
    _SIZE: ClassVar[tuple[float, float]] = (6.2, 4.4)
    _PANELS: ClassVar[dict[str, Any]] = {}

    # Tables of what is drawn, from the errors of all rows in the unit, and options.
    _computed: ClassVar[Callable[..., dict[str, pd.DataFrame]]]
    _draw: Callable[..., None]

    def __init__(self, tables: dict[str, pd.DataFrame]) -> None:
        self._tables = tables

    def tables(self) -> dict[str, pd.DataFrame]:
        """What is drawn.

        Returns
        -------
        tables : dict of str to DataFrame
            Columns carry their units.
        """
        return self._tables

    def plot(self, ax: Any = None) -> Self:
        """Draw.

        Parameters
        ----------
        ax : matplotlib axes or array of these, default=None
            Where to draw, one for each panel; None makes a figure.

        Returns
        -------
        display
            Itself.
        """
        if ax is None:
            from matplotlib import pyplot

            ax = self.panels(pyplot.figure)
        self.axes_ = np.atleast_1d(np.asarray(ax, dtype=object)).ravel()
        n_axes = self._PANELS.get("nrows", 1) * self._PANELS.get("ncols", 1)
        if self.axes_.size != n_axes:
            raise ValueError(f"ax has {self.axes_.size} axes; this picture needs {n_axes}.")
        self.ax_, self.figure_ = self.axes_[0], self.axes_[0].figure
        self._draw(self.axes_, **{name.replace("-", "_"): t for name, t in self._tables.items()})
        return self

    @classmethod
    def from_predictions(
        cls,
        rate: ArrayLike,
        before: ArrayLike,
        after: ArrayLike,
        *,
        unit: str | None = None,
        ax: Any = None,
        **options: Any,
    ) -> Self:
        """Compute from rates, and draw.

        Parameters
        ----------
        rate, before, after : array-like of shape (n_rows,)
            True, indicated and compensated rate [deg/s]. NaN: the compensator refused the row.
        unit : {"deg/s", "deg/h"}, default=None
            Unit of the errors; None is that which is usual in this picture.
        ax : matplotlib axes or array of these, default=None
            Where to draw, one for each panel; None makes a figure.
        **options
            What the class describes.

        Returns
        -------
        display
            The display, drawn.
        """
        return cls.computed(rate, before, after, unit, **options).plot(ax)

    @classmethod
    def computed(
        cls,
        rate: ArrayLike,
        before: ArrayLike,
        after: ArrayLike,
        unit: str | None = None,
        **options: Any,
    ) -> Self:
        """The display from predictions, undrawn."""
        unit = cls._UNITS[0] if unit is None else unit
        if unit not in cls._UNITS:
            raise ValueError(f"unit={unit!r} must be one of {', '.join(cls._UNITS)}.")
        for name in cls._PER_ROW:
            if name not in options:
                raise TypeError(f"{cls.__name__} needs {name}, with one value per row.")
        names = [name for name in (*cls._PER_ROW, *cls._OPTIONAL) if name in options]
        columns = {"rate": rate, "before": before, "after": after}
        columns |= {name: options.pop(name) for name in names}
        rows = table_of(columns, labels=("run", "groups"), gaps=("before", "after"))
        for side in ("before", "after"):
            if rows[side].isna().all():
                raise ValueError(f"{side} is NaN in all rows: there is nothing to draw.")
        factor = RATE_UNITS.get(unit, 1.0)
        errors = {side: factor * (rows[side] - rows["rate"]) for side in ("before", "after")}
        return cls(cls._computed(rows.assign(**errors), unit, **options))

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: Any,
        rate: ArrayLike,
        *,
        output: str | ArrayLike = "output",
        predicts: str = "error",
        ax: Any = None,
        **options: Any,
    ) -> Self:
        """Compute from a fitted estimator, and draw.

        Parameters
        ----------
        estimator : estimator
            Fitted regressor; rows should be others than it was trained on.
        X : DataFrame of shape (n_rows, n_columns)
            What the estimator predicts from; it takes the columns that it was trained on.
        rate : array-like of shape (n_rows,)
            True rate [deg/s].
        output : str or array-like of shape (n_rows,), default="output"
            Indicated rate without compensation [deg/s], or the column of X that holds it.
        predicts : {"error", "rate"}, default="error"
            Whether the estimator predicts the error, indicated minus true rate, or the rate.
        ax : matplotlib axes or array of these, default=None
            Where to draw; None makes a figure.
        **options
            As for ``from_predictions``; in place of a value per row, the name of a column of X.

        Returns
        -------
        display
            The display, drawn.
        """
        if predicts not in ("error", "rate"):
            raise ValueError(f"predicts={predicts!r} must be one of error, rate.")
        before = np.asarray(X[output] if isinstance(output, str) else output, dtype=float)
        names = getattr(estimator, "feature_names_in_", None)
        predicted = estimator.predict(X if names is None else X[list(names)])
        for name in (*cls._PER_ROW, *cls._OPTIONAL):
            if isinstance(options.get(name), str):
                options[name] = X[options[name]]
        after = before - predicted if predicts == "error" else predicted
        return cls.from_predictions(rate, before, after, ax=ax, **options)

    def panels(self, make_figure: Callable[..., Any]) -> Any:
        """Axes of a new figure."""
        figure = make_figure(figsize=self._size(), layout="constrained")
        return figure.subplots(**self._PANELS)

    @property
    def _unit(self):
        """That of the errors, which stand in the last column."""
        *_, table = self._tables.values()
        return table.columns[-1].rpartition("[")[2].rstrip("]")

    def _size(self):
        return self._SIZE


def bins_of(values, n_bins):
    """The bin of each value, and the edges of equal bins over the values."""
    low, high = values.min(), values.max()
    edges = np.linspace(low, high if high > low else low + 1.0, n_bins + 1)
    return pd.cut(values, edges, labels=False, include_lowest=True), edges


def dress(axes, xlabel="", ylabel="", title="", legend=None):
    """Labels, a light grid, no box; ``legend`` is the title of one beside the panel."""
    axes.grid(True, color="0.9", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set(xlabel=signs(xlabel), ylabel=signs(ylabel))
    axes.set_title(signs(title), loc="left", fontsize="medium")
    if legend is not None:
        axes.legend(title=legend, **_BESIDE)


def signs(text):
    """Units with the signs that are usual in print."""
    for name, sign in _SIGNS:
        text = text.replace(name, sign)
    return text


def figures(value):
    """A number with three digits that count, without an exponent where it can be."""
    if value == 0 or not np.isfinite(value):
        return f"{value:g}"
    decimals = max(2 - int(np.floor(np.log10(abs(value)))), 0)
    return f"{value:,.{decimals}f}" if decimals < 8 else f"{value:.2e}"


def mark_decades(axis, low, high):
    """Numbers on a logarithmic axis as they are spoken: 0.01, 0.1, 1, not powers of ten."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    decades = np.log10(high / low)
    digits = (1, 2, 3, 5) if decades < 1.0 else (1, 3) if decades < 3.0 else (1,)
    axis.set_major_locator(LogLocator(subs=digits, numticks=8))
    form = FuncFormatter(lambda v, _: f"{v:,.0f}" if 100.0 <= v < 1e6 else f"{v:.3g}")
    axis.set_major_formatter(form)
    axis.set_minor_formatter(NullFormatter())
