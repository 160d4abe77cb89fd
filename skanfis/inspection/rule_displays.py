"""Pictures of the rules: how much of the data each fires on, and what each contributes."""

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from .._validation import check_count
from ..export import fold, fold_with_rows
from ._display import COVERED, Display, colors, position, section
from .labels import as_label
from .rules import has_training_data, rule_values, rules_frame
from .text import rows_text

__all__ = ["RuleActivationDisplay", "RuleContributionDisplay"]

# A cell is empty where its rule is the strongest on less than half a row.
_EMPTY = 0.5
# Beyond so many cells, numbers in them cannot be read.
_MOST_NUMBERED = 100


@dataclass(kw_only=True, eq=False, repr=False)
class RuleActivationDisplay(Display):
    """Map of the rules: how much of the data each fires on, with empty cells hatched.

    Rules over shared terms are a table with a cell for every combination of terms; scattered rules
    are a list, the weightiest first. ``ax_`` and ``figure_`` are matplotlib's, once drawn.

    Parameters
    ----------
    weights, rows : ndarray of shape (n_down, n_across)
        Part of the data's weight on which the rule of each cell fires, and number of rows on which
        it is the strongest; NaN where there is no rule.
    rules : ndarray of int of shape (n_down, n_across)
        Number of each cell's rule; -1 where there is none.
    labels_down, labels_across : list of str
        The terms, of several inputs one after the other.
    inputs_down, inputs_across : tuple of str
        The inputs that these terms are of.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import RuleActivationDisplay
    >>> model = ANFISRegressor(n_mfs=[3, 2]).fit(*make_jang_sinc())
    >>> display = RuleActivationDisplay.from_estimator(model)
    >>> display.labels_down, display.labels_across
    (['low', 'medium', 'high'], ['low', 'high'])
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
            Rows to count; None is the training data.
        colormap : str, default="Blues"
            Colours of the weights.
        ax : matplotlib Axes, default=None
            None makes a figure.
        """
        if X is None:
            model = fold(estimator)
            if not has_training_data(model):
                raise ValueError("The model was read from a file and knows of no data: give X.")
            weights, rows = model.rule_weights, model.rule_rows
        else:
            model, table = fold_with_rows(estimator, X)
            strengths = model.strengths(table)
            weights = strengths.mean(axis=0)
            rows = np.bincount(strengths.argmax(axis=1), minlength=model.n_rules)
        return cls(**_layout(model, weights, rows)).plot(colormap=colormap, ax=ax)

    def plot(self, *, colormap: str = "Blues", ax: Any = None) -> Self:
        """Draw the map; parameters are those of :meth:`from_estimator`."""
        down, across = self.weights.shape
        width, height = 3.5 + 0.7 * across, 1.8 + 0.5 * down
        axes = self._begin(ax, np.clip(width, 5.6, 14.0), np.clip(height, 2.8, 10.0))
        percent = 100.0 * self.weights
        image = axes.pcolormesh(percent, cmap=colormap, vmin=0.0, edgecolors="white", linewidth=1.0)
        self.figure_.colorbar(image, ax=axes, label="part of the data's weight, %")
        is_empty = self.rows < _EMPTY
        for i, j in np.argwhere(is_empty):
            corners = [j, j + 1, j + 1, j], [i, i, i + 1, i + 1]
            axes.fill(*corners, fill=False, hatch="////", edgecolor="0.6", linewidth=0.0)
        if self.weights.size <= _MOST_NUMBERED:
            box = {"color": "white", "alpha": 0.7, "pad": 1}
            style: dict = {"ha": "center", "va": "center", "fontsize": "small", "bbox": box}
            for i, j in np.argwhere(self.rules >= 0):
                count = "" if is_empty[i, j] else f"\n{rows_text(self.rows[i, j])}"
                axes.text(j + 0.5, i + 0.5, f"{percent[i, j]:.1f} %{count}", **style)
        axes.set_xticks(np.arange(across) + 0.5, list(map(as_label, self.labels_across)))
        axes.set_yticks(np.arange(down) + 0.5, list(map(as_label, self.labels_down)))
        if max(map(len, self.labels_across)) * across > 60:
            axes.tick_params("x", rotation=45)
        axes.invert_yaxis()
        axes.tick_params(length=0)
        names = [as_label(", ".join(own)) for own in (self.inputs_across, self.inputs_down)]
        axes.set(xlabel=names[0], ylabel=names[1])
        self._note({}, *(["hatched: strongest on no row"] if np.any(is_empty) else []))
        return self


def _layout(model, weights, rows):
    """Cells and their labels: a table over shared terms, or a list of rules with their own."""
    antecedent = model.antecedent
    rule, place = np.nonzero(antecedent.rule_terms >= 0)
    asked = antecedent.rule_terms[rule, place]
    terms = np.full((model.n_rules, model.n_inputs), -1)  # of each rule on each input
    terms[rule, antecedent.term_inputs[asked]] = asked
    inputs = np.flatnonzero((terms >= 0).any(axis=0))
    has_own_terms = inputs.size > 1 and np.unique(asked).size == asked.size
    if has_own_terms or len(np.unique(terms, axis=0)) < model.n_rules:
        order = np.argsort(-weights, kind="stable")
        down, across, numbers = inputs, inputs[:0], order[:, None]
        keys_down, keys_across = terms[order][:, down], terms[:1, across]
    else:
        down, across = inputs[: inputs.size // 2], inputs[inputs.size // 2 :]
        keys_down, i = np.unique(terms[:, down], axis=0, return_inverse=True)
        keys_across, j = np.unique(terms[:, across], axis=0, return_inverse=True)
        numbers = np.full((len(keys_down), len(keys_across)), -1)
        numbers[i.ravel(), j.ravel()] = np.arange(model.n_rules)

    def labels(keys):
        return [", ".join("any" if t < 0 else model.term_names[t] for t in key) for key in keys]

    return {
        "weights": np.where(numbers >= 0, weights[numbers], np.nan),
        "rows": np.where(numbers >= 0, rows[numbers], np.nan),
        "rules": numbers,
        "labels_down": labels(keys_down),
        "labels_across": labels(keys_across),
        "inputs_down": tuple(model.input_names[j] for j in down),
        "inputs_across": tuple(model.input_names[j] for j in across),
    }


@dataclass(kw_only=True, eq=False, repr=False)
class RuleContributionDisplay(Display):
    """Contributions of the rules to the prediction along one input, the rest held.

    A rule contributes its strength times the distance of its value from a baseline; contributions
    and baseline add up to the prediction, before it is held at the limits of its training.
    ``ax_`` and ``figure_`` are matplotlib's, once drawn.

    Parameters
    ----------
    grid, coverage : ndarray of shape (n_points,)
        Values of the input, and how well the training data cover each, from 0 to 1.
    contributions, baseline : ndarray of shape (n_rules, n_points), float
        Strength times value less baseline, for every rule; what values are compared with.
    rule_terms, premise_inputs : list of str, tuple of str
        The terms of each rule, on these inputs one after the other.
    input_name, output_name : str
        Names of the input and the output.
    held : dict
        Value of every other input by its name.
    band : ndarray of shape (n_points,), default=None
        Half the width of a band around the prediction.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import RuleContributionDisplay
    >>> model = ANFISRegressor(n_mfs=[4, 1]).fit(*make_jang_sinc())
    >>> RuleContributionDisplay.from_estimator(model, "x0").rule_terms
    ['very low', 'low', 'high', 'very high']
    """

    grid: np.ndarray
    coverage: np.ndarray
    contributions: np.ndarray
    baseline: float
    rule_terms: Sequence[str]
    premise_inputs: Sequence[str]
    input_name: str
    output_name: str
    held: dict[str, Any]
    band: np.ndarray | None = None

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        feature: int | str = 0,
        *,
        held: dict[str, Any] | None = None,
        output: int | str = 0,
        baseline: Any = "mean",
        n_deviations: float = 0,
        n_points: int = 201,
        max_rules: int = 6,
        colormap: str = "viridis",
        ax: Any = None,
    ) -> Self:
        """Draw the contributions of the rules of a fitted estimator.

        Parameters
        ----------
        estimator : fitted estimator or TSKModel
            As :func:`skanfis.export.fold` takes it.
        feature : int or str, default=0
            The input to follow over its range in training, by position or name.
        held, output : dict, int or str
            Values of other inputs, by default their mean in training; which output.
        baseline : "mean" or float, default="mean"
            What values are compared with: "mean" of the prediction, or 0 as in :func:`explain`.
        n_deviations : float, default=0
            Half the width of a band around the prediction, in standard deviations; 0 draws none.
        n_points, max_rules : int, default=201 and 6
            Points of each curve; most rules with a line of their own, beside the others' sum.
        colormap : str, default="viridis"
            Colours of the rules.
        ax : matplotlib Axes, default=None
            None makes a figure.
        """
        check_count("n_points", n_points, 2)
        model = fold(estimator)
        j = position(feature, model.input_names)
        k = position(output, model.output_names, "output")
        grid = np.linspace(model.minimum[j], model.maximum[j], n_points)
        rows, others, coverage = section(model, [j], grid[:, None], held)
        strengths = model.strengths(rows)
        values = rule_values(model, rows)[:, :, k]
        if isinstance(baseline, str) and baseline == "mean":
            baseline = float(np.mean(np.sum(strengths * values, axis=1)))
        elif not isinstance(baseline, Real) or not np.isfinite(float(baseline)):
            raise ValueError(f"baseline={baseline!r} must be 'mean' or a finite number.")
        if not isinstance(n_deviations, Real) or not 0.0 <= float(n_deviations) < np.inf:
            raise ValueError(f"n_deviations={n_deviations!r} must be a number, zero or positive.")
        band = None
        if n_deviations:
            band = float(n_deviations) * model.standard_deviation(rows)[:, k]
        frame = rules_frame(model, model.reference)
        terms = frame["if"] if "if" in frame else frame[[]]
        display = cls(
            grid=grid,
            contributions=(strengths * (values - baseline)).T,
            baseline=float(baseline),
            input_name=model.input_names[j],
            output_name=model.output_names[k],
            coverage=coverage,
            rule_terms=[", ".join(rule) for rule in terms.fillna("any").to_numpy()],
            premise_inputs=tuple(terms.columns),
            held=others,
            band=band,
        )
        return display.plot(max_rules=max_rules, colormap=colormap, ax=ax)

    def plot(self, *, max_rules: int = 6, colormap: str = "viridis", ax: Any = None) -> Self:
        """Draw the contributions; parameters are those of :meth:`from_estimator`."""
        check_count("max_rules", max_rules, 1)
        axes = self._begin(ax, width=7.5)
        most = np.argsort(-np.abs(self.contributions).mean(axis=1), kind="stable")
        chosen = np.sort(most[:max_rules])
        lines, total = self.baseline + self.contributions, self.contributions.sum(axis=0)
        total += self.baseline
        axes.axhline(self.baseline, color="0.6", linewidth=0.8)
        for r, shade in zip(chosen, colors(chosen.size, colormap), strict=True):
            label = as_label(f"{r}: {self.rule_terms[r]}")
            axes.plot(self.grid, lines[r], color=shade, linewidth=1.5, label=label)
        if chosen.size < len(self.contributions):
            others = self.baseline + np.delete(self.contributions, chosen, axis=0).sum(axis=0)
            label = f"{len(self.contributions) - chosen.size} other rules"
            axes.plot(self.grid, others, ":", color="0.5", linewidth=1.5, label=label)
        if self.band is not None:
            ends = total - self.band, total + self.band
            axes.fill_between(self.grid, *ends, color="black", alpha=0.15, label="deviation")
            lines = np.vstack([lines, *ends])
        axes.plot(self.grid, total, color="black", linewidth=2.2, label="prediction")
        label = f"{as_label(self.output_name)}: {self.baseline:.4g} + contribution"
        axes.set(xlabel=as_label(self.input_name), ylabel=label, xlim=self.grid[[0, -1]])
        covered = self.coverage >= COVERED
        is_grey = covered.any() and not covered.all()
        if is_grey:
            # Extrapolation does not set the limits.
            seen = np.vstack([lines, total])[:, covered]
            if margin := 0.1 * np.ptp(seen):
                axes.set_ylim(seen.min() - margin, seen.max() + margin)
            style = {"color": "0.93", "zorder": 0, "transform": axes.get_xaxis_transform()}
            axes.fill_between(self.grid, 0.0, 1.0, where=~covered, **style)
        self._note(self.held, *(["grey: few training data"] if is_grey else []))
        title = as_label("rule: " + ", ".join(self.premise_inputs))
        place = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0), "alignment": "left"}
        axes.legend(title=title, fontsize="small", title_fontsize="small", frameon=False, **place)
        return self
