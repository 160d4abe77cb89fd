r"""Promises kept by how a model is made: inequalities on the consequents, proven by themselves.

A prediction rises with x_j all over the range where every rule's slope by x_j is not negative, and
rules stand in order: f_r >= f_s all over the range for certain pairs (r, s).

*Tree.* At a cut of x_j, every rule above and every rule below it: the derivative is
sigma' (A - B) / s + sigma dA + (1 - sigma) dB, with A and B what both sides say.

*Any other rule base*, with w = softmax of log-strengths and a_r their slopes by x_j: dy / dx_j =
E b_j + Cov(a, f), and a covariance of two that are in one order is not negative (Chebyshev). On a
grid it is taken along the input's own axis. Slopes of Gaussian log-memberships are straight lines:
what is in one order at both ends of the range is so in between, as centres are if widths are equal.

A prediction is within limits where every rule is. All of it is linear in the consequents, and a
linear function is least at a corner of the range.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..antecedent import Antecedent, TreeAntecedent
from ..membership import Gaussian
from ..model import TSKModel
from .inequalities import InfeasibleError, nearest
from .terms import EPS

# In standard deviations of the target: what is left for rounding, and what is none.
_MARGIN, _ROUNDING = 1e-9, 1e-11
# Rounds in which corners are added. Slopes are compared this far beyond the range, in its widths.
_MOST_ROUNDS, _BEYOND = 200, 1e-9


@dataclass(frozen=True, eq=False)
class RuleOrder:
    """What rules of one output must keep: f[above] - f[below] >= least on a box; -1 is no rule.

    ``signs`` are those of the slopes. Rules of one label are to say the same.
    """

    above: np.ndarray
    below: np.ndarray
    least: np.ndarray
    signs: np.ndarray
    labels: np.ndarray

    @classmethod
    def of(cls, antecedent: Antecedent, signs, limits, low, high, is_line=False):
        """None where nothing is known that is enough; of a line, all rules are one."""
        n_rules, pairs = antecedent.n_rules, [np.empty((0, 2), dtype=int)]
        for j in () if is_line else np.flatnonzero(signs):
            found = _pairs(antecedent, j, low[j], high[j])
            if found is None:
                return None
            pairs.append(found[:, :: signs[j]])
        above, below = np.vstack(pairs).T
        graph = coo_array((np.ones(above.size), (above, below)), shape=(n_rules, n_rules))
        # Rules that must not be below one another say the same.
        labels = connected_components(graph, connection="strong")[1]
        if is_line:
            labels = np.zeros(n_rules, dtype=int)
        apart = labels[above] != labels[below]
        above, below = above[apart], below[apart]
        least, every, none = np.zeros(above.size), np.arange(n_rules), np.full(n_rules, -1)
        for limit, up, down in ((limits[0], every, none), (-limits[1], none, every)):
            if np.isfinite(limit):
                above, below = np.append(above, up), np.append(below, down)
                least = np.append(least, np.full(n_rules, limit))
        return cls(above, below, least, signs, labels)

    def left(self, rules, low, high):
        """By how much each holds for rules a + b x on a box, its worst corner, and its rounding."""
        rules = np.vstack([rules, np.zeros((1, rules.shape[1]))])
        apart = rules[self.above] - rules[self.below]
        corner = np.where(apart[:, 1:] > 0.0, low, high)
        parts = np.column_stack([-self.least, apart[:, :1], apart[:, 1:] * corner])
        return parts.sum(axis=1), corner, (8 + parts.shape[1]) * EPS * np.abs(parts).sum(axis=1)

    def repaired(self, rules, low, high):
        """Rules that keep it for certain, or None: rounding is made good by raising values."""
        rules = rules.copy()
        for label in np.unique(self.labels):
            own = self.labels == label
            rules[own] = rules[own].mean(axis=0)
        rules[:, 1:][rules[:, 1:] * self.signs[: rules.shape[1] - 1] < 0.0] = 0.0
        for _ in range(2 * len(rules) + 3):
            left, _, rounding = self.left(rules, low, high)
            is_short = left < rounding
            if not is_short.any():
                return rules
            if (self.above[is_short] < 0).any():
                return None
            lift = np.zeros(len(rules))
            at, by = self.labels[self.above[is_short]], 2.0 * rounding - left
            np.maximum.at(lift, at, by[is_short])
            rules[:, 0] += lift[self.labels]
        return None


def is_in_order(model: TSKModel, output, j, sign) -> bool:
    """Whether rules in order prove that an output rises (sign 1), or falls, all over the range."""
    order = RuleOrder.of(
        model.antecedent,
        sign * (np.arange(model.n_inputs) == j),
        (-np.inf, np.inf),
        model.minimum,
        model.maximum,
    )
    rules = model.coefficients[:, :, output]
    if order is None:
        return False
    n_slopes = rules.shape[1] - 1
    ends = ((end - model.reference)[:n_slopes] for end in (model.minimum, model.maximum))
    left, _, rounding = order.left(rules, *ends)
    return bool((left >= rounding).all() and (sign * rules[:, 1:][:, j : j + 1] >= 0.0).all())


def _pairs(antecedent, j, low, high):
    """Pairs of rules, (above, below), that in order let predictions rise with x_j; or None."""
    if isinstance(antecedent, TreeAntecedent):
        return _pairs_of_tree(antecedent, j)
    terms = np.flatnonzero(antecedent.term_inputs == j)
    steep, start = np.zeros((2, antecedent.n_terms + 1)), 0
    ends = np.array([low, high]) + _BEYOND * (high - low) * np.array([-1.0, 1.0])
    for group in antecedent.groups:
        own = np.flatnonzero(group.inputs == j)
        if own.size and group.family is not Gaussian:
            return None
        if own.size:
            center, log_width = group.theta[:, own]
            steep[:, start + own] = (center - ends[:, None]) * np.exp(-2.0 * log_width)
        start += group.n_terms
    rules = np.arange(antecedent.n_rules)
    if antecedent.grid_counts is None:
        rules, steep = rules[:, None], steep[:, antecedent.rule_terms].sum(axis=2)
    elif terms.size:
        axis = antecedent.share_inputs.index(j)
        rules = np.moveaxis(rules.reshape(antecedent.grid_counts), axis, 0)
        rules, steep = rules.reshape(terms.size, -1), steep[:, terms]
    else:
        return np.empty((0, 2), dtype=int)
    order = np.lexsort(steep[::-1])
    rise = np.diff(steep[:, order], axis=1)
    if (rise < 0.0).any():
        return None
    step = np.append(0, np.cumsum((rise > 0.0).any(axis=0)))
    found = [np.empty((0, 2), dtype=int)]
    for k in range(step[-1]):
        below, above = rules[order[step == k]], rules[order[step == k + 1]]
        both = np.broadcast_arrays(above[:, None], below[None])
        found.append(np.column_stack([one.ravel() for one in both]))
    return np.vstack(found)


def _pairs_of_tree(antecedent, j):
    found = [np.empty((0, 2), dtype=int)]
    paths = [dict(path) for path in antecedent.paths]
    for node in np.flatnonzero(antecedent.groups[0].inputs == j):
        above, below = (
            [r for r, path in enumerate(paths) if path.get(node) is side] for side in (True, False)
        )
        found.append(np.stack(np.meshgrid(above, below), axis=-1).reshape(-1, 2))
    return np.vstack(found)


def with_equal_widths(antecedent: Antecedent, inputs) -> Antecedent:
    """The same rule base with one width for all Gaussian terms of each of some inputs."""
    groups = []
    for group in antecedent.groups:
        theta = group.theta.copy()
        for j in inputs if group.family is Gaussian else ():
            own = group.inputs == j
            theta[1, own] = theta[1, own].mean() if own.any() else 0.0
        groups.append(replace(group, theta=theta))
    return replace(antecedent, groups=tuple(groups))


def held_by_order(orders, evaluation, problem, equalities):
    """The nearest local consequents that keep an order by output, and what they meet with equality.

    ``equalities`` are local rows and what they equal, by output. What is met are rows on [1, z],
    (n, n_rules, n_basis) of every output. InfeasibleError where there are none.
    """
    local, met = evaluation.normal.coefficients.copy(), []
    low, high = (end[problem.consequent_inputs] for end in problem.rows.inputs.box)
    for k, order in enumerate(orders):
        solve = _Corners(order, evaluation, problem, equalities[0], equalities[1][:, k])
        try:
            local[:, k] = solve.run(k, low, high)
        except InfeasibleError as failure:
            failure.output = k
            raise
        met.append(solve.met)
    return local, met


class _Corners:
    """One output: inequalities at corners, which are added until all hold."""

    def __init__(self, order, evaluation, problem, equal, equal_to):
        self.order, self.normal, self.problem = order, evaluation.normal, problem
        self.n_rules, self.n_basis = evaluation.antecedent.n_rules, problem.n_basis
        first = np.array([np.flatnonzero(order.labels == label)[0] for label in order.labels])
        basis = np.eye(self.n_basis)
        doubles = np.flatnonzero(first != np.arange(self.n_rules))
        self.same = np.zeros((doubles.size, self.n_basis, self.n_rules, self.n_basis))
        for place, r in zip(self.same, doubles, strict=True):
            place[:, r], place[:, first[r]] = basis, -basis
        self.same = self.same.reshape(-1, self.n_rules, self.n_basis)
        self.equal = np.vstack([equal, self._in_local(self.same)])
        self.equal_to = np.concatenate([equal_to, np.zeros(len(self.same))])
        # The sign of every slope; of rules that are one, of the first.
        slopes = np.zeros((0, self.n_rules, self.n_basis))
        if self.n_basis > 1:
            signs = order.signs[problem.consequent_inputs]
            rules, inputs = (
                one.ravel() for one in np.meshgrid(np.unique(first), np.flatnonzero(signs))
            )
            slopes = np.zeros((rules.size, self.n_rules, self.n_basis))
            slopes[np.arange(rules.size), rules, 1 + inputs] = signs[inputs]
        self.rows, self.least = slopes, np.zeros(len(slopes))
        self.met = self.same

    def _in_local(self, rows):
        flat = rows.reshape(len(rows), self.n_rules * self.n_basis)
        if not len(flat):
            return flat
        return self.problem.local.transform_rows(np.array(flat.T, order="C")).T

    def run(self, k, low, high):
        targets, start = self.problem.rows.targets, self.normal.coefficients[:, k]
        # Limits in standardised units; an order has none.
        order = self.order
        alone = np.where(order.below < 0, 1.0, np.where(order.above < 0, -1.0, 0.0))
        least = (order.least - alone * targets.offset[k]) / targets.scale[k] + _MARGIN
        order, local = replace(order, least=least), self._in_local(self.rows)
        for _ in range(_MOST_ROUNDS):
            solved, active = nearest(
                self.normal.factor, start, self.equal, self.equal_to, local, self.least
            )
            rules = self.problem.local.to_global(solved[:, None]).reshape(self.n_rules, -1)
            left, corner, _ = order.left(rules, low, high)
            short = np.flatnonzero(left < -_ROUNDING)
            if not short.size:
                break
            rows = np.zeros((short.size, self.n_rules + 1, self.n_basis))
            at, place = np.column_stack([np.ones(short.size), corner[short]]), np.arange(short.size)
            rows[place, order.above[short]] += at
            rows[place, order.below[short]] -= at
            rows = rows[:, :-1]
            self.rows = np.concatenate([self.rows, rows])
            local = np.vstack([local, self._in_local(rows)])
            self.least = np.append(self.least, order.least[short])
        self.met = np.concatenate([self.same, self.rows[active]])
        return solved
