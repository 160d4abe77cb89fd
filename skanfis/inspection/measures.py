r"""How the rules of a model stand to its sum and to the target, in one pass over rows.

With strengths w_r, consequents f_r, the output yhat = sum_r w_r f_r at the nearest point of the box
of training, weights s of the rows, and m, sd and range of the target:

* strongest rule alone, sqrt(mean (f_r* - yhat)^2) / sd, r* the strongest rule of the row: how wrong
  a person is who reads, for each row, the one rule that speaks loudest. Rules that are equally
  strong count in equal parts, so that neither order nor units decide;
* disagreement, sqrt(mean sum_r w_r (f_r - yhat)^2) / sd: the same for a rule drawn by its strength;
* greatest sum, max sum_r |w_r (f_r - m)| / range: how much of the contributions cancels;
* the value of each rule at its own center, the mean of the rows by s w_r;
* the part of the rows on which no term of an input is more true than false: whatever is said of
  them there, the input has no word for it.

Means over rows are by s. All is computed in standard deviations of the target about its mean, block
by block: memory does not grow with the rows.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..blocks import LARGE_BLOCK_ROWS, row_blocks
from ..membership import LEAST_TRUTH

__all__ = ["Measures", "Source", "TargetScale", "measure", "rule_sums"]

# Bytes that the intermediate results of a block may take.
_BLOCK_BYTES = 2**21
# Strengths that differ by rounding errors only are equal.
_EQUALLY_STRONG = 1.0 - 1e-9
# A target that varies by rounding errors only, as the predictions of a constant do, is constant.
_CONSTANT = 16.0 * np.finfo(float).eps


@dataclass(frozen=True, eq=False)
class Source:
    """Where the rows come from.

    Parameters
    ----------
    n_rows : int
    read : callable
        From a slice to the rows of the model's inputs, (n, n_inputs), finite and in raw units.
    y : ndarray of shape (n_rows, n_outputs) or None
        The target; None stands for the predictions.
    sample_weight : ndarray of shape (n_rows,) or None
        Zero or positive, one of them positive.
    """

    n_rows: int
    read: Callable
    y: np.ndarray | None = None
    sample_weight: np.ndarray | None = None

    def blocks(self):
        """Slices of the rows, each with a mask of the rows that have weight, and their weights."""
        for part in row_blocks(self.n_rows, LARGE_BLOCK_ROWS) or [slice(0, 0)]:
            if self.sample_weight is None:
                yield part, slice(None), np.ones(part.stop - part.start)
            else:
                weight = np.asarray(self.sample_weight[part], dtype=float)
                yield part, weight > 0.0, weight[weight > 0.0]


@dataclass(frozen=True, eq=False)
class Measures:
    """What was found. Errors are in standard deviations of the target, sums in its ranges.

    Attributes
    ----------
    weight : float
        Of all rows; their number where none has a weight.
    mean, deviation, low, high : ndarray of shape (n_outputs,)
        Of the target, in its units; a constant target has a deviation and a range of one.
    truth : ndarray of shape (n_terms,)
        Greatest membership of each term on a row.
    wordless : ndarray of shape (n_inputs,)
        Part of the rows' weight on which every term of an input has a membership below one half;
        NaN for inputs without terms.
    rule_weights, rule_rows : ndarray of shape (n_rules,)
        Part of the rows' weight on which each rule fires, and weight of the rows on which it is the
        strongest.
    rule_alone, rule_disagreement : ndarray of shape (n_rules, n_outputs)
        RMS of f_r - yhat over the rows where the rule is the strongest, and over all rows by the
        rule's strength; NaN where there are none.
    rule_values : ndarray of shape (n_rules, n_outputs)
        f_r at the rule's own center, in standard deviations about the mean of the target.
    alone, disagreement, greatest_sum : ndarray of shape (n_outputs,)
        Of all rules together.
    """

    weight: float
    mean: np.ndarray
    deviation: np.ndarray
    low: np.ndarray
    high: np.ndarray
    truth: np.ndarray
    wordless: np.ndarray
    rule_weights: np.ndarray
    rule_rows: np.ndarray
    rule_alone: np.ndarray
    rule_disagreement: np.ndarray
    rule_values: np.ndarray
    alone: np.ndarray
    disagreement: np.ndarray
    greatest_sum: np.ndarray

    @property
    def span(self):
        """Range of the target, or one where it is constant."""
        return _span(self.low, self.high)

    @property
    def rule_beyond(self):
        """How far each rule's value at its center lies beyond the target's range, in ranges."""
        values = self.mean + self.deviation * self.rule_values
        beyond = np.maximum(self.low - values, values - self.high) / self.span
        return np.where(np.isnan(beyond), np.nan, np.maximum(beyond, 0.0))


def measure(model, source):
    """Measure the rules of a model on rows.

    Parameters
    ----------
    model : TSKModel
    source : Source

    Returns
    -------
    measures : Measures
    """
    model = model.with_out_of_bounds("clip")
    target = _Moments(model.n_outputs)
    for part, kept, weight in source.blocks():
        values = model.predict(source.read(part)) if source.y is None else source.y[part]
        target.add(np.asarray(values, dtype=float)[kept], weight)
    sums = _Sums(model, target)
    for part, kept, weight in source.blocks():
        sums.add(source.read(part)[kept], weight)
    return sums.measures()


@dataclass(frozen=True, eq=False)
class TargetScale:
    """What :func:`measure` finds of the target first, where it is known; arrays (n_outputs,)."""

    weight: float
    mean: np.ndarray
    deviation: np.ndarray
    low: np.ndarray
    high: np.ndarray


def rule_sums(rows, model, target):
    """The sums of :func:`measure` over a part of the rows; ``joined`` adds those of another part.

    Parameters
    ----------
    rows : object
        With X (n_rows, n_inputs) in raw units, and sample_weight (n_rows,) or None.
    model : TSKModel
    target : TargetScale
        Of all rows.
    """
    sums = _Sums(model.with_out_of_bounds("clip"), target)
    weight = np.ones(len(rows.X)) if rows.sample_weight is None else rows.sample_weight
    sums.add(rows.X, weight)
    return sums


def _is_constant(low, high):
    return high - low <= _CONSTANT * np.maximum(np.abs(low), np.abs(high))


def _span(low, high):
    return np.where(_is_constant(low, high), 1.0, high - low)


class _Moments:
    """Weighted mean, deviation, lowest and highest of columns that come in blocks."""

    def __init__(self, n_columns):
        self.weight, self._origin, self._unit = 0.0, None, None
        self._mean, self._square = np.zeros(n_columns), np.zeros(n_columns)
        self.low, self.high = np.full(n_columns, np.inf), np.full(n_columns, -np.inf)

    def add(self, values, weight):
        if not len(values):
            return
        if self._origin is None:
            # Sums are of differences from the first row, in parts of the first block's range:
            # columns far from the origin lose no digits, and squares do not overflow.
            self._origin = values[0]
            span = np.ptp(values, axis=0)
            self._unit = np.where(span > 0.0, span, 1.0)
        scaled = (values - self._origin) / self._unit
        block = weight.sum()
        mean = weight @ scaled / block
        total = self.weight + block
        step = mean - self._mean
        self._square += weight @ (scaled - mean) ** 2 + step**2 * (self.weight * block / total)
        self._mean += step * (block / total)
        self.weight = total
        np.minimum(self.low, values.min(axis=0), out=self.low)
        np.maximum(self.high, values.max(axis=0), out=self.high)

    @property
    def mean(self):
        return self._origin + self._unit * self._mean

    @property
    def deviation(self):
        found = self._unit * np.sqrt(self._square / self.weight)
        return np.where(_is_constant(self.low, self.high) | (found == 0.0), 1.0, found)


class _Sums:
    """The pass over the rows."""

    def __init__(self, model, target):
        self.model, self.target = model, target
        # Consequents in standard deviations of the target about its mean, on the inputs' distances
        # from the reference in standard deviations of their own.
        by_rule = model.coefficients / target.deviation
        by_rule[:, 0] -= target.mean / target.deviation
        by_rule[:, 1:] *= model.spread[: by_rule.shape[1] - 1, None]
        self.by_rule = np.ascontiguousarray(by_rule.transpose(2, 0, 1))
        n_rules, n_outputs = model.n_rules, model.n_outputs
        self.truth = np.full(model.antecedent.n_terms, -np.inf)
        inputs = model.antecedent.term_inputs
        self.terms_of = {int(j): np.flatnonzero(inputs == j) for j in np.unique(inputs)}
        self.wordless = np.zeros(model.n_inputs)
        self.mass, self.rows = np.zeros(n_rules), np.zeros(n_rules)
        self.first = np.zeros((n_rules, model.n_inputs))
        self.alone, self.disagreement = np.zeros((2, n_rules, n_outputs))
        self.greatest = np.zeros(n_outputs)

    def add(self, rows, weight):
        step = max(_BLOCK_BYTES // (8 * (6 * self.model.n_rules + self.truth.size)), 64)
        for start in range(0, len(rows), step):
            part = slice(start, start + step)
            self._add(np.array(rows[part].T, dtype=float, order="C"), weight[part])

    def _add(self, Z, weight):
        model = self.model
        np.clip(Z, model.minimum[:, None], model.maximum[:, None], out=Z)
        log_mu = model.antecedent.log_memberships(Z)
        np.maximum(self.truth, log_mu.max(axis=1), out=self.truth)
        for j, own in self.terms_of.items():
            self.wordless[j] += weight @ (log_mu[own].max(axis=0) < np.log(LEAST_TRUTH))
        strengths, _ = model.antecedent.normalise(log_mu)
        mass = strengths * weight
        self.mass += mass.sum(axis=1)
        Z -= model.reference[:, None]
        Z /= model.spread[:, None]
        self.first += mass @ Z.T
        strongest = (strengths >= _EQUALLY_STRONG * strengths.max(axis=0)).astype(float)
        strongest *= weight / strongest.sum(axis=0)
        self.rows += strongest.sum(axis=1)
        for k, (constants, slopes) in enumerate((one[:, :1], one[:, 1:]) for one in self.by_rule):
            values = constants + slopes @ Z[: slopes.shape[1]]
            weighted = strengths * values
            distance = (values - weighted.sum(axis=0)) ** 2
            self.alone[:, k] += np.einsum("rn,rn->r", strongest, distance)
            self.disagreement[:, k] += np.einsum("rn,rn->r", mass, distance)
            greatest = np.abs(weighted, out=weighted).sum(axis=0).max()
            self.greatest[k] = max(self.greatest[k], greatest)

    def joined(self, other):
        for name in ("mass", "rows", "first", "alone", "disagreement", "wordless"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        for name in ("truth", "greatest"):
            setattr(self, name, np.maximum(getattr(self, name), getattr(other, name)))
        return self

    def measures(self):
        target = self.target
        with np.errstate(divide="ignore", invalid="ignore"):
            fires = np.where(self.mass > 0.0, 1.0, np.nan)[:, None]
            centers = self.first / self.mass[:, None]
            slopes = self.by_rule[:, :, 1:]
            change = np.einsum("orj,rj->ro", slopes, centers[:, : slopes.shape[2]])
            rule_alone = np.sqrt(self.alone / self.rows[:, None])
            rule_disagreement = np.sqrt(self.disagreement / self.mass[:, None])
        wordless = np.full(self.model.n_inputs, np.nan)
        for j in self.terms_of:
            wordless[j] = self.wordless[j] / target.weight
        return Measures(
            weight=target.weight,
            mean=target.mean,
            deviation=target.deviation,
            low=target.low,
            high=target.high,
            truth=np.exp(self.truth),
            wordless=wordless,
            rule_weights=self.mass / target.weight,
            rule_rows=self.rows,
            rule_alone=rule_alone,
            rule_disagreement=rule_disagreement,
            rule_values=fires * (self.by_rule[:, :, 0].T + change),
            alone=np.sqrt(self.alone.sum(axis=0) / target.weight),
            disagreement=np.sqrt(self.disagreement.sum(axis=0) / target.weight),
            greatest_sum=self.greatest * target.deviation / _span(target.low, target.high),
        )
