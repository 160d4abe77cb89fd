r"""How well the training data support every rule: the numbers that ``coverage`` is made of.

A rule is known only as far as data determine it, and only near them. Kept are the share of its
coefficients that the rows can determine; and, of the rows on which it fires, their mean and
covariance, and how far from that mean the farthest lies.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class RuleSupport:
    r"""Where the training data of every rule lie, and whether there are enough of them.

    A rule that is the strongest on no training row has share zero, and zeros elsewhere. ``share``
    is min(1, N / P), with N the number of distinct training inputs on which the rule is the
    strongest and P the number of its coefficients.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> t = np.linspace(-1.0, 1.0, 50)
    >>> model = ANFISRegressor(n_mfs=1).fit(np.column_stack([t, t]), t).model_
    >>> model.support.share
    array([1.])
    >>> model.coverage(np.array([[0.5, 0.5], [0.5, -0.5]])).round(6)
    array([1., 0.])
    """

    share: np.ndarray  # (n_rules,)
    center: np.ndarray  # m, mean of the inputs by the rule's strength, (n_rules, n_inputs)
    factor: np.ndarray  # lower triangular; Mahalanobis' distance d of x is |factor (x - m)|
    radius: np.ndarray  # the largest d of a training row on which the rule fires, (n_rules,)
    # For each standardised input alone: second moments of what the rules say of it, or None
    # (``inspection.anova``); its values at evenly spaced quantiles; its values next to the places
    # of terms. Empty if not known.
    marginals: Any = ()

    def change_units(self, offset, scale):
        """Return the same support for inputs given as offset + scale * z, per input."""
        return replace(self, center=offset + scale * self.center, factor=self.factor / scale)

    def reordered(self, order):
        """Return the same support with the inputs in another order."""
        if (np.diff(order) > 0).all():
            return self
        # QR makes the factor triangular again; Q only rotates, so that distances stay the same.
        turned = np.asarray(np.linalg.qr(self.factor[:, :, order[::-1]], mode="r"))
        return replace(
            self,
            center=self.center[:, order],
            factor=turned[:, ::-1, ::-1].copy(),
            marginals=tuple(self.marginals[j] for j in order) if self.marginals else (),
        )

    def without_moments(self):
        """Return the same support for rules with other terms, whose moments are not known."""
        marginals = tuple((None, *values) for _, *values in self.marginals)
        return replace(self, marginals=marginals)

    def by_rule(self, Z):
        """The share of each rule, falling with the distance from its data, (n_rules, n_rows).

        It is share exp(-max(0, d - radius)^2 / 2) at points Z (n_inputs, n_rows) in the box.
        """
        found = np.zeros((self.share.size, Z.shape[1]))
        known = self.share > 0.0
        away = self.factor[known] @ (Z - self.center[known, :, None])
        distance = np.sqrt(np.einsum("rjn,rjn->rn", away, away))
        beyond = np.maximum(distance - self.radius[known, None], 0.0)
        found[known] = self.share[known, None] * np.exp(-0.5 * beyond**2)
        return found
