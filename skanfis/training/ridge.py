r"""The ridge in closed form: generalised cross-validation of the linear part.

At fixed premises the consequents are a ridge regression, whose leave-one-out error is nearly

    GCV(alpha) = MSE(alpha) / (1 - k(alpha) / n)^2 ,    k = tr G (G + alpha)^-1

(Golub, Heath and Wahba 1979). With beta the solution at one alpha_0, whose normal equations say
that Phi' r / W = alpha_0 beta, and g the eigenvalues of G, the solution at any other alpha differs
by delta = (alpha_0 - alpha) (G + alpha)^-1 beta, and

    MSE(alpha) = MSE(alpha_0) - 2 alpha_0 beta' delta + delta' G delta :

one eigenvalue decomposition gives the whole curve. The premises' parameters are not counted.
"""

from dataclasses import replace

import numpy as np

__all__ = ["best_alpha", "learn_with_best_alpha"]

# A decade is as fine as matters; below, rounding decides, above, every rule is a constant.
_ALPHAS = 10.0 ** np.arange(-12, 2)
# The premises move a little with alpha: choose, train, choose again.
_MOST_ROUNDS = 3


def best_alpha(problem, evaluation, n_rows, smallest=0.0):
    """The alpha of the smallest GCV at an evaluation's premises, and not below ``smallest``."""
    solved = problem.evaluate(evaluation.antecedent.parameters, evaluation.coefficients)
    at, gram = solved.factor.alpha, solved.factor.gram()
    values, vectors = np.linalg.eigh(gram)
    values = np.maximum(values, 0.0)
    beta = vectors.T @ problem.local.to_local(solved.coefficients)
    scores = []
    alphas = _ALPHAS[smallest <= _ALPHAS]
    for alpha in alphas:
        delta = (at - alpha) * beta / (values + alpha)[:, None]
        error = solved.mean_squared_error - 2.0 * at * np.sum(beta * delta)
        error += np.sum(values[:, None] * delta**2)
        k = np.sum(values / (values + alpha))
        scores.append(max(error, 0.0) / max(1.0 - k / n_rows, 1e-12) ** 2)
    # Of equal ones, as where the data are without noise, the largest.
    good_enough = np.array(scores) <= min(scores) * (1.0 + 1e-3)
    return float(alphas[np.flatnonzero(good_enough)[-1]])


def learn_with_best_alpha(learn, structure, displacement, n_rows):
    """Train with the alpha of the smallest GCV; ``learn(structure, displacement)``.

    The structure's own alpha is the smallest one that keeps rounding errors down.
    """
    learned = learn(structure, displacement)
    for _ in range(_MOST_ROUNDS):
        alpha = best_alpha(learned.problem, learned.result.evaluation, n_rows, structure.alpha)
        if alpha == learned.structure.alpha:
            break
        learned = learn(replace(learned.structure, alpha=alpha), learned.displacement)
    return learned
