"""A picture of a tree: its cuts, and at each leaf the value of a rule."""

from dataclasses import dataclass
from typing import Any, Self, cast

import numpy as np

from .._validation import checked_position
from ..antecedent import TreeAntecedent
from ..digits import counted, percent, plain
from ..export import fold
from ..model import TSKModel
from .displays import axes_or_new
from .labels import as_label
from .rules import condition, parts_led
from .sentences import Sentences

# Inches of a letter, of a leaf, and around the tree.
_LETTER, _LEAF, _MARGIN = 0.082, 0.42, 0.3
# Line width, in points, of a branch that no row takes, and how much wider one is that all take.
_THIN, _THICK = 0.6, 6.0


@dataclass(kw_only=True, eq=False, repr=False)
class TreeDisplay:
    """A tree of rules: its cuts, and at each leaf the rule's value and part of the rows.

    A branch is thicker if more rows take it. ``ax_`` and ``figure_`` are matplotlib's, once drawn.

    Parameters
    ----------
    model : TSKModel
        Its rule base is a tree.
    output : int, default=0
        The output whose values stand at the leaves.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.inspection import TreeDisplay
    >>> model = ANFISRegressor(partition="tree", max_rules=4).fit(*make_jang_sinc())
    >>> display = TreeDisplay.from_estimator(model)
    >>> len(display.leaves) == model.n_rules_
    True
    """

    model: TSKModel
    output: int = 0

    @classmethod
    def from_estimator(cls, estimator: Any, *, output: int | str = 0, ax: Any = None) -> Self:
        """Draw the tree of a fitted estimator.

        Parameters
        ----------
        estimator : fitted estimator or TSKModel
            As :func:`skanfis.export.fold` takes it; scalers are folded into the cuts.
        output : int or str, default=0
            Which output, by position or name.
        ax : matplotlib Axes, default=None
            None makes a figure.

        Raises
        ------
        ValueError
            If the rules are no tree.
        """
        model = fold(estimator)
        if not isinstance(model.antecedent, TreeAntecedent):
            raise ValueError(
                f"The model has {counted(model.n_rules, 'rule')} and is not a tree, so there are "
                "no cuts to draw. partition='tree' makes a tree if it finds two rules or more."
            )
        place = checked_position(output, model.output_names, "output")
        return cls(model=model, output=place).plot(ax=ax)

    @property
    def _said(self):
        return Sentences.of(self.model)

    @property
    def values(self) -> np.ndarray:
        """For every leaf, the rule's value where its rows lie, (n_rules,)."""
        return self._said.values[:, self.output]

    @property
    def leaves(self) -> list[str]:
        """The text at every leaf."""
        both = zip(self.values, parts_led(self.model), strict=True)
        return [f"{plain(value)}  ({percent(share)})" for value, share in both]

    def plot(self, *, ax: Any = None) -> Self:
        """Draw the tree on ``ax``, as of :meth:`from_estimator`."""
        model, tree = self.model, cast(TreeAntecedent, self.model.antecedent)
        (order, ends), n_rules = tree.walk, model.n_rules
        # Conditions above and below each node.
        terms = zip(tree.term_inputs, self._said.model.term_names, strict=True)
        words = [as_label(condition(model, j, term)) for j, term in terms]
        words = np.reshape(words, (2, -1)).T[order]
        # By position, leaves first: height in the picture, depth from the root, part of the rows.
        depth, height = np.zeros(2 * n_rules - 1), np.zeros(2 * n_rules - 1)
        share = np.concatenate([parts_led(model), np.zeros(n_rules - 1)])
        for k, pair in enumerate(ends):
            depth[pair] = depth[n_rules + k] + 1.0
        # The branch above a cut is drawn above the branch below it.
        sides = [[is_above for _, is_above in path] for path in tree.paths]
        height[sorted(range(n_rules), key=sides.__getitem__)] = np.arange(n_rules)
        for k, pair in reversed(list(enumerate(ends))):
            height[n_rules + k], share[n_rules + k] = height[pair].mean(), share[pair].sum()
        step = _LETTER * max(map(len, words.ravel())) + _MARGIN
        last = _LETTER * max(map(len, self.leaves)) + _MARGIN
        size = step * depth.max() + last + _MARGIN, _LEAF * n_rules + _MARGIN
        ax = self.ax_ = axes_or_new(ax, size)
        self.figure_ = ax.figure
        for k, pair in enumerate(ends):
            start = depth[n_rules + k], height[n_rules + k]
            for end, text in zip(pair, words[k], strict=True):
                width = _THIN + _THICK * share[end]
                path = [start[0], start[0], depth[end]], [start[1], height[end], height[end]]
                ax.plot(*path, color="0.75", linewidth=width, solid_joinstyle="round", zorder=1)
                place = start[0] + 0.08, height[end] + 0.04 + width / 100.0
                ax.text(*place, text, fontsize="small", va="bottom")
        for r, text in enumerate(self.leaves):
            ax.text(depth[r] + 0.06, height[r], text, fontsize="small", weight="bold", va="center")
        ax.set_xlim(-0.05, depth.max() + last / step)
        ax.set_ylim(-0.6, n_rules - 0.2)
        ax.set_axis_off()
        name = as_label(model.output_names[self.output])
        ax.set_title(f"{name}: what each rule says (its rows)", fontsize="small", loc="left")
        return self
