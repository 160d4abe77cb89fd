"""Rules in order: conditions on them that make predictions rise, or keep within limits.

Let no rule's slope by x_j be negative. As x_j rises, the strength of one rule grows at the cost of
another's. The prediction then changes by the difference of their values f, and by their slopes b.
It rises on a box if every such pair keeps, with u = (x_j - middle) / width,

    f_above - f_below + width ((o + c e^u) b_above + (o + c e^-u) b_below) >= 0

everywhere on the box. This is linear in the consequents at every point. It is convex along x_j, and
least at a corner of all other inputs. docs/bounds.rst proves it, and says which rules of a tree, a
grid and scattered rules form pairs, with which middle, width, o and c. A single line has no pairs.

To fall, all signs are reversed. A prediction is within limits if every rule is.
"""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..antecedent import Antecedent, GridAntecedent, TreeAntecedent
from ..membership import Gaussian
from ..model import TSKModel
from .quadratic_program import nearest_by_exchange
from .terms import EPS, ROUNDINGS

# Margins of slopes, and of the inequalities of pairs, in standard deviations of the target. A pair
# that keeps half of its margin counts as in order.
_SLOPE, _MARGIN = 1e-6, 1e-5
# Replaces a slope of zero as a divisor; and the largest u, so that exp(u) is finite.
_TINY, _FARTHEST = float(np.finfo(float).tiny), 300.0
ONE_RULE = GridAntecedent.build([], [], [])


class _Pairs(NamedTuple):
    """Pairs of rules with the numbers of their inequality; widths are negative for falling ones.

    Rule -1 is zero everywhere; ``column`` is the place of x_j in [1, x]. Until pairs are joined, a
    single number may stand for all of them.
    """

    above: Any
    below: Any
    column: Any = 0
    middle: Any = 0.0
    width: Any = 1.0
    own: Any = 0.0  # o
    curved: Any = 0.0  # c
    least: Any = 0.0  # the right-hand side of the inequality


_NO_PAIRS = _Pairs(np.empty(0, dtype=int), np.empty(0, dtype=int))


@dataclass(frozen=True, eq=False)
class RuleOrder:
    """The conditions on the rules of one output over a box; ``signs`` are those of slopes."""

    pairs: _Pairs
    signs: np.ndarray

    @classmethod
    def of(cls, antecedent: Antecedent, signs, limits, slope_inputs, reference):
        """The conditions for signs and limits; None where no sufficient ones are known.

        Consequents are linear in ``slope_inputs``, less their ``reference``.
        """
        every = np.arange(antecedent.n_rules)
        nothing, found = np.full(every.size, -1), [_NO_PAIRS]
        for j in np.flatnonzero(signs):
            pairs = _pairs_along(antecedent, j, reference[j])
            if pairs is None:
                return None
            if signs[j] < 0:
                pairs = pairs._replace(above=pairs.below, below=pairs.above, width=-pairs.width)
            column = 1 + np.flatnonzero(slope_inputs == j)
            # Without slopes by x_j only the values are compared.
            slopes = {"column": column[0]} if column.size else {"own": 0.0, "curved": 0.0}
            found.append(pairs._replace(**slopes))
        if np.isfinite(limits[0]):
            found.append(_Pairs(every, nothing, least=limits[0]))
        if np.isfinite(limits[1]):
            found.append(_Pairs(nothing, every, least=-limits[1]))
        return cls(_joined(found), signs[slope_inputs])

    def margins(self, rules, low, high):
        """Least margin of every inequality for rules a + b x on a box, and its rounding error.

        Also, where it is least, the factors of [a, b] of the rule above, and of the rule below.
        """
        pairs, columns = self.pairs, self.pairs.column
        rules = np.vstack([rules, np.zeros((1, rules.shape[1]))])
        low, high, every = np.append(1.0, low), np.append(1.0, high), np.arange(columns.size)
        above, below = rules[pairs.above], rules[pairs.below]
        at = np.where(above > below, low, high)
        # The inequality is stationary along x_j where
        # b_above (1 + c e^u) = b_below (1 + c e^-u).
        rise, fall = (np.maximum(np.abs(one[every, columns]), _TINY) for one in (above, below))
        root, curved = np.sqrt(rise) * np.sqrt(fall), np.maximum(pairs.curved, _TINY)
        with np.errstate(over="ignore"):
            u = np.arcsinh((fall - rise) / root / (2.0 * curved))
        u += 0.5 * (np.log(fall) - np.log(rise))
        place = np.clip(pairs.middle + pairs.width * u, low[columns], high[columns])
        at[every, columns] = place
        u = np.clip((place - pairs.middle) / pairs.width, -_FARTHEST, _FARTHEST)
        by_above, by_below = at.copy(), at.copy()
        by_above[every, columns] += pairs.width * (pairs.own + pairs.curved * np.exp(u))
        by_below[every, columns] -= pairs.width * (pairs.own + pairs.curved * np.exp(-u))
        margins = (by_above * above - by_below * below).sum(axis=1) - pairs.least
        size = (np.abs(by_above * above) + np.abs(by_below * below)).sum(axis=1)
        # The error of u grows with the size of place and middle, in widths.
        far = 1.0 + (np.abs(place) + np.abs(pairs.middle)) / np.abs(pairs.width)
        rounding = EPS * (ROUNDINGS + at.shape[1]) * (size + np.abs(pairs.least)) * far
        return margins, rounding, by_above, by_below

    def holds(self, rules, low, high):
        """Whether all conditions hold for certain, rounding included."""
        if not (self.signs * rules[:, 1:] >= 0.0).all():
            return False
        margins, rounding, *_ = self.margins(rules, low, high)
        return bool((margins >= rounding).all())


def is_in_order(model: TSKModel, output, signs, limits=(-np.inf, np.inf)):
    """Whether the order of its rules proves that a frozen model keeps signs and limits in range.

    This certificate does not depend on how the model was found.
    """
    antecedent, rules = model.antecedent, model.coefficients[:, :, output]
    if (rules == rules[0]).all():
        antecedent, rules = ONE_RULE, rules[:1]
    inputs = np.arange(rules.shape[1] - 1)
    order = RuleOrder.of(antecedent, signs, limits, inputs, model.reference)
    ends = ((end - model.reference)[inputs] for end in (model.minimum, model.maximum))
    return order is not None and order.holds(rules, *ends)


def _joined(parts):
    every = (np.broadcast_arrays(*pairs) for pairs in parts)
    return _Pairs(*map(np.concatenate, zip(*every, strict=True)))


def _pairs_along(antecedent, j, origin):
    """Pairs whose order makes predictions rise with x_j; None if no sufficient order is known."""
    if isinstance(antecedent, TreeAntecedent):
        return _pairs_of_tree(antecedent, j, origin)
    has_own = np.append(antecedent.term_inputs == j, False)[antecedent.rule_terms]
    lines, shared = np.arange(antecedent.n_rules)[None], 0.0
    if not has_own.any():
        return _NO_PAIRS
    # Every rule has one Gaussian term, all of one width: else no sufficient order is known.
    kinds = {(family, theta[1]) for i, family, theta in antecedent.terms if i == j}
    (family, log_width), *others = kinds
    if family is not Gaussian or others or (has_own.sum(axis=1) != 1).any():
        return None
    if antecedent.grid_counts is not None:
        axis = antecedent.inputs_with_terms.index(j)
        lines = np.moveaxis(lines.reshape(antecedent.grid_counts), axis, -1)
        lines = lines.reshape(-1, antecedent.grid_counts[axis])
        shared = 1.0 / max(lines.shape[1] - 1, 1)
    centers = np.append(antecedent.term_places, 0.0)[antecedent.rule_terms[has_own]]
    above, below = np.hstack([_all_pairs(line, line) for line in lines])
    is_above = centers[above] > centers[below]
    above, below = above[is_above], below[is_above]
    width = np.exp(2.0 * log_width) / (centers[above] - centers[below])
    middle = 0.5 * ((centers[above] - origin) + (centers[below] - origin))
    return _Pairs(above, below, middle=middle, width=width, own=1.0, curved=shared)


def _pairs_of_tree(antecedent, j, origin):
    paths, cuts = [dict(path) for path in antecedent.paths], antecedent.groups[0]
    nodes = np.flatnonzero(cuts.inputs == j)
    n_cuts = np.array([sum(node in path for node in nodes) for path in paths])
    found = [_NO_PAIRS]
    for node in nodes:
        is_above = np.array([path.get(node, np.nan) for path in paths])
        above, below = _all_pairs(*(np.flatnonzero(is_above == side) for side in (1.0, 0.0)))
        part = 1.0 / np.maximum(n_cuts[above], n_cuts[below])
        cut, width = cuts.theta[0, node] - origin, np.exp(cuts.theta[1, node])
        found.append(_Pairs(above, below, middle=cut, width=width, own=part, curved=part))
    return _joined(found)


def _all_pairs(above, below):
    return np.stack(np.meshgrid(above, below), axis=-1).reshape(-1, 2).T


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
    """The u nearest to ``start`` that keep an order on a box; InfeasibleError if there are none.

    Rules on [1, z] are ``to_rules @ u``. ``equal`` and ``equal_to`` are E and e of E u = e.
    """
    n_basis = 1 + order.signs.size
    n_rules = len(to_rules) // n_basis
    # Signs of slopes are constraints at once. A pair that fails adds one, where it fails most.
    slopes = to_rules.reshape(n_rules, n_basis, -1)[:, 1:][:, order.signs != 0]
    signs = order.signs[order.signs != 0, None]
    slopes = (signs * slopes).reshape(-1, to_rules.shape[1])

    def violated(u):
        rules = (to_rules @ u).reshape(n_rules, n_basis)
        margins, _, by_above, by_below = order.margins(rules, *box)
        short = np.flatnonzero(margins < 0.5 * _MARGIN)
        rows, place = np.zeros((short.size, n_rules + 1, n_basis)), np.arange(short.size)
        rows[place, order.pairs.above[short]] += by_above[short]
        rows[place, order.pairs.below[short]] -= by_below[short]
        rows = rows[:, :-1].reshape(short.size, len(to_rules)) @ to_rules
        return rows, order.pairs.least[short] + _MARGIN

    # A slope that ``Penalty.absent`` holds at zero cannot keep a margin.
    least = _SLOPE * factor.half_solve(slopes.T).any(axis=0)
    return nearest_by_exchange(factor, start, equal, equal_to, slopes, least, violated)
