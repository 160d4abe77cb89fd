r"""The fit of the arcsine law to a calibration log; :mod:`skanfis.gyro.physics` has the formulas.

The fit minimises the squared error of the *output*: there the noise is white and of one size, and
the law is defined for every rate. It works on s = A k_0 in place of A, the scale factor at rest:
where the sine is nearly straight, A and K cannot be told apart but s can. With A = s / k_0 its
Jacobian is exact,

    dV/ds_i  = tau^i sin(phi) / k_0
    dV/dk_i  = tau^i A cos(phi) (Omega + b) - [i = 0] A sin(phi) / k_0
    dV/db_i  = tau^i A K cos(phi)
    dV/dlag  = rho {A' sin(phi) + A cos(phi) [K' (Omega + b) + K b']}
    dV/dV0   = 1

For given K the law is linear in A cos(K b) and A sin(K b), which makes a start: of a range of
phases at the largest rate, the one that linear least squares likes best.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval, polyvander
from scipy.optimize import least_squares, root

__all__ = [
    "MAX_EVALUATIONS",
    "Shape",
    "check_log_fits",
    "fit_law",
    "jacobian",
    "misfit",
    "standardise",
]

# Phase at the largest rate [rad]. Below 0.01 the sine is a straight line to 20 ppm; from pi/2 on
# two rates give one output.
_SMALLEST_PHASE, _LARGEST_PHASE = 0.01, np.pi / 2.0
# A tenth of a radian apart: the fit goes the rest of the way.
_STARTING_PHASES = np.linspace(0.1, 1.5, 15)
# A dozen coefficients at most: more rows only make many starts slow. The fit to all rows follows.
_ROWS_FOR_START = 2000
# Of a long log, the law is fitted to so many rows first: what is left takes an evaluation or two.
_ROWS_FOR_TRIAL = 10_000
# A bound on time; a log that the law describes takes a part of it.
MAX_EVALUATIONS = 200
_NEARBY = 1e-5  # how far a finished fit may still move, in standardised units


@dataclass(frozen=True)
class CalibrationLog:
    """A calibration log, standardised: what the fit sees."""

    output: np.ndarray
    rate: np.ndarray
    tau: np.ndarray
    rho: np.ndarray
    root_weights: np.ndarray
    output_unit: float
    rate_unit: float
    lag_unit: float
    mean: float
    std: float

    def thinned(self, n_rows):
        """Every so many rows, evenly, that about ``n_rows`` are left."""
        rows = slice(None, None, max(1, self.rate.size // n_rows))
        columns = ("output", "rate", "tau", "rho", "root_weights")
        return replace(self, **{name: getattr(self, name)[rows] for name in columns})


def standardise(used, rate, weights):
    """The log with outputs of RMS 1, rates up to 1, and temperature about 0 with spread 1."""
    output_unit = np.sqrt(np.average(used[:, 0] ** 2, weights=weights)) or 1.0
    rate_unit = np.abs(rate).max() or 1.0
    nothing = np.zeros(len(rate))
    temperature = used[:, 1] if used.shape[1] > 1 else nothing
    mean = np.average(temperature, weights=weights)
    std = np.sqrt(np.average((temperature - mean) ** 2, weights=weights))
    if np.ptp(temperature) == 0:
        mean, std = temperature[0], 1.0
    thermal_rate = used[:, 2] if used.shape[1] == 3 else nothing
    thermal_unit = np.abs(thermal_rate).max() or 1.0
    return CalibrationLog(
        output=used[:, 0] / output_unit,
        rate=rate / rate_unit,
        tau=(temperature - mean) / std,
        rho=thermal_rate / thermal_unit,
        root_weights=np.sqrt(weights),
        output_unit=output_unit,
        rate_unit=rate_unit,
        lag_unit=std / thermal_unit,
        mean=mean,
        std=std,
    )


def check_log_fits(log, shape):
    if len(log.rate) < shape.n_coefficients:
        raise ValueError(
            f"The law has {shape.n_coefficients} coefficients; n_samples = {len(log.rate)} rows "
            "cannot tell them. Give more rows, or lower the degrees."
        )
    for name, values in (("the output", log.output), ("the rate (y)", log.rate)):
        if np.ptp(values) == 0:
            raise ValueError(f"No scale factor can be found: {name} never changes.")


@dataclass(frozen=True)
class Law:
    """The law's coefficients in standardised units: of A = s / k_0, K and b."""

    a: np.ndarray
    k: np.ndarray
    b: np.ndarray
    lag: float
    offset: float


@dataclass(frozen=True)
class Shape:
    """Degrees of A, K and b in temperature, and whether there is a lag and an offset."""

    degrees: tuple[int, int, int]
    has_lag: bool
    has_offset: bool

    @property
    def amplitude(self):
        return self.degrees[0]

    @property
    def sagnac(self):
        return self.degrees[1]

    @property
    def n_coefficients(self):
        return sum(self.degrees) + 3 + self.has_lag + self.has_offset

    def law(self, parameters):
        """From the vector that the solver works on: s, k, b; lag and offset where there are any."""
        s, k, b, rest = np.split(parameters, np.cumsum([degree + 1 for degree in self.degrees]))
        lag = rest[0] if self.has_lag else 0.0
        return Law(s / k[0], k, b, lag, rest[-1] if self.has_offset else 0.0)


def fit_law(log, shape):
    """The solution of the least-squares problem, as SciPy gives it."""
    if log.rate.size > 2 * _ROWS_FOR_TRIAL:
        # Few steps on all rows are left where a part of them has shown the way.
        start = fit_law(log.thinned(_ROWS_FOR_TRIAL), shape).x
    else:
        start = _start(log.thinned(_ROWS_FOR_START), shape)
    lower, upper = np.full((2, start.size), [[-np.inf], [np.inf]])
    first_of_sagnac = shape.amplitude + 1
    lower[first_of_sagnac], upper[first_of_sagnac] = _SMALLEST_PHASE, _LARGEST_PHASE
    found = least_squares(
        misfit,
        start,
        jac=jacobian,
        bounds=(lower, upper),
        x_scale="jac",
        # Tight, and not by the cost: where the law fits badly, that is flat long before the end.
        ftol=None,
        xtol=1e-12,
        gtol=1e-13,
        max_nfev=MAX_EVALUATIONS,
        args=(log, shape),
    )
    at_bound = not lower[first_of_sagnac] < found.x[first_of_sagnac] < upper[first_of_sagnac]
    # On a large log the noise is far above the eighth digit, and every pass has its price.
    if not at_bound and log.rate.size <= 2 * _ROWS_FOR_TRIAL:
        found.x = _polish(found.x, log, shape)
    return found


def _polish(parameters, log, shape):
    """The nearby zero of the gradient.

    A trust region compares costs, and near the minimum these differ by less than their rounding
    errors as soon as the parameters are right to eight digits. The gradient goes on to tell.
    """

    def gradient(trial):
        return jacobian(trial, log, shape).T @ misfit(trial, log, shape)

    found = root(gradient, parameters, method="hybr", options={"xtol": 1e-14, "maxfev": 60}).x
    return found if np.abs(found - parameters).max() < _NEARBY else parameters


def misfit(parameters, log, shape):
    """Modelled minus measured output, by the root of the weight."""
    law = shape.law(parameters)
    tau = log.tau + law.lag * log.rho
    phase = polyval(tau, law.k) * (log.rate + polyval(tau, law.b))
    output = polyval(tau, law.a) * np.sin(phase) + law.offset
    return log.root_weights * (output - log.output)


def jacobian(parameters, log, shape):
    law = shape.law(parameters)
    tau = log.tau + law.lag * log.rho
    amplitude, factor = polyval(tau, law.a), polyval(tau, law.k)
    biased = log.rate + polyval(tau, law.b)
    sine, cosine = np.sin(factor * biased), np.cos(factor * biased)
    by_polynomial = (sine / law.k[0], amplitude * cosine * biased, amplitude * cosine * factor)
    blocks = [
        polyvander(tau, degree) * derivative[:, None]
        for degree, derivative in zip(shape.degrees, by_polynomial, strict=True)
    ]
    blocks[1][:, 0] -= amplitude * sine / law.k[0]
    if shape.has_lag:
        a, k, b = (polyval(tau, polyder(of)) for of in (law.a, law.k, law.b))
        blocks.append(
            (log.rho * (a * sine + amplitude * cosine * (k * biased + factor * b)))[:, None]
        )
    if shape.has_offset:
        blocks.append(np.ones((tau.size, 1)))
    return log.root_weights[:, None] * np.hstack(blocks)


def _start(log, shape):
    """The best of several phases, the rest of the law by linear least squares; no lag."""
    weights, powers = log.root_weights, polyvander(log.tau, shape.amplitude)
    lowest = np.inf
    for candidate in _STARTING_PHASES:
        sines = powers * np.sin(candidate * log.rate)[:, None]
        cosine = np.cos(candidate * log.rate)[:, None]
        design = weights[:, None] * np.hstack([sines, cosine])
        target = weights * log.output
        found = np.linalg.lstsq(design, target, rcond=None)[0]
        misfit = np.sum((design @ found - target) ** 2)
        if misfit < lowest:
            lowest, phase, solution = misfit, candidate, found
    start = np.zeros(shape.n_coefficients)
    start[: shape.amplitude + 1] = phase * solution[:-1]
    start[shape.amplitude + 1] = phase
    # tan(K b) = (A sin K b) / (A cos K b); a bias beyond the largest rate is no start.
    bias = np.arctan2(solution[-1] * np.sign(solution[0]), np.abs(solution[0])) / phase
    start[shape.amplitude + shape.sagnac + 2] = np.clip(bias, -1.0, 1.0)
    return start
