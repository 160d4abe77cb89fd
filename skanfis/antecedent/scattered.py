"""Scattered rules: each with terms of its own."""

from dataclasses import dataclass

import numpy as np

from .base import Antecedent, TermGroup, softmax_in_place


@dataclass(frozen=True, eq=False)
class ScatteredAntecedent(Antecedent):
    """Rules with terms of their own, one per premise input; terms are in rule-major order.

    w = softmax over rules of the sum over inputs of log mu.
    """

    n_premise_inputs: int = 0
    is_ordered = False

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
    def rule_terms(self):
        return np.arange(self.n_terms).reshape(self.n_rules, self.n_premise_inputs)

    def normalise(self, log_mu):
        strengths = log_mu.reshape(self.n_rules, self.n_premise_inputs, -1).sum(axis=1)
        softmax_in_place(strengths)
        return strengths, strengths

    def sum_over_rules(self, values):
        return np.repeat(values, self.n_premise_inputs, axis=0)
