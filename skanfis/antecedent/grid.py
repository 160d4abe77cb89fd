"""Grid partition: a rule for every combination of terms."""

from dataclasses import dataclass, replace
from math import prod

import numpy as np

from .base import Antecedent, combinations, groups_of, pieces, softmax_in_place


@dataclass(frozen=True, eq=False)
class GridAntecedent(Antecedent):
    r"""Every combination of one term per input (grid partition).

    The sum over all rules of products of memberships is the product of the sums over terms. So each
    input can be normalised alone, and the strengths are the products of the shares,

        w_(k1 .. kd) = prod_j nu_(j, kj) ,    nu_jk = mu_jk / sum_k' mu_jk' .

    This takes one exponential per term, instead of one per rule and input. Rules are in C order:
    the last input's term changes fastest.
    """

    counts: tuple[int, ...] = ()

    @classmethod
    def build(cls, families, inputs, thetas):
        """Each argument has one entry per input with terms; thetas are (n_parameters, count)."""
        entries = zip(inputs, families, thetas, strict=True)
        groups = groups_of((j, family, one) for j, family, theta in entries for one in theta.T)
        return cls(groups, counts=tuple(theta.shape[1] for theta in thetas))

    @property
    def n_rules(self):
        return prod(self.counts)

    @property
    def grid_counts(self):
        return self.counts

    def factor_terms(self):
        terms, inputs = np.arange(self.n_terms)[:, None], self.term_inputs
        return [{j: terms[inputs == j]} for j in self.inputs_with_terms]

    def without_rules(self, rules):
        """As in the base class, but a grid stays a grid if whole terms go.

        An input with one term left has no influence any more, and loses its term.
        """
        table = np.delete(self.rule_terms, rules, axis=0)
        if prod(np.unique(column).size for column in table.T) != table.shape[0]:
            return super().without_rules(rules)
        terms, inputs = np.unique(table), self.term_inputs
        left, numbers = np.unique(inputs[terms], return_counts=True)
        terms = terms[np.isin(inputs[terms], left[numbers > 1])]
        own = inputs[terms].tolist()
        counts = tuple(own.count(j) for j in dict.fromkeys(own))
        every = self.terms
        return replace(self, groups=groups_of(every[t] for t in terms), counts=counts), terms

    @property
    def rule_terms(self):
        places = np.indices(self.counts).reshape(len(self.counts), self.n_rules).T
        return places + np.cumsum([0, *self.counts[:-1]])

    def factors(self, Z):
        return self.strengths_and_shares(Z)[1]

    def normalise(self, log_mu):
        n_rows = log_mu.shape[1]
        if not self.counts:
            return np.ones((1, n_rows)), log_mu
        shares = pieces(log_mu, self.counts)
        if min(self.counts) == max(self.counts):
            # All inputs at once: the time to predict one row is mostly that of calls.
            softmax_in_place(log_mu.reshape(len(shares), -1, n_rows))
        else:
            for share in shares:
                softmax_in_place(share)
        return combinations(shares), log_mu

    def term_sensitivity(self, rule_outputs, output, shares):
        # A share is already the sum of its rules' strengths: no product per rule is needed.
        sensitivity = self.sum_over_rules(rule_outputs)
        sensitivity -= shares * output
        return sensitivity
