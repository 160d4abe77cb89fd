"""Scattered rules: each with terms of its own."""

from dataclasses import dataclass

import numpy as np

from .base import TermGroup
from .rule_table import RuleTableAntecedent


@dataclass(frozen=True, eq=False)
class ScatteredAntecedent(RuleTableAntecedent):
    """Rules with terms of their own, each on some of the premise inputs."""

    is_ordered = False

    @classmethod
    def build(cls, family, inputs, theta):
        """Of one family, in the order of the rules.

        ``inputs`` are the premise inputs; theta is (n_parameters, n_rules, n_premise_inputs), NaN
        where a rule has no term.
        """
        has_term = np.isfinite(theta[0])
        table = np.where(has_term, np.cumsum(has_term).reshape(has_term.shape) - 1, -1)
        on = np.broadcast_to(inputs, has_term.shape)[has_term]
        return cls((TermGroup(family, on, theta[:, has_term]),), table)
