"""A picture of whether the rules can be read one by one."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from .._validation import check_count
from ..learning.penalty import GREATEST_ALONE
from ..membership import GREATEST_CROSSING, LEAST_TRUTH
from ._display import panels, position
from .labels import as_label
from .measures import measure
from .readability import Readability, checked_rows
from .rules import rule_values

__all__ = ["ReadabilityDisplay"]

_BLUE, _RED = "#0072b2", "#c1272d"


@dataclass(kw_only=True, eq=False, repr=False)
class ReadabilityDisplay:
    """Terms as bands with their greatest truth; the strongest rule alone against the model.

    On the left a band for every term, along the range of its input: the darker, the truer the term
    is there. The number beside it is the greatest truth on the rows. Red is what cannot be read: a
    term that is hardly true anywhere, neighbours that can hardly be told apart. On the right every
    point is a row: what the strongest rule says there alone, over what all rules say together.
    Where the rules can be read one by one, points lie along the diagonal.

    Parameters
    ----------
    readability : Readability
        The figures.
    memberships : ndarray of shape (n_distinct_terms, n_points)
        Each term of ``readability.terms`` along the range of its input in training.
    predictions, alone : ndarray of shape (n_shown_rows,)
        What all rules, and what the strongest says, on some of the rows.
    output : int
        Position of the output.

    Attributes
    ----------
    figure_, axes_ : matplotlib Figure, ndarray of matplotlib Axes of shape (2,)
        The figure and its panels, once drawn.

    See Also
    --------
    readability : The figures without the picture.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import ReadabilityDisplay
    >>> X, y = make_jang_sinc()
    >>> model = ANFISRegressor(n_mfs=[4, 1]).fit(X, y)
    >>> display = ReadabilityDisplay.from_estimator(model, X, y)
    >>> display.memberships.shape, display.alone.shape
    ((4, 201), (121,))
    """

    readability: Any
    memberships: np.ndarray
    predictions: np.ndarray
    alone: np.ndarray
    output: int

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: ArrayLike,
        y: ArrayLike | None = None,
        *,
        sample_weight: ArrayLike | None = None,
        output: int | str = 0,
        n_points: int = 201,
        max_rows: int = 2000,
        colormap: str = "Blues",
        ax: Any = None,
    ) -> Self:
        """Draw how the rules of a fitted estimator can be read.

        Parameters
        ----------
        estimator : fitted estimator or TSKModel
            As :func:`skanfis.export.fold` takes it.
        X, y, sample_weight : array-like
            As :func:`readability` takes them.
        output : int or str, default=0
            Which output the right panel shows, by position or name.
        n_points : int, default=201
            Points along each band, 2 or more.
        max_rows : int, default=2000
            Most points on the right, evenly chosen, 1 or more; the figures are of all rows.
        colormap : str, default="Blues"
            Colours of the bands, for truth from 0 to 1.
        ax : sequence of 2 matplotlib Axes or matplotlib Axes, default=None
            Where to draw: None makes a figure; one axes is divided.
        """
        check_count("n_points", n_points, 2)
        check_count("max_rows", max_rows, 1)
        model, read, n_rows, y, weight = checked_rows(estimator, X, y, sample_weight)
        k = position(output, model.output_names, "output")
        found = Readability(model, measure(model, read, n_rows, y, weight))
        shown = slice(None, None, -(-n_rows // max_rows))
        rows = np.clip(read(shown), model.minimum, model.maximum)
        if weight is not None:
            rows = rows[weight[shown] > 0.0]
        strengths, values = model.strengths(rows), rule_values(model, rows)[:, :, k]
        # Every input along its own range at once: a term looks at one input alone.
        Z = np.linspace(model.minimum, model.maximum, n_points, axis=1)
        display = cls(
            readability=found,
            memberships=np.exp(model.antecedent.log_memberships(Z))[found.terms.index],
            predictions=np.sum(strengths * values, axis=1),
            alone=values[np.arange(len(rows)), strengths.argmax(axis=1)],
            output=k,
        )
        return display.plot(colormap=colormap, ax=ax)

    def plot(self, *, colormap: str = "Blues", ax: Any = None) -> Self:
        """Draw the picture; parameters are those of :meth:`from_estimator`."""
        height = np.clip(1.4 + 0.34 * len(self.memberships), 3.8, 12.0)
        self.axes_ = panels(ax, 2, width=5.4, height=height)
        self.figure_ = self.axes_[0].figure
        self._draw_terms(self.axes_[0], colormap)
        self._draw_rules(self.axes_[1])
        return self

    def _draw_terms(self, axes, colormap):
        terms = list(self.readability.terms.itertuples(index=False))
        for place, (term, curve) in enumerate(zip(terms, self.memberships, strict=True)):
            axes.imshow(
                curve[None],
                extent=(0.0, 1.0, place + 0.36, place - 0.36),
                cmap=colormap,
                vmin=0.0,
                vmax=1.0,
                aspect="auto",
            )
            color = _RED if term.greatest_truth < LEAST_TRUTH else "0.2"
            axes.text(1.02, place, f"{term.greatest_truth:.2f}", va="center", color=color)
            if term.crossing > GREATEST_CROSSING:
                text = f" cross at {term.crossing:.2f} "
                box = {"color": "white", "pad": 0.5}
                axes.text(0.5, place + 0.5, text, ha="center", va="center", color=_RED, bbox=box)
        if not terms:
            axes.text(0.5, 0.5, "no terms", ha="center", color="0.4")
        labels = [as_label(f"{term.input}: {term.term}") for term in terms]
        axes.set_yticks(range(len(terms)), labels)
        axes.set_xticks([0.0, 1.0], ["lowest", "highest in training"])
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        axes.set(xlim=(0.0, 1.12), ylim=(max(len(terms), 1) - 0.5, -0.5))
        axes.set_title("terms, and their greatest truth on the rows", fontsize="medium", loc="left")

    def _draw_rules(self, axes):
        k = self.output
        name = as_label(self.readability.model.output_names[k])
        error = self.readability.measures.alone[k]
        ends = [self.predictions.min(), self.predictions.max()]
        axes.plot(ends, ends, color="0.3", linewidth=1.0)
        axes.scatter(self.predictions, self.alone, s=9, alpha=0.5, linewidths=0.0, color=_BLUE)
        axes.set(xlabel=f"{name}: all rules", ylabel=f"{name}: strongest rule alone")
        axes.spines[["top", "right"]].set_visible(False)
        axes.set_title(
            f"strongest rule alone: off by {error:.3g} sd of the target",
            fontsize="medium",
            loc="left",
            color=_RED if error > GREATEST_ALONE else "black",
        )
