r"""Scattered rules from clusters: one rule for each.

The first clusters are sought in standardised inputs and target together. A rule's terms stand at
the mean of its cluster. Their widths are the cluster's standard deviations times sqrt(d): in d
inputs, distances from the centre grow as sqrt(d), and rules would otherwise hardly overlap. Further
rules are added where those that have learnt leave the largest residuals.
"""

import numpy as np

from ..antecedent import GridAntecedent, RuleTableAntecedent
from ..antecedent.base import TOLD_APART
from ..learning.data import StandardisedData
from .grid import terms_by_input
from .sample import counting_weight, representative_rows


def clustered_antecedent(families, rows: StandardisedData, label, premise_inputs):
    """A rule for every cluster that ``label(table, weight)`` finds in [z, y].

    z are the ``premise_inputs`` alone, on which the rules have terms; ``families`` has one entry
    per input of the rows. ``label`` returns one integer per row; a row with a negative one (noise)
    belongs to no rule. A single cluster gives a single rule without terms: a linear model.
    """
    table, weight, _ = representative_rows(rows)
    n_inputs = rows.X.shape[1]
    inputs = premise_inputs[~rows.inputs.is_constant[premise_inputs]]
    seen = np.hstack([table[:, premise_inputs], table[:, n_inputs:]])
    labels = np.asarray(label(seen, weight))
    found = np.unique(labels[labels >= 0])
    if found.size == 0:
        raise ValueError(
            "partition found no cluster: every training row was labelled as noise. Give a "
            "clusterer whose parameters fit standardised data (zero mean, unit deviation)."
        )
    if found.size == 1 or inputs.size == 0:
        return GridAntecedent((), counts=())
    masses = weight * (labels == found[:, None])
    return RuleTableAntecedent.of_own_terms(families, _terms_at(families, inputs, table, masses))


def grown_antecedent(families, tuned, label, premise_inputs):
    """The rules of a smaller rule base, and a new rule for every cluster of its residual.

    Clusters are sought on the ``premise_inputs``, with rows weighted by their squared residuals. If
    an input has no terms yet, the old rules get terms on it where they fire.
    """
    rows, smaller = tuned.problem.rows, tuned.evaluation.antecedent
    weight = counting_weight(rows)
    square = weight * (np.sum(tuned.residual**2, axis=1) + np.finfo(float).eps)
    labels = label(rows.X[:, premise_inputs], square)
    masses = square * (labels == np.unique(labels)[:, None])
    added = _terms_at(families, premise_inputs, rows.X, masses)
    strengths, _ = smaller.strengths_and_shares(np.ascontiguousarray(rows.X.T))
    learnt = _terms_at(families, premise_inputs, rows.X, weight * strengths)
    for j, terms in terms_by_input(smaller).items():
        has_term = np.append(smaller.term_inputs == j, False)[smaller.rule_terms].any(axis=1)
        learnt[j][:] = np.nan
        learnt[j][:, has_term] = terms
    terms = {j: np.concatenate([learnt[j], added[j]], axis=1) for j in premise_inputs}
    return RuleTableAntecedent.of_own_terms(families, terms)


def _terms_at(families, inputs, table, masses):
    """By input, the parameters of a term per rule; ``masses`` (n_rules, n_rows) weight the rows."""
    found, total = {}, masses.sum(axis=1)
    for j in inputs:
        centers = masses @ table[:, j] / total
        squares = (table[:, j] - centers[:, None]) ** 2
        spread = np.sqrt(np.sum(masses * squares, axis=1) / total)
        # A cluster on one spot still gets terms of some width.
        widths = np.maximum(spread, TOLD_APART) * np.sqrt(len(inputs))
        found[j] = families[j].from_center_and_width(centers, widths)
    return found
