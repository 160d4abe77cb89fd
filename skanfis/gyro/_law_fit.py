"""The fit of the arcsine law to a calibration log; docs/gyro_physics.rst has the formulas.

The squared error of the *output* is minimised: there the noise is white and of one size, and the
law is defined for every rate.
"""

from types import SimpleNamespace

import numpy as np
from numpy.polynomial.polynomial import polyval, polyvander
from scipy.optimize import least_squares, root

__all__ = ["MAX_EVALUATIONS", "check_log", "fit_law", "standardise"]

# Phase at the largest rate [rad]. Below 0.01 the sine is a straight line to 20 ppm; from pi/2 on
# two rates give one output.
_SMALLEST_PHASE, _LARGEST_PHASE = 0.01, np.pi / 2.0
# A tenth of a radian apart: the fit goes the rest of the way.
_STARTING_PHASES = np.linspace(0.1, 1.5, 15)
# A dozen coefficients at most: the start needs few rows, and the fit to all begins with some.
_ROWS_FOR_START, _ROWS_FOR_TRIAL = 2_000, 10_000
MAX_EVALUATIONS = 200
_NEARBY = 1e-5  # how far a finished fit may still move, in standardised units


def standardise(used, rate, weights):
    """The log with outputs of RMS 1, rates up to 1, and temperature about 0 with spread 1."""
    nothing, has_lag = np.zeros(len(rate)), used.shape[1] > 2
    temperature = used[:, 1] if used.shape[1] > 1 else nothing
    thermal_rate = used[:, 2] if has_lag else nothing
    mean = np.average(temperature, weights=weights)
    std = np.sqrt(np.average((temperature - mean) ** 2, weights=weights))
    if np.ptp(temperature) == 0:
        mean, std = temperature[0], 1.0
    output_unit = np.sqrt(np.average(used[:, 0] ** 2, weights=weights)) or 1.0
    rate_unit = np.abs(rate).max() or 1.0
    thermal_unit = np.abs(thermal_rate).max() or 1.0
    columns = (
        used[:, 0] / output_unit,
        rate / rate_unit,
        (temperature - mean) / std,
        thermal_rate / thermal_unit,
        np.sqrt(weights),
    )
    return SimpleNamespace(
        columns=np.stack(columns),
        output_unit=output_unit,
        rate_unit=rate_unit,
        thermal_unit=thermal_unit,
        mean=mean,
        std=std,
        has_lag=has_lag,
    )


def check_log(log):
    n_coefficients = sum(log.degrees) + 3 + log.has_lag + log.has_offset
    output, rate = log.columns[:2]
    if rate.size < n_coefficients:
        raise ValueError(
            f"The law has {n_coefficients} coefficients; n_samples = {rate.size} rows cannot tell "
            "them. Give more rows, or lower the degrees."
        )
    for name, values in (("the output", output), ("the rate (y)", rate)):
        if np.ptp(values) == 0:
            raise ValueError(f"No scale factor can be found: {name} never changes.")


def _law_of(parameters, log):
    """The law from the vector that the solver works on: s = A k_0, K, b, then lag and offset.

    Where the sine is nearly straight, A and K cannot be told apart, but s can.
    """
    ends = np.cumsum([degree + 1 for degree in log.degrees])
    s, k, b, rest = np.split(parameters, ends)
    lag, offset = rest[0] if log.has_lag else 0.0, rest[-1] if log.has_offset else 0.0
    return SimpleNamespace(a=s / k[0], k=k, b=b, lag=lag, offset=offset)


def _misfit(parameters, columns, log):
    """Modelled minus measured output, by the root of the weight."""
    output, rate, tau, rho, root_weights = columns
    law = _law_of(parameters, log)
    tau = tau + law.lag * rho
    phase = polyval(tau, law.k) * (rate + polyval(tau, law.b))
    return root_weights * (polyval(tau, law.a) * np.sin(phase) + law.offset - output)


def fit_law(log):
    """The law in standardised units, the number of evaluations, and whether the fit settled."""
    n_rows = log.columns.shape[1]
    start = _start(log.columns[:, :: max(1, n_rows // _ROWS_FOR_START)], log)
    lower, upper = np.full((2, start.size), [[-np.inf], [np.inf]])
    first_of_sagnac = log.degrees[0] + 1
    lower[first_of_sagnac], upper[first_of_sagnac] = _SMALLEST_PHASE, _LARGEST_PHASE
    # Of a long log some rows show the way; few steps on all are left then.
    for step in sorted({max(1, n_rows // _ROWS_FOR_TRIAL), 1}, reverse=True):
        fitted = least_squares(
            _misfit,
            start,
            jac=_jacobian,
            bounds=(lower, upper),
            x_scale="jac",
            # Tight, and not by the cost: where the law fits badly, that is flat before the end.
            ftol=None,
            xtol=1e-12,
            gtol=1e-13,
            max_nfev=MAX_EVALUATIONS,
            args=(log.columns[:, ::step], log),
        )
        start = fitted.x
    # On a large log the noise is far above the eighth digit, and every pass has its price.
    if n_rows <= _ROWS_FOR_TRIAL:
        start = _polished(start, log)
    return _law_of(start, log), fitted.nfev, fitted.status != 0


def _polished(parameters, log):
    """The nearby zero of the gradient: costs tell a minimum to eight digits only."""

    def gradient(trial):
        return _jacobian(trial, log.columns, log).T @ _misfit(trial, log.columns, log)

    found = root(gradient, parameters, method="hybr", options={"xtol": 1e-14, "maxfev": 60}).x
    return found if np.abs(found - parameters).max() < _NEARBY else parameters


def _jacobian(parameters, columns, log):
    """By complex steps: no difference is taken, and the derivative is exact to rounding."""
    steps = parameters + 1e-30j * np.eye(parameters.size)
    return np.stack([_misfit(step, columns, log).imag for step in steps], axis=1) * 1e30


def _start(columns, log):
    """The best of several phases, the rest of the law by linear least squares; no lag.

    For given K the law is linear in A cos(K b) and A sin(K b).
    """
    output, rate, tau, _, weights = columns
    powers, target = polyvander(tau, log.degrees[0]), weights * output
    trials = []
    for phase in _STARTING_PHASES:
        basis = np.column_stack([powers * np.sin(phase * rate)[:, None], np.cos(phase * rate)])
        design = weights[:, None] * basis
        found = np.linalg.lstsq(design, target, rcond=None)[0]
        trials.append((np.sum((design @ found - target) ** 2), phase, found))
    _, phase, found = min(trials, key=lambda trial: trial[0])
    # tan(K b) = (A sin K b) / (A cos K b); a bias beyond the largest rate is no start.
    bias = np.arctan2(found[-1] * np.sign(found[0]), np.abs(found[0])) / phase
    k, b = np.zeros(log.degrees[1] + 1), np.zeros(log.degrees[2] + 1)
    k[0], b[0] = phase, np.clip(bias, -1.0, 1.0)
    return np.concatenate([phase * found[:-1], k, b, np.zeros(log.has_lag + log.has_offset)])
