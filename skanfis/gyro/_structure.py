"""How many terms each input gets: grown one at a time, judged on groups that are held out."""

import math
import warnings

import numpy as np

__all__ = ["errors_of_fold", "grow_terms", "held_out_rms"]

# A term has to pay for the rules that it brings.
_LEAST_GAIN = 0.02


def grow_terms(score, n_inputs, max_rules, tell):
    """Numbers of terms per input, and all that were tried: (numbers, score), in order.

    From one term each (a linear model) on, the input gets one more on which the held-out error
    falls most; until it falls by less than 2 %, or there would be more rules than ``max_rules``.
    """
    terms = [1] * n_inputs
    best = score(terms)
    tried = [(tuple(terms), best)]
    while True:
        candidates = []
        for j in range(n_inputs):
            candidate = terms.copy()
            candidate[j] += 1
            if math.prod(candidate) <= max_rules:
                candidates.append((score(candidate), candidate))
        tried += [(tuple(candidate), found) for found, candidate in candidates]
        if not candidates:
            return terms, tried
        found, candidate = min(candidates)
        if not found < (1.0 - _LEAST_GAIN) * best:
            return terms, tried
        best, terms = found, candidate
        tell(f"terms {','.join(map(str, terms))}: held-out RMS {best:.4g} deg/s")


def held_out_rms(fit_and_predict, folds):
    """RMS over the rows of all folds that were in the bounds of what was trained on.

    ``fit_and_predict(train, test)`` gives errors and whether each row was in bounds.
    """
    squares, count = 0.0, 0
    with warnings.catch_warnings():
        # What a candidate warns of, it is judged by.
        warnings.simplefilter("ignore")
        for train, test in folds:
            errors, inside = fit_and_predict(train, test)
            squares += float(np.sum(errors[inside] ** 2))
            count += int(inside.sum())
    return math.sqrt(squares / count) if count else math.inf


def errors_of_fold(make, X, target, train, test, *, quiet=False):
    """Errors of the test rows, and which of them are in the range of the training rows."""
    with warnings.catch_warnings():
        if quiet:
            warnings.simplefilter("ignore")
        estimator = make().fit(X.iloc[train], target[train])
        errors = estimator.predict(X.iloc[test]) - target[test]
    low, high = X.iloc[train].min(), X.iloc[train].max()
    tested = X.iloc[test]
    inside = ((tested >= low) & (tested <= high)).all(axis=1).to_numpy()
    return errors, inside & np.isfinite(errors)
