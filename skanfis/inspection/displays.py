"""Pictures of a model: its terms, and its prediction over two inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import compress
from numbers import Real
from textwrap import fill
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from .._validation import check_count, checked_position
from ..antecedent import TreeAntecedent
from ..digits import rounded
from ..export import fold_with_rows
from ..export.columns import categories
from ..learning.data import never_changes
from .labels import as_label, on_axis, title_of
from .rules import has_training_data
from .sentences import PRECISION

# Points of a membership along its input, and bins of the data behind it.
_N_POINTS, BINS = 201, 30
# The brightest end of a colour map is hard to see on white.
BRIGHTEST = 0.85
# With more terms, a legend is longer than the picture is high.
_MOST_NAMED = 7
# Characters of a legend, or of a note below, that a panel has room for.
_LEGEND_WIDTH = 42
# Contours that can still be told apart by colour; relative range that counts as rounding errors.
_LEVELS, _FLAT = 15, 1e-12
# Below this coverage a prediction counts as extrapolated: it does not set the colours.
_COVERED = 0.5


class InputTerms(NamedTuple):
    """The terms of one input along its range."""

    input_name: str
    term_names: tuple[str, ...]
    grid: np.ndarray  # (n_points,)
    before: np.ndarray  # memberships before training, (n_terms, n_points)
    after: np.ndarray  # and after it
    edges: np.ndarray | None  # of the bins of the data, (n_bins + 1,)
    counts: np.ndarray | None  # rows in each bin, (n_bins,)


@dataclass(kw_only=True, eq=False, repr=False)
class MembershipDisplay:
    """Membership functions before and after training, over a histogram of the data.

    ``axes_`` (n_inputs,) and ``figure_`` are matplotlib's, once drawn.

    Parameters
    ----------
    inputs : list of objects with attributes
        ``input_name``, ``term_names``, a ``grid`` of values, the memberships ``before`` and
        ``after`` training, (n_terms, n_points), ``edges`` and ``counts`` of the histogram, or None.
        For the cuts of a tree, only the sides above are drawn.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import MembershipDisplay
    >>> model = ANFISRegressor(n_mfs=3).fit(*make_jang_sinc())
    >>> display = MembershipDisplay.from_estimator(model)
    >>> display.inputs[0].term_names
    ('low', 'medium', 'high')
    """

    inputs: Any

    @classmethod
    def from_estimator(cls, estimator: Any, X: ArrayLike | None = None, *, ax: Any = None) -> Self:
        """Draw the memberships of a fitted estimator.

        Parameters
        ----------
        estimator : fitted estimator or TSKModel
            As for :func:`skanfis.export.fold`; units are those of a pipeline's input.
        X : array-like of shape (n_samples, n_features), default=None
            Data whose histogram lies behind the memberships.
        ax : matplotlib Axes or sequence of Axes, default=None
            One for each input with terms; None makes a figure.
        """
        model, rows = fold_with_rows(estimator, X)
        with_terms = np.unique(model.antecedent.term_inputs).tolist()
        if not with_terms:
            raise ValueError("The model has no fuzzy terms, so there is nothing to draw.")
        return cls(inputs=[_terms_on(model, j, rows) for j in with_terms]).plot(ax=ax)

    def plot(self, *, ax: Any = None) -> Self:
        """Draw the memberships on ``ax``, as of :meth:`from_estimator`."""
        data = "" if self.inputs[0].counts is None else "; grey: data"
        self.axes_ = panels_or_new(ax, len(self.inputs), f"dashed: before training{data}")
        self.figure_ = self.axes_[0].figure
        for terms, axes in zip(self.inputs, self.axes_, strict=True):
            _draw_terms(axes, terms)
        return self


def _terms_on(model, j, rows):
    grid = np.linspace(model.minimum[j], model.maximum[j], _N_POINTS)
    own = np.flatnonzero(model.antecedent.term_inputs == j)
    if isinstance(model.antecedent, TreeAntecedent):
        # Draw only the side above a cut; the side below is one minus that.
        own = own[own < model.antecedent.n_nodes]
    # Equal terms of several rules or cuts share a name.
    _, first = np.unique([model.term_names[t] for t in own], return_index=True)
    own = own[np.sort(first)]
    Z = np.zeros((model.n_inputs, _N_POINTS))
    Z[j] = grid
    names = tuple(model.term_names[t] for t in own)
    before = np.exp(model.initial_antecedent.log_memberships(Z)[own])
    after = np.exp(model.antecedent.log_memberships(Z)[own])
    counts, edges = (None, None) if rows is None else np.histogram(rows[:, j], BINS)
    return InputTerms(model.input_names[j], names, grid, before, after, edges, counts)


def _draw_terms(axes, terms):
    names = [as_label(name) for name in terms.term_names]
    if terms.counts is not None:
        heights = terms.counts / max(terms.counts.max(), 1)
        axes.stairs(heights, terms.edges, fill=True, color="0.9", zorder=0)
    # Shades follow the places of terms: scattered terms come in the order of their rules.
    places = terms.after @ terms.grid / terms.after.sum(axis=1)
    shades = pyplot().get_cmap()(np.linspace(0.0, BRIGHTEST, len(names)))
    for t, shade in zip(np.argsort(places, kind="stable"), shades, strict=True):
        axes.plot(terms.grid, terms.before[t], "--", color=shade, linewidth=1.0, alpha=0.7)
        axes.plot(terms.grid, terms.after[t], color=shade, linewidth=1.8, label=names[t])
    axes.set(xlabel=on_axis(terms.input_name), ylabel="membership", ylim=(0.0, 1.05))
    axes.set_xlim(terms.grid[0], terms.grid[-1])
    if len(names) <= _MOST_NAMED:
        columns = max(_LEGEND_WIDTH // (max(map(len, names)) + 5), 1)
        place = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "borderaxespad": 0.1}
        axes.legend(ncols=columns, fontsize="small", frameon=False, handlelength=1.2, **place)


@dataclass(kw_only=True, eq=False, repr=False)
class ResponseSurfaceDisplay:
    """Prediction over two inputs with the others held; it fades where no data cover it.

    ``ax_``, ``figure_`` and ``surface_`` are matplotlib's, once drawn.

    Parameters
    ----------
    xx0, xx1, response, coverage : ndarray of shape (grid_resolution, grid_resolution)
        Values of the two inputs, as of ``numpy.meshgrid``, the prediction, and how well the
        training data cover each point, from 0 to 1; 1 if they are not known.
    input_names, output_name : tuple of two str, str
        Names of the two inputs and of the output.
    held : dict
        Value of every other input by its name; the level of a category by its column's.
    points : ndarray of shape (n_samples, 2), default=None
        Rows of data on these inputs.
    strongest : ndarray of shape (grid_resolution, grid_resolution), default=None
        The rule that is the strongest at each point; lines show where it changes.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import ResponseSurfaceDisplay
    >>> model = ANFISRegressor(n_mfs=4).fit(*make_jang_sinc())
    >>> display = ResponseSurfaceDisplay.from_estimator(model)
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
    strongest: np.ndarray | None = None

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: ArrayLike | None = None,
        features: Any = (0, 1),
        *,
        held: dict[str, Any] | None = None,
        output: int | str = 0,
        grid_resolution: int = 60,
        show_rules: bool = False,
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
            Inputs across and up; values of the others, by default the mean, or the commonest case
            of a category or of an input that is 0 or 1; which output.
        grid_resolution : int, default=60
            Points on each axis, 2 or more.
        show_rules : bool, default=False
            Whether lines show where another rule becomes the strongest.
        ax : matplotlib Axes, default=None
            None makes a figure.
        """
        check_count("grid_resolution", grid_resolution, 2)
        model, points = fold_with_rows(estimator, X)
        if np.size(features) != 2:
            raise ValueError(f"features={features!r} must name two inputs.")
        if model.n_inputs == 1:
            raise ValueError(
                "The model has one input, but a surface needs two: plot its predictions as a curve."
            )
        both = [checked_position(feature, model.input_names) for feature in features]
        if both[0] == both[1]:
            raise ValueError(f"features={features!r} names the same input twice.")
        for j in both:
            if never_changes(model.minimum[j], model.maximum[j]):
                raise ValueError(
                    f"features={features!r}: {model.input_names[j]!r} is constant in the training "
                    f"data (always {model.minimum[j]:g}). Name two inputs that vary."
                )
        k = checked_position(output, model.output_names, "output")
        (xx0, xx1), rows, others = _section(model, both, grid_resolution, held)
        coverage = np.ones(len(rows)) if model.support is None else model.coverage(rows)
        strongest = model.strengths(rows).argmax(axis=1).reshape(xx0.shape) if show_rules else None
        display = cls(
            xx0=xx0,
            xx1=xx1,
            response=model.predict(rows)[:, k].reshape(xx0.shape),
            coverage=coverage.reshape(xx0.shape),
            input_names=tuple(model.input_names[j] for j in both),
            output_name=model.output_names[k],
            held=others,
            points=None if points is None else points[:, both],
            strongest=strongest,
        )
        return display.plot(ax=ax)

    def plot(self, *, ax: Any = None) -> Self:
        """Draw the surface on ``ax``, as of :meth:`from_estimator`."""
        ax = self.ax_ = axes_or_new(ax)
        self.figure_ = ax.figure
        x, y = self.xx0[0], self.xx1[:, 0]
        seen = self.response[self.coverage >= _COVERED]
        seen = seen if seen.size > 1 else self.response
        low, high = np.min(seen), np.max(seen)
        # A surface that is flat but for rounding gets a scale around its value.
        room = 0.0 if high - low > _FLAT * max(-low, high) else 0.1 * max(-low, high) or 1.0
        levels = pyplot().MaxNLocator(_LEVELS).tick_values(low - room, high + room)
        self.surface_ = ax.contourf(x, y, self.response, levels=levels, extend="both")
        self.figure_.colorbar(self.surface_, ax=ax, label=on_axis(self.output_name))
        # White over the surface, below the points, fades it where few data cover it.
        white = np.ones((*self.coverage.shape, 4))
        white[..., 3] = 0.85 * np.clip(1.0 - self.coverage, 0.0, 1.0)
        ax.pcolormesh(x, y, white, zorder=1.5)
        # Lines around each rule but the first: the rest is the first's.
        for rule in () if self.strongest is None else np.unique(self.strongest)[1:]:
            is_here = 1.0 * (self.strongest == rule)
            ax.contour(x, y, is_here, levels=[0.5], colors="black", linewidths=1.0)
        if self.points is not None:
            ax.plot(*self.points.T, ".", color="black", markersize=2, alpha=0.5)
        first, second = map(on_axis, self.input_names)
        ax.set(xlabel=first, ylabel=second, xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
        notes = ["pale: few training data"] if np.any(self.coverage < _COVERED) else []
        notes += [] if self.strongest is None else ["lines: another rule becomes the strongest"]
        ax.set_title(title_of(self.held, *notes), fontsize="small", loc="left")
        return self


def axes_or_new(ax, figsize=(5.6, 4.2)):
    """The given axes, or those of a new figure."""
    return spaced(pyplot().subplots(figsize=figsize, layout="constrained")[1]) if ax is None else ax


def panels_or_new(ax, count, note):
    """An array of ``count`` axes: the given ones, or those of a new figure with a note below."""
    if ax is not None:
        axes = np.ravel(ax)
        if axes.size != count:
            raise ValueError(f"ax holds {axes.size} Axes, not {count}: give one per panel.")
        return axes
    columns = min(3, count)
    rows = -(-count // columns)
    figure = pyplot().figure(figsize=(3.2 * columns, 2.6 * rows), layout="constrained")
    figure.supxlabel(fill(note, _LEGEND_WIDTH * columns), fontsize="small", color="0.4")
    return np.array([spaced(figure.add_subplot(rows, columns, i + 1)) for i in range(count)])


def spaced(axes):
    """The axes with few numbers along x: more, of six letters each, run into one another."""
    axes.locator_params("x", nbins=4)
    return axes


def pyplot():
    """The module matplotlib.pyplot; the ImportError says what to install."""
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError(
            "Displays are drawn with matplotlib: pip install matplotlib (or the extra 'plot'; in a "
            "clone, pip install '.[plot]')."
        ) from error
    return plt


def mark_decades(axis):
    """Label a logarithmic axis with plain numbers, 0.01, 0.1, 1, not with powers of ten."""
    from matplotlib.ticker import LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    decades = np.log10(high / low)
    digits = (1, 2, 3, 5) if decades < 1.0 else (1, 2, 5) if decades < 3.0 else (1,)
    axis.set_major_locator(LogLocator(subs=digits, numticks=8))
    axis.set_major_formatter("{x:,g}")
    axis.set_minor_formatter(NullFormatter())


def _section(model, both, n_points, held):
    """A grid over two inputs, its rows with the others held, and the others' values by name.

    The others take their value in ``held``, or their mean in training, in few digits. An input that
    is 0 or 1, and a category, take the commonest case. Without training data, the others take the
    middle of their range.
    """
    mean = model.reference if has_training_data(model) else 0.5 * (model.minimum + model.maximum)
    row = np.clip(rounded(mean, model.spread, PRECISION), model.minimum, model.maximum)
    row = np.where(model.two_valued, np.round(row), row)
    held = {} if held is None else held
    if not isinstance(held, Mapping):
        raise TypeError(f"held must be a dict from inputs to values; got {held!r}.")
    names, columns = model.input_names, categories(model)
    taken = {*both, *(checked_position(feature, names) for feature in held)}
    for one in columns.values():
        # Hold the commonest level, unless a level is already drawn or held.
        row[one.inputs] = 0.0
        share = model.reference[one.inputs]
        if taken.isdisjoint(one.inputs) and share.max() >= 1.0 - share.sum():
            row[one.inputs[int(share.argmax())]] = 1.0
    for feature, value in held.items():
        j = checked_position(feature, model.input_names)
        if j in both:
            raise ValueError(f"held[{feature!r}] fixes an input that is drawn: leave it out.")
        low, high = model.minimum[j], model.maximum[j]
        if not isinstance(value, Real) or not low <= value <= high:
            raise ValueError(
                f"held[{feature!r}]={value!r} must be a number within the range of the training "
                f"data, from {low:.6g} to {high:.6g}."
            )
        row[j] = value
    grid = np.meshgrid(*np.linspace(model.minimum[both], model.maximum[both], n_points).T)
    rows = np.tile(row, (n_points**2, 1))
    rows[:, both] = np.stack(grid, axis=-1).reshape(-1, 2)
    others: dict[str, Any] = {name: float(row[j]) for j, name in enumerate(names) if j not in both}
    for column, one in columns.items():
        if not {*both} & {*one.inputs}:
            values = [others.pop(names[j]) for j in one.inputs]
            others[column] = [*compress(one.levels, values), *one.others, "other"][0]
    return grid, rows, others
