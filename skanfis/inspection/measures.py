r"""How far each rule is from the model, and from the target, in one pass over rows.

With strengths w_r, consequents f_r, the output yhat = sum_r w_r f_r at the nearest point of the box
of training, and sd the target's standard deviation, the *strongest rule alone* is

    sqrt(mean (f_r* - yhat)^2) / sd ,    r* the strongest rule of the row.

The error of a rule is that of its f_r to the target, on the rows on which it is the strongest; the
spread is the standard deviation of the target there. Means are by the rows' weights.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..antecedent import strongest_rules
from ..blocks import add_each, fitting_rows, row_blocks
from ..learning.data import StandardisedData
from .sentences import Sentences

_ROUNDING = 1e-12  # relative error of a difference of two sums over rows


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
    if sample_weight is not None and not np.all(sample_weight):
        kept = sample_weight > 0.0
        X, y, sample_weight = X[kept], y[kept], sample_weight[kept]
    return measure_rows(model, StandardisedData.of(X, y, sample_weight))


def measure_rows(model, rows):
    """Measure the rules on ``StandardisedData``, or on rows that stay on a cluster."""
    printed = Sentences.of(model).printed
    # The posterior is not needed, and is most of the bytes that a cluster is sent.
    model, printed = (replace(one, posterior=None) for one in (model, printed))
    of_rows = partial(_sums, model=model, printed=printed, target=rows.targets)
    weight, mass, lead, alone, rule_errors, first, second, errors, printed_errors = rows.reduce(
        of_rows, add_each
    )
    n_led = lead[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        squares = second - first**2 / n_led
        return Measures(
            deviation=rows.targets.scale,
            rule_weights=mass / weight,
            rule_rows=lead,
            rule_alone=np.sqrt(alone / n_led),
            alone=np.sqrt(alone.sum(axis=0) / weight),
            rule_errors=np.sqrt(rule_errors / n_led),
            rule_spreads=np.sqrt(np.where(squares > _ROUNDING * second, squares, 0.0) / n_led),
            errors=np.sqrt(errors / weight),
            printed_errors=np.sqrt(printed_errors / weight),
        )


def _sums(rows, model, printed, target):
    """The sums over some rows; ``target`` is the scale of all, ``printed`` the model as printed."""
    offset, scale = target.offset, target.scale
    by_rule, by_printed = (_standardised(one, offset, scale) for one in (model, printed))
    mass, lead = np.zeros((2, model.n_rules))
    alone, rule_errors, first, second = np.zeros((4, model.n_rules, model.n_outputs))
    errors, printed_errors = np.zeros((2, model.n_outputs))
    n_values = 8 * model.n_rules + model.antecedent.n_terms
    for part in row_blocks(rows.n_rows, fitting_rows(n_values)):
        Z, s = np.array(rows.X[part].T, dtype=float, order="C"), rows.part(part).weights
        np.clip(Z, model.minimum[:, None], model.maximum[:, None], out=Z)
        strengths, basis = model.antecedent.strengths(Z), model.basis(Z)
        as_printed = printed.antecedent.strengths(Z)
        mass += strengths @ s
        strongest = s * (np.arange(model.n_rules)[:, None] == strongest_rules(strengths))
        lead += strongest.sum(axis=1)
        for k, of_target in enumerate(((rows.y[part] - offset) / scale).T):
            values, output = _outputs(by_rule[k], strengths, basis)
            alone[:, k] += np.einsum("rn,rn->r", strongest, (values - output) ** 2)
            rule_errors[:, k] += np.einsum("rn,rn->r", strongest, (values - of_target) ** 2)
            first[:, k] += strongest @ of_target
            second[:, k] += strongest @ of_target**2
            errors[k] += s @ (output - of_target) ** 2
            told = _outputs(by_printed[k], as_printed, basis)[1]
            printed_errors[k] += s @ (told - of_target) ** 2
    sums = [mass, lead, alone, rule_errors, first, second, errors, printed_errors]
    return [rows.total_weight, *sums]


def _standardised(model, offset, scale):
    """Consequents in deviations of the target about its mean."""
    by_rule = model.coefficients / scale
    by_rule[:, 0] -= offset / scale
    return np.ascontiguousarray(by_rule.transpose(2, 0, 1))


def _outputs(by_rule, strengths, basis):
    """The value of every rule at a block of rows, and their mean by strength."""
    values = by_rule @ basis
    return values, np.einsum("rn,rn->n", strengths, values)
