r"""Short trainings of candidates on one set of rows: all that a search learns from, or a part.

The weights of every candidate's penalty are found by the evidence (``tuning``). Its error on rows
left out one by one follows from the training on all of them; that ranks the next steps of one kind,
and no more: it has seen the rows by which the step was chosen. What is expected of new rows is the
error on rows that had no part in anything (``judging``).
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
from .tuning import ARRIVING, FEW_TURNS, FIRST_PENALTY, MOST_TURNS, Tuned, tune, with_sparse_slopes

# Rows that a candidate sees for each of its parameters; and at least: those of which one fold is
# enough to judge.
_ROWS_PER_PARAMETER, FEWEST_SEEN = 40, FOLDS * ENOUGH
# Steps of the weights that tell what a candidate promises; training goes on from there.
_STEPS_TO_PROMISE = 1
# Operations of a pass over all the rows that a candidate needs. More rows never mean fewer rules.
_MOST_OPERATIONS = 4e9
# Inputs, or splits, of the largest scores (``TermScores``, ``splits``) that are tried.
_TRIED = 4
# Leaves of a tree for each that is split at once.
_LEAVES_OF_ONE_SPLIT = 4
# A score beyond this is more than chance.
_SIGNIFICANT = 2.0
# Terms on an input for its score: two do not see an odd curve, as of a saturation, beside a line.
_TERMS = 3

# From a training, which is free, to the premises and consequents that keep what is known of the
# outputs: these are judged.
Held = Callable[[SeparableProblem, Evaluation], tuple[Antecedent, np.ndarray]]


@dataclass(frozen=True, eq=False, kw_only=True)
class Plan:
    """What all trainings of a search have in common."""

    families: Sequence[type[Membership]]  # one per input
    order: int
    premise_inputs: np.ndarray  # those that may have terms
    consequent_inputs: np.ndarray
    weights: dict[str, Any]  # of the penalty, those that are given, of ``evidence.FREE``
    seed: int  # of clusterings that have none of their own
    max_rules: int | None
    premises_move: bool  # whether what is trained afterwards moves them
    held: Held | None = None
    n_all: float = np.nan  # rows by weight that the final model will be trained on

    @property
    def free(self):
        """Weights that the evidence finds."""
        return [key for key in FREE if key not in self.weights]

    @property
    def first(self):
        """The penalty at the start."""
        return replace(FIRST_PENALTY, **self.weights)


class Trials:
    """Trainings of candidates on one set of rows, in an order that says nothing of them.

    ``is_wide``: whether the rows are few for so many inputs (``lasso``).
    """

    def __init__(self, rows: StandardisedData, plan: Plan, is_wide=False):
        self.rows, self.plan = rows, plan
        self.slope_inputs = plan.consequent_inputs
        if is_wide:
            self.slope_inputs = lasso_inputs(rows, plan.consequent_inputs)
        self.spacing = Spacing(rows)
        # A bell around one of two values is a little true of the other; a tree's cut is not.
        self.bell_inputs = [int(j) for j in plan.premise_inputs if self.spacing.n_values(j) > 2]
        self.one_rule = Candidate((1,) * rows.X.shape[1])
        self._begun: dict[Candidate, Tuned] = {}  # trained as far as tells what they promise
        self._found: dict[Candidate, Tuned] = {}  # and to the end

    def _significant_inputs(self, candidate, scores):
        """Inputs for terms of scattered rules: of scores beyond chance; for the first rules one.

        The input of the largest score first; what its terms explain counts for no other.
        """
        left = self.bell_inputs
        found: list[int] = []
        work = len(scores.basis) * (_TERMS * scores.basis.shape[1]) ** 2
        # Where to project is too much work, all whose scores are beyond chance have terms.
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
        """As many as its parameters need, by powers of two: most candidates see the same."""
        needed = max(_ROWS_PER_PARAMETER * self.n_parameters(candidate), FEWEST_SEEN)
        n_rows = FEWEST_SEEN * 2 ** int(np.ceil(np.log2(needed / FEWEST_SEEN)))
        part = self.rows.part(slice(n_rows))
        return replace(part, inputs=unit_scale(part.X))

    def larger(self, kind, candidate) -> Candidate | None:
        """The next of a kind: of those that are tried, the one that promises most; or None."""
        smaller = self.tuned(candidate)
        begun = {}
        for one in filter(self._is_small, self._tried(kind, candidate, smaller)):
            problem = self._problem(one, smaller)
            # Of rows that are alike but for a few, there are fewer clusters than were asked for.
            if problem.antecedent.n_rules == one.n_rules:
                begun[one] = self._train(problem, turns=0)
        self._begun |= begun
        return min(begun, key=lambda one: to_six_digits(self.expected(begun[one])), default=None)

    def _tried(self, kind, candidate, tuned):
        """What may be the next of a kind, by the residual of a candidate, ``tuned``."""
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
        """Inputs that terms and cuts may act together with: those of the lasso, or all."""
        is_all = candidate.has_all_slopes or self.slope_inputs is self.plan.consequent_inputs
        varying = np.ptp(np.round(self.rows.X, DIGITS), axis=0) > 0.0
        return np.flatnonzero(varying) if is_all else self.slope_inputs

    def n_parameters(self, candidate):
        """Of consequents and, two each, of terms."""
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
        """The end of a candidate's training."""
        if candidate not in self._found:
            if candidate.slope_worth is not None:
                trained = self.tuned(replace(candidate, slope_worth=None))
                found = with_sparse_slopes(trained, candidate.slope_worth)
            elif candidate.n_rules == 1:
                found = self._train(self._problem(candidate), turns=0, first_steps=ARRIVING)
            else:
                # Terms of a grid serve many rules. After more turns they tell apart runs that lie
                # far from one another, and the rules are wild between these.
                turns = FEW_TURNS if candidate.is_grid else MOST_TURNS
                found = self._train(self._begun[candidate].problem, turns)
                # To be held in order, all rules need a term on an input.
                if candidate.n_clusters and self.plan.premises_move and self.plan.held is None:
                    found = with_fewer_conditions(found)
            self._found[candidate] = found
        return self._found[candidate]

    def expected(self, tuned: Tuned) -> float:
        """Squared error on rows left out one by one, of a training on all rows of the fit."""
        return tuned.expected_error * self.with_more_rows(tuned)

    def with_more_rows(self, tuned: Tuned) -> float:
        """Factor of the squared error where a model is trained on all rows of the fit.

        What the parameters cost, k / n of the noise's variance, falls as the rows rise.
        """
        n_effective = tuned.posterior.n_effective
        return (1.0 + n_effective / self.plan.n_all) / (1.0 + n_effective / tuned.posterior.n_rows)

    def _problem(self, candidate, smaller=None):
        """What a candidate begins with: rules and weights of a smaller one, if there is one."""
        plan, rows = self.plan, self.rows_for(candidate)
        penalty = plan.first if smaller is None else smaller.penalty
        antecedent = rule_base(candidate, rows, plan.families, self.spacing, plan.seed, smaller)
        inputs = self._inputs_with_slopes(candidate)
        return SeparableProblem(rows, antecedent, penalty, consequent_inputs=inputs)

    def _train(self, problem, turns, first_steps=_STEPS_TO_PROMISE):
        if turns and not self.plan.premises_move:
            turns, first_steps = 0, ARRIVING
        premise = Premise.of(problem.antecedent, *problem.rows.inputs.box)
        return tune(problem, premise, self.plan.free, turns, first_steps)

    def squared_errors(self, tuned: Tuned, rows: StandardisedData, held: Held | None):
        """Of rows that were not trained on, as predict answers; summed over outputs."""
        seen = tuned.problem.rows
        antecedent, coefficients = tuned.evaluation.antecedent, tuned.solved.coefficients
        if held is not None:
            antecedent, coefficients = held(tuned.problem, tuned.solved)
        n_inputs, targets = seen.X.shape[1], unit_scale(seen.y)
        inputs, order = tuned.problem.consequent_inputs, self.plan.order
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
            target=TargetRange(targets.minimum, targets.maximum, targets.scale),
        )
        return np.sum((model.predict(rows.X) - rows.y) ** 2, axis=1)
