"""Rows that come in chunks, at premises that stay: what is kept of them, and the model they make.

A chunk, what came before it and what another machine has seen are all of one kind, and are added
in the same way: the order and the size of chunks make no difference.
"""

from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np

from ..learning.covariance import posterior_of
from ..learning.data import StandardisedData, check_scales
from ..learning.evidence import laplace, least_weights
from ..learning.objective import SeparableProblem
from ..learning.penalty import Penalty
from ..learning.premise import Premise
from ..model import TSKModel
from ..policies import TargetRange
from ..search.tuning import ARRIVING, FIRST_PENALTY, scaled, tune
from .farthest import Farthest
from .firing import Distinct, RuleFiring, row_keys
from .held_chunks import HeldProblem
from .information import Information
from .moments import Moments, blocks
from .pruning import RuleStatistics, redundant_rules
from .scales import Change

__all__ = ["Solved", "Stream"]

# The weights of the penalty that premises which stay have.
_FREE = ("agreement", "alpha", "slope")
# All that a penalty on consequents is made of.
_OF_CONSEQUENTS = (*_FREE, "pulls", "slope_pulls")
# Distinct rows per consequent that are counted: beyond, nothing asks for their number.
_ROWS_EACH = 2
# Weights of a fit that this part of the least falls short of were found without a least.
_FAR_BELOW = 0.1


@dataclass(frozen=True, eq=False)
class Solved:
    """The model of all rows so far."""

    model: TSKModel
    penalty: Penalty
    mean_squared_error: float  # of the standardised target, summed over outputs
    redundant_rules: list[dict] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Stream:
    """What is kept of rows; immutable.

    Parameters
    ----------
    base : TSKModel
        Whose premises and names hold; its consequents are not looked at.
    moments : Moments
    firing : RuleFiring
    farthest : Farthest
    distinct : Distinct
        Distinct rows, all of one class.
    n_rows : int
        Rows with weight, however long ago.
    first : Penalty
        Where the search for its weights starts from, for ``first_rows`` rows by weight.
    first_rows : float or None
        None where it is the same for any number of rows.
    is_free : bool
        Whether rules may compensate one another beyond all reading, as they did at first.
    """

    base: TSKModel
    moments: Moments
    firing: RuleFiring
    farthest: Farthest
    distinct: Distinct
    n_rows: int
    first: Penalty = FIRST_PENALTY
    first_rows: float | None = None
    is_free: bool = False

    @classmethod
    def of(cls, base: TSKModel, consequent_inputs, X, y, sample_weight=None, farthest=None):
        """Of a first chunk; ``X`` (n_rows, n_inputs), ``y`` (n_rows, n_outputs), weights positive.

        ``farthest`` is where that of these rows starts from. Raises ValueError where columns are
        beyond what floats hold.
        """
        rows = StandardisedData.of(X, y, sample_weight)
        _check(rows.inputs, rows.targets, base)
        antecedent, n_columns = base.antecedent, base.n_rules * (1 + consequent_inputs.size)
        parts = blocks(rows, antecedent)
        if farthest is None:
            offset, scale = rows.inputs.offset, rows.inputs.scale
            farthest = Farthest.none(
                base.n_rules, offset[consequent_inputs], scale[consequent_inputs]
            )
        distinct = Distinct.none(1, _ROWS_EACH * n_columns)
        for part in parts:
            raw = np.array(rows.X[part].T, dtype=float, order="C")
            if consequent_inputs.size:
                farthest = farthest.plus_rows(antecedent.strengths(raw), raw[consequent_inputs])
            keys = row_keys(np.column_stack([raw.T, rows.y[part]]).astype(float))
            distinct = distinct.plus(np.zeros(keys.size, dtype=int), keys)
        return cls(
            base,
            Moments.of(rows, antecedent, consequent_inputs),
            RuleFiring.of(rows, antecedent, parts),
            farthest,
            distinct,
            rows.n_rows,
        )

    def starting_from(self, weights):
        """The same rows, for which a fit has found these weights, by their names in ``Penalty``."""
        found = Penalty(**{key: weights[key] for key in _OF_CONSEQUENTS})
        stream = replace(self, first=found, first_rows=self.moments.effective_weight)
        problem, evaluation, penalty = stream._solve(weights)
        posterior = stream._posterior(problem, evaluation, penalty)
        n_distinct = problem.rows.n_rows
        least = least_weights(posterior, problem.antecedent.n_rules, n_distinct).agreement
        # Data next to exact: what is left of them must not be taken for noise afterwards.
        return replace(stream, is_free=found.agreement < _FAR_BELOW * least)

    def chunk(self, X, y, sample_weight=None):
        """The stream of a chunk alone, at the same premises."""
        # The corners so far tell which new rows may be corners; to have them twice is no harm.
        own = self.moments.consequent_inputs
        return Stream.of(self.base, own, X, y, sample_weight, self.farthest)

    def anew(self, X, y, sample_weight=None):
        """The stream of other rows in place of these, whose weights are sought from as before."""
        fresh = Stream.of(self.base, self.moments.consequent_inputs, X, y, sample_weight)
        return replace(fresh, first=self.first, first_rows=self.first_rows, is_free=self.is_free)

    def faded(self, factor):
        """The same rows with all weights times a factor."""
        if factor == 1.0:
            return self
        return replace(self, moments=self.moments.faded(factor), firing=self.firing.faded(factor))

    def plus(self, other):
        """The rows of both."""
        moments = self.moments.plus(other.moments)
        inputs = moments.inputs
        _check(inputs, moments.targets, self.base)
        one = Change.of(self.moments.inputs, inputs)
        two = Change.of(other.moments.inputs, inputs)
        return replace(
            self,
            moments=moments,
            firing=self.firing.on(one).plus(other.firing.on(two), inputs),
            farthest=self.farthest.plus(other.farthest),
            distinct=self.distinct.plus(other.distinct.classes, other.distinct.keys),
            n_rows=self.n_rows + other.n_rows,
        )

    def solved(self, weights) -> Solved:
        """The model of these rows.

        ``weights`` are those of the penalty that are given, by their names in ``evidence.FREE``;
        the evidence of all rows finds the others, as it does for ``fit`` from a few.
        """
        problem, evaluation, penalty = self._solve(weights)
        moments = self.moments
        overlap = moments.gram[:: moments.n_basis, :: moments.n_basis] / moments.weight
        statistics = RuleStatistics(
            overlap, self.firing.strongest / moments.weight, self.firing.peak
        )
        return Solved(
            self._model(problem, evaluation),
            penalty,
            evaluation.mean_squared_error,
            redundant_rules(statistics),
        )

    def information(self, weights):
        """How well the consequents are determined, with the penalty of these weights."""
        problem, evaluation, _ = self._solve(weights)
        moments = self.moments
        matrix = moments.weight * problem.information(evaluation)
        return Information(matrix, moments.consequent_inputs, moments.weight)

    def _solve(self, weights):
        free = [key for key in _FREE if key not in weights]
        given = {key: value for key, value in weights.items() if key in _OF_CONSEQUENTS}
        for key, pulls in (("alpha", "pulls"), ("slope", "slope_pulls")):
            if key in given:
                given.setdefault(pulls, {})
        penalty = replace(self._first_penalty(), **given, stiffness=0.0)
        antecedent, n_distinct = self.base.antecedent, int(self.distinct.counts[0])
        problem = HeldProblem(self.moments, self.farthest, antecedent, penalty, n_distinct)
        if free:
            rows = self.moments.effective_weight
            none = np.empty(0)
            held = Premise(antecedent, none, none, none, ())
            # It is one in all that matters at premises that stay.
            like_rows = cast("SeparableProblem", problem)
            tuned = tune(
                like_rows,
                held,
                free,
                rows,
                turns=0,
                first_steps=ARRIVING,
                has_least=not self.is_free,
            )
            penalty = scaled(tuned.penalty, free, 1.0)
        problem = problem.with_penalty(penalty)
        return problem, problem.evaluate(), penalty

    def _posterior(self, problem, evaluation, penalty):
        targets = self.moments.targets
        return laplace(
            evaluation.normal,
            problem.common_line,
            evaluation.mean_squared_error,
            penalty,
            self.moments.effective_weight,
            problem.antecedent.n_rules,
            n_outputs=max(int(np.count_nonzero(~targets.is_constant)), 1),
        )

    def _first_penalty(self):
        """The weights of a few rows fall with their number."""
        if self.first_rows is None:
            return self.first
        ratio = self.first_rows / self.moments.effective_weight
        return scaled(self.first, _FREE, ratio)

    def _model(self, problem, evaluation):
        moments = self.moments
        inputs, targets = moments.inputs, moments.targets
        n_rules, n_outputs = self.base.n_rules, moments.slope.shape[1]
        coefficients = evaluation.coefficients.reshape(n_rules, -1, n_outputs) * targets.scale
        coefficients[:, 0] += targets.offset
        own = moments.consequent_inputs
        if own.size:
            solved = coefficients
            coefficients = np.zeros((n_rules, 1 + inputs.offset.size, n_outputs))
            coefficients[:, 0] = solved[:, 0]
            coefficients[:, 1 + own] = solved[:, 1:] / inputs.scale[own, None]
        n_coefficients = 1 + int(np.sum(~inputs.is_constant[own]))
        strongest = self.firing.strongest
        return replace(
            self.base,
            coefficients=coefficients,
            reference=inputs.offset,
            spread=inputs.scale,
            minimum=inputs.minimum,
            maximum=inputs.maximum,
            rule_weights=evaluation.masses,
            rule_rows=strongest * (self.n_rows / moments.weight),
            support=self.firing.support(inputs, n_coefficients),
            target=TargetRange(targets.minimum, targets.maximum, targets.scale),
            # Premises stay: what is not known of them is not counted.
            posterior=posterior_of(problem, None, evaluation, moments.effective_weight),
        )


def _check(inputs, targets, base):
    check_scales(inputs, targets, base.input_names, base.output_names)
