"""Rules listed one by one: scattered, with terms of their own, or over terms that they share."""

from dataclasses import dataclass

import numpy as np

from ..membership import PRODUCTS, SIDES
from .base import Antecedent, groups_of, softmax_in_place


def _one_term(terms):
    """Family and theta of the product of some terms; None if no known family is this product."""
    if len(terms) == 1:
        return terms[0]
    (first, low), (second, high), *others = sorted(terms, key=lambda one: one[1][0])
    if others or not {first, second} <= set(SIDES.values()) or low[0] == high[0]:
        return None
    half = 0.5 * (high[0] - low[0])
    theta = np.array([low[0] + half, np.log(half), low[1], high[1]])
    return PRODUCTS[first.side, second.side], theta


@dataclass(frozen=True, eq=False)
class RuleTableAntecedent(Antecedent):
    """Any rules over any terms.

    w is the softmax over rules of the sum of log mu over the rule's terms. ``table`` (n_rules,
    terms per rule) holds positions of terms; -1 stands for none. A full grid in this form has the
    strengths of :class:`GridAntecedent`, but takes one exponential per rule.
    """

    table: np.ndarray

    @classmethod
    def of_own_terms(cls, families, terms):
        """Scattered rules: each with terms of its own.

        ``terms`` are parameters (n_parameters, n_rules) by input; NaN stands for no term.
        ``families`` are by input too.
        """
        every = list(dict.fromkeys(families[j] for j in terms))
        inputs = sorted(terms, key=lambda j: every.index(families[j]))
        has_term = np.isfinite([terms[j][0] for j in inputs]).T
        # Terms are ordered by family, then by rule.
        of_family = ([families[j] is family for j in inputs] for family in every)
        places = np.concatenate([np.argwhere(has_term & is_own) for is_own in of_family])
        table = np.full(has_term.shape, -1)
        table[tuple(places.T)] = np.arange(len(places))
        named = ((inputs[k], r) for r, k in places)
        return cls(groups_of((j, families[j], terms[j][:, r]) for j, r in named), table)

    @property
    def is_ordered(self):
        return bool((self._contains.sum(axis=0) > 1.0).any())

    @property
    def n_rules(self):
        return self.table.shape[0]

    @property
    def rule_terms(self):
        return self.table

    def with_one_term_each(self, input_names):
        """The same rules with at most one term per input and rule; the old terms of each new one.

        Two sides of an input become a product of two sigmoids. ValueError where no one term says
        the same, as for three sides.
        """
        own = self.terms
        rules: list[dict[int, tuple[int, ...]]] = []
        made: dict[tuple, tuple] = {}
        for r, row in enumerate(self.table):
            used = sorted(row[row >= 0].tolist())
            inputs = dict.fromkeys(own[t][0] for t in used)
            rules.append({j: tuple(t for t in used if own[t][0] == j) for j in inputs})
            for j, terms in rules[r].items():
                found = _one_term([own[t][1:] for t in terms])
                if found is None:
                    places = ", ".join(f"{own[t][2][0]:g}" for t in terms)
                    raise ValueError(
                        f"Rule {r} has {len(terms)} terms of {input_names[j]!r} (at {places}), but "
                        "only two sides of different cuts can be written as one term. JSON, C and "
                        "ONNX take such rules; a .fis file takes those of partition='grid' or "
                        "'scattered'."
                    )
                made[j, terms] = found
        order = sorted(made, key=lambda key: (made[key][0].name, *key))
        groups = groups_of((j, *made[j, terms]) for j, terms in order)
        place, columns = {key: k for k, key in enumerate(order)}, sorted({j for j, _ in order})
        table = [[place[j, rule[j]] if j in rule else -1 for j in columns] for rule in rules]
        return RuleTableAntecedent(groups, np.array(table)), [terms for _, terms in order]

    def normalise(self, log_mu):
        strengths = self._contains @ log_mu
        softmax_in_place(strengths)
        return strengths, strengths
