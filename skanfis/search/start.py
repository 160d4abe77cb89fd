"""Where training starts: rules in standardised units, weights of the penalty, premises so far.

Rules come from a search, or are given: by terms per input, by a clusterer, by a model. For given
rules, the weights are found in the same way, on a sample.
"""

from dataclasses import dataclass, field

import numpy as np

from ..antecedent import Antecedent, GridAntecedent, RuleTableAntecedent, TreeAntecedent
from ..learning.data import StandardisedData
from ..learning.objective import SeparableProblem
from ..learning.penalty import Penalty
from ..learning.premise import Premise
from ..learning.sparse_slopes import SLOPE_WORTHS
from ..model import TSKModel
from .choice import tolerated
from .sample import search_sample
from .trials import FEWEST_SEEN, Plan
from .tuning import (
    MOST_TURNS,
    Tuned,
    cost_of,
    scaled,
    tune,
    tuned_on,
    with_free_terms,
    with_most_agreement,
    with_sparse_slopes,
)

# Decimals of displacements, in spacings of terms. Rounding errors are smaller.
_DIGITS = 5


@dataclass(frozen=True, eq=False)
class Start:
    """A rule base in standardised units, the penalty's weights, and the premises so far."""

    antecedent: Antecedent
    penalty: Penalty
    consequent_inputs: np.ndarray  # inputs that the consequents are linear in
    displacement: np.ndarray | None = None  # of the premises; None is zero
    is_unbounded: bool = False  # whether terms have no bounds (see ``premise``)
    # Whether agreement was raised as far as the tolerance allows: then more rows do not lower it.
    agreement_is_raised: bool = False
    candidates: list[dict] = field(default_factory=list)  # all that were compared, best first
    term_names: tuple[str, ...] = ()  # if given with the rules


def started(tuned: Tuned, rows: StandardisedData, plan: Plan, room: float, candidates) -> Start:
    """A start from a training, with as much agreement as the tolerance leaves room for.

    First it goes on with all ``rows``. ``room`` is the factor by which the squared error may still
    rise. Only its root is used up: agreement costs more on new rows than the training rows show.
    """
    tuned = tuned_on(tuned, rows)
    problem, weight = tuned.problem, tuned.posterior.effective_weight
    # Premises make room for agreement by following it. Fixed ones cannot, so none is added.
    room = np.sqrt(room) if plan.premises_move else 1.0
    agreeing = with_most_agreement(tuned, room)
    is_raised = agreeing is not tuned
    return Start(
        problem.antecedent,
        scaled(agreeing.penalty, plan.free, weight / plan.n_all, is_raised),
        problem.consequent_inputs,
        # Training goes on from there; rounding errors are cut off.
        np.round(agreeing.displacement, _DIGITS),
        tuned.premise.is_unbounded,
        is_raised,
        candidates,
    )


def tuned_start(antecedent: Antecedent, rows: StandardisedData, plan: Plan, simplicity) -> Start:
    """A start from given rules, with the free weights found on a sample of the rows."""
    free, inputs = plan.free, plan.consequent_inputs
    every = search_sample(rows)
    sample = search_sample(every, FEWEST_SEEN)
    problem = SeparableProblem(sample, antecedent, plan.first, consequent_inputs=inputs)
    # Rules whose terms stay may compensate one another: least weights would keep them from it.
    low, high = sample.inputs.box
    premise = Premise.of(antecedent, low, high, is_unbounded=not plan.premises_move)
    turns = MOST_TURNS if plan.premises_move and free else 0
    best = with_free_terms(tune(problem, premise, free, turns))
    room, worths = 1.0, SLOPE_WORTHS if turns else ()
    sparse = [with_sparse_slopes(best, worth) for worth in worths]
    error = min(one.expected_error for one in (best, *sparse))
    variance = float(np.count_nonzero(~rows.targets.is_constant))
    if turns and 0.0 < error < np.inf:
        most = tolerated(error, variance, simplicity)
        best = next(one for one in (*sparse[::-1], best) if one.expected_error <= most)
        room = most / best.expected_error
    n_rules = antecedent.n_rules
    given = "one rule as given" if n_rules == 1 else f"{n_rules} rules as given"
    return started(best, every, plan, room, [described(best, given, best.expected_error, variance)])


def described(tuned: Tuned, structure, squared_error, variance, is_chosen=True):
    """A candidate in words and numbers; ``variance`` is the squared error of the mean."""
    antecedent, n_mfs = tuned.problem.antecedent, None
    kind = "tree" if isinstance(antecedent, TreeAntecedent) else "scattered"
    if antecedent.grid_counts is not None:
        kind = "grid" if antecedent.n_rules > 1 else "one rule"
        n_mfs = [1] * tuned.problem.rows.X.shape[1]
        for j, count in zip(antecedent.inputs_with_terms, antecedent.grid_counts, strict=True):
            n_mfs[j] = count
    return {
        "structure": structure,
        "kind": kind,
        "rules": antecedent.n_rules,
        "n_mfs": n_mfs,
        "reading_cost": cost_of(tuned),
        "expected_error": float(np.sqrt(squared_error)),
        "rules_beat_mean": bool(squared_error + tuned.disagreement <= variance),
        "chosen": is_chosen,
    }


def imported_antecedent(model: TSKModel, rows: StandardisedData) -> Antecedent:
    """The rule base of a model in the rows' standardised units, ready for training."""
    scale = rows.inputs
    antecedent = model.antecedent.change_units(-scale.offset / scale.scale, 1.0 / scale.scale)
    if isinstance(antecedent, GridAntecedent):
        # Terms of a grid move by their distances, which must be positive; a table's move singly.
        places = np.split(antecedent.term_places, np.cumsum(antecedent.counts)[:-1])
        if any((np.diff(own) <= 0.0).any() for own in places):
            return RuleTableAntecedent(antecedent.groups, antecedent.rule_terms)
    return antecedent
