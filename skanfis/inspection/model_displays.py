"""Pictures of a model: its terms, and its prediction over two inputs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from .._validation import check_choice, check_count
from ..export import fold, fold_with_rows
from ._display import COVERED, Display, colors, panels, position, section
from .labels import as_label

__all__ = ["MembershipDisplay", "ResponseSurfaceDisplay"]

# Beyond so many terms, a legend is longer than the picture is high.
_MOST_NAMED = 7
# Characters of a legend that a panel has room for.
_LEGEND_WIDTH = 42
# Contours that can still be told apart by colour.
_LEVELS = 15


class InputTerms(NamedTuple):
    """The terms of one input along its range."""

    input_name: str
    term_names: tuple[str, ...]
    grid: np.ndarray  # (n_points,)
    before: np.ndarray  # (n_terms, n_points), as after
    after: np.ndarray
    edges: np.ndarray | None  # of the bins of the data, (n_bins + 1,)
    counts: np.ndarray | None  # rows in each bin, (n_bins,)


@dataclass(kw_only=True, eq=False, repr=False)
class MembershipDisplay(Display):
    """Membership functions before and after training, over a histogram of the data.

    ``axes_`` (n_inputs,) and ``figure_`` are matplotlib's, once drawn.

    Parameters
    ----------
    inputs : list of InputTerms
        For each input "input_name", "term_names", a "grid" of values, the memberships "before" and
        "after" training, (n_terms, n_points), "edges" and "counts" of the histogram, or None.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import MembershipDisplay
    >>> X, y = make_jang_sinc()
    >>> display = MembershipDisplay.from_estimator(ANFISRegressor(n_mfs=3).fit(X, y), X)
    >>> display.inputs[0].term_names
    ('low', 'medium', 'high')
    """

    inputs: Any

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: ArrayLike | None = None,
        *,
        features: Sequence[int] | str | None = None,
        n_points: int = 201,
        bins: int = 30,
        show_before: bool = True,
        colormap: str = "viridis",
        ax: Any = None,
    ) -> Self:
        """Draw the memberships of a fitted estimator.

        Parameters
        ----------
        estimator : fitted estimator or TSKModel
            As :func:`skanfis.export.fold` takes it; the units are those of a pipeline's input.
        X : array-like of shape (n_samples, n_features), default=None
            Data whose histogram lies behind the memberships.
        features : sequence of int or str, default=None
            Inputs to draw, by position or name; None is all that have terms.
        n_points, bins : int, default=201 and 30
            Points of each curve, 2 or more, and bins of the histogram.
        show_before : bool, default=True
            Whether to draw the memberships before training, dashed.
        colormap : str, default="viridis"
            Colours of the terms, from the lowest to the highest.
        ax : matplotlib Axes or sequence of Axes, default=None
            One for each input; None makes a figure.
        """
        check_count("n_points", n_points, 2)
        check_count("bins", bins, 1)
        model, rows = (fold(estimator), None) if X is None else fold_with_rows(estimator, X)
        with_terms = np.unique(model.antecedent.term_inputs).tolist()
        if not with_terms:
            raise ValueError("The model has no terms: nothing to draw.")
        names = model.input_names
        chosen = with_terms if features is None else [position(j, names) for j in features]
        for j in chosen:
            if j not in with_terms:
                raise ValueError(f"Input {names[j]!r} has no terms.")
        display = cls(inputs=[_terms_on(model, j, n_points, rows, bins) for j in chosen])
        return display.plot(ax=ax, show_before=show_before, colormap=colormap)

    def plot(self, *, show_before: bool = True, colormap: str = "viridis", ax: Any = None) -> Self:
        """Draw the memberships; parameters are those of :meth:`from_estimator`."""
        self.axes_ = panels(ax, len(self.inputs))
        self.figure_ = self.axes_[0].figure
        for terms, axes in zip(self.inputs, self.axes_, strict=True):
            _draw_terms(axes, terms, show_before, colormap)
        if ax is None:
            notes = ["dashed: before training"] if show_before else []
            notes += ["grey: data"] if self.inputs[0].counts is not None else []
            self.figure_.supxlabel("; ".join(notes), fontsize="small", color="0.4")
        return self


def _terms_on(model, j, n_points, rows, bins):
    grid = np.linspace(model.minimum[j], model.maximum[j], n_points)
    own = np.flatnonzero(model.antecedent.term_inputs == j)
    Z = np.zeros((model.n_inputs, n_points))
    Z[j] = grid
    names = tuple(model.term_names[t] for t in own)
    before = np.exp(model.initial_antecedent.log_memberships(Z)[own])
    after = np.exp(model.antecedent.log_memberships(Z)[own])
    counts, edges = (None, None) if rows is None else np.histogram(rows[:, j], bins)
    return InputTerms(model.input_names[j], names, grid, before, after, edges, counts)


def _draw_terms(axes, terms, show_before, colormap):
    names = [as_label(name) for name in terms.term_names]
    if terms.counts is not None:
        heights = terms.counts / max(terms.counts.max(), 1)
        axes.stairs(heights, terms.edges, fill=True, color="0.9", zorder=0)
    # Colours in the order of places: scattered terms come in the order of their rules.
    rank = np.argsort(np.argsort(terms.after.argmax(axis=1), kind="stable"))
    shades = colors(len(names), colormap)[rank]
    for name, before, after, shade in zip(names, terms.before, terms.after, shades, strict=True):
        if show_before:
            axes.plot(terms.grid, before, "--", color=shade, linewidth=1.0, alpha=0.7)
        axes.plot(terms.grid, after, color=shade, linewidth=1.8, label=name)
    axes.set(xlabel=as_label(terms.input_name), ylabel="membership", ylim=(0.0, 1.05))
    axes.set_xlim(terms.grid[0], terms.grid[-1])
    if len(names) <= _MOST_NAMED:
        columns = max(_LEGEND_WIDTH // (max(map(len, names)) + 5), 1)
        place = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "borderaxespad": 0.1}
        axes.legend(ncols=columns, fontsize="small", frameon=False, handlelength=1.2, **place)


@dataclass(kw_only=True, eq=False, repr=False)
class ResponseSurfaceDisplay(Display):
    """Prediction over two inputs with the rest held; it fades where no data cover it.

    ``ax_``, ``figure_`` and ``surface_`` are matplotlib's, once drawn.

    Parameters
    ----------
    xx0, xx1, response, coverage : ndarray of shape (grid_resolution, grid_resolution)
        Values of the two inputs, as of ``numpy.meshgrid``, the prediction, and how well the
        training data cover each point, from 0 to 1; 1 where none are known.
    input_names, output_name : tuple of two str, str
        Names of the two inputs and of the output.
    held : dict
        Value of every other input by its name.
    points : ndarray of shape (n_samples, 2), default=None
        Rows of data on these inputs.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import ResponseSurfaceDisplay
    >>> X, y = make_jang_sinc()
    >>> display = ResponseSurfaceDisplay.from_estimator(ANFISRegressor(n_mfs=4).fit(X, y), X)
    >>> display.response.shape
    (60, 60)
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
            Rows to show as points.
        features, held, output : pair of int or str, dict, int or str
            Inputs across and up; values of others, by default their mean; which output.
        grid_resolution : int, default=60
            Points on each axis, 2 or more.
        plot_method : {"contourf", "pcolormesh"}, default="contourf"
            Bands with lines between them, or a colour per point.
        colormap : str, default="viridis"
            Colours of the prediction.
        ax : matplotlib Axes, default=None
            None makes a figure.
        """
        check_count("grid_resolution", grid_resolution, 2)
        model, points = (fold(estimator), None) if X is None else fold_with_rows(estimator, X)
        if isinstance(features, str) or len(features) != 2:
            raise ValueError(f"features={features!r} must be two inputs.")
        if model.n_inputs == 1:
            raise ValueError(
                "The model has one input, and a surface takes two: RuleContributionDisplay draws "
                "the prediction along one."
            )
        both = [position(feature, model.input_names) for feature in features]
        if both[0] == both[1]:
            raise ValueError(f"features={features!r} is the same input twice.")
        k = position(output, model.output_names, "output")
        ends = model.minimum[both], model.maximum[both]
        xx0, xx1 = np.meshgrid(*np.linspace(*ends, grid_resolution).T)
        values = np.column_stack([xx0.ravel(), xx1.ravel()])
        rows, others, coverage = section(model, both, values, held)
        display = cls(
            xx0=xx0,
            xx1=xx1,
            response=model.predict(rows)[:, k].reshape(xx0.shape),
            coverage=coverage.reshape(xx0.shape),
            input_names=tuple(model.input_names[j] for j in both),
            output_name=model.output_names[k],
            held=others,
            points=None if points is None else points[:, both],
        )
        return display.plot(plot_method=plot_method, colormap=colormap, ax=ax)

    def plot(
        self, *, plot_method: str = "contourf", colormap: str = "viridis", ax: Any = None
    ) -> Self:
        """Draw the surface; parameters are those of :meth:`from_estimator`."""
        check_choice("plot_method", plot_method, ("contourf", "pcolormesh"))
        axes = self._begin(ax)
        x, y = self.xx0[0], self.xx1[:, 0]
        grid = (x, y, self.response)
        # Extrapolation shall not set the colours.
        seen = self.response[self.coverage >= COVERED]
        seen = seen if seen.size > 1 else self.response
        low, high = np.min(seen), np.max(seen)
        if plot_method == "contourf":
            from matplotlib.ticker import MaxNLocator

            levels = MaxNLocator(_LEVELS).tick_values(low, high) if high > low else None
            self.surface_ = axes.contourf(*grid, levels=levels, cmap=colormap, extend="both")
        else:
            self.surface_ = axes.pcolormesh(*grid, vmin=low, vmax=high, cmap=colormap)
        self.figure_.colorbar(self.surface_, ax=axes, label=as_label(self.output_name))
        # White over the surface, the thicker the less data cover it; under the points.
        white = np.ones((*self.coverage.shape, 4))
        white[..., 3] = 0.85 * np.clip(1.0 - self.coverage, 0.0, 1.0)
        axes.pcolormesh(x, y, white, zorder=1.5)
        if self.points is not None:
            axes.plot(*self.points.T, ".", color="black", markersize=2, alpha=0.5)
        first, second = map(as_label, self.input_names)
        axes.set(xlabel=first, ylabel=second, xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
        is_pale = np.any(self.coverage < COVERED)
        self._note(self.held, *(["pale: few training data"] if is_pale else []))
        return self
