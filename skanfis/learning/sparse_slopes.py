r"""Slopes that several rules share, and slopes of zero, wherever the evidence asks for no more.

The consequents of an output have the prior N(0, V0) and the posterior N(m, V). Some rules share one
slope by an input if C u = 0, where C are contrasts of their slopes; with C a single slope, that
slope is zero. This hypothesis takes from the evidence (docs/mathematics.rst)

    (C m)' (C V C')^-1 C m + log |C V C'| - log |C V0 C'| ,

so that one factorisation serves every input and every set of rules. Inputs whose slopes are worth
least come first; the posterior is conditioned on what is found before the next one is tested.
"""

import numpy as np
from scipy import linalg

from .evidence import WORTH, Laplace

# Worth, in -2 log p, from which on a slope is kept: anything above zero, or that of other numbers.
SLOPE_WORTHS = (0.0, WORTH)


def sparse_slopes(posterior: Laplace, coefficients, worth):
    """Inputs with the rules that share a slope, and with those that have none.

    They become ``Penalty.common`` and ``Penalty.absent``. ``coefficients`` are the local ones,
    (n_columns, n_outputs). A slope is kept if it is worth at least ``worth``.
    """
    line, unit = posterior.line, posterior.noise_variance / posterior.effective_weight
    identity, n_outputs = np.eye(line.n_rules), coefficients.shape[1]
    before, after = (unit * one.root.T @ one.root for one in (posterior.prior, posterior.factor))
    state, every, common, absent = [coefficients, after, before], np.arange(line.n_rules), [], []
    whole = [_loss(_of(state, line.own_slopes(j, every))) for j in line.slopes]
    for k in np.argsort(whole, kind="stable"):
        j, rules = line.slopes[k], every
        slopes = line.own_slopes(j, every)
        by_input = _of(state, slopes)
        while rules.size > 1:
            own, contrasts = _of(by_input, identity[rules]), linalg.helmert(rules.size)
            if _loss(_of(own, contrasts)) < worth * contrasts.shape[0] * n_outputs:
                break
            rules = np.delete(rules, _farthest(own))
        if rules.size > 1:
            state = _given(state, contrasts @ slopes[rules])
        else:
            # Nothing is shared. The rule that can do best without its slope is the one to test.
            alone = [_loss(_of(by_input, rule)) for rule in identity[:, None]]
            rules = every[[int(np.argmin(alone))]]
        slope = slopes[rules[:1]]
        if _loss(_of(state, slope)) < worth * n_outputs:
            absent.append((j, tuple(rules.tolist())))
            state = _given(state, slope)
        elif rules.size > 1:
            common.append((j, tuple(rules.tolist())))
    return tuple(sorted(common)), tuple(sorted(absent))


def _of(state, contrasts):
    """Mean and covariances of these contrasts alone."""
    mean, *covariances = state
    return [contrasts @ mean, *(contrasts @ one @ contrasts.T for one in covariances)]


def _loss(state):
    """What the evidence loses, in -2 log p, if all of the state's slopes are zero."""
    mean, *covariances = state
    root, of_prior = np.linalg.cholesky(covariances)
    misfit = np.linalg.solve(root, mean)
    change = np.log(root.diagonal() / of_prior.diagonal()).sum()
    return float(np.sum(misfit**2) + 2.0 * mean.shape[1] * change)


def _given(state, contrasts):
    """Mean and covariances, given that these contrasts are zero."""
    mean, *covariances = state
    across = [contrasts @ one for one in covariances]
    gains = [np.linalg.solve(one @ contrasts.T, one).T for one in across]
    return [
        mean - gains[0] @ (contrasts @ mean),
        *(one - gain @ rows for one, gain, rows in zip(covariances, gains, across, strict=True)),
    ]


def _farthest(state):
    """The rule whose slope is farthest from the mean of the others, in deviations."""
    values, after, _ = state
    weights = 1.0 / np.maximum(after.diagonal(), np.finfo(float).tiny)
    others = weights.sum() - weights
    centers = (weights @ values - weights[:, None] * values) / others[:, None]
    squares = np.sum((values - centers) ** 2, axis=1)
    return int(np.argmax(squares / (1.0 / weights + 1.0 / others)))
