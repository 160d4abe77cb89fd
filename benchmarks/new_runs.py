"""How many of some new runs an interval leaves short, if they are like the old ones.

Of every run, old or new, the score counts that a part c of its rows does not exceed: s_c. With K
old runs the interval reaches as far as the k-th smallest of theirs, k = ceil((K + 1) p). Had any K
of all runs been the old ones, the run i would be new and have less than a part b of its rows
covered with the probability

    P(i is new)  P(of those with s_c below s_b(i), k or more are old) ,

the second hypergeometric: of all other runs K are drawn without replacement. Summed over all runs
this is the number to be expected, exactly, whatever the distribution; of b = c it is
(K + 1 - k) / (K + 1) of the new ones.
"""

import numpy as np
from scipy.stats import hypergeom
from sklearn.model_selection import GroupKFold

__all__ = ["expected_short", "run_scores", "scores_of_rows"]


def scores_of_rows(model, X, y, groups, new, truth):
    """Scores of old rows by the folds without them, and of new rows, in deviations."""
    old = np.empty(len(y))
    splits = GroupKFold(len(model.estimators_)).split(X, y, groups)
    for (_, rows), one in zip(splits, model.estimators_, strict=True):
        old[rows] = _in_deviations(one, X[rows], y[rows])
    return old, _in_deviations(model.estimator_, new, truth)


def _in_deviations(model, X, y):
    mean, deviation = model.predict(X, return_std=True)
    return np.abs(y - mean) / deviation


def run_scores(scores, runs, part):
    """Of every run the smallest score that this part of its rows does not exceed."""
    own = [np.sort(scores[runs == run]) for run in np.unique(runs)]
    return np.array([one[int(np.ceil(part * one.size - 1e-9)) - 1] for one in own])


def expected_short(old, new, confidence):
    """How many new runs are to be expected with less than a part of their rows covered.

    ``old`` and ``new`` are scores of runs, each a pair: by the part of rows that the interval is
    asked for, and by the part that counts here.
    """
    asked, counted = (np.concatenate(pair) for pair in zip(old, new, strict=True))
    n_old, n_all = len(old[0]), asked.size
    needed = int(np.ceil((n_old + 1) * confidence - 1e-9))
    # Of a run itself the asked-for score may be below the one that counts.
    below = np.sum(asked < counted[:, None], axis=1) - (asked < counted)
    are_old = hypergeom.sf(needed - 1, n_all - 1, below, n_old)
    return float(np.sum(are_old) * (n_all - n_old) / n_all)
