r"""Terms for what is known: a structure that was found without the constraints, grown under them.

A few rules may owe their shape to slopes that compensate one another, which a constraint forbids:
the steps of a staircase are two lines that fall away from the step. What is known then costs them
more than it would cost more rules. Where it costs anything to speak of, the grid that was found
grows on, one term at a time, by what is expected on new rows of the fits that keep what is known,

    n log ( MSE (n + k) / (n - k) ) ,

Akaike's final prediction error, with MSE after the constraints and the effective number of
parameters k without them, which is on the safe side. A term is taken for a gain of two, "positive"
in the words of Kass and Raftery (1995), where the search without constraints asks for ten: few
candidates are compared here, and what is known speaks for them too. Of rows that come in groups n
is the number of groups.
"""

import warnings
from collections.abc import Callable
from dataclasses import replace
from math import prod

import numpy as np

from .._validation import warn_user
from ..antecedent import GridAntecedent
from ..constraints.wishes import Wishes
from .result import Fitted

__all__ = ["grown"]

# What a term must gain, and what is known must cost before any is tried, in n log(error).
_WORTHWHILE = 2.0
_MOST_TERMS, _MOST_RULES = 6, 36
# Of more inputs only those are tried that have terms, or that something is known of.
_FEW_INPUTS = 4


def grown(wishes: Wishes, inputs, fit: Callable[..., Fitted]) -> Fitted:
    """The fit of a structure found, or of the same with more terms, if what is known asks for it.

    Parameters
    ----------
    wishes : Wishes
        What is known.
    inputs : ndarray of int
        Those that may have terms.
    fit : callable
        A fit of the structure that the data ask for; or, given them, of so many terms per input, as
        a trial, of which nothing need be proven, or for good.
    """
    best, told = _quiet(fit)
    found, counts, n_units = best, _counts(best), best.n_units
    if n_units * _cost(best) > _WORTHWHILE:
        model = best.model
        most = np.where(model.minimum < model.maximum, _MOST_TERMS, 1)
        while trials := [*_fits(_next(wishes, inputs, counts, found), most, fit)]:
            trial, more = min(trials, key=lambda one: _log_error(one[0]))
            gain = n_units * (_log_error(best) - _log_error(trial))
            if not gain > _WORTHWHILE:
                break
            best, counts = trial, more
    if best is not found:
        best, told = _quiet(fit, counts.tolist())
    for message in told:
        warn_user(str(message.message), message.category)
    return replace(best, start=replace(best.start, candidates=found.start.candidates))


def _quiet(fit, *args):
    """A fit, and what it would have warned of."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        return fit(*args), told


def _counts(fitted):
    """Terms per input of a grid; None of other rules."""
    antecedent = fitted.model.antecedent
    if not isinstance(antecedent, GridAntecedent):
        return None
    inputs = np.concatenate([group.inputs for group in antecedent.groups] or [np.empty(0, int)])
    return np.maximum(np.bincount(inputs, minlength=fitted.model.n_inputs), 1)


def _next(wishes, inputs, counts, found):
    """Terms per input of what is tried next: one more on an input; beside other rules a grid."""
    if counts is None:
        grids = [one["n_mfs"] for one in found.start.candidates if one["n_mfs"] is not None]
        return [np.array(grid) for grid in grids[:1]]
    if len(inputs) > _FEW_INPUTS:
        known = wishes.signs.any(axis=0)
        inputs = [j for j in inputs if counts[j] > 1 or known[j]]
    return [counts + (np.arange(counts.size) == j) for j in inputs]


def _fits(every, most, fit):
    """Fits of grids that are not too large, and their terms."""
    for counts in every:
        if (counts > most).any() or prod(counts.tolist()) > _MOST_RULES:
            continue
        try:
            yield _quiet(fit, counts.tolist(), True)[0], counts
        except ValueError:
            # These rules cannot keep what is known at all, and are none of the candidates.
            continue


def _cost(fitted):
    """How much what is known raises the logarithm of the error of training."""
    known = fitted.constraints
    least = np.finfo(float).eps
    return np.log((known["loss_after"] + least) / (known["loss_before"] + least))


def _log_error(fitted):
    """The logarithm of the error to be expected on new rows; infinite of too many parameters."""
    share = fitted.effective_share
    if not share < 0.5:
        return np.inf
    error = fitted.constraints["loss_after"] + np.finfo(float).eps
    return np.log(error * (1.0 + share) / (1.0 - share))
