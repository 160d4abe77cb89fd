"""Which rules the data speak for, and which cells of the rule base are empty."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..export import fold, fold_with_rows
from ._common import one_axes
from .labels import as_label
from .rules import knows_data, premises
from .text import rows_text

__all__ = ["RuleActivationDisplay"]

# A cell is empty where its rule is the strongest on less than half a row.
_EMPTY = 0.5
# With more cells than these, numbers in them cannot be read.
_MOST_NUMBERED = 100


@dataclass(kw_only=True, eq=False, repr=False)
class RuleActivationDisplay:
    """Map of the rules: how much of the data each fires on, with empty cells shown.

    Rules over shared terms are laid out as a table, with a cell for every combination of terms; the
    terms of the first inputs run down, those of the last ones across. Scattered rules, which have
    terms of their own, are listed, the weightiest first. A rule that is the strongest on no row is
    hatched: what it says is extrapolation.

    Make it with :meth:`from_estimator`; parameters are stored as attributes.

    Parameters
    ----------
    weights : ndarray of shape (n_down, n_across)
        Part of the data's weight on which the rule of each cell fires; NaN where there is no rule.
    rows : ndarray of shape (n_down, n_across)
        Number of rows on which the rule of each cell is the strongest; NaN where there is no rule.
    rules : ndarray of int of shape (n_down, n_across)
        Number of each cell's rule; -1 where there is none.
    labels_down, labels_across : list of str
        The terms, of several inputs one after the other.
    inputs_down, inputs_across : tuple of str
        The inputs that these terms are of.

    Attributes
    ----------
    figure_, ax_ : matplotlib Figure, matplotlib Axes
        Once drawn.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import RuleActivationDisplay
    >>> X, y = make_jang_sinc()
    >>> display = RuleActivationDisplay.from_estimator(ANFISRegressor(n_mfs=[3, 2]).fit(X, y))
    >>> display.labels_down, display.labels_across
    (['low', 'medium', 'high'], ['low', 'high'])
    >>> display.weights.shape
    (3, 2)
    """

    weights: np.ndarray
    rows: np.ndarray
    rules: np.ndarray
    labels_down: Sequence[str]
    labels_across: Sequence[str]
    inputs_down: Sequence[str]
    inputs_across: Sequence[str]

    @classmethod
    def from_estimator(
        cls, estimator: Any, X: ArrayLike | None = None, *, colormap: str = "Blues", ax: Any = None
    ) -> Self:
        """Draw the activation of the rules of a fitted estimator.

        Parameters
        ----------
        estimator : fitted estimator or TSKModel
            As :func:`skanfis.export.fold` takes it.
        X : array-like of shape (n_samples, n_features), default=None
            Rows to count; None is the training data, as the model remembers them.
        colormap : str, default="Blues"
            Colours of the weights.
        ax : matplotlib Axes, default=None
            Where to draw; None makes a figure.

        Returns
        -------
        display : RuleActivationDisplay

        Raises
        ------
        ValueError
            If X is None, and the model was read from a file without data.
        """
        if X is None:
            model = fold(estimator)
            if not knows_data(model):
                raise ValueError("The model was read from a file and knows of no data: give X.")
            weights, rows = model.rule_weights, model.rule_rows
        else:
            model, table = fold_with_rows(estimator, X)
            strengths = model.strengths(table)
            weights = strengths.mean(axis=0)
            rows = np.bincount(strengths.argmax(axis=1), minlength=model.n_rules)
        return cls(**_layout(model, weights, rows)).plot(colormap=colormap, ax=ax)

    def plot(self, *, colormap: str = "Blues", ax: Any = None) -> Self:
        """Draw the map.

        Parameters
        ----------
        colormap, ax
            As :meth:`from_estimator` takes them.

        Returns
        -------
        display : RuleActivationDisplay
        """
        down, across = self.weights.shape
        width, height = 3.5 + 0.7 * across, 1.8 + 0.5 * down
        self.ax_ = one_axes(ax, np.clip(width, 5.6, 14.0), np.clip(height, 2.8, 10.0))
        self.figure_ = self.ax_.figure
        percent = 100.0 * self.weights
        image = self.ax_.pcolormesh(
            percent, cmap=colormap, vmin=0.0, edgecolors="white", linewidth=1.0
        )
        self.figure_.colorbar(image, ax=self.ax_, label="part of the data's weight, %")
        for cell in np.argwhere(self.rows < _EMPTY):
            self._hatch(cell)
        if self.weights.size <= _MOST_NUMBERED:
            for cell in np.argwhere(self.rules >= 0):
                self._write(cell, image)
        self.ax_.set_xticks(np.arange(across) + 0.5, list(map(as_label, self.labels_across)))
        self.ax_.set_yticks(np.arange(down) + 0.5, list(map(as_label, self.labels_down)))
        if max(map(len, self.labels_across), default=0) * across > 60:
            for label in self.ax_.get_xticklabels():
                label.set(rotation=45, rotation_mode="anchor", ha="right")
        self.ax_.invert_yaxis()
        self.ax_.tick_params(length=0)
        self.ax_.set(
            xlabel=as_label(", ".join(self.inputs_across)),
            ylabel=as_label(", ".join(self.inputs_down)),
        )
        if np.any(self.rows < _EMPTY):
            self.ax_.set_title("hatched: strongest on no row", fontsize="small", loc="left")
        return self

    def _hatch(self, cell):
        from matplotlib.patches import Rectangle

        self.ax_.add_patch(
            Rectangle(
                (cell[1], cell[0]), 1, 1, fill=False, hatch="////", edgecolor="0.6", linewidth=0.0
            )
        )

    def _write(self, cell, image):
        i, j = cell
        red, green, blue, _ = image.cmap(image.norm(100.0 * self.weights[i, j]))
        is_dark = 0.3 * red + 0.6 * green + 0.1 * blue < 0.5
        is_empty = self.rows[i, j] < _EMPTY
        text = f"{100.0 * self.weights[i, j]:.1f} %"
        if is_empty and text == "0.0 %":
            return
        self.ax_.text(
            j + 0.5,
            i + 0.5,
            text if is_empty else f"{text}\n{rows_text(self.rows[i, j])}",
            ha="center",
            va="center",
            fontsize="small",
            color="white" if is_dark else "black",
            bbox={"color": "white", "alpha": 0.7, "pad": 1} if is_empty else None,
        )


def _layout(model, weights, rows):
    """Cells and their labels: a table over shared terms, or a list of rules with their own."""
    rules, looked_at = premises(model)
    terms = [term for rule in rules for term in rule.values()]
    has_own_terms = len(looked_at) > 1 and len(set(terms)) == len(terms)
    repeats = len({_key(rule, looked_at) for rule in rules}) < len(rules)
    if has_own_terms or repeats:
        order = np.argsort(-weights, kind="stable")
        numbers = order[:, None]
        down, across = looked_at, []
        keys_down, keys_across = [_key(rules[r], down) for r in order], [()]
    else:
        down, across = looked_at[: len(looked_at) // 2], looked_at[len(looked_at) // 2 :]
        keys_down = sorted({_key(rule, down) for rule in rules})
        keys_across = sorted({_key(rule, across) for rule in rules})
        numbers = np.full((len(keys_down), len(keys_across)), -1)
        for r, rule in enumerate(rules):
            numbers[keys_down.index(_key(rule, down)), keys_across.index(_key(rule, across))] = r
    return {
        "weights": np.where(numbers >= 0, weights[numbers], np.nan),
        "rows": np.where(numbers >= 0, rows[numbers], np.nan),
        "rules": numbers,
        "labels_down": [_label(model, key) for key in keys_down],
        "labels_across": [_label(model, key) for key in keys_across],
        "inputs_down": tuple(model.input_names[j] for j in down),
        "inputs_across": tuple(model.input_names[j] for j in across),
    }


def _key(rule, inputs):
    """The rule's terms on some inputs; -1 where it does not look at one."""
    return tuple(rule.get(j, -1) for j in inputs)


def _label(model, key):
    return ", ".join("any" if t < 0 else model.term_names[t] for t in key)
