"""The error of rows that were not trained on."""

import numpy as np

from ..blocks import BLOCK_ROWS
from ..consequent import basis, rule_outputs
from ..learning.data import StandardisedData

__all__ = ["held_out_loss"]


def held_out_loss(rows: StandardisedData, consequent_inputs, evaluation):
    """Mean squared error of rows that were not trained on, standardised, summed over outputs.

    Rows beyond the training rows' range count as predict holds them, at its edge.
    """
    low, high = (edge[:, None] for edge in rows.inputs.box)
    coefficients = evaluation.coefficients
    by_rule = coefficients.reshape(evaluation.antecedent.n_rules, -1, coefficients.shape[1])
    total = 0.0
    for chunk in rows.chunks(BLOCK_ROWS):
        for part in chunk:
            Z, target, weight = rows.read(part)
            np.clip(Z, low, high, out=Z)
            strengths = evaluation.antecedent.strengths(Z)
            basis_rows = basis(Z[consequent_inputs])
            for k, one in enumerate(by_rule.transpose(2, 0, 1)):
                squares = (target[k] - rule_outputs(one, strengths, basis_rows)[1]) ** 2
                total += squares.sum() if weight is None else weight @ squares
    return total / rows.total_weight
