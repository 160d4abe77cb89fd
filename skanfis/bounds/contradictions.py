"""Whether data contradict a constraint: the free fit breaks it by more than its uncertainty.

For a sign, the rows are split into thirds by the input. On one third, the mean change of the free
fit from the smallest to the largest value must be against the sign by more than four of its
standard deviations. For a limit, the free fit must be beyond it by as many at some row.
"""

from itertools import pairwise

import numpy as np

from .enclosure import reach_of

# Ratio of squared errors, with the constraint over without, below which there is no warning.
_WORTH_SAYING = 1.01**2
# Standard deviations that count as certain; and the least part of all slopes by an input with the
# wrong sign: less may come from how rules bend between data.
_CERTAIN, _WRONG_PART = 4.0, 0.25
_MOST_ROWS, _ROWS_NAMED, _PARTS = 2048, 5, 3


def contradicted(free, held, inequalities, fixed, rows, raised):
    """A sentence for every output whose constraints the data contradict.

    ``free`` and ``held`` are models in the user's units, ``fixed`` the fixed points and the outputs
    there, ``rows`` X, y and their numbers, ``raised`` the ratio of squared training errors.
    """
    if free.posterior is None or raised <= _WORTH_SAYING:
        return
    X, y, numbers = rows
    some = X[:: max(len(X) // _MOST_ROWS, 1)]
    points, values = fixed
    gap = np.zeros(values.shape)
    if len(points):
        # Predictions no longer change beyond the reach: a point further out is moved there.
        reach = reach_of(free)
        answered = np.clip(points, free.minimum - reach, free.maximum + reach)
        gap = np.abs(free.predict(points) - values) - _CERTAIN * _deviation(free, answered).T
    for k, output in enumerate(free.output_names):
        own = [one for one in inequalities if one.output == k]
        guilty = [one.name for one in own if _speaks_against(one, free, some)]
        guilty += [f"FixedPoint at {points[i]}" for i in np.flatnonzero(gap[:, k] > 0.0)]
        if not guilty:
            continue
        before, after = ((y[:, k] - model.predict(X)[:, k]) ** 2 for model in (free, held))
        worst = np.sort(numbers[np.argsort(before - after)[:_ROWS_NAMED]])
        yield (
            f"The data contradict {' and '.join(guilty)}: keeping this raises the training error "
            f"of {output!r} from {np.sqrt(before.mean()):.3g} to {np.sqrt(after.mean()):.3g}, far "
            f"more than noise explains. Rows {', '.join(map(str, worst))} contradict it most. "
            "Check these rows, or drop the constraint."
        )


def _speaks_against(one, free, X):
    """Whether the free fit violates an inequality for certain."""
    excess = one.excess(free, X)
    if one.input is None:
        return bool((excess > _CERTAIN * _deviation(free, X)[one.output]).any())
    if excess[excess > 0.0].sum() <= _WRONG_PART * np.abs(excess).sum():
        return False
    column = X[:, one.input]
    # Edges are values of rows, so that no part is empty.
    edges = np.quantile(column, np.linspace(0.0, 1.0, _PARTS + 1), method="nearest")
    for low, high in pairwise(edges):
        before = X[(low <= column) & (column <= high)]
        after = before.copy()
        before[:, one.input], after[:, one.input] = low, high
        falls = -one.sign * (free.predict(after) - free.predict(before)).mean(axis=0)[one.output]
        deviation = free.posterior.of_mean(free, after.T.copy(), before.T.copy())[one.output]
        if falls > _CERTAIN * deviation:
            return True
    return False


def _deviation(free, X):
    """Standard deviation of the free fit itself, without the noise, (n_outputs, n_rows)."""
    of_rows, of_noise = free.posterior.inside(free, X.T), free.posterior.noise[:, None]
    return np.sqrt(np.maximum(of_rows**2 - of_noise**2, 0.0))
