"""Least squares on one or a few columns, as the scale factor and the sensitivities need it."""

import numpy as np

from .._columns import check_column

__all__ = ["centred", "least_squares", "line", "rate_and_output", "rms"]


def rate_and_output(rate, output) -> tuple[np.ndarray, np.ndarray]:
    rate = check_column(rate, "rate")
    return rate, check_column(output, "output", rate.size)


def line(rate, output):
    """Slope and intercept of the least-squares line."""
    mean = rate.mean()
    squares = np.sum((rate - mean) ** 2)
    if np.ptp(rate) == 0:
        raise ValueError(f"No scale factor: the rate is {mean:g} deg/s in all rows.")
    slope = (rate - mean) @ (output - output.mean()) / squares
    return slope, output.mean() - slope * mean


def least_squares(design, target, without):
    """Coefficients of the columns in ``design``; ValueError where they cannot be told apart."""
    columns = np.column_stack(design)
    size = np.sqrt(np.mean(columns**2, axis=0))
    if (size == 0).any():
        raise ValueError(f"No sensitivity: {without}.")
    solution, _, rank, _ = np.linalg.lstsq(columns / size, target, rcond=1e-10)
    if rank < columns.shape[1]:
        raise ValueError(f"No sensitivity: {without}.")
    return solution / size


def centred(values, name, n_rows) -> np.ndarray:
    values = check_column(values, name, n_rows)
    # Not values - mean where they are all equal: that leaves rounding errors, not zero.
    return values - (values[0] if np.ptp(values) == 0 else values.mean())


def rms(values) -> float:
    return float(np.sqrt(np.mean(values**2)))
