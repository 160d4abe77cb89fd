r"""How the rules of a model stand to their sum, and to the rows, in one pass over rows.

With strengths w_r, consequents f_r, the output yhat = sum_r w_r f_r at the nearest point of the box
of training, and sd the target's standard deviation, the *strongest rule alone* is

    sqrt(mean (f_r* - yhat)^2) / sd ,    r* the strongest rule of the row.

The error of a rule is that of its f_r to the target, on the rows on which it is the strongest.
Rules that are equally strong count in equal parts. Means are by the rows' weights.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..blocks import LARGE_BLOCK_ROWS, fitting_rows, row_blocks
from ..learning.data import column_statistics
from ..model import EQUALLY_STRONG
from .sentences import Sentences

# A target that varies by rounding errors only, as the predictions of a constant do, is constant.
_CONSTANT = 16.0 * np.finfo(float).eps


@dataclass(frozen=True, eq=False)
class Measures:
    """What was found on rows; errors are in standard deviations of the target."""

    weight: float  # of all rows
    mean: np.ndarray  # of the target, (n_outputs,)
    deviation: np.ndarray  # its standard deviation; one of a constant
    rule_weights: np.ndarray  # part of the rows' weight on which each rule fires, (n_rules,)
    rule_rows: np.ndarray  # weight of the rows on which it is the strongest, (n_rules,)
    rule_alone: np.ndarray  # RMS of f_r - yhat on these or NaN, (n_rules, n_outputs)
    alone: np.ndarray  # the same of the strongest rule of every row, (n_outputs,)
    rule_errors: np.ndarray  # RMS of f_r - y on its rows or NaN, (n_rules, n_outputs)
    errors: np.ndarray  # RMSE of the model, (n_outputs,)
    printed_errors: np.ndarray  # the same of the model as it is printed


def measure(model, read, n_rows, y=None, sample_weight=None):
    """Measure the rules on rows, which ``read`` gives from a slice; y None is the predictions."""
    blocks = row_blocks(n_rows, LARGE_BLOCK_ROWS) or [slice(0, 0)]
    if y is None:
        held = model.with_out_of_bounds("clip")
        y = np.concatenate([held.predict(read(part)) for part in blocks])
    y = np.asarray(y, dtype=float)
    if sample_weight is None:
        target = column_statistics(y)
    else:
        has_weight = sample_weight > 0.0
        target = column_statistics(y[has_weight], sample_weight[has_weight])
    sums = RuleSums(model, Sentences.of(model).printed, target)
    for part in blocks:
        sums.add(read(part), y[part], None if sample_weight is None else sample_weight[part])
    return sums.measures()


class RuleSums:
    """The pass over the rows, by parts.

    ``target`` is the scale of all of them; ``printed`` the model as it is printed.
    """

    def __init__(self, model, printed, target):
        largest = np.maximum(np.abs(target.minimum), np.abs(target.maximum))
        is_constant = target.maximum - target.minimum <= _CONSTANT * largest
        target = replace(target, scale=np.where(is_constant, 1.0, target.scale))
        self.model, self.printed, self.target, self.weight = model, printed, target, 0.0
        self.by_rule, self.by_printed = (self._standardised(one) for one in (model, printed))
        self.mass, self.rows = np.zeros((2, model.n_rules))
        self.alone, self.rule_errors = np.zeros((2, model.n_rules, model.n_outputs))
        self.errors, self.printed_errors = np.zeros((2, model.n_outputs))

    def _standardised(self, model):
        """Consequents in deviations of the target about its mean."""
        by_rule = model.coefficients / self.target.scale
        by_rule[:, 0] -= self.target.offset / self.target.scale
        return np.ascontiguousarray(by_rule.transpose(2, 0, 1))

    def add(self, rows, y, weight=None):
        """Add rows; returns itself."""
        weight = np.ones(len(rows)) if weight is None else np.asarray(weight, dtype=float)
        if not np.all(weight > 0.0):
            rows, y, weight = rows[weight > 0.0], y[weight > 0.0], weight[weight > 0.0]
        self.weight += float(weight.sum())
        step = fitting_rows(8 * self.model.n_rules + self.model.antecedent.n_terms)
        for part in row_blocks(len(rows), step):
            Z = np.array(rows[part].T, dtype=float, order="C")
            of_target = (y[part] - self.target.offset) / self.target.scale
            self._add(Z, of_target.T, weight[part])
        return self

    def _add(self, Z, target, weight):
        model = self.model
        np.clip(Z, model.minimum[:, None], model.maximum[:, None], out=Z)
        strengths = model.antecedent.strengths(Z)
        as_printed = self.printed.antecedent.strengths(Z)
        self.mass += strengths @ weight
        strongest = (strengths >= EQUALLY_STRONG * strengths.max(axis=0)).astype(float)
        strongest *= weight / strongest.sum(axis=0)
        self.rows += strongest.sum(axis=1)
        basis = model.basis(Z)
        for k, y in enumerate(target):
            values, output = _outputs(self.by_rule[k], strengths, basis)
            self.alone[:, k] += np.einsum("rn,rn->r", strongest, (values - output) ** 2)
            self.rule_errors[:, k] += np.einsum("rn,rn->r", strongest, (values - y) ** 2)
            self.errors[k] += weight @ (output - y) ** 2
            printed = _outputs(self.by_printed[k], as_printed, basis)[1]
            self.printed_errors[k] += weight @ (printed - y) ** 2

    def joined(self, other):
        """The sums over the rows of both."""
        for name in ("weight", "mass", "rows", "alone", "rule_errors", "errors", "printed_errors"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        return self

    def measures(self):
        """What the sums amount to."""
        with np.errstate(divide="ignore", invalid="ignore"):
            rule_alone = np.sqrt(self.alone / self.rows[:, None])
            rule_errors = np.sqrt(self.rule_errors / self.rows[:, None])
        return Measures(
            weight=self.weight,
            mean=self.target.offset,
            deviation=self.target.scale,
            rule_weights=self.mass / self.weight,
            rule_rows=self.rows,
            rule_alone=rule_alone,
            alone=np.sqrt(self.alone.sum(axis=0) / self.weight),
            rule_errors=rule_errors,
            errors=np.sqrt(self.errors / self.weight),
            printed_errors=np.sqrt(self.printed_errors / self.weight),
        )


def _outputs(by_rule, strengths, basis):
    """What every rule says at a block of rows, and their sum by strength."""
    values = by_rule @ basis
    return values, np.einsum("rn,rn->n", strengths, values)
