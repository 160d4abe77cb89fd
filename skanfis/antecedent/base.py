r"""Rule bases: from memberships to normalised firing strengths, and back for derivatives.

``Z`` has shape (n_inputs, n_rows): one contiguous row of memory per input, so that every operation
runs along the data's rows. A rule base has ``n_terms`` membership functions, its *terms*, and
``n_rules`` rules; ``strengths`` w has shape (n_rules, n_rows), and its columns sum to one.

With f_r the value of rule r's consequent and y = sum_r w_r f_r, the derivative of y by the
log-membership of term t has one form for every rule base,

    dy / d log mu_t = sum_(rules r that contain t) w_r f_r  -  nu_t y ,

where the share nu_t is the sum of the strengths of the rules that contain t. On a grid, it is the
membership of t, normalised over the terms of its input; of scattered rules, the rule's strength.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, groupby, pairwise
from typing import ClassVar

import numpy as np

from ..membership import Membership

# In standard deviations of an input: values nearer than this count as one place.
TOLD_APART = 0.1
# Step, standardised, to either side of a row that stands on a corner of a term; far above rounding.
_ASIDE = 1e-8


@dataclass(frozen=True, eq=False)
class TermGroup:
    """Consecutive terms of one family: their inputs, and parameters (n_parameters, n_terms)."""

    family: type[Membership]
    inputs: np.ndarray
    theta: np.ndarray

    @property
    def n_terms(self):
        """Number of terms in the group."""
        return self.inputs.size


def groups_of(terms):
    """Groups from terms (input, family, theta); consecutive terms of one family form a group."""
    groups = []
    for family, members in groupby(terms, key=lambda term: term[1]):
        inputs, _, theta = zip(*members, strict=True)
        groups.append(TermGroup(family, np.array(inputs), np.array(theta).T.copy()))
    return tuple(groups)


def _stack(values, Z):
    """The rows of all groups stacked; a single group, the usual case, is not copied."""
    if len(values) == 1:
        return values[0]
    return np.concatenate(values) if values else np.empty((0, Z.shape[1]))


def pieces(values, lengths):
    """Consecutive pieces of some lengths along the first axis, as views."""
    return [values[start:stop] for start, stop in pairwise([0, *accumulate(lengths)])]


def by_group(gradients, by_term):
    """Pairs of the gradients of a group, and its rows of ``by_term``, which has one per term."""
    return zip(gradients, pieces(by_term, [one.shape[1] for one in gradients]), strict=True)


def by_parameter(gradients, by_term):
    """Derivatives by every parameter from those by log mu, shape (n_parameters, n_rows)."""
    pairs = by_group(gradients, by_term)
    return _stack([(gradient * own).reshape(-1, own.shape[1]) for gradient, own in pairs], by_term)


def strongest_rules(strengths):
    """The strongest rule of every row of (n_rules, n_rows); of equally strong ones the first."""
    # Strengths that differ by rounding errors only are equal.
    return (strengths >= (1.0 - 1e-9) * strengths.max(axis=0)).argmax(axis=0)


def combinations(parts):
    """Products of one row of each part, in all combinations; the last part's row varies fastest."""
    found, *others = parts
    for other in others:
        found = (found[:, None, :] * other).reshape(-1, found.shape[1])
    return found


def softmax_in_place(log_values):
    """Softmax along the last axis but one."""
    log_values -= np.maximum.reduce(log_values, axis=-2, keepdims=True)
    np.exp(log_values, out=log_values)
    log_values /= np.add.reduce(log_values, axis=-2, keepdims=True)


@dataclass(frozen=True, eq=False)
class Antecedent(ABC):
    """The IF parts of a set of rules over a sequence of terms; immutable."""

    groups: tuple[TermGroup, ...]
    # Least width of a term, standardised; narrower terms are crisp and do not move.
    least_width: ClassVar[float] = 0.0

    def without_implied(self, tolerance, columns=None) -> "Antecedent":
        """The same without terms that other terms of the same rule imply, up to ``tolerance``."""
        return self

    @property
    def is_ordered(self) -> bool:
        """Whether rules share the terms of an input; shared terms can be kept in order."""
        return True

    @property
    def n_terms(self):
        """Number of membership functions."""
        return sum(group.n_terms for group in self.groups)

    @property
    def terms(self):
        """Input, family and theta of every term."""
        return [
            (j, group.family, theta)
            for group in self.groups
            for j, theta in zip(group.inputs.tolist(), group.theta.T, strict=True)
        ]

    @property
    def term_inputs(self):
        """Input of every term, shape (n_terms,)."""
        every = [group.inputs for group in self.groups]
        return np.concatenate(every) if every else np.empty(0, dtype=int)

    @property
    def inputs_with_terms(self) -> tuple[int, ...]:
        """Inputs with terms, in the order of the terms; on a grid, each is a factor of w."""
        return tuple(dict.fromkeys(self.term_inputs.tolist()))

    @property
    def term_places(self):
        """Location of every term, its first parameter, shape (n_terms,)."""
        return np.concatenate([group.theta[0] for group in self.groups] or [np.empty(0)])

    @property
    @abstractmethod
    def n_rules(self):
        """Number of rules."""

    @property
    @abstractmethod
    def rule_terms(self):
        """Indices of each rule's terms, -1 for none, shape (n_rules, n_terms_per_rule)."""

    @property
    def grid_counts(self) -> tuple[int, ...] | None:
        """Number of terms of each input that has some, if rules are all combinations; else None."""
        return None

    @property
    def tied(self):
        """For every entry of :attr:`parameters`, the displacement that moves it (``premise``)."""
        return np.arange(self.parameters.size)

    def factor_terms(self) -> list[dict[int, np.ndarray]]:
        """For each factor of the strengths, by input, the terms of each of its shares.

        Arrays (n_shares, most terms of a share on the input) of positions; ``n_terms`` means none.
        """
        table, inputs = self.rule_terms, self.term_inputs
        of = np.append(inputs, -1)[table]
        # Without any terms, the first input stands for all, with none.
        used = np.unique(of[table >= 0]).tolist() or [0]
        found = {j: np.where((of == j) & (table >= 0), table, inputs.size) for j in used}
        # Most rules have one term of an input: drop the columns without any.
        return [{j: where[:, (where < inputs.size).any(axis=0)] for j, where in found.items()}]

    def without_rules(self, rules) -> tuple["Antecedent", np.ndarray]:
        """The rule base without some rules, and the positions of the terms that are left.

        The other rules are listed one by one. Terms that no rule uses go too.
        """
        table, every = np.delete(self.rule_terms, rules, axis=0), np.arange(self.n_terms)
        unused = np.setdiff1d(every, table)
        return self.without_terms(unused, table), np.delete(every, unused)

    def without_terms(self, terms, table=None) -> "Antecedent":
        """The same rules, or those of ``table``, listed one by one without some terms."""
        from .rule_table import RuleTableAntecedent  # here, because it imports this module

        table = self.rule_terms if table is None else table
        kept, place = np.delete(np.arange(self.n_terms), terms), np.full(self.n_terms + 1, -1)
        place[kept] = np.arange(kept.size)
        every = self.terms
        return RuleTableAntecedent(groups_of(every[t] for t in kept), place[table])

    @property
    def parameters(self):
        """All theta as one vector, group after group, parameter after parameter."""
        return np.concatenate([group.theta.ravel() for group in self.groups] or [np.empty(0)])

    def with_parameters(self, parameters):
        """Return the same rule base with other parameters, laid out as in :attr:`parameters`."""
        own = pieces(parameters, [group.theta.size for group in self.groups])
        pairs = zip(self.groups, own, strict=True)
        groups = [replace(group, theta=one.reshape(group.theta.shape)) for group, one in pairs]
        return replace(self, groups=tuple(groups))

    def change_units(self, offset, scale):
        """Return the same rule base for inputs given as offset + scale * z, per input."""
        groups = []
        for group in self.groups:
            units = offset[group.inputs], scale[group.inputs]
            groups.append(replace(group, theta=group.family.change_units(group.theta, *units)))
        return replace(self, groups=tuple(groups))

    def log_memberships(self, Z):
        """Log mu of every term at every row, shape (n_terms, n_rows)."""
        return _stack([g.family.log_value(Z[g.inputs], g.theta) for g in self.groups], Z)

    def log_memberships_and_gradient(self, Z):
        """Log mu, and per group its derivatives (n_parameters, n_terms of the group, n_rows)."""
        found = [g.family.log_value_and_gradient(Z[g.inputs], g.theta) for g in self.groups]
        return _stack([value for value, _ in found], Z), [gradient for _, gradient in found]

    def log_memberships_and_mean_gradient(self, Z):
        """The same; on a corner, the mean of both sides, where rounding would else choose one."""
        if not any(group.family.has_corners for group in self.groups):
            return self.log_memberships_and_gradient(Z)
        sides = [self.log_memberships_and_gradient(Z + aside)[1] for aside in (-_ASIDE, _ASIDE)]
        return self.log_memberships(Z), [0.5 * (a + b) for a, b in zip(*sides, strict=True)]

    def strengths_and_shares(self, Z):
        """Normalised firing strengths w (n_rules, n_rows), and the shares of terms."""
        return self.normalise(self.log_memberships(Z))

    def strengths(self, Z):
        """Normalised firing strengths w, shape (n_rules, n_rows)."""
        return self.strengths_and_shares(Z)[0]

    @property
    def share_counts(self) -> tuple[int, ...]:
        """Number of shares of each factor of the strengths; w is a product of one share of each."""
        return (self.n_rules,) if self.grid_counts is None else self.grid_counts

    def factors(self, Z):
        """A function of one input per term, (n_terms, n_rows), with rules' products as strengths.

        None where strengths are no such products.
        """
        return None

    @abstractmethod
    def normalise(self, log_mu):
        """Strengths w and term shares nu from log mu, which is overwritten."""

    @cached_property
    def _contains(self):
        """1 where rule r has term t, shape (n_rules, n_terms)."""
        table, contains = self.rule_terms, np.zeros((self.n_rules, self.n_terms))
        rules, places = np.nonzero(table >= 0)
        contains[rules, table[rules, places]] = 1.0
        return contains

    def sum_over_rules(self, values):
        """For every term, the sum of values (n_rules, n_rows) over the rules that contain it."""
        return self._contains.T @ values

    def term_sensitivity(self, rule_outputs, output, shares):
        """The derivative of the output by every term's log mu, shape (n_terms, n_rows).

        ``rule_outputs`` is w_r f_r, ``output`` its sum over rules, ``shares`` as normalise gave it.
        """
        return self.sum_over_rules(rule_outputs - shares * output)
