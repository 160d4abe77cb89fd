"""The start of rules that are given: their weights, and how free their terms are.

Rules of a structure that the user chose are what they can be: where rows enough say so, they may
compensate one another, and terms may leave their bounds, if the error to be expected is so much
smaller.
"""

from dataclasses import replace

from ..antecedent import Antecedent
from ..learning.data import StandardisedData
from ..learning.evidence import FREE, ROWS_EACH
from ..learning.objective import SeparableProblem
from ..learning.premise import Premise
from .between import places_between, unknown_between
from .readable_terms import has_idle_term, has_twin_terms
from .sample import effective_weight, search_sample
from .start import Start
from .tuning import (
    ARRIVING,
    FIRST_PENALTY,
    FIRST_STEPS,
    MOST_COLUMNS,
    MOST_TURNS,
    Tuned,
    held,
    scaled,
    settled,
    tune,
)

__all__ = ["tuned_start"]

# The weights of rules that are given are found on at most so many representative rows.
_MOST_ROWS = 1000
# Of the noise, what is left where terms are freed beyond all reading: only for data that are next
# to exact. And of the error, where they are freed and can be read nevertheless.
_LEAST_NOISE = 0.05
_LESS_ERROR = 0.1


def tuned_start(
    antecedent: Antecedent,
    rows: StandardisedData,
    order,
    consequent_inputs,
    weights,
    premises_move,
    is_compared=False,
    is_noisy=False,
) -> Start:
    """A start from rules that are given, with the weights that are not given found on the rows.

    ``weights`` are those of the penalty that are given, by their names in ``evidence.FREE``;
    ``is_compared`` says that the error to be expected is wanted even where all of them are given,
    ``is_noisy`` that what remains of the target is noise, and loose trainings would look in vain.
    """
    free = [key for key in FREE if key not in weights]
    penalty = replace(FIRST_PENALTY, **weights)
    if not premises_move:
        free = [key for key in free if key != "stiffness"]
        penalty = replace(penalty, stiffness=weights.get("stiffness", 0.0))
    if not free and not is_compared:
        return Start(antecedent, penalty)
    sample = search_sample(rows, _MOST_ROWS)
    problem = SeparableProblem(
        sample, antecedent, order, penalty, consequent_inputs=consequent_inputs
    )
    n_sample = effective_weight(sample)
    premise, is_free = _premise(problem), False
    turns = MOST_TURNS if premises_move else 0
    first_steps = FIRST_STEPS if premises_move else ARRIVING
    best = tune(problem, premise, free, n_sample, turns, first_steps)
    if premises_move and _may_be_free(problem) and not is_noisy:
        loose = _freely(problem, premise, free, n_sample)
        if best.takes_for_noise(loose):
            loose = held(loose, premise, free, n_sample)
            best = loose if loose.priced_error < best.priced_error else best
        anywhere = _premise(problem, is_free=True)
        freed = _freed(best, anywhere, free, n_sample)
        if freed is not None:
            best, premise, is_free = freed, anywhere, True
    penalty = scaled(best.penalty, free, n_sample / effective_weight(rows), best.is_held)
    return Start(
        antecedent,
        penalty,
        settled(best.displacement),
        is_free,
        best.is_apart,
        best.is_held,
        expected_error=best.expected_error,
        unknown_between=unknown_between(best, places_between(sample)),
    )


def _may_be_free(problem: SeparableProblem) -> bool:
    """Whether there are premises, and rows enough: any freedom passes through hardly more rows."""
    n_columns, n_rows = problem.n_columns, problem.rows.n_rows
    return (
        problem.antecedent.parameters.size > 0
        and n_columns <= MOST_COLUMNS
        and n_rows >= ROWS_EACH * n_columns
    )


def _freed(bounded: Tuned, premise: Premise, free, n_rows: float) -> Tuned | None:
    """The same with terms that have no bounds, where that is worth it.

    Freedom is worth nine tenths of the squared error if the terms can still be told apart, and next
    to all of the noise if not.
    """
    problem = bounded.problem
    freed = _freely(problem, premise, free, n_rows)
    if bounded.is_beaten_loosely(freed, _LEAST_NOISE):
        return freed
    if freed.expected_error < _LESS_ERROR * bounded.priced_error:
        freed = held(freed, premise, free, n_rows)
        rows, antecedent = problem.rows, freed.evaluation.antecedent
        is_read = not has_idle_term(rows, antecedent) and not has_twin_terms(rows, antecedent)
        if is_read and freed.priced_error < _LESS_ERROR * bounded.priced_error:
            return freed
    return None


def _freely(problem, premise, free, n_rows) -> Tuned:
    """Rules that may compensate one another."""
    return tune(problem, premise, free, n_rows, is_loose=True, has_least=False, is_last=False)


def _premise(problem, is_free=False):
    """What moves of a problem's rules, within the box of its rows."""
    low, high = problem.rows.inputs.minimum, problem.rows.inputs.maximum
    return Premise.of(problem.antecedent, low, high, is_free)
