"""Arrays of other libraries, where scikit-learn's dispatch asks to compute in them."""

import numpy as np
from sklearn import get_config

from ._sklearn import get_namespace, to_numpy

__all__ = ["in_bounds", "namespace_of", "to_numpy"]


def namespace_of(X):
    """The namespace to compute in; None for NumPy's arrays, for tables, and without dispatch."""
    if type(X) is np.ndarray or not get_config()["array_api_dispatch"]:
        return None
    if isinstance(X, np.ndarray) or not hasattr(X, "__dlpack__"):
        return None
    xp, is_of_standard = get_namespace(X)
    return xp if is_of_standard else None


def in_bounds(xp, X, minimum, maximum):
    """Whether each row lies in a box, as an array of the library.

    In single precision an edge is the number next to it inside: no row changes sides.
    """
    if X.dtype == xp.float32:
        low, high = minimum.astype(np.float32), maximum.astype(np.float32)
        minimum = np.where(low < minimum, np.nextafter(low, np.float32(np.inf)), low)
        maximum = np.where(high > maximum, np.nextafter(high, np.float32(-np.inf)), high)
    low, high = (
        xp.asarray(edge.tolist(), dtype=X.dtype, device=X.device) for edge in (minimum, maximum)
    )
    return xp.all((low <= X) & (high >= X), axis=1)
