"""Rules listed one by one over terms that they share: imported, pruned, of mixed families."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .base import Antecedent, softmax_in_place


@dataclass(frozen=True, eq=False)
class RuleTableAntecedent(Antecedent):
    """Any rules over any terms.

    w = softmax over rules of the sum of log mu over the rule's terms. ``table`` (n_rules, n_terms
    of a rule) holds positions of terms; -1 stands for none, where a rule does not look at an input.
    A full grid in this form has the strengths of :class:`GridAntecedent`, at the price of one
    exponential per rule.
    """

    table: np.ndarray

    @property
    def n_rules(self):
        return self.table.shape[0]

    @property
    def rule_terms(self):
        return self.table

    @cached_property
    def _contains(self):
        """1 where rule r has term t, shape (n_rules, n_terms)."""
        contains = np.zeros((self.n_rules, self.n_terms))
        rules, places = np.nonzero(self.table >= 0)
        contains[rules, self.table[rules, places]] = 1.0
        return contains

    def normalise(self, log_mu):
        strengths = self._contains @ log_mu
        softmax_in_place(strengths)
        return strengths, strengths

    def sum_over_rules(self, values):
        return self._contains.T @ values
