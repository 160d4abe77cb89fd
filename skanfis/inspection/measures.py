r"""How far each rule is from the model, and from the target, in one pass over rows.

With strengths w_r, consequents f_r, the output yhat = sum_r w_r f_r at the nearest point of the box
of training, and sd the target's standard deviation, the *strongest rule alone* is

    sqrt(mean (f_r* - yhat)^2) / sd ,    r* the strongest rule of the row.

The error of a rule is that of its f_r to the target, on the rows on which it is the strongest; the
spread is the standard deviation of the target there. Means are by the rows' weights.
"""

from dataclasses import dataclass
from functools import reduce

import numpy as np

from ..antecedent import strongest_rules
from ..blocks import LARGE_BLOCK_ROWS, add_each, fitting_rows, row_blocks
from ..learning.data import column_statistics
from .sentences import Sentences


@dataclass(frozen=True, eq=False)
class Measures:
    """Measures of rules on rows; errors are in standard deviations of the target."""

    deviation: np.ndarray  # standard deviation of the target; 1 if constant, (n_outputs,)
    rule_weights: np.ndarray  # part of the rows' weight on which each rule fires, (n_rules,)
    rule_rows: np.ndarray  # weight of the rows on which it is the strongest, (n_rules,)
    rule_alone: np.ndarray  # RMS of f_r - yhat on these or NaN, (n_rules, n_outputs)
    alone: np.ndarray  # RMS of f_r* - yhat on all rows, (n_outputs,)
    rule_errors: np.ndarray  # RMS of f_r - y on its rows or NaN, (n_rules, n_outputs)
    rule_spreads: np.ndarray  # standard deviation of y there or NaN, (n_rules, n_outputs)
    errors: np.ndarray  # RMSE of the model, (n_outputs,)
    printed_errors: np.ndarray  # RMSE of the model as printed, (n_outputs,)


def measure(model, X, y=None, sample_weight=None):
    """Measure the rules on rows; if y is None, the predictions are the target."""
    if y is None:
        y = model.with_out_of_bounds("clip").predict(X)
    y = np.asarray(y, dtype=float)
    weight = np.ones(len(X)) if sample_weight is None else np.asarray(sample_weight, dtype=float)
    target = column_statistics(y[weight > 0.0], weight[weight > 0.0])
    printed = Sentences.of(model).printed
    sums = (
        rule_sums(model, printed, target, X[part], y[part], weight[part])
        for part in row_blocks(len(X), LARGE_BLOCK_ROWS)
    )
    return measures_of(target, reduce(add_each, sums))


def rule_sums(model, printed, target, rows, y, weight):
    """The sums that :func:`measures_of` takes, over some rows; those of more rows are added.

    ``target`` is the scale of all of them; ``printed`` the model as it is printed.
    """
    kept, scale = weight > 0.0, target.scale
    rows, y, weight = rows[kept], y[kept], weight[kept]
    by_rule, by_printed = (_standardised(one, target.offset, scale) for one in (model, printed))
    mass, lead = np.zeros((2, model.n_rules))
    alone, rule_errors, first, second = np.zeros((4, model.n_rules, model.n_outputs))
    errors, printed_errors = np.zeros((2, model.n_outputs))
    for part in row_blocks(len(rows), fitting_rows(8 * model.n_rules + model.antecedent.n_terms)):
        Z, s = np.array(rows[part].T, dtype=float, order="C"), weight[part]
        np.clip(Z, model.minimum[:, None], model.maximum[:, None], out=Z)
        strengths, basis = model.antecedent.strengths(Z), model.basis(Z)
        as_printed = printed.antecedent.strengths(Z)
        mass += strengths @ s
        strongest = s * (np.arange(model.n_rules)[:, None] == strongest_rules(strengths))
        lead += strongest.sum(axis=1)
        for k, of_target in enumerate(((y[part] - target.offset) / scale).T):
            values, output = _outputs(by_rule[k], strengths, basis)
            alone[:, k] += np.einsum("rn,rn->r", strongest, (values - output) ** 2)
            rule_errors[:, k] += np.einsum("rn,rn->r", strongest, (values - of_target) ** 2)
            first[:, k] += strongest @ of_target
            second[:, k] += strongest @ of_target**2
            errors[k] += s @ (output - of_target) ** 2
            told = _outputs(by_printed[k], as_printed, basis)[1]
            printed_errors[k] += s @ (told - of_target) ** 2
    sums = [mass, lead, alone, rule_errors, first, second, errors, printed_errors]
    return [float(weight.sum()), *sums]


def measures_of(target, sums):
    """The :class:`Measures` from the sums over all rows."""
    weight, mass, lead, alone, rule_errors, first, second, errors, printed_errors = sums
    rows = lead[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        return Measures(
            deviation=target.scale,
            rule_weights=mass / weight,
            rule_rows=lead,
            rule_alone=np.sqrt(alone / rows),
            alone=np.sqrt(alone.sum(axis=0) / weight),
            rule_errors=np.sqrt(rule_errors / rows),
            rule_spreads=np.sqrt(np.maximum(second - first**2 / rows, 0.0) / rows),
            errors=np.sqrt(errors / weight),
            printed_errors=np.sqrt(printed_errors / weight),
        )


def _standardised(model, offset, scale):
    """Consequents in deviations of the target about its mean."""
    by_rule = model.coefficients / scale
    by_rule[:, 0] -= offset / scale
    return np.ascontiguousarray(by_rule.transpose(2, 0, 1))


def _outputs(by_rule, strengths, basis):
    """The value of every rule at a block of rows, and their mean by strength."""
    values = by_rule @ basis
    return values, np.einsum("rn,rn->n", strengths, values)
