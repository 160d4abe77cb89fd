"""A picture of a search: the error of every candidate against its reading cost."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pandas as pd

from ..export.folding import last_step
from ..learning.data import never_changes
from ..search.choice import tolerated
from .displays import axes_or_new, mark_decades

# Colours that the colour-blind can tell apart, and a marker for each kind.
_KINDS = {"one rule": ("0.3", "s"), "grid": ("#0072b2", "o"), "scattered": ("#d55e00", "^")}
_KINDS["tree"] = ("#009e73", "D")
# Errors that differ by more than this factor are drawn on a logarithmic scale.
_FAR_APART = 5.0


@dataclass(kw_only=True, eq=False, repr=False)
class StructureDisplay:
    """Expected error on new rows against reading cost, for every structure that was compared.

    The chosen one is ringed. Below the dashed line, errors are surely within the tolerance of
    ``simplicity``. A candidate further to the left there has more rules than the best, or is
    crossed out because its rules are worse than the mean one by one. ``ax_`` and ``figure_`` are
    matplotlib's, once drawn.

    Parameters
    ----------
    structures : list of dict
        As ``structures_`` of an estimator: of each its "kind", "rules", "reading_cost",
        "expected_error", whether "rules_beat_mean" and whether it was "chosen".
    tolerance : float
        Error, in standard deviations of the target, up to which a candidate is near enough to the
        best. The best of the search must win by more than chance, so that the search may tolerate a
        little more.
    simplicity : float
        That of the estimator.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import StructureDisplay
    >>> model = ANFISRegressor(max_rules=6).fit(*make_jang_sinc())
    >>> display = StructureDisplay.from_estimator(model)
    >>> display.ax_.get_xlabel()
    'reading cost, numerals in the rules'
    """

    structures: Sequence[Mapping[str, Any]]
    tolerance: float
    simplicity: float

    @classmethod
    def from_estimator(cls, estimator: Any, *, ax: Any = None) -> Self:
        """Draw the structures that the search of a fitted estimator has compared.

        Parameters
        ----------
        estimator : fitted estimator
            An ANFISRegressor; or a Pipeline, a TransformedTargetRegressor or a search such as
            GridSearchCV that ends in one.
        ax : matplotlib Axes, default=None
            None makes a figure.
        """
        last = last_step(estimator)
        every = getattr(last, "structures_", [])
        structures = [one for one in every if np.isfinite(one["expected_error"])]
        if not structures:
            raise ValueError(
                "The estimator has no structure with an expected error, so there is nothing to "
                "draw. Fit one with n_mfs='auto' and partition='auto'."
            )
        least = min(one["expected_error"] for one in structures) ** 2
        taken = next(one["expected_error"] for one in structures if one["chosen"]) ** 2
        # The mean's squared error is one for each output that varies: they are standardised.
        target = last.model_.target
        variance = np.count_nonzero(~never_changes(target.minimum, target.maximum))
        most = max(tolerated(least, float(variance), last.simplicity), taken)
        tolerance = float(np.sqrt(most))
        display = cls(structures=structures, tolerance=tolerance, simplicity=last.simplicity)
        return display.plot(ax=ax)

    def plot(self, *, ax: Any = None) -> Self:
        """Draw the candidates on ``ax``, as of :meth:`from_estimator`."""
        ax = self.ax_ = axes_or_new(ax)
        self.figure_ = ax.figure
        table = pd.DataFrame(self.structures).sort_values("reading_cost", kind="stable")
        costs, errors = table["reading_cost"], table["expected_error"]
        for kind, own in table.groupby("kind", sort=False).groups.items():
            color, marker = _KINDS[kind]
            line = {"marker": marker, "color": color, "linewidth": 0.8, "label": kind}
            ax.plot(costs[own], errors[own], "-", **line)
        poor = ~table["rules_beat_mean"]
        if poor.any():
            label = "rules worse than the mean, one by one"
            ax.plot(costs[poor], errors[poor], "x", color="black", markersize=8, label=label)
        chosen = table["chosen"]
        n_rules = table["rules"][chosen].item()
        label = "chosen: one rule" if n_rules == 1 else f"chosen: {n_rules} rules"
        ring = {"markersize": 13, "markerfacecolor": "none", "markeredgecolor": "black"}
        ax.plot(costs[chosen], errors[chosen], "o", **ring, label=label)
        label = f"tolerated, simplicity={self.simplicity:g}"
        ax.axhline(self.tolerance, linestyle="--", color="0.5", linewidth=1, label=label)
        ax.set_xlabel("reading cost, numerals in the rules")
        ax.set_ylabel("error expected of new rows,\nsd of the target")
        ax.set_xscale("log")
        mark_decades(ax.xaxis)
        if 0.0 < _FAR_APART * errors.min() < errors.max():
            ax.set_yscale("log")
            mark_decades(ax.yaxis)
        # Above the picture, where it hides no candidate.
        place = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "borderaxespad": 0.1}
        ax.legend(ncols=2, fontsize="small", frameon=False, **place)
        return self
