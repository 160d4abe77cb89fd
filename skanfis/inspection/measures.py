r"""How the rules of a model stand to their sum, in one pass over rows; where terms cross.

With strengths w_r, consequents f_r, the output yhat = sum_r w_r f_r at the nearest point of the box
of training, and sd the target's standard deviation, the *strongest rule alone* is

    sqrt(mean (f_r* - yhat)^2) / sd ,    r* the strongest rule of the row.

Rules that are equally strong count in equal parts. Means are by the rows' weights.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..blocks import LARGE_BLOCK_ROWS, fitting_rows, row_blocks
from ..learning.data import column_statistics
from ..model import EQUALLY_STRONG

# A target that varies by rounding errors only, as the predictions of a constant do, is constant.
_CONSTANT = 16.0 * np.finfo(float).eps
# Digits, in widths, to which equal terms agree: one that came through a file may lose its last.
_SAME_DIGITS = 7
# An interval is searched at so many points, and shrinks to 1/16, so many times.
_POINTS, _LOOKS = 33, 14


@dataclass(frozen=True, eq=False)
class Measures:
    """What was found on rows; errors are in standard deviations of the target."""

    weight: float  # of all rows
    mean: np.ndarray  # of the target, (n_outputs,)
    deviation: np.ndarray  # its standard deviation; one of a constant
    truth: np.ndarray  # greatest membership of each term on a row, (n_terms,)
    rule_weights: np.ndarray  # part of the rows' weight on which each rule fires, (n_rules,)
    rule_rows: np.ndarray  # weight of the rows on which it is the strongest, (n_rules,)
    rule_alone: np.ndarray  # RMS of f_r - yhat on these or NaN, (n_rules, n_outputs)
    alone: np.ndarray  # the same of the strongest rule of every row, (n_outputs,)


def measure(model, read, n_rows, y=None, sample_weight=None):
    """Measure the rules on rows, which ``read`` gives from a slice; y None is the predictions."""
    model = model.with_out_of_bounds("clip")
    blocks = row_blocks(n_rows, LARGE_BLOCK_ROWS) or [slice(0, 0)]
    if y is None:
        y = np.concatenate([model.predict(read(part)) for part in blocks])
    y = np.asarray(y, dtype=float)
    if sample_weight is None:
        sums = RuleSums(model, column_statistics(y))
    else:
        has_weight = sample_weight > 0.0
        sums = RuleSums(model, column_statistics(y[has_weight], sample_weight[has_weight]))
    for part in blocks:
        sums.add(read(part), None if sample_weight is None else sample_weight[part])
    return sums.measures()


class RuleSums:
    """The pass over the rows, by parts; ``target`` is the scale of all of them."""

    def __init__(self, model, target):
        largest = np.maximum(np.abs(target.minimum), np.abs(target.maximum))
        is_constant = target.maximum - target.minimum <= _CONSTANT * largest
        target = replace(target, scale=np.where(is_constant, 1.0, target.scale))
        self.model, self.target, self.weight = model.with_out_of_bounds("clip"), target, 0.0
        # Consequents in standard deviations of the target about its mean, on the inputs' distances
        # from the reference in standard deviations of their own.
        by_rule = model.coefficients / target.scale
        by_rule[:, 0] -= target.offset / target.scale
        by_rule[:, 1:] *= model.spread[: by_rule.shape[1] - 1, None]
        self.by_rule = np.ascontiguousarray(by_rule.transpose(2, 0, 1))
        self.truth = np.full(model.antecedent.n_terms, -np.inf)
        self.mass, self.rows = np.zeros((2, model.n_rules))
        self.alone = np.zeros((model.n_rules, model.n_outputs))

    def add(self, rows, weight=None):
        """Add rows; returns itself."""
        weight = np.ones(len(rows)) if weight is None else np.asarray(weight, dtype=float)
        if not np.all(weight > 0.0):
            rows, weight = rows[weight > 0.0], weight[weight > 0.0]
        self.weight += float(weight.sum())
        step = fitting_rows(6 * self.model.n_rules + self.truth.size)
        for part in row_blocks(len(rows), step):
            self._add(np.array(rows[part].T, dtype=float, order="C"), weight[part])
        return self

    def _add(self, Z, weight):
        model = self.model
        np.clip(Z, model.minimum[:, None], model.maximum[:, None], out=Z)
        log_mu = model.antecedent.log_memberships(Z)
        np.maximum(self.truth, log_mu.max(axis=1), out=self.truth)
        strengths, _ = model.antecedent.normalise(log_mu)
        self.mass += strengths @ weight
        strongest = (strengths >= EQUALLY_STRONG * strengths.max(axis=0)).astype(float)
        strongest *= weight / strongest.sum(axis=0)
        self.rows += strongest.sum(axis=1)
        Z -= model.reference[:, None]
        Z /= model.spread[:, None]
        for k, (constants, slopes) in enumerate((one[:, :1], one[:, 1:]) for one in self.by_rule):
            values = constants + slopes @ Z[: slopes.shape[1]]
            distance = (values - np.einsum("rn,rn->n", strengths, values)) ** 2
            self.alone[:, k] += np.einsum("rn,rn->r", strongest, distance)

    def joined(self, other):
        """The sums over the rows of both."""
        for name in ("weight", "mass", "rows", "alone"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.truth = np.maximum(self.truth, other.truth)
        return self

    def measures(self):
        """What the sums amount to."""
        with np.errstate(divide="ignore", invalid="ignore"):
            rule_alone = np.sqrt(self.alone / self.rows[:, None])
        return Measures(
            weight=self.weight,
            mean=self.target.offset,
            deviation=self.target.scale,
            truth=np.exp(self.truth),
            rule_weights=self.mass / self.weight,
            rule_rows=self.rows,
            rule_alone=rule_alone,
            alone=np.sqrt(self.alone.sum(axis=0) / self.weight),
        )


def distinct_terms(antecedent):
    """By input, its terms from the lowest to the highest; of equal ones the first."""
    found: dict[tuple, int] = {}
    t = 0
    for group in antecedent.groups:
        kinds = [parameter.kind for parameter in group.family.parameters]
        width = np.exp(group.theta[kinds.index("log_width")])
        rounded = np.round([group.theta[0] / width, *group.theta[1:]], _SAME_DIGITS)
        for j, theta in zip(group.inputs.tolist(), rounded.T.tolist(), strict=True):
            found.setdefault((j, group.family.name, *theta), t)
            t += 1
    inputs, places = antecedent.term_inputs, antecedent.term_places
    by_input: dict[int, list[int]] = {}
    for t in sorted(found.values(), key=lambda t: (inputs[t], places[t])):
        by_input.setdefault(int(inputs[t]), []).append(t)
    return by_input


def crossings(antecedent):
    """The height at which each term crosses the next one of its input, shape (n_terms,).

    That is the greatest value of the smaller of both memberships between the two locations. NaN
    for the last term of an input, and for terms that another stands for.
    """
    heights = np.full(antecedent.n_terms, np.nan)
    pairs = [pair for own in distinct_terms(antecedent).values() for pair in pairwise(own)]
    if not pairs:
        return heights
    lower, upper = np.array(pairs).T
    low, high = antecedent.term_places[lower], antecedent.term_places[upper]
    every = np.arange(low.size)
    best = np.full(low.size, -np.inf)
    for _ in range(_LOOKS):
        x = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, _POINTS)
        smaller = np.minimum(_log_truth(antecedent, lower, x), _log_truth(antecedent, upper, x))
        top = smaller.argmax(axis=1)
        best = np.maximum(best, smaller[every, top])
        low, high = x[every, np.maximum(top - 1, 0)], x[every, np.minimum(top + 1, _POINTS - 1)]
    heights[lower] = np.exp(best)
    return heights


def _log_truth(antecedent, terms, x):
    """Log mu of some terms, each at values of its own: x and result (terms.size, n_points)."""
    values = np.empty(x.shape)
    start = 0
    for group in antecedent.groups:
        own = (terms >= start) & (terms < start + group.n_terms)
        if own.any():
            values[own] = group.family.log_value(x[own], group.theta[:, terms[own] - start])
        start += group.n_terms
    return values
