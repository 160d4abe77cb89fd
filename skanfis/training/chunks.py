r"""Sums over rows that come in chunks, at fixed premises, and the model that they give.

    G = sum s phi phi' ,    c = sum s phi y ,    q = sum s y^2 ,    W = sum s ,

with phi = kron(w(x), [1, z]), weights s, and inputs and targets standardised by all rows in the
sums. To add the sums of two sets of rows, both are first converted to the scales of all their rows,
z' = t + g z, which is exact. So the order and size of chunks make no difference, and no digits are
lost as a sensor drifts.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..blocks import add_each, fitting_rows
from ..consequent import LocalBasis, basis, in_user_units
from ..learning import SolverResult
from ..learning.covariance import posterior_of
from ..learning.data import Scale, StandardisedData, check_scales, fingerprint, never_changes
from ..learning.gram import DesignMoments
from ..learning.objective import SeparableProblem
from ..learning.passes import normal_sums
from ..learning.penalty import CommonLine, Penalty
from ..learning.premise import Premise
from ..model import TSKModel
from ..policies import TargetRange
from ..search import Start
from ..search.tuning import FIRST_PENALTY, scaled, tune
from .chunk_checks import check_distance
from .data import Fitted
from .pruning import redundant_rules
from .rule_rows import RuleRows, rescaled

# The weights of the penalty that are found at fixed premises.
_FREE = ("agreement", "alpha", "slope")
# The weighted sums over rows.
_SUMS = ("weight", "gram", "slope", "square")


@dataclass(frozen=True, eq=False)
class RowSums:
    """All that is kept of the rows: sums of a fixed size; immutable."""

    base: TSKModel  # provides premises and names; its consequents are not used
    consequent_inputs: np.ndarray
    inputs: Scale  # of the inputs in the sums
    targets: Scale  # of the targets in the sums
    n_rows: int  # rows with positive weight, however old
    weight: float  # W
    squared_weight: float  # the sum of squares of the weights
    gram: np.ndarray  # G
    slope: np.ndarray  # c, (n_columns, n_outputs)
    square: np.ndarray  # q, (n_outputs,)
    rules: RuleRows

    @classmethod
    def of(cls, base: TSKModel, consequent_inputs, X, y, sample_weight=None):
        """Sum over a chunk, X (n_rows, n_inputs), y (n_rows, n_outputs), weights positive."""
        rows = StandardisedData.of(X, y, sample_weight)
        check_distance(base, rows.inputs)
        check_scales(rows.inputs, rows.targets, base.input_names, base.output_names)
        antecedent, own, n_inputs = base.antecedent, consequent_inputs, X.shape[1]
        n_rules, n_basis = antecedent.n_rules, 1 + own.size
        design = DesignMoments(antecedent.share_counts, n_basis)
        slopes = np.zeros((n_rules * n_basis, y.shape[1]))
        sums = [np.zeros(design.shape), slopes, np.zeros(y.shape[1])]
        centers = base.rule_centers[:, own]
        rules = RuleRows.none(n_rules, n_inputs, own.size)
        n_values = 4 * (n_rules + antecedent.n_terms + n_inputs) + sum(design.shape)
        for part, Z, target, weight in rows.blocks(fitting_rows(n_values)):
            raw = np.array(rows.X[part].T, dtype=float, order="C")
            strengths, shares = antecedent.strengths_and_shares(raw)
            numbers = fingerprint((raw - base.reference[:, None]) / base.spread[:, None])
            every = basis(Z)
            block = RuleRows.of(raw, every, strengths, weight, numbers, own, centers)
            rules = rules.plus(block, rows.inputs)
            of_slopes = every[np.append(0, 1 + own)]
            of_block = normal_sums(design, strengths, shares, of_slopes, weight, target)
            sums = add_each(sums, of_block)
        moments, slope, square = sums
        return cls(
            base,
            own,
            rows.inputs,
            rows.targets,
            rows.n_rows,
            rows.total_weight,
            float(np.sum(rows.weights**2)),
            design.gram(moments),
            slope,
            square,
            rules,
        )

    @property
    def n_basis(self):
        """Columns of the design per rule."""
        return 1 + self.consequent_inputs.size

    @property
    def effective_weight(self):
        """Number of rows by weight, as ``StandardisedData`` counts it."""
        return max(self.weight, self.weight**2 / self.squared_weight)

    def faded(self, factor):
        """The same rows with all weights times a factor."""
        sums = {name: factor * getattr(self, name) for name in _SUMS}
        squared, rules = factor**2 * self.squared_weight, self.rules.faded(factor)
        return replace(self, squared_weight=squared, rules=rules, **sums)

    def plus(self, other):
        """The sums over the rows of both."""
        weights = self.weight, other.weight
        inputs = joined_scales(self.inputs, other.inputs, *weights)
        targets = joined_scales(self.targets, other.targets, *weights)
        check_scales(inputs, targets, self.base.input_names, self.base.output_names)
        one, two = self._on(inputs, targets), other._on(inputs, targets)
        names = (*_SUMS, "n_rows", "squared_weight")
        sums = {name: getattr(one, name) + getattr(two, name) for name in names}
        return replace(one, rules=one.rules.plus(two.rules, inputs), **sums)

    def _on(self, inputs: Scale, targets: Scale):
        """The sums on other scales."""
        shift, factor = _change(self.inputs, inputs)
        t, g = _change(self.targets, targets)
        own = shift[self.consequent_inputs], factor[self.consequent_inputs]
        # sum s phi and sum s y, because strengths sum to one.
        every = self.gram[:, :: self.n_basis].sum(axis=1)
        total = self.slope[:: self.n_basis].sum(axis=0)
        gram = rescaled(self.gram, *own)
        return replace(
            self,
            inputs=inputs,
            targets=targets,
            gram=rescaled(np.ascontiguousarray(gram.T), *own),
            slope=rescaled(g * self.slope + t * every[:, None], *own),
            square=g**2 * self.square + 2.0 * t * g * total + t**2 * self.weight,
            rules=self.rules.on(shift, factor),
        )


def joined_scales(one: Scale, other: Scale, weight: float, other_weight: float) -> Scale:
    """The scale of two sets of rows together, by their weights (Chan, Golub and LeVeque 1979)."""
    low, high = np.minimum(one.minimum, other.minimum), np.maximum(one.maximum, other.maximum)
    if other_weight > weight:
        # Start from the heavier side: adding a small change to it costs no digits.
        one, other, weight, other_weight = other, one, other_weight, weight
    share = other_weight / (weight + other_weight)
    # Relative to the range, squares neither overflow nor vanish.
    span = np.where(never_changes(low, high), 1.0, high - low)
    step = (other.offset - one.offset) / span
    square = (1.0 - share) * _variance(one, span) + share * _variance(other, span)
    deviation = span * np.sqrt(square + share * (1.0 - share) * step**2)
    return Scale.of(one.offset + share * span * step, deviation, low, high)


def _variance(scale, span):
    return np.where(scale.is_constant, 0.0, scale.scale / span) ** 2


def _change(old: Scale, new: Scale):
    """Shift t and factor g of z' = t + g z, from one standardisation to another."""
    return (old.offset - new.offset) / new.scale, old.scale / new.scale


class _ProblemOfSums(SeparableProblem):
    """The least-squares problem at fixed premises, from sums; no rows are read."""

    def __init__(self, sums: RowSums, penalty: Penalty, extent):
        self.antecedent, self.penalty = sums.base.antecedent, penalty
        # Stands for the rows, of which only the scales are used.
        none = np.empty((0, 0))
        self.rows = StandardisedData(none, none, None, sums.inputs, sums.targets)
        self.consequent_inputs, self.n_basis = sums.consequent_inputs, sums.n_basis
        self.n_columns, self.n_outputs = sums.slope.shape
        self.on_sample, self.effective_weight = None, sums.effective_weight
        means = (sums.gram / sums.weight, sums.slope / sums.weight, sums.square / sums.weight)
        self._sums_at_start = means
        self.local = LocalBasis.from_gram(means[0], self.antecedent.n_rules)
        own, inputs = self.consequent_inputs, sums.inputs
        extent = np.maximum(extent / inputs.scale[own], 1.0)
        self.common_line = CommonLine(self.local, extent, self.antecedent, inputs.varying(own))


def inputs_with_slopes(model: TSKModel, inputs):
    """Inputs by which a model has slopes, or may get some: those that were constant so far."""
    assert model.target is not None
    if not model.order or never_changes(model.target.minimum, model.target.maximum).all():
        return inputs
    may_yet = never_changes(model.minimum, model.maximum)
    return inputs[(model.coefficients[:, 1:].any(axis=(0, 2)) | may_yet)[inputs]]


def fitted_weights(estimator, sums: RowSums):
    """The weights of the penalty that a fit found, times the rows by weight, in plain types."""
    place, weight = list(sums.base.input_names).index, sums.effective_weight
    model = estimator.model_
    is_absent = (model.coefficients[:, 1:] == 0.0).all(axis=2)
    is_constant = never_changes(model.minimum, model.maximum)
    varying = [j for j in sums.consequent_inputs if not is_constant[j]]

    def by_input(is_marked):
        found = [[int(j), np.flatnonzero(is_marked[:, j]).tolist()] for j in varying]
        return [[j, rules] for j, rules in found if rules]

    return {
        "agreement": weight * estimator.agreement_,
        "alpha": weight * estimator.alpha_,
        "slope": weight * estimator.slope_alpha_,
        "pulls": [
            ([place(name) for name in one["inputs"]], one["pull"]) for one in estimator.pulls_
        ],
        "slope_pulls": [[place(name), pull] for name, pull in estimator.slope_pulls_.items()],
        "common": by_input(model.common_slopes),
        "absent": by_input(is_absent),
        "extent": sums.rules.extent.tolist(),
    }


def solve(sums: RowSums, given, first=None) -> Fitted:
    """Solve for the consequents: the model of all rows so far.

    ``given`` are weights of the penalty, by name. The others come from ``first``, which
    :func:`fitted_weights` returns; without ``first``, the evidence finds them.
    """
    antecedent = sums.base.antecedent
    given, extent = {key: given[key] for key in _FREE if key in given}, sums.rules.extent
    if first is not None:
        # Weights are relative to a mean over rows, so they fall as rows rise.
        found = {key: first[key] / sums.effective_weight for key in _FREE}
        if "alpha" not in given:
            found["pulls"] = {tuple(component): pull for component, pull in first["pulls"]}
            found["slope_pulls"] = dict(first["slope_pulls"])
            # Of a fixed strength also where later rows lie further off, or a stray one did.
            extent = np.array(first["extent"])
            # Shared slopes stay shared, absent ones absent.
            for key in ("common", "absent"):
                found[key] = tuple((j, tuple(rules)) for j, rules in first[key])
        given = found | given
    free = [key for key in _FREE if key not in given]
    problem = _ProblemOfSums(sums, replace(FIRST_PENALTY, **given, stiffness=0.0), extent)
    if free:
        # Rules that stay may compensate one another: least weights would keep them from it.
        premise = replace(Premise.still(antecedent), is_unbounded=True)
        tuned = tune(problem, premise, free, turns=0)
        problem = problem.with_penalty(scaled(tuned.penalty, free, 1.0))
    evaluation = problem.evaluate(antecedent.parameters)
    overlap = sums.gram[:: sums.n_basis, :: sums.n_basis] / sums.weight
    return Fitted(
        _model(sums, problem, evaluation),
        SolverResult(evaluation, np.full(1, evaluation.mean_squared_error), 0, "no_premise"),
        Start(antecedent, problem.penalty, problem.consequent_inputs),
        redundant_rules(overlap, sums.rules.peak),
    )


def _model(sums, problem, evaluation):
    posterior = None
    if sums.n_rows > 1:
        # The premises are fixed: their uncertainty is left out.
        posterior = posterior_of(problem, None, evaluation, sums.effective_weight)
    inputs, targets, own = sums.inputs, sums.targets, sums.consequent_inputs
    units = inputs, targets, own, 1 if own.size else 0
    common = problem.penalty.common, evaluation.masses
    return replace(
        sums.base,
        coefficients=in_user_units(evaluation.coefficients, *units, *common),
        reference=inputs.offset,
        spread=inputs.scale,
        minimum=inputs.minimum,
        maximum=inputs.maximum,
        rule_weights=evaluation.masses,
        rule_rows=sums.rules.strongest * (sums.effective_weight / sums.weight),
        support=sums.rules.support(inputs, 1 + int(np.sum(~inputs.is_constant[own]))),
        target=TargetRange(targets.minimum, targets.maximum, targets.scale),
        posterior=posterior,
        tangent_at=None,  # there are no monotonic constraints
    )
