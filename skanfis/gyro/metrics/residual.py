"""What is left of the error, in deg/s."""

import numpy as np
from numpy.typing import ArrayLike

from .._columns import check_column
from ._lines import rms

__all__ = ["reduction_factor", "residual_peak", "residual_peak_to_peak", "residual_rms"]


def residual_rms(error: ArrayLike) -> float:
    """Root mean square of what is left of the error.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Indicated less true rate [deg/s].

    Returns
    -------
    rms : float
        [deg/s]

    Raises
    ------
    ValueError
        If the column is empty or not finite.

    Examples
    --------
    >>> from skanfis.gyro import residual_rms
    >>> residual_rms([0.3, -0.4])
    0.35355
    """
    return rms(check_column(error, "error"))


def residual_peak(error: ArrayLike) -> float:
    """Largest size of what is left of the error.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Indicated less true rate [deg/s].

    Returns
    -------
    peak : float
        [deg/s]

    Raises
    ------
    ValueError
        If the column is empty or not finite.

    Examples
    --------
    >>> from skanfis.gyro import residual_peak
    >>> residual_peak([0.3, -0.4])
    0.4
    """
    return float(np.abs(check_column(error, "error")).max())


def residual_peak_to_peak(error: ArrayLike) -> float:
    """Distance from the smallest to the largest of what is left of the error.

    Parameters
    ----------
    error : array-like of shape (n_rows,)
        Indicated less true rate [deg/s].

    Returns
    -------
    peak_to_peak : float
        [deg/s]

    Raises
    ------
    ValueError
        If the column is empty or not finite.

    Examples
    --------
    >>> from skanfis.gyro import residual_peak_to_peak
    >>> residual_peak_to_peak([0.3, -0.4])
    0.7
    """
    return float(np.ptp(check_column(error, "error")))


def reduction_factor(before: ArrayLike, after: ArrayLike) -> float:
    """Reduction factor: RMS of the error before compensation over that after it.

    Parameters
    ----------
    before, after : array-like of shape (n_rows,)
        Indicated less true rate, without and with compensation [deg/s].

    Returns
    -------
    factor : float
        Larger than 1 where the compensation helps.

    Raises
    ------
    ValueError
        If a column is empty or not finite, or ``after`` is zero everywhere.

    Examples
    --------
    >>> from skanfis.gyro import reduction_factor
    >>> reduction_factor([3.0, -4.0], [0.4, 0.3])
    10.0
    """
    left = residual_rms(after)
    if left == 0:
        raise ValueError("after is zero everywhere: a factor without bound.")
    return residual_rms(before) / left
