"""The law of the open-loop interferometer, fitted to a calibration log and inverted.

The squared error of the *output* is minimised, because its noise is white and of constant size, and
the law gives an output for every rate. docs/gyro_physics.rst has the formulas.
"""

from __future__ import annotations

import warnings
from copy import copy
from types import SimpleNamespace
from typing import Self

import numpy as np
from numpy.polynomial.polynomial import polyval, polyvander
from numpy.typing import ArrayLike
from scipy.optimize import least_squares
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.exceptions import ConvergenceWarning
from sklearn.utils.validation import check_is_fitted, check_scalar, validate_data

from ..exceptions import ConstantInputWarning, OutOfBoundsWarning
from ..policies import SILENT, check_policy
from ._columns import column_position

HIGHEST_DEGREE = 5
DEGREES = ("amplitude_degree", "sagnac_degree", "bias_degree")
ROLES = ("output", "temperature", "temperature_rate")
# Phase at the largest rate [rad]. Below 0.01 the sine is a straight line to 20 ppm; from pi/2 on
# two rates give one output.
_SMALLEST_PHASE, _LARGEST_PHASE = 0.01, np.pi / 2.0
# A tenth of a radian apart: the fit goes the rest of the way.
_STARTING_PHASES = np.linspace(0.1, 1.5, 15)
# For at most 19 coefficients the start needs few rows, and the fit to all begins with some.
_FEW_ROWS = 2_000
_MAX_EVALUATIONS = 200


class OpenLoopArcsineRegressor(RegressorMixin, BaseEstimator):
    r"""Rate from the output of an open-loop fiber-optic gyro by the arcsine law.

    The law :math:`V = A(T) \sin[K(T) (\Omega + b(T))]` is fitted to a calibration log by
    least squares on the output V, and inverted for the rate,
    :math:`\hat\Omega = \arcsin[V / A(T)] / K(T) - b(T)`. The target is the true *rate*, not
    the error of the indicated one. See :doc:`/gyro_physics`.

    Parameters
    ----------
    output : int or str, default=0
        Column of X that holds the output of the gyro, by position or name. Any unit, any sign.
    temperature : int, str or None, default=1
        Column of the temperature; None leaves temperature out.
    temperature_rate : int, str or None, default=None
        Column of the rate of temperature change (:class:`ThermalRate`), if the thermometer lags
        behind the coil. The law then takes the temperature plus this rate times a fitted lag.
    amplitude_degree, sagnac_degree, bias_degree : int, default=1
        Degrees of A(T), K(T) and b(T), 0 to 5; without a temperature they are 0.
    max_phase : float, default=1.2
        Largest phase that is inverted, in (0, pi/2) [rad]; towards pi/2 the inverse magnifies noise
        by 1 / cos(phase).
    out_of_bounds : {"clip", "linear", "nan", "raise"}, default="clip"
        What ``predict`` does beyond ``max_phase``: hold the phase there, go on along the tangent,
        return NaN, or raise ValueError. Rows within it but outside the training data follow the
        law; ``in_bounds`` flags them, and ``predict`` warns of them and of rows on the tangent.

    Attributes
    ----------
    amplitude_, sagnac_factor_, bias_ : ndarray of shape (degree + 1,)
        Coefficients of A, K and b in powers of T minus ``reference_temperature_``, lowest first; K
        in rad per unit of the target.
    thermometer_lag_ : float
        Lag of the thermometer [s]; zero unless fitted.
    reference_temperature_ : float
        Temperature of the coefficients.
    columns_ : list of int
        Positions in X of output, then of temperature and its rate if used.
    minimum_, maximum_ : ndarray of shape (n_used,)
        Range of the training data in these columns.
    n_iter_ : int
        Evaluations of the law in the fit.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of shape (n_features,)
        Their names, where X had names that are all strings.

    See Also
    --------
    ResidualRegressor : This law, and an ANFIS for what it leaves.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis.gyro import OpenLoopArcsineRegressor
    >>> rate, temperature = np.meshgrid(np.linspace(-100, 100, 21), [10.0, 20.0, 30.0])
    >>> factor = 0.2536 * (1 - 400e-6 * (temperature - 20.0))  # rad/(rad/s)
    >>> counts = 6e6 * np.sin(factor * np.deg2rad(rate))
    >>> X = np.column_stack([counts.ravel(), temperature.ravel()])
    >>> law = OpenLoopArcsineRegressor().fit(X, rate.ravel())
    >>> round(float(np.rad2deg(law.sagnac_factor_[0])), 9)
    0.2536
    """

    def __init__(
        self,
        output: int | str = 0,
        temperature: int | str | None = 1,
        *,
        temperature_rate: int | str | None = None,
        amplitude_degree: int = 1,
        sagnac_degree: int = 1,
        bias_degree: int = 1,
        max_phase: float = 1.2,
        out_of_bounds: str = "clip",
    ) -> None:
        self.output = output
        self.temperature = temperature
        self.temperature_rate = temperature_rate
        self.amplitude_degree = amplitude_degree
        self.sagnac_degree = sagnac_degree
        self.bias_degree = bias_degree
        self.max_phase = max_phase
        self.out_of_bounds = out_of_bounds

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        # It reads few columns and knows one law: it scores poorly on data of another law.
        tags.regressor_tags.poor_score = True
        return tags

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit the law to the columns of X that it takes, and to the true rate.

        Raises
        ------
        ValueError
            If a parameter or column is not what it must be, if there are fewer rows than
            coefficients, or if output or rate never change.
        """
        check_parameters(self)
        trial = copy(self)  # so that a fit that fails leaves what was there
        inputs, rate = validate_data(trial, X, y, dtype=float, y_numeric=True)
        columns = trial._find_columns()
        used = inputs[:, columns]
        log = _standardised(used, rate.astype(float))
        log.degrees = trial._degrees(used)
        n_coefficients = sum(log.degrees) + 3 + log.has_lag
        if rate.size < n_coefficients:
            raise ValueError(
                f"The law has {n_coefficients} coefficients; n_samples = {rate.size} rows cannot "
                "tell them. Give more rows, or lower the degrees."
            )
        for name, values in (("the output", used[:, 0]), ("the rate (y)", rate)):
            if np.ptp(values) == 0:
                raise ValueError(f"No scale factor can be found: {name} never changes.")
        parameters, trial.n_iter_, has_settled = _fit_law(log)
        if not has_settled:
            text = f"The law did not settle in {_MAX_EVALUATIONS} evaluations: check its columns."
            warnings.warn(text, ConvergenceWarning, stacklevel=2)
        trial._keep(log, _law_of(parameters, log))
        trial.columns_ = columns
        trial.minimum_, trial.maximum_ = used.min(axis=0), used.max(axis=0)
        self.__dict__ = trial.__dict__
        return self

    def predict(self, X: ArrayLike) -> np.ndarray:
        """Predict the rate, in the unit of the target."""
        check_parameters(self)
        used = self._used(X)
        sine, limit = self._sine(used), np.sin(self.max_phase)
        beyond = np.abs(sine) > limit
        if beyond.any() and self.out_of_bounds == "raise":
            raise ValueError(
                f"{beyond.sum()} of {beyond.size} rows cannot be inverted: their output means a "
                f"Sagnac phase beyond max_phase={self.max_phase:g} rad."
            )
        outside, goes_on = self._outside(used), self.out_of_bounds == "linear"
        told = outside | beyond if goes_on else outside & ~beyond
        if told.any():
            past = f", or its tangent beyond max_phase={self.max_phase:g} rad" * goes_on
            rows = f"{told.sum()} of {told.size} rows follow the law there{past}"
            message = f"X lies outside the training data: {rows}."
            warnings.warn(message, OutOfBoundsWarning, stacklevel=2)
        held = np.clip(sine, -limit, limit)
        phase = np.arcsin(held)
        if goes_on:
            phase += (sine - held) / np.cos(self.max_phase)
        elif self.out_of_bounds == "nan":
            phase[beyond] = np.nan
        difference = self._difference(used)
        return phase / polyval(difference, self.sagnac_factor_) - polyval(difference, self.bias_)

    def in_bounds(self, X: ArrayLike) -> np.ndarray:
        """Tell which rows lie in the range of the training data and within ``max_phase``."""
        used = self._used(X)
        return ~self._outside(used) & (np.abs(self._sine(used)) <= np.sin(self.max_phase))

    def _find_columns(self):
        """Positions of output and, if used, of temperature and its rate."""
        if self.temperature is None and self.temperature_rate is not None:
            raise ValueError("temperature_rate is of no use with temperature=None.")
        roles = [role for role in ROLES if getattr(self, role) is not None or role == "output"]
        names = list(getattr(self, "feature_names_in_", range(self.n_features_in_)))
        columns = [column_position(names, role, getattr(self, role)) for role in roles]
        if len(set(columns)) < len(columns):
            given = ", ".join(f"{role}={getattr(self, role)!r}" for role in roles)
            raise ValueError(f"Two of {given} are one column.")
        return columns

    def _degrees(self, used):
        """Degrees in temperature, at most as many as its different values can determine."""
        n_values = 1 if self.temperature is None else np.unique(used[:, 1]).size
        if self.temperature is not None and n_values == 1:
            warnings.warn(
                f"The temperature is {used[0, 1]:g} in all rows: the law is learnt for it alone.",
                ConstantInputWarning,
                stacklevel=3,
            )
        return tuple(min(getattr(self, degree), n_values - 1) for degree in DEGREES)

    def _keep(self, log, law):
        """Set coefficients in the units of X and y, in powers of T minus the reference."""
        self.reference_temperature_ = float(log.mean)
        output_unit, rate_unit, std, thermal_unit = log.units

        def in_units(coefficients, unit, degree):
            n_terms = 1 + (degree if self.temperature is not None else 0)
            found = coefficients * unit / std ** np.arange(coefficients.size)
            return np.pad(found, (0, n_terms - found.size))

        self.amplitude_ = in_units(law.a, output_unit, self.amplitude_degree)
        self.sagnac_factor_ = in_units(law.k, 1.0 / rate_unit, self.sagnac_degree)
        self.bias_ = in_units(law.b, rate_unit, self.bias_degree)
        self.thermometer_lag_ = float(law.lag * std / thermal_unit)

    def _used(self, X):
        check_is_fitted(self)
        return validate_data(self, X, reset=False, dtype=float)[:, self.columns_]

    def _difference(self, used):
        """The coil's temperature minus the reference."""
        if self.temperature is None:
            return np.zeros(len(used))
        lagging = self.thermometer_lag_ * used[:, 2] if used.shape[1] == len(ROLES) else 0.0
        return used[:, 1] + lagging - self.reference_temperature_

    def _sine(self, used):
        """V / A(T): the sine of the phase, unless its size is above one."""
        amplitude = polyval(self._difference(used), self.amplitude_)
        with np.errstate(divide="ignore", invalid="ignore"):
            sine = used[:, 0] / amplitude
        # 0 / 0: without an amplitude the rate cannot be known.
        return np.where(np.isnan(sine), np.inf, sine)

    def _outside(self, used):
        return ((used < self.minimum_) | (used > self.maximum_)).any(axis=1)


def check_parameters(law):
    """Raise ValueError if a parameter of an OpenLoopArcsineRegressor is not allowed."""
    for name in DEGREES:
        check_scalar(getattr(law, name), name, (int, np.integer), min_val=0, max_val=HIGHEST_DEGREE)
    real, ends = (float, int, np.floating), {"min_val": 0.0, "max_val": np.pi / 2.0}
    check_scalar(law.max_phase, "max_phase", real, **ends, include_boundaries="neither")
    check_policy(law.out_of_bounds)


def phase_of(law, X):
    """Sagnac phase of each row, bias included; NaN where the output is beyond the amplitude."""
    with np.errstate(invalid="ignore"):
        return np.arcsin(law._sine(law._used(X)))


def past_phase(policy, what):
    """What happens beyond the largest phase, as a clause; ``what`` names the missing result."""
    if policy in SILENT:
        return f"there is no {what}"
    return "the phase is held there" if policy == "clip" else "the law goes on along its tangent"


def _standardised(used, rate):
    """The log with outputs of RMS 1, rates up to 1, and temperature about 0 with spread 1."""
    output, temperature, thermal_rate = np.pad(used, ((0, 0), (0, len(ROLES) - used.shape[1]))).T
    mean, std = temperature.mean(), temperature.std()
    if np.ptp(temperature) == 0:
        mean, std = temperature[0], 1.0
    root = np.sqrt(np.mean(output**2))
    units = root or 1.0, np.abs(rate).max() or 1.0, std, np.abs(thermal_rate).max() or 1.0
    columns = np.stack([output, rate, temperature - mean, thermal_rate]) / np.array(units)[:, None]
    has_lag = used.shape[1] == len(ROLES)
    return SimpleNamespace(columns=columns, units=units, mean=mean, has_lag=has_lag)


def _law_of(parameters, log):
    """The law from the vector that the solver works on: s = A k_0, K, b, then the lag.

    Where the sine is nearly straight, data determine the product s, but not A and K.
    """
    ends = np.cumsum([degree + 1 for degree in log.degrees])
    s, k, b, rest = np.split(parameters, ends)
    return SimpleNamespace(a=s / k[0], k=k, b=b, lag=rest[0] if log.has_lag else 0.0)


def _misfit(parameters, columns, log):
    """Modelled minus measured output."""
    output, rate, tau, rho = columns
    law = _law_of(parameters, log)
    tau = tau + law.lag * rho
    phase = polyval(tau, law.k) * (rate + polyval(tau, law.b))
    return polyval(tau, law.a) * np.sin(phase) - output


def _fit_law(log):
    """The solver's vector at the minimum, the number of evaluations, and whether it settled."""
    n_rows = log.columns.shape[1]
    start = _start(log.columns[:, :: max(1, n_rows // _FEW_ROWS)], log)
    lower, upper = np.full((2, start.size), [[-np.inf], [np.inf]])
    first_of_sagnac = log.degrees[0] + 1
    lower[first_of_sagnac], upper[first_of_sagnac] = _SMALLEST_PHASE, _LARGEST_PHASE
    # On a long log the noise is far above the eighth digit, and passes are expensive.
    is_long = n_rows > _FEW_ROWS
    # A long log is first fitted on some of its rows; few steps on all rows are left then.
    for step in sorted({max(1, n_rows // _FEW_ROWS), 1}, reverse=True):
        fitted = least_squares(
            _misfit,
            start,
            jac="cs",  # by complex steps: exact to rounding
            bounds=(lower, upper),
            x_scale="jac",
            # No test of the cost: where the law fits badly, it is flat before the minimum.
            ftol=None,
            xtol=1e-7 if is_long else 1e-12,
            gtol=1e-13,
            max_nfev=_MAX_EVALUATIONS,
            args=(log.columns[:, ::step], log),
        )
        start = fitted.x
    return start, fitted.nfev, fitted.status != 0


def _start(columns, log):
    """Starting values: the best of several phases, the rest by linear least squares; no lag.

    For given K the law is linear in A cos(K b) and A sin(K b).
    """
    output, rate, tau, _ = columns
    powers = polyvander(tau, log.degrees[0])
    trials = []
    for phase in _STARTING_PHASES:
        basis = np.column_stack([powers * np.sin(phase * rate)[:, None], np.cos(phase * rate)])
        found = np.linalg.lstsq(basis, output, rcond=None)[0]
        trials.append((np.sum((basis @ found - output) ** 2), phase, found))
    _, phase, found = min(trials, key=lambda trial: trial[0])
    # tan(K b) = (A sin K b) / (A cos K b); a bias beyond the largest rate is no start.
    bias = np.arctan2(found[-1] * np.sign(found[0]), np.abs(found[0])) / phase
    k, b = np.zeros(log.degrees[1] + 1), np.zeros(log.degrees[2] + 1)
    k[0], b[0] = phase, np.clip(bias, -1.0, 1.0)
    return np.concatenate([phase * found[:-1], k, b, [0.0] * log.has_lag])
