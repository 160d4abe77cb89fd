r"""What can be said of terms without data: which are the same, and where neighbours cross.

The crossing of neighbours a and b is the greatest value of min(mu_a, mu_b) between their locations:
the truth up to which one may be called the other. Every membership rises to its top and falls from
it, and so does the smaller of two: its greatest value is found by looking at points along the
interval, and again between the neighbours of the best, to the last digit. For two Gaussians of
deviations s and t whose centers lie D apart it is exp(-(D / (s + t))^2 / 2); for two S-shaped terms
or two Z-shaped ones it is one, for both are true beyond the shoulder of the second.
"""

from itertools import pairwise

import numpy as np

__all__ = ["crossings", "distinct_terms", "greatest_truth_in_box", "own_terms"]

# Terms are the same where every parameter is, to this part of the term's width. Rules that share a
# term by training have it to the last bit; rules that came through a file may not.
_SAME = 1e-9
# An interval is looked at in so many points, and shrinks to 1/16: from any length to its last digit
# in so many looks.
_POINTS, _LOOKS = 33, 14


def distinct_terms(antecedent):
    """By input, the positions of its terms from the lowest to the highest location.

    Terms that are the very same are one term: the first of them stands for all.

    Parameters
    ----------
    antecedent : Antecedent

    Returns
    -------
    terms : dict from int to list of int
        Inputs that have terms, in order.
    """
    described = _described(antecedent)
    by_input: dict[int, list[int]] = {}
    for t in sorted(range(len(described)), key=lambda t: described[t]):
        j, place, family, theta, width = described[t]
        own = by_input.setdefault(j, [])
        if own:
            _, its_place, its_family, its_theta, _ = described[own[-1]]
            is_near = abs(place - its_place) <= _SAME * width
            if is_near and family == its_family and np.allclose(theta, its_theta, 0.0, _SAME):
                own[-1] = min(own[-1], t)
                continue
        own.append(t)
    return by_input


def own_terms(antecedent):
    """The terms of :func:`distinct_terms`, one input after the other.

    Parameters
    ----------
    antecedent : Antecedent

    Returns
    -------
    terms : ndarray of int of shape (n_distinct_terms,)
    """
    return np.array([t for own in distinct_terms(antecedent).values() for t in own], dtype=int)


def crossings(antecedent):
    """The height at which each term crosses the next one of its input.

    Parameters
    ----------
    antecedent : Antecedent

    Returns
    -------
    heights : ndarray of shape (n_terms,)
        From 0 to 1; NaN for the last term of an input, and for terms that another stands for (see
        :func:`distinct_terms`).
    """
    heights = np.full(antecedent.n_terms, np.nan)
    pairs = [pair for own in distinct_terms(antecedent).values() for pair in pairwise(own)]
    if not pairs:
        return heights
    lower, upper = np.array(pairs).T
    places = antecedent.term_places

    def smaller_of_both(x):
        return np.minimum(_log_truth(antecedent, lower, x), _log_truth(antecedent, upper, x))

    heights[lower] = np.exp(_greatest(smaller_of_both, places[lower], places[upper]))
    return heights


def greatest_truth_in_box(model):
    """The most that each term can be true in the range of training; on the rows it is no truer.

    Parameters
    ----------
    model : TSKModel

    Returns
    -------
    truth : ndarray of shape (n_terms,)
    """
    antecedent = model.antecedent
    if not antecedent.n_terms:
        return np.empty(0)
    inputs = antecedent.term_inputs
    every = np.arange(antecedent.n_terms)

    def log_truth(x):
        return _log_truth(antecedent, every, x)

    return np.exp(_greatest(log_truth, model.minimum[inputs], model.maximum[inputs]))


def _described(antecedent):
    """Input, location, family, the other parameters and the width of every term."""
    described = []
    for group in antecedent.groups:
        kinds = [parameter.kind for parameter in group.family.parameters]
        widths = np.exp(group.theta[kinds.index("log_width")])
        described += [
            (int(j), float(theta[0]), group.family.name, tuple(map(float, theta[1:])), float(width))
            for j, theta, width in zip(group.inputs, group.theta.T, widths, strict=True)
        ]
    return described


def _log_truth(antecedent, terms, x):
    """Log mu of some terms, each at values of its own: x and result (terms.size, n_points)."""
    values = np.empty(x.shape)
    start = 0
    for group in antecedent.groups:
        own = (terms >= start) & (terms < start + group.n_terms)
        if own.any():
            values[own] = group.family.log_value(x[own], group.theta[:, terms[own] - start])
        start += group.n_terms
    return values


def _greatest(function, low, high):
    """The greatest values between low and high (n,) of functions that rise and then fall."""
    steps = np.linspace(0.0, 1.0, _POINTS)
    every = np.arange(low.size)
    best = np.full(low.size, -np.inf)
    for _ in range(_LOOKS):
        x = low[:, None] + (high - low)[:, None] * steps
        values = function(x)
        top = values.argmax(axis=1)
        best = np.maximum(best, values[every, top])
        low, high = x[every, np.maximum(top - 1, 0)], x[every, np.minimum(top + 1, _POINTS - 1)]
    return best
