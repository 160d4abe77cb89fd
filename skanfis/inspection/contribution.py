"""What each rule contributes to the prediction along one input."""

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any, Self

import numpy as np

from .._validation import check_count
from ..export import fold
from ._common import COVERED, colors, coverage_if_known, held_row, one_axes, position, terms_text
from .labels import as_label
from .rules import premises
from .table import rule_values

__all__ = ["RuleContributionDisplay"]


@dataclass(kw_only=True, eq=False, repr=False)
class RuleContributionDisplay:
    """Contributions of the rules to the prediction along one input, the rest held.

    A rule contributes its strength times the distance of its value from a baseline; the sum of the
    contributions and the baseline is the prediction, before it is held at the limits of its
    training.

    Make it with :meth:`from_estimator`; parameters are stored as attributes.

    Parameters
    ----------
    grid : ndarray of shape (n_points,)
        Values of the input.
    contributions : ndarray of shape (n_rules, n_points)
        Strength times value less baseline, for every rule.
    baseline : float
        What the rules' values are compared with.
    coverage : ndarray of shape (n_points,)
        How well the training data cover each point, from 0 to 1; 1 for a model that was read from a
        file without data.
    rule_terms : list of str
        The terms of each rule, on the "premise_inputs" one after the other.
    premise_inputs : tuple of str
        Inputs that rules look at.
    input_name, output_name : str
        Names of the input and the output.
    held : dict
        Value of every other input by its name.
    band : ndarray of shape (n_points,), default=None
        Half the width of a band around the prediction.

    Attributes
    ----------
    figure_, ax_ : matplotlib Figure, matplotlib Axes
        Once drawn.

    See Also
    --------
    skanfis.inspection.explain : The same as a table, for given rows.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import RuleContributionDisplay
    >>> X, y = make_jang_sinc()
    >>> model = ANFISRegressor(n_mfs=[4, 1]).fit(X, y)
    >>> display = RuleContributionDisplay.from_estimator(model, "x0")
    >>> display.rule_terms
    ['very low', 'low', 'high', 'very high']
    """

    grid: np.ndarray
    contributions: np.ndarray
    baseline: float
    coverage: np.ndarray
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
        held : dict, default=None
            Values of other inputs, by position or name; those not named are held at their mean in
            training; in a model that knows of no data, at the middle of their range.
        output : int or str, default=0
            Which output, by position or name.
        baseline : "mean" or float, default="mean"
            What the rules' values are compared with. "mean" is the mean of the prediction along the
            line drawn; 0 gives the contributions of :func:`skanfis.inspection.explain`.
        n_deviations : float, default=0
            Half the width of a band around the prediction, in its standard deviations
            (``predict(X, return_std=True)``), zero or positive; 0 draws none.
        n_points : int, default=201
            Points of each curve, 2 or more.
        max_rules : int, default=6
            Most rules with a line of their own, 1 or more; the others are drawn as their sum.
        colormap : str, default="viridis"
            Colours of the rules.
        ax : matplotlib Axes, default=None
            Where to draw; None makes a figure.

        Returns
        -------
        display : RuleContributionDisplay

        Raises
        ------
        ValueError
            If there is no such input or output, ``held`` lies outside the training range, or a
            number is out of its range.
        TypeError
            If ``estimator`` has no rules.
        ImportError
            Without matplotlib.
        """
        check_count("n_points", n_points, 2)
        model = fold(estimator)
        j = position(feature, model.input_names)
        k = position(output, model.output_names, "output")
        row = held_row(model, held)
        grid = np.linspace(model.minimum[j], model.maximum[j], n_points)
        rows = np.tile(row, (n_points, 1))
        rows[:, j] = grid
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
        rules, inputs = premises(model)
        display = cls(
            grid=grid,
            contributions=(strengths * (values - baseline)).T,
            baseline=float(baseline),
            input_name=model.input_names[j],
            output_name=model.output_names[k],
            coverage=coverage_if_known(model, rows),
            rule_terms=[terms_text(model, rule, inputs) for rule in rules],
            premise_inputs=tuple(model.input_names[i] for i in inputs),
            held={model.input_names[i]: float(row[i]) for i in range(model.n_inputs) if i != j},
            band=band,
        )
        return display.plot(max_rules=max_rules, colormap=colormap, ax=ax)

    def plot(self, *, max_rules: int = 6, colormap: str = "viridis", ax: Any = None) -> Self:
        """Draw the contributions.

        Parameters
        ----------
        max_rules, colormap, ax
            As :meth:`from_estimator` takes them.

        Returns
        -------
        display : RuleContributionDisplay

        Raises
        ------
        ValueError
            If ``max_rules`` is less than 1.
        ImportError
            Without matplotlib.
        """
        check_count("max_rules", max_rules, 1)
        self.ax_ = one_axes(ax, width=7.5)
        self.figure_ = self.ax_.figure
        most = np.argsort(-np.abs(self.contributions).mean(axis=1), kind="stable")
        told = np.sort(most[:max_rules])
        total = self.baseline + self.contributions.sum(axis=0)
        self.ax_.axhline(self.baseline, color="0.6", linewidth=0.8)
        for r, shade in zip(told, colors(told.size, colormap), strict=True):
            line = self.baseline + self.contributions[r]
            self.ax_.plot(
                self.grid,
                line,
                color=shade,
                linewidth=1.5,
                label=as_label(f"{r}: {self.rule_terms[r]}"),
            )
        if told.size < len(self.contributions):
            others = self.baseline + np.delete(self.contributions, told, axis=0).sum(axis=0)
            label = f"{len(self.contributions) - told.size} other rules"
            self.ax_.plot(self.grid, others, ":", color="0.5", linewidth=1.5, label=label)
        if self.band is not None:
            ends = (total - self.band, total + self.band)
            self.ax_.fill_between(self.grid, *ends, color="black", alpha=0.15, label="deviation")
        self.ax_.plot(self.grid, total, color="black", linewidth=2.2, label="prediction")
        self.ax_.set(
            xlabel=as_label(self.input_name),
            ylabel=f"{as_label(self.output_name)}: {self.baseline:.4g} + contribution",
            xlim=(self.grid[0], self.grid[-1]),
        )
        notes = [f"{as_label(name)} = {value:.4g}" for name, value in self.held.items()]
        covered = self.coverage >= COVERED
        if covered.any() and not covered.all():
            self._shade(covered, total)
            notes.append("grey: few training data")
        self.ax_.set_title("; ".join(notes), fontsize="small", loc="left")
        self.ax_.legend(
            loc="upper left",
            bbox_to_anchor=(1.0, 1.0),
            frameon=False,
            fontsize="small",
            title=as_label("rule: " + ", ".join(self.premise_inputs)),
            title_fontsize="small",
            alignment="left",
        )
        return self

    def _shade(self, covered, total):
        """Grey where data do not cover the line; what is there does not set the limits."""
        from matplotlib.transforms import blended_transform_factory

        across = blended_transform_factory(self.ax_.transData, self.ax_.transAxes)
        self.ax_.fill_between(
            self.grid, 0.0, 1.0, where=~covered, color="0.93", transform=across, zorder=0
        )
        band = 0.0 if self.band is None else self.band
        lines = [self.baseline + self.contributions, total - band, total + band]
        seen = np.vstack(lines)[:, covered]
        if margin := 0.1 * np.ptp(seen):
            self.ax_.set_ylim(seen.min() - margin, seen.max() + margin)
