r"""Rule bases: from memberships to normalised firing strengths, and back for derivatives.

Conventions
-----------
``Z`` has shape (n_inputs, n_rows): one contiguous row of memory per input, so that every operation
runs along the data's rows. A rule base has ``n_terms`` membership functions, its *terms*, and
``n_rules`` rules; ``strengths`` w has shape (n_rules, n_rows), and its columns sum to one.

With f_r the value of rule r's consequent and y = sum_r w_r f_r, the derivative of y by the
log-membership of term t is needed for training, and has one form for every rule base:

    dy / d log mu_t = sum_(rules r that contain t) w_r f_r  -  nu_t y ,

where nu_t is the share of the strength that rules containing t hold, among those that use t's
input (scattered rules: the rule's strength itself). The chain rule through the family's own
derivatives then gives the sensitivity to every premise parameter.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import accumulate, groupby, pairwise
from math import prod

import numpy as np

from .membership import Membership

__all__ = ["Antecedent", "GridAntecedent", "ScatteredAntecedent", "TermGroup"]


@dataclass(frozen=True, eq=False)
class TermGroup:
    """Consecutive terms of one family: parameters theta (n_parameters, n_terms), input of each."""

    family: type[Membership]
    inputs: np.ndarray
    theta: np.ndarray

    @property
    def n_terms(self):
        """Number of terms in the group."""
        return self.inputs.size


def _stack(values, Z):
    """Rows of all groups; the usual single group is not copied."""
    if len(values) == 1:
        return values[0]
    return np.concatenate(values) if values else np.empty((0, Z.shape[1]))


def _softmax_in_place(log_values):
    """Softmax along the last axis but one."""
    log_values -= np.maximum.reduce(log_values, axis=-2, keepdims=True)
    np.exp(log_values, out=log_values)
    log_values /= np.add.reduce(log_values, axis=-2, keepdims=True)


@dataclass(frozen=True, eq=False)
class Antecedent(ABC):
    """The IF parts of a set of rules over a sequence of terms; immutable."""

    groups: tuple[TermGroup, ...]

    @property
    def n_terms(self):
        """Number of membership functions."""
        return sum(group.n_terms for group in self.groups)

    @property
    @abstractmethod
    def n_rules(self):
        """Number of rules."""

    @property
    @abstractmethod
    def rule_terms(self):
        """Indices of the terms of each rule, shape (n_rules, n_terms_per_rule)."""

    @property
    def parameters(self):
        """All theta as one vector, group after group, parameter after parameter."""
        return np.concatenate([group.theta.ravel() for group in self.groups] or [np.empty(0)])

    def with_parameters(self, parameters):
        """Return the same rule base with other parameters, laid out as in :attr:`parameters`."""
        groups, start = [], 0
        for group in self.groups:
            stop = start + group.theta.size
            theta = parameters[start:stop].reshape(group.theta.shape)
            groups.append(replace(group, theta=theta))
            start = stop
        return replace(self, groups=tuple(groups))

    def change_units(self, offset, scale):
        """Return the same rule base for inputs given as offset + scale * z, per input."""
        groups = tuple(
            replace(
                group,
                theta=group.family.change_units(
                    group.theta, offset[group.inputs], scale[group.inputs]
                ),
            )
            for group in self.groups
        )
        return replace(self, groups=groups)

    def log_memberships(self, Z):
        """Log mu of every term at every row, shape (n_terms, n_rows)."""
        return _stack([g.family.log_value(Z[g.inputs], g.theta) for g in self.groups], Z)

    def log_memberships_and_gradient(self, Z):
        """Log mu, and per group its derivatives (n_parameters, n_terms of the group, n_rows)."""
        values, gradients = [], []
        for group in self.groups:
            value, gradient = group.family.log_value_and_gradient(Z[group.inputs], group.theta)
            values.append(value)
            gradients.append(gradient)
        return _stack(values, Z), gradients

    def strengths_and_shares(self, Z):
        """Normalised firing strengths w (n_rules, n_rows), and the shares that they factor into."""
        return self.normalise(self.log_memberships(Z))

    def strengths(self, Z):
        """Normalised firing strengths w, shape (n_rules, n_rows)."""
        return self.strengths_and_shares(Z)[0]

    @property
    @abstractmethod
    def share_counts(self):
        """How many shares each factor of the strengths has: w is a product of one of each."""

    @abstractmethod
    def normalise(self, log_mu):
        """Strengths w and term shares nu from log mu, which is overwritten."""

    @abstractmethod
    def term_sensitivity(self, rule_outputs, output, shares):
        """The derivative of the output by every term's log mu, shape (n_terms, n_rows).

        ``rule_outputs`` is w_r f_r, ``output`` its sum over rules, ``shares`` as normalise gave it.
        """


def _grid_rule_terms(counts):
    """The terms of every rule of a full grid, shape (n_rules, n_inputs with terms)."""
    combinations = np.indices(counts).reshape(len(counts), -1).T
    return combinations + np.cumsum([0, *counts[:-1]])


@lru_cache(maxsize=16)
def _grid_indicator(counts):
    """1 where term t is part of rule r, shape (n_terms, n_rules)."""
    rule_terms = _grid_rule_terms(counts)
    indicator = np.zeros((sum(counts), rule_terms.shape[0]))
    indicator[rule_terms.T, np.arange(rule_terms.shape[0])] = 1.0
    return indicator


@dataclass(frozen=True, eq=False)
class GridAntecedent(Antecedent):
    r"""Every combination of one term per input (grid partition).

    The sum over all rules of products of memberships is the product of the sums, so that each input
    is normalised alone and the strengths are the products of the shares,

        w_(k1 .. kd) = prod_j nu_(j, kj) ,    nu_jk = mu_jk / sum_k' mu_jk' :

    as many exponentials as there are terms, not as there are rules times inputs. Rules are in
    C order: the last input's term changes fastest.
    """

    counts: tuple[int, ...] = ()

    @classmethod
    def build(cls, families, inputs, thetas):
        """One entry of each argument per input that has terms; thetas (n_parameters, count)."""
        groups = []
        entries = zip(families, inputs, thetas, strict=True)
        for family, members in groupby(entries, key=lambda entry: entry[0]):
            _, used, theta = zip(*members, strict=True)
            repeats = [part.shape[1] for part in theta]
            groups.append(TermGroup(family, np.repeat(used, repeats), np.hstack(theta)))
        return cls(tuple(groups), counts=tuple(theta.shape[1] for theta in thetas))

    @property
    def n_rules(self):
        return prod(self.counts)

    @property
    def share_counts(self):
        return self.counts

    @property
    def rule_terms(self):
        return _grid_rule_terms(self.counts) if self.counts else np.empty((1, 0), dtype=int)

    def normalise(self, log_mu):
        n_rows = log_mu.shape[1]
        if not self.counts:
            return np.ones((1, n_rows)), log_mu
        edges = [0, *accumulate(self.counts)]
        shares = [log_mu[i:j] for i, j in pairwise(edges)]
        if min(self.counts) == max(self.counts):
            # All inputs at once: fewer calls, which is what the prediction of one row consists of.
            _softmax_in_place(log_mu.reshape(len(shares), -1, n_rows))
        else:
            for share in shares:
                _softmax_in_place(share)
        strengths = shares[0]
        for share in shares[1:]:
            strengths = (strengths[:, None, :] * share).reshape(-1, n_rows)
        return strengths, log_mu

    def term_sensitivity(self, rule_outputs, output, shares):
        sensitivity = _grid_indicator(self.counts) @ rule_outputs
        sensitivity -= shares * output
        return sensitivity


@dataclass(frozen=True, eq=False)
class ScatteredAntecedent(Antecedent):
    """Rules with terms of their own, one per premise input; terms are in rule-major order.

    w = softmax over rules of the sum over inputs of log mu.
    """

    n_premise_inputs: int = 0

    @classmethod
    def build(cls, family, inputs, theta):
        """``inputs`` the premise inputs; theta (n_parameters, n_rules, n_premise_inputs)."""
        n_parameters, n_rules, n_premise_inputs = theta.shape
        group = TermGroup(family, np.tile(inputs, n_rules), theta.reshape(n_parameters, -1))
        return cls((group,), n_premise_inputs=n_premise_inputs)

    @property
    def n_rules(self):
        return self.n_terms // self.n_premise_inputs

    @property
    def share_counts(self):
        return (self.n_rules,)

    @property
    def rule_terms(self):
        return np.arange(self.n_terms).reshape(self.n_rules, self.n_premise_inputs)

    def normalise(self, log_mu):
        strengths = log_mu.reshape(self.n_rules, self.n_premise_inputs, -1).sum(axis=1)
        _softmax_in_place(strengths)
        return strengths, strengths

    def term_sensitivity(self, rule_outputs, output, shares):
        return np.repeat(rule_outputs - shares * output, self.n_premise_inputs, axis=0)
