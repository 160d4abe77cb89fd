"""How well rows have determined the consequents."""

from dataclasses import dataclass

import numpy as np

__all__ = ["Information"]


@dataclass(frozen=True, eq=False)
class Information:
    """How well rows have determined the consequents.

    Parameters
    ----------
    matrix : ndarray of shape (n_rules * (1 + n_inputs), n_rules * (1 + n_inputs))
        Phi' S Phi + W P, the inverse of the covariance of one output's consequents in variances of
        the noise: rule by rule, of coefficients on 1 and (x - mean) / deviation.
    inputs : ndarray of int of shape (n_inputs,)
        The inputs that consequents are linear in.
    weight : float
        W, of all rows, as far as it has not faded.

    Examples
    --------
    The standard deviation of a rule's value, in deviations of the noise, is that of a mean:

    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> t = np.linspace(-1.0, 1.0, 100)[:, None]
    >>> model = ANFISRegressor(n_mfs=1, alpha=0.0).partial_fit(t, t.ravel())
    >>> covariance = np.linalg.inv(model.information_.matrix)
    >>> float(covariance[0, 0].round(6))
    0.01
    """

    matrix: np.ndarray
    inputs: np.ndarray
    weight: float
