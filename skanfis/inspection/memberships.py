"""Membership functions before and after training, over the data."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from .._validation import check_count
from ..export import fold, fold_with_rows
from ._common import colors, panels, position
from .labels import as_label

__all__ = ["InputTerms", "MembershipDisplay"]

# Beyond so many terms, a legend is longer than the picture is high.
_MOST_NAMED = 7
# Characters of a legend that a panel has room for; line and gaps take so many per name.
_LEGEND_WIDTH, _LEGEND_GAP = 42, 5


class InputTerms(NamedTuple):
    """The terms of one input along its range."""

    input_name: str
    term_names: tuple[str, ...]
    grid: np.ndarray  # (n_points,)
    before: np.ndarray  # (n_terms, n_points)
    after: np.ndarray  # (n_terms, n_points)
    edges: np.ndarray | None  # of the bins of the data, (n_bins + 1,)
    counts: np.ndarray | None  # rows in each bin, (n_bins,)


@dataclass(kw_only=True, eq=False, repr=False)
class MembershipDisplay:
    """Membership functions before and after training, over a histogram of the data.

    Make it with :meth:`from_estimator`; parameters are stored as attributes.

    Parameters
    ----------
    inputs : list of InputTerms
        For each input its "input_name", the "term_names", a "grid" of values, the memberships
        "before" and "after" training at these, of shape (n_terms, n_points), and the "edges" and
        "counts" of the data's histogram, or None.

    Attributes
    ----------
    figure_, axes_ : matplotlib Figure, ndarray of matplotlib Axes of shape (n_inputs,)
        The figure and its panels, once drawn.

    See Also
    --------
    skanfis.inspection.memberships_table : The parameters in figures.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import MembershipDisplay
    >>> X, y = make_jang_sinc()
    >>> model = ANFISRegressor(n_mfs=3).fit(X, y)
    >>> display = MembershipDisplay.from_estimator(model, X)
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
        n_points : int, default=201
            Points of each curve, 2 or more.
        bins : int, default=30
            Bins of the histogram, 1 or more.
        show_before : bool, default=True
            Whether to draw the memberships before training, dashed.
        colormap : str, default="viridis"
            Colours of the terms, from the lowest to the highest.
        ax : matplotlib Axes or sequence of Axes, default=None
            Where to draw: None makes a figure; one axes is divided; a sequence has one per input.

        Returns
        -------
        display : MembershipDisplay

        Raises
        ------
        ValueError
            If the model, or an input asked for, has no terms, or X has other columns than in
            training.
        TypeError
            If ``estimator`` has no rules.
        ImportError
            Without matplotlib.
        """
        check_count("n_points", n_points, 2)
        check_count("bins", bins, 1)
        model, rows = (fold(estimator), None) if X is None else fold_with_rows(estimator, X)
        with_terms = sorted({int(j) for group in model.antecedent.groups for j in group.inputs})
        if not with_terms:
            raise ValueError("The model has no terms: nothing to draw.")
        chosen = with_terms
        if features is not None:
            chosen = [position(feature, model.input_names) for feature in features]
            for j in chosen:
                if j not in with_terms:
                    raise ValueError(f"Input {model.input_names[j]!r} has no terms.")
        display = cls(inputs=[_terms_on(model, j, n_points, rows, bins) for j in chosen])
        return display.plot(ax=ax, show_before=show_before, colormap=colormap)

    def plot(self, *, show_before: bool = True, colormap: str = "viridis", ax: Any = None) -> Self:
        """Draw the memberships.

        Parameters
        ----------
        show_before, colormap, ax
            As :meth:`from_estimator` takes them.

        Returns
        -------
        display : MembershipDisplay
        """
        self.axes_ = panels(ax, len(self.inputs))
        self.figure_ = self.axes_[0].figure
        for one, axes in zip(self.inputs, self.axes_, strict=True):
            _draw(axes, one, show_before, colormap)
        if ax is None:
            told = ["dashed: before training"] if show_before else []
            told += ["grey: data"] if self.inputs[0].counts is not None else []
            self.figure_.supxlabel("; ".join(told), fontsize="small", color="0.4")
        return self


def _terms_on(model, j, n_points, rows, bins):
    """The terms of input j over the box of the training data."""
    grid = np.linspace(model.minimum[j], model.maximum[j], n_points)
    own = np.flatnonzero(model.antecedent.term_inputs == j)
    Z = np.zeros((model.n_inputs, n_points))
    Z[j] = grid
    edges = counts = None
    if rows is not None:
        counts, edges = np.histogram(rows[:, j], bins)
    return InputTerms(
        model.input_names[j],
        tuple(model.term_names[t] for t in own),
        grid,
        np.exp(model.initial_antecedent.log_memberships(Z)[own]),
        np.exp(model.antecedent.log_memberships(Z)[own]),
        edges,
        counts,
    )


def _draw(axes, terms, show_before, colormap):
    if terms.counts is not None:
        heights = terms.counts / max(terms.counts.max(), 1)
        axes.stairs(heights, terms.edges, fill=True, color="0.9", zorder=0)
    # Colours in the order of places: scattered terms come in the order of their rules.
    rank = np.argsort(np.argsort(terms.after.argmax(axis=1), kind="stable"))
    shades = colors(len(terms.term_names), colormap)[rank]
    for name, before, after, shade in zip(
        terms.term_names, terms.before, terms.after, shades, strict=True
    ):
        if show_before:
            axes.plot(terms.grid, before, "--", color=shade, linewidth=1.0, alpha=0.7)
        axes.plot(terms.grid, after, color=shade, linewidth=1.8, label=as_label(name))
    axes.set(xlabel=as_label(terms.input_name), ylabel="membership", ylim=(0.0, 1.05))
    axes.set_xlim(terms.grid[0], terms.grid[-1])
    if len(terms.term_names) <= _MOST_NAMED:
        axes.legend(
            loc="lower center",
            bbox_to_anchor=(0.5, 1.0),
            ncols=_legend_columns(terms.term_names),
            frameon=False,
            fontsize="small",
            handlelength=1.2,
            columnspacing=1.0,
            borderaxespad=0.1,
        )


def _legend_columns(names):
    """As many columns as there is room for, in lines of equal length."""
    most = max(_LEGEND_WIDTH // (max(map(len, names)) + _LEGEND_GAP), 1)
    n_lines = -(-len(names) // most)
    return -(-len(names) // n_lines)
