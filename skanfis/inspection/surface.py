"""The prediction over two inputs, the rest held."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from .._validation import check_choice, check_count
from ..export import fold, fold_with_rows
from ._common import COVERED, coverage_if_known, held_row, one_axes, position
from .labels import as_label

__all__ = ["ResponseSurfaceDisplay"]

_PLOT_METHODS = ("contourf", "pcolormesh")
# Contours that can still be told apart by colour.
_LEVELS = 15


@dataclass(kw_only=True, eq=False, repr=False)
class ResponseSurfaceDisplay:
    """Prediction over two inputs with the rest held; it fades where no data cover it.

    Make it with :meth:`from_estimator`; parameters are stored as attributes.

    Parameters
    ----------
    xx0, xx1 : ndarray of shape (grid_resolution, grid_resolution)
        Values of the two inputs, as of ``numpy.meshgrid``.
    response : ndarray of shape (grid_resolution, grid_resolution)
        Prediction there.
    coverage : ndarray of shape (grid_resolution, grid_resolution)
        How well the training data cover each point, from 0 to 1; 1 for a model that was read from a
        file without data.
    input_names : tuple of str
        Names of the two inputs.
    output_name : str
        Name of the output.
    held : dict
        Value of every other input by its name.
    points : ndarray of shape (n_samples, 2), default=None
        Rows of data on these inputs.

    Attributes
    ----------
    figure_, ax_ : matplotlib Figure, matplotlib Axes
        Once drawn.
    surface_ : matplotlib ContourSet or QuadMesh
        The surface, once drawn.

    See Also
    --------
    sklearn.inspection.PartialDependenceDisplay : The same averaged over the other inputs.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import ResponseSurfaceDisplay
    >>> X, y = make_jang_sinc()
    >>> display = ResponseSurfaceDisplay.from_estimator(ANFISRegressor(n_mfs=4).fit(X, y), X)
    >>> display.response.shape
    (60, 60)
    >>> display.held
    {}
    """

    xx0: np.ndarray
    xx1: np.ndarray
    response: np.ndarray
    coverage: np.ndarray
    input_names: Sequence[str]
    output_name: str
    held: dict[str, Any]
    points: np.ndarray | None = None

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: ArrayLike | None = None,
        *,
        features: Any = (0, 1),
        held: dict[str, Any] | None = None,
        output: int | str = 0,
        grid_resolution: int = 60,
        plot_method: str = "contourf",
        colormap: str = "viridis",
        ax: Any = None,
    ) -> Self:
        """Draw the prediction of a fitted estimator over the range of two inputs.

        Parameters
        ----------
        estimator : fitted estimator or TSKModel
            As :func:`skanfis.export.fold` takes it.
        X : array-like of shape (n_samples, n_features), default=None
            Rows to show as points, wherever they lie on the inputs that are held.
        features : pair of int or str, default=(0, 1)
            The inputs across and up, by position or name.
        held : dict, default=None
            Values of other inputs, by position or name; those not named are held at their mean in
            training; in a model that knows of no data, at the middle of their range.
        output : int or str, default=0
            Which output, by position or name.
        grid_resolution : int, default=60
            Points on each axis, 2 or more.
        plot_method : {"contourf", "pcolormesh"}, default="contourf"
            Bands with lines between them, or a colour per point.
        colormap : str, default="viridis"
            Colours of the prediction.
        ax : matplotlib Axes, default=None
            Where to draw; None makes a figure.

        Returns
        -------
        display : ResponseSurfaceDisplay

        Raises
        ------
        ValueError
            If ``features`` are not two different inputs, there is no such output, ``held`` lies
            outside the training range, or the model has one input.
        TypeError
            If ``estimator`` has no rules.
        ImportError
            Without matplotlib.
        """
        check_count("grid_resolution", grid_resolution, 2)
        model, table = (fold(estimator), None) if X is None else fold_with_rows(estimator, X)
        if isinstance(features, str) or len(features) != 2:
            raise ValueError(f"features={features!r} must be two inputs.")
        if model.n_inputs == 1:
            raise ValueError(
                "The model has one input, and a surface takes two: RuleContributionDisplay draws "
                "the prediction along one."
            )
        first, second = (position(feature, model.input_names) for feature in features)
        if first == second:
            raise ValueError(f"features={features!r} is the same input twice.")
        k = position(output, model.output_names, "output")
        xx0, xx1 = np.meshgrid(
            *(
                np.linspace(model.minimum[j], model.maximum[j], grid_resolution)
                for j in (first, second)
            )
        )
        row = held_row(model, held)
        rows = np.tile(row, (xx0.size, 1))
        rows[:, first], rows[:, second] = xx0.ravel(), xx1.ravel()
        others = [j for j in range(model.n_inputs) if j not in (first, second)]
        display = cls(
            xx0=xx0,
            xx1=xx1,
            response=model.predict(rows)[:, k].reshape(xx0.shape),
            coverage=coverage_if_known(model, rows).reshape(xx0.shape),
            input_names=(model.input_names[first], model.input_names[second]),
            output_name=model.output_names[k],
            held={model.input_names[j]: float(row[j]) for j in others},
            points=None if table is None else table[:, [first, second]],
        )
        return display.plot(plot_method=plot_method, colormap=colormap, ax=ax)

    def plot(
        self, *, plot_method: str = "contourf", colormap: str = "viridis", ax: Any = None
    ) -> Self:
        """Draw the surface.

        Parameters
        ----------
        plot_method, colormap, ax
            As :meth:`from_estimator` takes them.

        Returns
        -------
        display : ResponseSurfaceDisplay

        Raises
        ------
        ValueError
            If there is no such ``plot_method``.
        ImportError
            Without matplotlib.
        """
        check_choice("plot_method", plot_method, _PLOT_METHODS)
        self.ax_ = one_axes(ax)
        self.figure_ = self.ax_.figure
        grid = (self.xx0, self.xx1, self.response)
        low, high = self._range_covered()
        if plot_method == "contourf":
            from matplotlib.ticker import MaxNLocator

            levels = MaxNLocator(_LEVELS).tick_values(low, high) if high > low else None
            self.surface_ = self.ax_.contourf(*grid, levels=levels, cmap=colormap, extend="both")
        else:
            self.surface_ = self.ax_.pcolormesh(
                *grid, vmin=low, vmax=high, cmap=colormap, shading="nearest"
            )
        self.figure_.colorbar(self.surface_, ax=self.ax_, label=as_label(self.output_name))
        self._fade()
        if self.points is not None:
            self.ax_.plot(*self.points.T, ".", color="black", markersize=2, alpha=0.5)
        x, y = self.xx0[0], self.xx1[:, 0]
        self.ax_.set(
            xlabel=as_label(self.input_names[0]),
            ylabel=as_label(self.input_names[1]),
            xlim=(x[0], x[-1]),
            ylim=(y[0], y[-1]),
        )
        notes = [f"{as_label(name)} = {value:.4g}" for name, value in self.held.items()]
        if np.any(self.coverage < COVERED):
            notes.append("pale: few training data")
        self.ax_.set_title("; ".join(notes), fontsize="small", loc="left")
        return self

    def _range_covered(self):
        """Range of the prediction where data are: extrapolation shall not set the colours."""
        seen = self.response[self.coverage >= COVERED]
        if self.points is not None:
            x, y = self.xx0[0], self.xx1[:, 0]
            i = np.rint((self.points[:, 1] - y[0]) / (y[1] - y[0])).astype(int)
            j = np.rint((self.points[:, 0] - x[0]) / (x[1] - x[0])).astype(int)
            on_grid = (i >= 0) & (i < y.size) & (j >= 0) & (j < x.size)
            seen = self.response[i[on_grid], j[on_grid]]
        seen = seen if seen.size > 1 else self.response
        return np.min(seen), np.max(seen)

    def _fade(self):
        """Lay white over the surface, the thicker the less the data cover it."""
        white = np.ones((*self.coverage.shape, 4))
        white[..., 3] = 0.85 * np.clip(1.0 - self.coverage, 0.0, 1.0)
        x, y = self.xx0[0], self.xx1[:, 0]
        half = 0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0])
        extent = (x[0] - half[0], x[-1] + half[0], y[0] - half[1], y[-1] + half[1])
        # Above the surface (1) and under the points (2).
        self.ax_.imshow(white, extent=extent, origin="lower", aspect="auto", zorder=1.5)
