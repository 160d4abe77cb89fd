"""A picture of the effects of every input, and of the strongest pairs, on the output."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from .._validation import check_count
from ..digits import counted
from .anova import N_SHARED, draw
from .displays import BINS, BRIGHTEST, panels_or_new, pyplot, spaced
from .effects import Study
from .labels import on_axis

_N_POINTS, _N_ACROSS = 61, 31
# Least share, beyond its error, of a pair that is drawn.
_LEAST = 0.005
# Most letters of all labels side by side under a panel, each as wide as the longest.
_MOST_LETTERS = 24
# Room above and below the curves, as a part of their span; the data stand below.
_ROOM = 0.2


@dataclass(kw_only=True, eq=False, repr=False)
class EffectsDisplay:
    """The output along every input, averaged over the others, and the two strongest pairs.

    The band is two standard deviations of the curve to either side, from consequents and premises.
    Terms are shaded, data grey. A pair shows its joint effect beyond the two effects alone.
    ``axes_`` and ``figure_`` are matplotlib's, once drawn.

    Parameters
    ----------
    curves : list of dict
        The strongest first: "input", "points" (of a category 0, 1, ...), "levels" or None, "share"
        of the variance (Sobol's, of this input alone), "mean" and its "deviation", 0 if not known,
        (n_points,); "terms", the memberships, (n_terms, n_points); "edges" and "counts" of the
        histogram of the data.
    pairs : list of dict
        "inputs", "points", "levels" of both, "share", and "effect" (n_points up, n_points across).
    output_name : str
    n_more : int, default=0
        Inputs that have no curve.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import EffectsDisplay
    >>> model = ANFISRegressor(n_mfs=4).fit(*make_jang_sinc())
    >>> EffectsDisplay.from_estimator(model).pairs[0]["inputs"]
    ('x0', 'x1')
    """

    curves: list[dict[str, Any]]
    pairs: list[dict[str, Any]]
    output_name: str
    n_more: int = 0

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: ArrayLike | None = None,
        *,
        output: int | str = 0,
        max_shown: int = 7,
        ax: Any = None,
    ) -> Self:
        """Draw the effects of a fitted estimator.

        Parameters
        ----------
        estimator, X, output : fitted estimator, array-like, int or str
            As of :func:`effects`.
        max_shown : int, default=7
            Most curves: those of the largest total shares are shown.
        ax : sequence of matplotlib Axes, default=None
            One for each curve, then one for each pair; None makes a figure.
        """
        check_count("max_shown", max_shown, 1)
        study = Study.of(estimator, X, output)
        ones, pairs = [(g,) for g in range(len(study.labels))], study.pairs()
        share = dict(zip([*ones, *pairs], study.sobol([*ones, *pairs]), strict=True))
        totals = study.anova.totals()
        ones = sorted(ones, key=lambda one: -totals[one[0]])[:max_shown]
        least = _LEAST + study.anova.error
        pairs = sorted([v for v in pairs if share[v] > least], key=lambda pair: -share[pair])[:2]
        return cls(
            curves=[_curve(study, *one) | {"share": share[one]} for one in ones],
            pairs=[_pair(study, *v) | {"share": share[v]} for v in pairs],
            output_name=study.model.output_names[study.output],
            n_more=len(study.labels) - len(ones),
        ).plot(ax=ax)

    def plot(self, *, ax: Any = None) -> Self:
        """Draw the effects on ``ax``, as of :meth:`from_estimator`."""
        note = "curve: mean over all other inputs, ± 2 sd; shaded: terms; grey: data"
        note += "; colours: beyond what both do alone" if self.pairs else ""
        note += f"; without a curve: {counted(self.n_more, 'more input')}" if self.n_more else ""
        self.axes_ = panels_or_new(ax, len(self.curves) + len(self.pairs), note)
        self.figure_ = self.axes_[0].figure
        # One scale for all, so that a flat curve looks flat.
        mean, sd = (np.hstack([one[key] for one in self.curves]) for key in ("mean", "deviation"))
        low, high = np.min(mean - 2.0 * sd), np.max(mean + 2.0 * sd)
        room = _ROOM * (high - low or max(-low, high) or 1.0)
        for axes, curve in zip(self.axes_, self.curves, strict=False):
            _draw_curve(axes, curve)
            axes.set(ylim=(low - room, high + room), ylabel=on_axis(self.output_name))
        for axes, pair in zip(self.axes_[len(self.curves) :], self.pairs, strict=True):
            _draw_pair(axes, pair)
        return self


def _along(study, g, n_points):
    """Rows along a block, the others at their means: "input", "points", and "levels" if any."""
    name, own = study.labels[g], study.blocks[g].inputs
    values, levels = np.unique(study.blocks[g].values, axis=0), study.levels.get(name)
    if levels is not None:
        values = np.eye(len(levels))[:, : len(own)]
    elif len(values) <= 2:
        levels = [f"{value:.6g}" for value in values[:, 0]]
    else:
        values = np.linspace(values[0], values[-1], n_points)
    rows = np.tile(study.model.reference, (len(values), 1))
    rows[:, own] = values
    points = values[:, 0] if levels is None else np.arange(len(values))
    return rows, {"input": name, "points": points, "levels": levels}


def _curve(study, g):
    """The mean along a block, its deviation, its terms and its data."""
    model, block = study.model, study.blocks[g]
    rows, axis = _along(study, g, _N_POINTS)
    deviation = np.zeros(len(rows))
    if model.posterior is not None:
        others = draw(study.blocks, N_SHARED, np.random.default_rng(0))
        for i, row in enumerate(rows):
            others[:, block.inputs] = row[list(block.inputs)]
            deviation[i] = model.posterior.of_mean(model, others.T.copy())[study.output]
    is_own = np.isin(model.antecedent.term_inputs, block.inputs)
    if axis["levels"] is None:
        counts, edges = np.histogram(block.values[:, 0], BINS)
    else:
        is_at = (block.values[:, None] == rows[:, block.inputs]).all(axis=2)
        weight = np.ones(len(is_at)) if block.weight is None else block.weight
        counts, edges = weight @ is_at, np.arange(len(rows) + 1) - 0.5
    return axis | {
        "mean": study.anova.mean + study.anova.curve((g,), rows),
        "deviation": deviation,
        "terms": np.exp(model.antecedent.log_memberships(rows.T.copy()))[is_own],
        "edges": edges,
        "counts": counts / counts.sum(),
    }


def _pair(study, g, h):
    """The joint effect of two blocks, less the effects of each alone."""
    (across, one), (up, other) = _along(study, g, _N_ACROSS), _along(study, h, _N_ACROSS)
    rows, own = np.tile(across, (len(up), 1)), study.blocks[h].inputs
    rows[:, own] = np.repeat(up[:, own], len(across), axis=0)
    effect = study.anova.curve((g, h), rows).reshape(len(up), len(across))
    effect -= study.anova.curve((g,), across) + study.anova.curve((h,), up)[:, None]
    return {
        "inputs": (one["input"], other["input"]),
        "points": (one["points"], other["points"]),
        "levels": (one["levels"], other["levels"]),
        "effect": effect,
    }


def _draw_curve(axes, curve):
    points, mean, band = curve["points"], curve["mean"], 2.0 * curve["deviation"]
    on_height = {"transform": axes.get_xaxis_transform()}
    # The histogram fits the room below the curves, in parts of the height of a panel.
    heights = 0.9 * _ROOM / (1.0 + 2.0 * _ROOM) * curve["counts"] / curve["counts"].max()
    axes.stairs(heights, curve["edges"], fill=True, color="0.8", zorder=0, **on_height)
    if curve["levels"] is not None:
        axes.errorbar(points, mean, band, fmt="o", color="black", capsize=3.0)
    else:
        shades = pyplot().get_cmap()(np.linspace(0.0, BRIGHTEST, len(curve["terms"])))
        for term, shade in zip(curve["terms"], shades, strict=True):
            axes.fill_between(points, term, color=shade, alpha=0.13, linewidth=0, **on_height)
        axes.fill_between(points, mean - band, mean + band, color="0.3", alpha=0.4, linewidth=0)
        axes.plot(points, mean, color="black", linewidth=1.8)
    axes.set_xlim(curve["edges"][0], curve["edges"][-1])
    _name(axes.xaxis, curve["input"], points, curve["levels"])
    # A share by draws may come out negative.
    title = f"alone {max(round(100.0 * curve['share']), 0)} % of variance"
    axes.set_title(title, fontsize="small", loc="left")


def _draw_pair(axes, pair):
    largest = np.abs(pair["effect"]).max()
    shown = axes.pcolormesh(*pair["points"], pair["effect"], vmin=-largest, vmax=largest)
    label = f"together {round(100.0 * pair['share'])} % of variance"
    bar = axes.figure.colorbar(shown, ax=axes, location="top")
    spaced(bar.ax)
    bar.set_label(label, fontsize="small", loc="left")
    sides = zip(pair["inputs"], pair["points"], pair["levels"], strict=True)
    for side, of_side in zip((axes.xaxis, axes.yaxis), sides, strict=True):
        _name(side, *of_side)


def _name(side, name, points, levels):
    side.set_label_text(on_axis(name))
    if levels is not None:
        # Of more levels than there is room for, only some are named.
        step = -(-len(levels) // _MOST_LETTERS)
        side.set_ticks(points[::step], [on_axis(level) for level in levels[::step]])
        if len(levels) * max(map(len, levels)) > _MOST_LETTERS:
            turned = 90.0 if side.axis_name == "x" else 0.0
            side.set_tick_params(rotation=turned, labelsize="x-small")
