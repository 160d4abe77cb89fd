r"""Rules in order: predictions that rise, or keep within limits, by how a model is made.

Let no rule's slope by x_j be negative, and let certain rules ("above") be no less than others
("below") at every corner of a box, and so all over it. Then predictions rise with x_j there:

*Tree.* At a cut of x_j every rule above it is at least every rule below it. With sigma the truth of
"above", y = sigma A + (1 - sigma) B, where A and B are means over the rules above and below: A is
at least B, sigma rises, and A and B rise themselves, by induction from the leaves.

*Gaussian terms of one width on x_j.* Rules are ordered as their centres c in x_j are; on a grid,
those that have all other terms alike. With w the strengths and f the values of rules, b their
slopes, and a = (c - x_j) / width^2 the slopes of log w: dy / dx_j = E b + Cov(a, f), and the
covariance of two things in the same order, the sum over pairs of w_r w_s (a_r - a_s) (f_r - f_s),
is not negative.

*One line for all rules* rises where its slope does not fall.

To fall is the same with all orders reversed. A prediction is within limits where every rule is.
All of it is linear in the consequents, and a linear function is least at a corner of the box.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..antecedent import Antecedent, GridAntecedent, TreeAntecedent
from ..membership import Gaussian
from ..model import TSKModel
from .quadratic_program import InfeasibleError, nearest
from .terms import EPS

# In standard deviations of the target, what inequalities are kept by; slopes are by so much more.
_MARGIN, _SLOPE = 1e-9, 1e3
# Rounds in which corners are added.
_MOST_ROUNDS = 60
ONE_RULE = GridAntecedent.build([], [], [])


@dataclass(frozen=True, eq=False)
class RuleOrder:
    """What the rules of one output must keep: f[above] - f[below] >= least, on all of a box.

    Rule -1 is zero everywhere. ``signs`` are those of the slopes, by column.
    """

    above: np.ndarray
    below: np.ndarray
    least: np.ndarray
    signs: np.ndarray

    @classmethod
    def of(cls, antecedent: Antecedent, signs, limits, slope_inputs):
        """None where no order is known that is enough; columns are those of ``slope_inputs``."""
        pairs = [np.empty((0, 2), dtype=int)]
        for j in np.flatnonzero(signs):
            found = _pairs(antecedent, j)
            if found is None:
                return None
            pairs.append(found[:, :: signs[j]])
        n_ordered = sum(map(len, pairs))
        least = [np.zeros(n_ordered)]
        every = np.arange(antecedent.n_rules)
        nothing = np.full(every.size, -1)
        for limit, both in ((limits[0], (every, nothing)), (-limits[1], (nothing, every))):
            if np.isfinite(limit):
                pairs.append(np.column_stack(both))
                least.append(np.full(every.size, limit))
        above, below = np.vstack(pairs).T
        return cls(above, below, np.concatenate(least), signs[slope_inputs])

    def left(self, rules, low, high):
        """By how much each holds for rules a + b x on a box, its worst corner, and its rounding."""
        rules = np.vstack([rules, np.zeros((1, rules.shape[1]))])
        apart = rules[self.above] - rules[self.below]
        corner = np.where(apart[:, 1:] > 0.0, low, high)
        parts = np.column_stack([-self.least, apart[:, 0], apart[:, 1:] * corner])
        return parts.sum(axis=1), corner, (8 + parts.shape[1]) * EPS * np.abs(parts).sum(axis=1)

    def holds(self, rules, low, high):
        """Whether all hold for certain, whatever rounding has done."""
        left, _, rounding = self.left(rules, low, high)
        return bool((left >= rounding).all() and (self.signs * rules[:, 1:] >= 0.0).all())


def is_in_order(model: TSKModel, output, signs, limits=(-np.inf, np.inf)):
    """Whether a frozen model keeps signs and limits all over its range, by the order of its rules.

    This is the certificate: it knows nothing of how the model was found.
    """
    antecedent, rules = model.antecedent, model.coefficients[:, :, output]
    if (rules == rules[0]).all():
        antecedent, rules = ONE_RULE, rules[:1]
    inputs = np.arange(rules.shape[1] - 1)
    order = RuleOrder.of(antecedent, signs, limits, inputs)
    ends = ((end - model.reference)[inputs] for end in (model.minimum, model.maximum))
    return order is not None and order.holds(rules, *ends)


def _pairs(antecedent, j):
    """Rules (above, below) that must be in order for predictions to rise with x_j, (n, 2)."""
    if isinstance(antecedent, TreeAntecedent):
        return _pairs_of_tree(antecedent, j)
    is_own = np.append(antecedent.term_inputs == j, False)
    has_own = is_own[antecedent.rule_terms]
    if not has_own.any():
        return np.empty((0, 2), dtype=int)
    # One term each, of one width: else no order of the rules is known to be enough.
    groups = [group for group in antecedent.groups if (group.inputs == j).any()]
    is_gaussian = all(group.family is Gaussian for group in groups)
    if not is_gaussian or (has_own.sum(axis=1) != 1).any():
        return None
    widths = np.concatenate([group.theta[1, group.inputs == j] for group in groups])
    if np.ptp(widths) > 0.0:
        return None
    centers = np.append(antecedent.term_places, 0.0)[antecedent.rule_terms[has_own]]
    lines = np.arange(antecedent.n_rules)[None]
    if antecedent.grid_counts is not None:
        axis = antecedent.share_inputs.index(j)
        lines = np.moveaxis(lines.reshape(antecedent.grid_counts), axis, -1)
        lines = lines.reshape(-1, antecedent.grid_counts[axis])
    return np.vstack([_neighbours(line, centers[line]) for line in lines])


def _neighbours(rules, places):
    """Rules (above, below) that are next to each other; of the same place all, in no order."""
    levels = [rules[places == place] for place in np.unique(places)]
    pairs = [_all_pairs(above, below) for below, above in pairwise(levels)]
    return np.vstack([np.empty((0, 2), dtype=int), *pairs])


def _pairs_of_tree(antecedent, j):
    paths = [dict(path) for path in antecedent.paths]
    pairs = [np.empty((0, 2), dtype=int)]
    for node in np.flatnonzero(antecedent.groups[0].inputs == j):
        above, below = (
            [r for r, path in enumerate(paths) if path.get(node) is side] for side in (True, False)
        )
        pairs.append(_all_pairs(above, below))
    return np.vstack(pairs)


def _all_pairs(above, below):
    return np.stack(np.meshgrid(above, below), axis=-1).reshape(-1, 2)


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


def nearest_in_order(order: RuleOrder, factor, start, to_rules, box, equal, equal_to):
    """The u nearest to ``start`` that keep an order on a box; and what is met with equality.

    Rules on [1, z] are ``to_rules @ u``. ``equal`` are rows of sums over them, (n, n_columns), and
    ``equal_to`` what these are; so is what is met. InfeasibleError where nothing keeps all.
    """
    n_basis = 1 + order.signs.size
    n_columns = len(to_rules)
    n_rules = n_columns // n_basis
    # First the signs of the slopes.
    signs = np.flatnonzero(order.signs)
    rules, columns = (one.ravel() for one in np.meshgrid(range(n_rules), signs, indexing="ij"))
    held = np.zeros((rules.size, n_rules, n_basis))
    held[np.arange(rules.size), rules, 1 + columns] = order.signs[columns]
    at_least, least = np.full(len(held), _SLOPE * _MARGIN), order.least + _MARGIN
    order = replace(order, least=least)
    for _ in range(_MOST_ROUNDS):
        rows = held.reshape(len(held), n_columns) @ to_rules
        solved, active = nearest(factor, start, equal @ to_rules, equal_to, rows, at_least)
        left, corner, _ = order.left((to_rules @ solved).reshape(n_rules, n_basis), *box)
        short = np.flatnonzero(left < -0.5 * _MARGIN)
        if not short.size:
            return solved, held[active]
        # Then every pair that is not in order, at the corner where it is worst.
        at = np.column_stack([np.ones(short.size), corner[short]])
        more, place = np.zeros((short.size, n_rules + 1, n_basis)), np.arange(short.size)
        more[place, order.above[short]] += at
        more[place, order.below[short]] -= at
        held = np.concatenate([held, more[:, :-1]])
        at_least = np.append(at_least, order.least[short])
    raise InfeasibleError(False)
