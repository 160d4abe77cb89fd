r"""Terms for what is known: a structure that was found without the constraints, grown under them.

A few rules may owe their shape to slopes that compensate one another, which a constraint forbids:
the steps of a staircase are two lines that fall away from the step. What is known then costs them
more than it would cost more rules. Where it costs anything to speak of, the grid that was found
grows on, one term at a time, by what is expected on new rows of the fits that keep what is known,

    n log E ,

with E the mean square of rows left out one by one, or of whole groups where rows come in groups, at
fixed premises and with whatever constraints hold the consequents back held on
(``Tuned.expected_error`` without any): exact while these stay the same; n is the number of rows, or
of groups. A term is taken for a gain of two, "positive" in the words of Kass and Raftery (1995),
where the search without constraints asks for ten: few candidates are compared here, and what is
known speaks for them too.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import prod

import numpy as np

from .._validation import warn_user
from ..bounds.wishes import Wishes
from ..exceptions import InfeasibleConstraintsError
from .result import Fitted

__all__ = ["grown"]

# What a term must gain, and what is known must cost before any is tried, in n log(error).
_WORTHWHILE = 2.0
_MOST_TERMS, _MOST_RULES = 6, 36
# Of many inputs fewer rules: so many coefficients, or a few rules.
_MOST_COEFFICIENTS, _FEW_RULES = 256, 3
# Of more inputs only those are tried that have terms, or that something is known of.
_FEW_INPUTS = 4
# Where the structure found leaves more of the target's variance than this, the rest is noise.
_NEARLY_EXACT = 0.01
_LEAST = np.finfo(float).eps


def grown(wishes: Wishes, inputs, fit: Callable[..., Fitted]) -> Fitted:
    """The fit of the structure found, or of that with more terms if what is known asks for them.

    Parameters
    ----------
    wishes : Wishes
        What is known.
    inputs : ndarray of int
        Those that may have terms.
    fit : callable
        A fit of the structure that the data ask for; or, given them, of so many terms per input,
        and whether what the former leaves is noise. Both are trials: what is known is kept on a
        sample; the one that is taken gets a proof.
    """
    found, told = _heard(fit)
    best, counts, n_units = found, _counts(found), found.n_units
    if n_units * _cost(found) > _WORTHWHILE:
        error, model = _log_error(found), found.model
        most = np.where(model.minimum < model.maximum, _MOST_TERMS, 1)
        is_noisy = found.constraints["loss_before"] > _NEARLY_EXACT
        while trials := [*_fits(_next(wishes, inputs, counts, found), most, fit, is_noisy)]:
            trial = min(trials, key=lambda one: one.log_error)
            if not n_units * (error - trial.log_error) > _WORTHWHILE:
                break
            best, counts, error, told = trial.fitted, trial.counts, trial.log_error, trial.told
    assert best.proven is not None
    best, more = _heard(best.proven)
    for message, category in told + more:
        warn_user(message, category)
    return replace(best, start=replace(best.start, candidates=found.start.candidates))


@dataclass(frozen=True)
class _Trial:
    """A fit of so many terms per input, what is to be expected of it, what it warned of."""

    fitted: Fitted
    counts: np.ndarray
    log_error: float
    told: list


def _heard(fit, *args):
    """A fit, and what it would have warned of."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = fit(*args)
    return found, [(str(one.message), one.category) for one in told]


def _counts(fitted):
    """Terms per input of a grid; None of other rules."""
    antecedent = fitted.model.antecedent
    if antecedent.grid_counts is None:
        return None
    return np.maximum(np.bincount(antecedent.term_inputs, minlength=fitted.model.n_inputs), 1)


def _next(wishes, inputs, counts, found):
    """Terms per input of what is tried next: one more on an input; beside other rules a grid."""
    if counts is None:
        grids = [one["n_mfs"] for one in found.start.candidates if one["n_mfs"] is not None]
        return [np.array(grid) for grid in grids[:1]]
    if len(inputs) > _FEW_INPUTS:
        known = wishes.signs.any(axis=0)
        inputs = [j for j in inputs if counts[j] > 1 or known[j]]
    return [counts + (np.arange(counts.size) == j) for j in inputs]


def _fits(every, most, fit, is_noisy):
    """Trials of grids that are not too large."""
    for counts in every:
        if (counts > most).any() or prod(counts.tolist()) > _most_rules(counts.size):
            continue
        try:
            fitted, told = _heard(fit, counts.tolist(), is_noisy)
        except InfeasibleConstraintsError:
            # These rules cannot keep what is known at all, and are none of the candidates.
            continue
        yield _Trial(fitted, counts, _log_error(fitted), told)


def _most_rules(n_inputs):
    return min(_MOST_RULES, max(_MOST_COEFFICIENTS // (1 + n_inputs), _FEW_RULES))


def _cost(fitted):
    """How much what is known raises the logarithm of the error of training."""
    known = fitted.constraints
    return np.log((known["loss_after"] + _LEAST) / (known["loss_before"] + _LEAST))


def _log_error(fitted):
    """The logarithm of the error to be expected on new rows."""
    return float(np.log(fitted.expected_error() + _LEAST))
