r"""Short trainings of candidates on one set of rows: all rows of a search, or those of a fold.

The evidence finds the weights of every candidate's penalty (``tuning``). The leave-one-out error
follows from the training on all rows. It only ranks the possible next steps of one kind, because
the rows that it leaves out took part in choosing the step. The error expected on new rows is that
on rows which no step has seen (``judging``).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..antecedent import Antecedent
from ..consequent import in_user_units
from ..learning.data import StandardisedData
from ..learning.evidence import FREE
from ..learning.objective import Evaluation, SeparableProblem
from ..learning.premise import Premise
from ..membership import Membership
from ..model import TSKModel
from ..policies import TargetRange
from .candidates import Candidate, TermScores, rule_base
from .conditions import with_fewer_conditions
from .grid import Spacing
from .judging import ENOUGH, FOLDS
from .lasso import lasso_inputs
from .sample import DIGITS, to_six_digits, unit_scale
from .splits import best_splits, together
from .tuning import (
    ARRIVING,
    FEW_TURNS,
    FIRST_PENALTY,
    MOST_TURNS,
    Tuned,
    tune,
    with_free_terms,
    with_sparse_slopes,
)

# Rows that a candidate sees for each of its parameters; and the fewest that it sees in any case,
# one fold of which is enough to judge.
_ROWS_PER_PARAMETER, FEWEST_SEEN = 40, FOLDS * ENOUGH
# Steps of the weights before a candidate is ranked; training goes on from there.
_STEPS_TO_PROMISE = 1
# Most operations of a pass over the rows that a candidate needs. The limit does not depend on the
# number of rows, so that more rows never mean fewer rules.
_MOST_OPERATIONS = 4e9
# This many inputs, or splits, with the largest scores (``TermScores``, ``splits``) are tried.
_TRIED = 4
# A tree splits one leaf for every four that it has, and at least one, at a time.
_LEAVES_OF_ONE_SPLIT = 4
# A score beyond this is more than chance.
_SIGNIFICANT = 2.0
# Terms on an input for its score. Two would miss an odd curve, as of a saturation, beside a line.
_TERMS = 3

# Trainings are unconstrained. This maps one to the premises and consequents that satisfy the
# monotonic constraints; these are judged.
Held = Callable[[SeparableProblem, Evaluation], tuple[Antecedent, np.ndarray]]


@dataclass(frozen=True, eq=False, kw_only=True)
class Plan:
    """What all trainings of a search have in common."""

    families: Sequence[type[Membership]]  # one per input
    order: int  # of the consequents
    premise_inputs: np.ndarray  # that may have terms
    consequent_inputs: np.ndarray
    weights: dict[str, Any]  # given weights of the penalty, by their names in ``evidence.FREE``
    seed: int  # for clusterers without one
    max_rules: int | None
    premises_move: bool  # whether the final training moves the premises
    held: Held | None = None
    n_all: float = np.nan  # rows by weight that the final model will be trained on
    tell: Callable[[str], None] | None = None  # of every candidate, for ``verbose``

    @property
    def free(self):
        """Names of the weights that the evidence finds."""
        return [key for key in FREE if key not in self.weights]

    @property
    def first(self):
        """The penalty at the start."""
        return replace(FIRST_PENALTY, **self.weights)


class Trials:
    """Trainings of candidates on one set of rows, which come in random order.

    ``is_wide``: whether the rows are few for the number of inputs (``lasso``).
    """

    def __init__(self, rows: StandardisedData, plan: Plan, is_wide=False):
        self.rows, self.plan = rows, plan
        self.slope_inputs = plan.consequent_inputs
        if is_wide:
            self.slope_inputs = lasso_inputs(rows, plan.consequent_inputs)
        self.spacing = Spacing(rows)
        # Bells overlap: on an input with two values, only the cut of a tree tells the values apart.
        self.bell_inputs = [int(j) for j in plan.premise_inputs if self.spacing.n_values(j) > 2]
        self.one_rule = Candidate((1,) * rows.X.shape[1])
        # The problem that a candidate begins with, and the smaller one that it has grown from.
        self._begun: dict[Candidate, tuple[SeparableProblem, Tuned]] = {}
        self._found: dict[Candidate, Tuned] = {}  # trained to the end

    def _significant_inputs(self, candidate, scores):
        """Inputs with scores beyond chance, for terms of scattered rules; the first rules get one.

        Forward selection: what the input with the largest score explains is projected out before
        the others are scored again.
        """
        left = self.bell_inputs
        found: list[int] = []
        work = len(scores.basis) * (_TERMS * scores.basis.shape[1]) ** 2
        # If the projection is too much work, all inputs with scores beyond chance are taken.
        while left and work * len(found) * len(left) <= _MOST_OPERATIONS:
            if found:
                scores.project_out(found[-1], _TERMS)
            values = scores.of([(j, _TERMS) for j in left])
            largest = left[int(np.argmax(values))]
            left = [left[k] for k in np.flatnonzero(values > _SIGNIFICANT)]
            if left or not (found or candidate.inputs):
                found.append(largest)
            left = [j for j in left if j != largest]
        return [*found, *left]

    def rows_for(self, candidate):
        """As many rows as a candidate needs, in powers of two, so that most see the same rows."""
        needed = max(_ROWS_PER_PARAMETER * self.n_parameters(candidate), FEWEST_SEEN)
        n_rows = FEWEST_SEEN * 2 ** int(np.ceil(np.log2(needed / FEWEST_SEEN)))
        part = self.rows.part(slice(n_rows))
        return replace(part, inputs=unit_scale(part.X))

    def larger(self, kind, candidate) -> Candidate | None:
        """The next candidate of a kind: the one tried with the least expected error, or None."""
        smaller = self.tuned(candidate)
        begun: dict[Candidate, Tuned] = {}
        for one in filter(self._is_small, self._tried(kind, candidate, smaller)):
            problem = self._problem(one, smaller)
            # If few rows differ, k-means finds fewer clusters than asked for: leave these out.
            if problem.antecedent.n_rules == one.n_rules:
                still = Premise.still(problem.antecedent)
                begun[one] = tune(problem, still, self.plan.free, 0, _STEPS_TO_PROMISE)
        self._begun |= {one: (tuned.problem, smaller) for one, tuned in begun.items()}
        return min(begun, key=lambda one: to_six_digits(self.expected(begun[one])), default=None)

    def _tried(self, kind, candidate, tuned):
        """The next candidates of a kind to try, chosen by the residual of the trained one."""
        crossed = self._crossed(candidate)
        if kind == "tree":
            splits = best_splits(tuned, self.plan.premise_inputs, crossed)
            n_more = max(candidate.n_rules // _LEAVES_OF_ONE_SPLIT - 1, 0)
            several = together(splits, n_more, _TRIED)
            return [candidate.with_more_splits(some) for some in several]
        scores = TermScores(tuned, self.spacing, crossed)
        if kind == "grid":
            values = scores.of([(j, candidate.counts[j] + _TERMS - 1) for j in self.bell_inputs])
            best = np.argsort(-values, kind="stable")[:_TRIED]
            return [candidate.with_more_terms(self.bell_inputs[k]) for k in best]
        more = candidate.with_more_clusters(self._significant_inputs(candidate, scores))
        return [more] if more.inputs else []

    def _inputs_with_slopes(self, candidate):
        """Inputs that the consequents of a candidate are linear in."""
        return self.plan.consequent_inputs if candidate.has_all_slopes else self.slope_inputs

    def _crossed(self, candidate):
        """Inputs by which new terms and cuts may change the slopes: those of the lasso, or all."""
        is_all = candidate.has_all_slopes or self.slope_inputs is self.plan.consequent_inputs
        varying = np.ptp(np.round(self.rows.X, DIGITS), axis=0) > 0.0
        return np.flatnonzero(varying) if is_all else self.slope_inputs

    def n_parameters(self, candidate):
        """Number of parameters: those of the consequents, and two for each term."""
        n_basis = 1 + self._inputs_with_slopes(candidate).size
        return candidate.n_rules * n_basis + 2 * candidate.n_terms

    def _is_small(self, candidate):
        most, n = self.plan.max_rules or np.inf, self.n_parameters(candidate)
        if candidate.n_rules > most or n > self.rows.n_rows:
            return False
        if any(count > self.spacing.n_values(j) for j, count in enumerate(candidate.counts)):
            return False
        return _ROWS_PER_PARAMETER * n**3 <= _MOST_OPERATIONS

    def tuned(self, candidate: Candidate) -> Tuned:
        """The candidate, trained to the end."""
        if candidate not in self._found:
            if candidate.slope_worth is not None:
                trained = self.tuned(replace(candidate, slope_worth=None))
                found = with_sparse_slopes(trained, candidate.slope_worth)
            elif candidate.n_rules == 1:
                found = self._train(self._problem(candidate), turns=0)
            else:
                # Terms of a grid serve many rules. More turns would fit them to runs that lie far
                # from one another, and make the rules wild in between.
                turns = FEW_TURNS if candidate.is_grid else MOST_TURNS
                problem, smaller = self._begun[candidate]
                found = self._train(problem, turns)
                # If terms without bounds do not pay in a small grid, they are not tried in larger.
                is_first = smaller.problem.antecedent.n_rules == 1
                if is_first or smaller.premise.is_unbounded:
                    found = with_free_terms(found)
                # Monotonic constraints need a term of every rule on an input: there, all stay.
                if candidate.n_clusters and self.plan.premises_move and self.plan.held is None:
                    found = with_fewer_conditions(found)
            self._found[candidate] = found
        return self._found[candidate]

    def expected(self, tuned: Tuned) -> float:
        """Expected squared error, scaled to a training on all rows of the fit."""
        return tuned.expected_error * self.with_more_rows(tuned)

    def with_more_rows(self, tuned: Tuned) -> float:
        """Factor by which the squared error changes in a training on all rows of the fit.

        k effective parameters add k / n of the noise variance, which falls as the rows n rise.
        """
        posterior, n_all = tuned.posterior, self.plan.n_all
        k = posterior.n_effective
        return (1.0 + k / n_all) / (1.0 + k / posterior.effective_weight)

    def _problem(self, candidate, smaller=None):
        """The problem that a candidate begins with, from the rules and weights of a smaller one."""
        plan, rows = self.plan, self.rows_for(candidate)
        penalty = plan.first if smaller is None else smaller.penalty
        antecedent = rule_base(candidate, rows, plan.families, self.spacing, plan.seed, smaller)
        inputs = self._inputs_with_slopes(candidate)
        return SeparableProblem(rows, antecedent, penalty, consequent_inputs=inputs)

    def _train(self, problem, turns):
        turns = turns if self.plan.premises_move else 0
        # If the premises stay, the weights take all of their steps at once.
        first_steps = _STEPS_TO_PROMISE if turns else ARRIVING
        premise = Premise.of(problem.antecedent, *problem.rows.inputs.box)
        return tune(problem, premise, self.plan.free, turns, first_steps)

    def squared_errors(self, tuned: Tuned, rows: StandardisedData, held: Held | None):
        """Squared errors of ``predict`` on rows that were not trained on, summed over outputs."""
        seen = tuned.problem.rows
        antecedent, coefficients = tuned.evaluation.antecedent, tuned.solved.coefficients
        if held is not None:
            antecedent, coefficients = held(tuned.problem, tuned.solved)
        n_inputs, targets = seen.X.shape[1], unit_scale(seen.y)
        target = TargetRange(targets.minimum, targets.maximum, targets.scale)
        inputs, order = tuned.problem.consequent_inputs, self.plan.order
        # As in the final model, every output has a noise of its own.
        squares = np.maximum(tuned.solved.mean_squares, np.finfo(float).tiny)
        shares = squares / squares.sum() * tuned.posterior.n_outputs
        noise = np.sqrt(tuned.posterior.noise_variance * shares)
        model = TSKModel(
            antecedent=antecedent,
            initial_antecedent=antecedent,
            coefficients=in_user_units(coefficients, seen.inputs, targets, inputs, order),
            reference=np.zeros(n_inputs),
            spread=np.ones(n_inputs),
            minimum=seen.inputs.minimum,
            maximum=seen.inputs.maximum,
            rule_weights=tuned.evaluation.masses,
            rule_rows=tuned.evaluation.masses,
            input_names=tuple(f"x{j}" for j in range(n_inputs)),
            target=target,
            max_extrapolation=target.supported_extrapolation(noise),
        )
        return np.sum((model.predict(rows.X) - rows.y) ** 2, axis=1)
