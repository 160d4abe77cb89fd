r"""A tree of soft splits: rules are its leaves.

Node n cuts one input j at c over a width s,

    sigma_n(x) = 1 / (1 + exp(-(x_j - c) / s)) ,

the membership in "x_j is above c"; that in "below c" is 1 - sigma_n. A rule's strength is the
product over the nodes on its path. Strengths sum to one without normalisation (Jordan and Jacobs
1994). So no rule regains strength far away, and it depends on the inputs on its path alone.

As a rule base it is a table of rules over two terms per node, its sides: first all that are above,
then all that are below. Both sides have one cut and one width.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ..membership import SigmoidFalling, SigmoidRising
from .base import TOLD_APART, TermGroup
from .rule_table import RuleTableAntecedent

# A side reaches 0.9 at the distance TOLD_APART from its cut, not nearer: for the error a narrow
# split is as good as a jump, for a reader it is not.
LEAST_WIDTH = TOLD_APART / np.log(9.0)
# Places, in widths from either cut, at which the product of two sides is evaluated.
_AROUND = np.linspace(-6.0, 6.0, 49)
# Widths of a cut between it and both values of a two-valued input: its sides are 0 or 1 there.
CRISP = 40.0


@dataclass(frozen=True, eq=False)
class TreeAntecedent(RuleTableAntecedent):
    """Leaves of a tree; ``table`` holds the sides on the path to each, from the root."""

    is_ordered = False
    least_width = LEAST_WIDTH

    @classmethod
    def build(cls, inputs, theta, paths):
        """From the input of each node, theta (2, n_nodes), and the path to each leaf.

        A path is a sequence of (node, is_above) from the root.
        """
        inputs, theta = np.asarray(inputs, dtype=int), np.asarray(theta, dtype=float)
        table = np.full((len(paths), max(map(len, paths), default=0)), -1)
        for row, path in zip(table, paths, strict=True):
            row[: len(path)] = [node if is_above else inputs.size + node for node, is_above in path]
        sides = (SigmoidRising, SigmoidFalling)
        return cls(tuple(TermGroup(side, inputs, theta.copy()) for side in sides), table)

    @property
    def n_nodes(self):
        """Number of nodes that cut."""
        return self.n_terms // 2

    @property
    def tied(self):
        """Both sides of a node move by the same displacements."""
        return np.tile(np.arange(2 * self.n_nodes), 2)

    @property
    def paths(self):
        """For every leaf, (node, is_above) from the root."""
        n = self.n_nodes
        return [[(int(t) % n, bool(t < n)) for t in row if t >= 0] for row in self.table]

    @property
    def walk(self):
        """Nodes, each after its parent, and the two children of each, above and below its cut.

        A child is leaf r, or n_rules + k for the k-th of these nodes. Arrays (n_nodes,) and
        (n_nodes, 2).
        """
        depth, ends = np.zeros(self.n_nodes, dtype=int), np.zeros((self.n_nodes, 2), dtype=int)
        for r, path in enumerate(self.paths):
            after = [*(self.n_rules + node for node, _ in path[1:]), r]
            for place, ((node, is_above), end) in enumerate(zip(path, after, strict=False)):
                depth[node], ends[node, 0 if is_above else 1] = place, end
        order = np.argsort(depth, kind="stable")
        rank = np.concatenate([np.arange(self.n_rules), self.n_rules + np.argsort(order)])
        return order, rank[ends[order]]

    def split(self, leaf, j, cut, log_width):
        """The tree with two leaves in place of one: that above the cut first, then that below."""
        paths, node = self.paths, self.n_nodes
        paths[leaf : leaf + 1] = [[*paths[leaf], (node, side)] for side in (True, False)]
        nodes = self.groups[0]
        theta = np.column_stack([nodes.theta, [cut, log_width]])
        return self.build(np.append(nodes.inputs, j), theta, paths)

    def without_implied(self, tolerance, columns=None):
        """A table of the rules without sides that another side on the same path implies.

        "x < 7.1 ± 0.7" implies "x < 9 ± 1" if the product of the memberships in "below 7.1" and
        "above 9" nowhere exceeds the tolerance. Inputs with the same name in ``columns`` are
        indicators of one column: one above its cut implies that the others are below theirs.
        """
        nodes, table = self.groups[0], self.table.copy()
        # Of two cuts k and m of one input, whether "below k" implies "below m".
        is_less = nodes.inputs[:, None] == nodes.inputs
        is_less &= nodes.theta[0][:, None] < nodes.theta[0]
        for k, m in np.argwhere(is_less):
            is_less[k, m] = _overlap(nodes.theta[:, [k, m]]) <= tolerance
        implies = linalg.block_diag(is_less.T, is_less)
        if columns is not None:
            of = np.array(columns)[nodes.inputs]
            is_other = (of[:, None] == of) & (nodes.inputs[:, None] != nodes.inputs)
            implies[: len(of), len(of) :] = is_other
        for row in table:
            own = row[row >= 0]
            row[np.isin(row, own[implies[np.ix_(own, own)].any(axis=0)])] = -1
        return self if (table == self.table).all() else RuleTableAntecedent(self.groups, table)

    def factors(self, Z):
        return np.exp(self.log_memberships(Z))

    def normalise(self, log_mu):
        strengths = np.exp(self._contains @ log_mu)
        return strengths, strengths


def _overlap(theta):
    """The largest product of "below the first cut" and "above the second" over all x."""
    # It lies within some widths of one of the cuts.
    x = (theta[0] + _AROUND[:, None] * np.exp(theta[1])).ravel()
    below, above = (SigmoidFalling, theta[:, :1]), (SigmoidRising, theta[:, 1:])
    return np.exp(sum(side.log_value(x, own) for side, own in (below, above)).max())
