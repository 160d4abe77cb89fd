r"""Promises kept by how a model is made: inequalities on the consequents, proven by themselves.

Let no rule's slope b_r by x_j be negative. A prediction then rises with x_j all over a box where
pairs of rules (r, s) keep, with a weight D of each pair,

    (3 b_r + b_s) / D + f_r - f_s >= 0   and   (b_r + 3 b_s) / D + f_r - f_s >= 0 .

*Tree.* At a cut of x_j of width 1 / D, with r above it and s below: what both add to dy / dx_j is,
but for a factor, t b_r + (1 - t) b_s + t (1 - t) D (f_r - f_s) with t = sigma. Over t (1 - t), the
part of the slopes is at least (sqrt b_r + sqrt b_s)^2, which is no less than either sum. A slope is
shared among the cuts of x_j on the path of its rule.

*Any other rule base*, with w = softmax of log-strengths and a_r their slopes by x_j: dy / dx_j =
E b + Cov(a, f). The covariance is the sum over pairs of w_r w_s D (f_r - f_s), with D = a_r - a_s,
and E b at least that of w_r w_s (b_r + b_s + 2 sqrt(b_r b_s) / (n - 1)), of n rules. On a grid all
that is along the input's own axis, of n terms. Where D changes its sign, either order counts.

A prediction is within limits where every rule is. All of it is linear in the consequents, and a
linear function is least at a corner of the box.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..antecedent import Antecedent, TreeAntecedent
from ..membership import Gaussian
from ..model import TSKModel
from .inequalities import InfeasibleError, nearest
from .terms import EPS, is_known, term_ranges

# In standard deviations of the target, what inequalities are kept by; slopes are by so much more.
_MARGIN, _SLOPE = 1e-9, 1e3
# Rounds in which corners are added. Pieces of the range in which slopes of log-strengths are
# enclosed; those of Gaussians are straight lines, compared this far beyond its ends, in its widths.
_MOST_ROUNDS, _PIECES, _BEYOND = 60, 64, 1e-9


@dataclass(frozen=True, eq=False)
class RuleOrder:
    """What rules of one output must keep on a box, an entry of each array for an inequality.

    f[above] - f[below] + gains @ (slopes of both by the input of ``column``) >= least; -1 is no
    rule, and no column. ``signs`` are those of the slopes, by column.
    """

    above: np.ndarray
    below: np.ndarray
    gains: np.ndarray
    column: np.ndarray
    least: np.ndarray
    signs: np.ndarray

    @classmethod
    def of(cls, antecedent: Antecedent, signs, limits, low, high, slope_inputs):
        """None where nothing is known that is enough; columns are those of ``slope_inputs``."""
        n_rules, found = antecedent.n_rules, []
        for j in np.flatnonzero(signs):
            pairs = _pairs(antecedent, j, low[j], high[j])
            if pairs is None:
                return None
            rules, weight, gains = pairs
            own = weight > 0.0
            rules, gains = rules[own], gains[own] / weight[own, None]
            place = np.flatnonzero(slope_inputs == j)
            column = np.full(len(rules), place[0] if place.size else -1)
            # What must not be below and what must not be above, where it is to fall.
            found.append((rules[:, :: signs[j]], signs[j] * gains[:, :: signs[j]], column))
        nothing = np.empty((0, 2), dtype=int), np.empty((0, 2)), np.empty(0, dtype=int)
        rules, gains, column = map(np.concatenate, zip(nothing, *found, strict=True))
        least, every = np.zeros(len(rules)), np.arange(n_rules)
        none = np.full(n_rules, -1)
        for limit, both in ((limits[0], (every, none)), (-limits[1], (none, every))):
            if np.isfinite(limit):
                rules = np.vstack([rules, np.column_stack(both)])
                gains, column = np.vstack([gains, np.zeros((n_rules, 2))]), np.append(column, none)
                least = np.append(least, np.full(n_rules, limit))
        return cls(rules[:, 0], rules[:, 1], gains, column, least, signs[slope_inputs])

    def left(self, rules, low, high):
        """By how much each holds for rules a + b x on a box, its worst corner, and its rounding."""
        # No rule is zero, and no column too.
        rules = np.pad(rules, ((0, 1), (0, 1)))
        apart = (rules[self.above] - rules[self.below])[:, :-1]
        corner = np.where(apart[:, 1:] > 0.0, low, high)
        column = np.where(self.column < 0, -1, 1 + self.column)
        slopes = np.stack([rules[self.above, column], rules[self.below, column]], axis=1)
        parts = np.column_stack(
            [-self.least, apart[:, :1], apart[:, 1:] * corner, self.gains * slopes]
        )
        return parts.sum(axis=1), corner, (8 + parts.shape[1]) * EPS * np.abs(parts).sum(axis=1)

    def holds(self, rules, low, high):
        """Whether all hold for certain, whatever rounding has done."""
        left, _, rounding = self.left(rules, low, high)
        return bool((left >= rounding).all() and (self.signs * rules[:, 1:] >= 0.0).all())


def order_of(model: TSKModel, signs, limits=(-np.inf, np.inf)):
    """The order of a frozen model's rules, and the range about its reference."""
    inputs = np.arange(model.coefficients.shape[1] - 1)
    order = RuleOrder.of(model.antecedent, signs, limits, model.minimum, model.maximum, inputs)
    return order, *((end - model.reference)[inputs] for end in (model.minimum, model.maximum))


def _pairs(antecedent, j, low, high):
    """Pairs of rules (above, below), the most that D can be, and what slopes gain, times D.

    D of no more than zero asks for nothing. None where slopes of log-strengths have no bound.
    """
    if isinstance(antecedent, TreeAntecedent):
        return _pairs_of_tree(antecedent, j)
    terms = np.flatnonzero(antecedent.term_inputs == j)
    steep = _slopes(antecedent, j, low, high)
    if steep is None:
        return None
    rules = np.arange(antecedent.n_rules)
    if antecedent.grid_counts is None:
        table = antecedent.rule_terms
        rules, steep = rules[:, None], [end[:, table].sum(axis=2) for end in steep]
    elif terms.size:
        axis = antecedent.share_inputs.index(j)
        rules = np.moveaxis(rules.reshape(antecedent.grid_counts), axis, 0)
        rules, steep = rules.reshape(terms.size, -1), [end[:, terms] for end in steep]
    else:
        return np.empty((0, 2), dtype=int), np.empty(0), np.empty((0, 2))
    n = len(rules)
    above, below = (one.ravel() for one in np.meshgrid(range(n), range(n), indexing="ij"))
    apart = above != below
    above, below = above[apart], below[apart]
    weight = (steep[1][:, above] - steep[0][:, below]).max(axis=0)
    both = np.stack([rules[above], rules[below]], axis=-1).reshape(-1, 2)
    return _both_sums(
        both, np.repeat(weight, rules.shape[1]), np.ones(both.shape), 2.0 / max(n - 1, 1)
    )


def _both_sums(rules, weight, gains, more):
    """Either sum of slopes, in which one of both counts for more."""
    sums = [gains * (1.0 + more * np.array(one)) for one in ((1.0, 0.0), (0.0, 1.0))]
    return np.tile(rules, (2, 1)), np.tile(weight, 2), np.vstack(sums)


def _slopes(antecedent, j, low, high):
    """Least and largest slopes by x_j of log-memberships on pieces of its range.

    Two arrays (n_pieces, n_terms + 1), the last for no term; None where they have no bound.
    """
    groups = [group for group in antecedent.groups if (group.inputs == j).any()]
    if not all(is_known(group.family) for group in groups):
        return None
    own = np.append(antecedent.term_inputs == j, False)
    ends = np.array([low, high]) + _BEYOND * (high - low) * np.array([-1.0, 1.0])
    if all(group.family is Gaussian for group in groups):
        # At both ends: in between they are straight lines, and so are differences.
        found, start = np.zeros((2, own.size)), 0
        for group in antecedent.groups:
            stop = start + group.n_terms
            place = start + np.flatnonzero(group.inputs == j)
            if place.size:
                center, log_width = group.theta[:, place - start]
                found[:, place] = (center - ends[:, None]) * np.exp(-2.0 * log_width)
            start = stop
        return found, found
    edges = np.linspace(ends[0], ends[1], _PIECES + 1)
    n_inputs = 1 + antecedent.term_inputs.max()
    pieces = (np.broadcast_to(edge, (n_inputs, _PIECES)) for edge in (edges[:-1], edges[1:]))
    with np.errstate(all="ignore"):
        ranges = term_ranges(antecedent, *pieces)
    least, most = (np.where(own, end.T, 0.0) for end in (ranges.slope_low, ranges.slope_high))
    return (least, most) if np.isfinite([least, most]).all() else None


def _pairs_of_tree(antecedent, j):
    nodes, paths = antecedent.groups[0], [dict(path) for path in antecedent.paths]
    cuts = np.flatnonzero(nodes.inputs == j)
    share = 1.0 / np.array([max(np.isin(cuts, list(path)).sum(), 1) for path in paths])
    rules, weight = [np.empty((0, 2), dtype=int)], [np.empty(0)]
    for node in cuts:
        sides = (
            [r for r, path in enumerate(paths) if path.get(node) is side] for side in (True, False)
        )
        rules.append(np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2))
        weight.append(np.full(len(rules[-1]), np.exp(-nodes.theta[1, node])))
    both = np.vstack(rules)
    return _both_sums(both, np.concatenate(weight), share[both], 2.0)


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


def held_by_order(order, evaluation, problem, k, equal, equal_to, is_line=False):
    """The nearest local consequents of output k that keep an order, (n_columns,).

    ``equal`` are local rows, and ``equal_to`` what they are; of a line all rules are one. Then what
    is met with equality: rows on [1, z], (n, n_rules, n_basis). InfeasibleError where none do.
    """
    n_rules, n_basis = evaluation.antecedent.n_rules, problem.n_basis
    low, high = (end[problem.consequent_inputs] for end in problem.rows.inputs.box)
    normal, targets, basis = evaluation.normal, problem.rows.targets, np.eye(n_basis)

    def in_local(rows):
        flat = rows.reshape(len(rows), n_rules * n_basis)
        return problem.local.transform_rows(np.array(flat.T, order="C")).T if len(flat) else flat

    same = np.zeros((n_rules - 1 if is_line else 0, n_basis, n_rules, n_basis))
    for r, rows in enumerate(same, start=1):
        rows[:, r], rows[:, 0] = basis, -basis
    same = same.reshape(-1, n_rules, n_basis)
    equal = np.vstack([equal, in_local(same)])
    equal_to = np.append(equal_to, np.zeros(len(same)))
    # Slopes have their signs; limits are in standardised units, an order has none.
    columns = np.flatnonzero(order.signs)
    every = np.repeat(np.arange(1 if is_line else n_rules), columns.size)
    columns = np.resize(columns, every.size)
    held = np.zeros((every.size, n_rules, n_basis))
    held[np.arange(every.size), every, 1 + columns] = order.signs[columns]
    at_least = np.full(len(held), _SLOPE * _MARGIN)
    alone = np.sign(order.below - order.above) * (np.minimum(order.above, order.below) < 0)
    least = (order.least + alone * targets.offset[k]) / targets.scale[k] + _MARGIN
    order, local = replace(order, least=least), in_local(held)
    for _ in range(_MOST_ROUNDS):
        start = normal.coefficients[:, k]
        solved, active = nearest(normal.factor, start, equal, equal_to, local, at_least)
        rules = problem.local.to_global(solved[:, None]).reshape(n_rules, n_basis)
        left, corner, _ = order.left(rules, low, high)
        short = np.flatnonzero(left < -0.5 * _MARGIN)
        if not short.size:
            break
        rows, place = np.zeros((short.size, n_rules + 1, n_basis + 1)), np.arange(short.size)
        at = np.column_stack([np.ones(short.size), corner[short], np.zeros(short.size)])
        column = np.where(order.column[short] < 0, -1, 1 + order.column[short])
        for own, sign, gain in zip(
            (order.above[short], order.below[short]), (1.0, -1.0), order.gains[short].T, strict=True
        ):
            rows[place, own] += sign * at
            rows[place, own, column] += gain
        held = np.concatenate([held, rows[:, :-1, :-1]])
        local = np.vstack([local, in_local(rows[:, :-1, :-1])])
        at_least = np.append(at_least, order.least[short])
    else:
        raise InfeasibleError(False)
    return solved, np.concatenate([same, held[active]])
