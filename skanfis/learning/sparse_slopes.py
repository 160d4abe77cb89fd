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
    line, unit = posterior.line, posterior.noise_variance / posterior.n_rows
    identity, n_outputs = np.eye(len(coefficients)), coefficients.shape[1]
    before, after = (
        unit * half.T @ half
        for half in (factor.half_solve(identity) for factor in (posterior.prior, posterior.factor))
    )
    state, every, common, absent = [coefficients, after, before], np.arange(line.n_rules), [], []
    whole = [_loss(state, line.own_slopes(j, every)) for j in line.slopes]
    for k in np.argsort(whole, kind="stable"):
        j, rules = line.slopes[k], every
        while rules.size > 1:
            slopes = line.own_slopes(j, rules)
            contrasts = linalg.helmert(rules.size) @ slopes
            if _loss(state, contrasts) < worth * contrasts.shape[0] * n_outputs:
                break
            rules = np.delete(rules, _farthest(state, slopes))
        if rules.size > 1:
            state = _given(state, contrasts)
        else:
            # Nothing is shared. The rule that can do best without its slope is the one to test.
            alone = [_loss(state, line.own_slopes(j, rule)) for rule in every[:, None]]
            rules = every[[int(np.argmin(alone))]]
        slope = line.own_slopes(j, rules[:1])
        if _loss(state, slope) < worth * n_outputs:
            absent.append((j, tuple(rules.tolist())))
            state = _given(state, slope)
        elif rules.size > 1:
            common.append((j, tuple(rules.tolist())))
    return tuple(sorted(common)), tuple(sorted(absent))


def _loss(state, contrasts):
    """What the evidence loses, in -2 log p, if these contrasts are zero."""
    mean, after, before = state
    root, of_prior = (linalg.cholesky(contrasts @ one @ contrasts.T) for one in (after, before))
    misfit = linalg.solve_triangular(root, contrasts @ mean, trans="T")
    change = np.log(np.diag(root) / np.diag(of_prior)).sum()
    return float(np.sum(misfit**2) + 2.0 * mean.shape[1] * change)


def _given(state, contrasts):
    """Mean and covariances, given that these contrasts are zero."""
    mean, *covariances = state
    gains = [
        linalg.solve(contrasts @ one @ contrasts.T, contrasts @ one, assume_a="pos").T
        for one in covariances
    ]
    return [
        mean - gains[0] @ (contrasts @ mean),
        *(one - gain @ (contrasts @ one) for one, gain in zip(covariances, gains, strict=True)),
    ]


def _farthest(state, slopes):
    """The rule whose slope is farthest from the mean of the others, in deviations."""
    mean, after, _ = state
    values = slopes @ mean
    variances = np.einsum("ri,ij,rj->r", slopes, after, slopes)
    weights = 1.0 / np.maximum(variances, np.finfo(float).tiny)
    others = weights.sum() - weights
    centers = (weights @ values - weights[:, None] * values) / others[:, None]
    squares = np.sum((values - centers) ** 2, axis=1)
    return int(np.argmax(squares / (1.0 / weights + 1.0 / others)))
