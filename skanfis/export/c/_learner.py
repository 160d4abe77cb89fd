r"""Recursive least squares for the consequents, in C: fixed memory, no heap, safe as float.

With phi the strengths times [1, (x - reference) / spread], and P the covariance of the consequents
in variances of the noise, a row with target t is learnt by

    P <- P / lambda ,    K = P phi / (1 + phi' P phi) ,    P <- P - K phi' P ,
    beta <- beta + K (t - y) .

P is never formed: of P = U D U', with U unit upper triangular and D diagonal, Bierman's algorithm
(1977, section V.3) updates the factors. Entries of D are multiplied by positive numbers alone, so
that P stays positive whatever rounding does. Columns that phi does not touch cost the product that
says so, and do not change.

Forgetting lets P grow along what no row excites. Of one coefficient after another, one in every
call, the variance is therefore held at a bound: where it is above, an observation of the
coefficient itself is made up, without innovation, and as uncertain as brings it back to the bound.
Between two turns of n calls it grows by no more than lambda^-n.

What is learnt is a change that is added to the constant consequents: it has digits of its own,
where the consequents are large and change little; to reset is to set it to zero.
"""

from numbers import Real

import numpy as np
from scipy import linalg

__all__ = ["Learner", "learner_of"]

# Of the variance that forgetting leaves where a rule is fed as in training; a rule that is fed
# nothing stops there.
_BOUND = 10.0


class Learner:
    """The covariance that learning starts from, and how it goes on.

    Parameters
    ----------
    information : ndarray of shape (n, n)
        Inverse of P, of the coefficients that the exported consequents have.
    weight : float
        Rows by weight that it is of.
    forgetting : float
        lambda.
    """

    def __init__(self, information, weight, forgetting):
        self.information, self.forgetting = information, forgetting
        # L D L' of the inverse is U' D U of the matrix: U = L^-T, with one over the same pivots.
        lower = linalg.cholesky(information, lower=True)
        pivots = np.diagonal(lower)
        inverse = linalg.solve_triangular(lower / pivots, np.eye(len(pivots)), lower=True)
        self.upper = inverse.T
        self.diagonal = 1.0 / pivots**2
        variances = self.upper**2 @ self.diagonal
        self.bound = _BOUND * max(1.0, (1.0 - forgetting) * weight) * variances

    @property
    def n(self):
        """Coefficients of one output."""
        return self.diagonal.size

    @property
    def packed(self):
        """U above its diagonal, column by column; one zero where there is nothing."""
        columns = [self.upper[:j, j] for j in range(1, self.n)]
        return np.concatenate(columns) if columns else np.zeros(1)

    @property
    def forgets(self):
        """Whether older rows count less."""
        return self.forgetting < 1.0

    def follow(self, design, errors):
        """The change (n, n_outputs) after rows (n_rows, n), of targets that are off by errors.

        By matrices in full, against which the factors are tested.
        """
        covariance = np.linalg.inv(self.information)
        change = np.zeros((self.n, errors.shape[1]))
        for turn, (phi, error) in enumerate(zip(design, errors, strict=True)):
            if self.forgets:
                covariance /= self.forgetting
                i = turn % self.n
                variance = covariance[i, i]
                if variance > self.bound[i]:
                    column = covariance[:, i].copy()
                    less = (variance - self.bound[i]) / variance**2
                    covariance -= less * np.outer(column, column)
            along = covariance @ phi
            gain = along / (1.0 + phi @ along)
            change += np.outer(gain, error - phi @ change)
            covariance -= np.outer(gain, along)
        return change


def learner_of(estimator, numbers, forgetting):
    """What an estimator knows of its consequents, or ValueError that says why it does not."""
    if isinstance(forgetting, bool) or not (
        isinstance(forgetting, Real) and 0.0 < float(forgetting) <= 1.0
    ):
        raise ValueError(
            f"forgetting={forgetting!r} must be a number above 0 and at most 1, or None."
        )
    information = getattr(estimator, "information_", None)
    if information is None:
        raise ValueError(
            f"forgetting={forgetting!r} asks for consequents that go on learning, which takes an "
            f"ANFISRegressor trained by partial_fit; {type(estimator).__name__} does not know how "
            "sure its consequents are. Train by partial_fit and give the estimator itself, or "
            "leave forgetting at None."
        )
    n_rules = numbers.n_rules
    n_basis = 1 + information.inputs.size
    # Inputs without any slope are not exported: their slopes are held at zero.
    kept = np.isin(information.inputs, numbers.slope_inputs)
    columns = np.concatenate([[0], 1 + np.flatnonzero(kept)])
    every = (n_basis * np.arange(n_rules)[:, None] + columns).ravel()
    matrix = information.matrix[np.ix_(every, every)]
    return Learner(matrix, information.weight, float(forgetting))
