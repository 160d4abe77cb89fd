r"""The physics of an open-loop fiber-optic gyro, one pure function per effect.

Units are those of data sheets: rates in deg/s, biases and their coefficients by the hour (deg/h),
scale factors in ppm, temperatures in degC, time in s. Every function that gives a rate gives it in
deg/s. All work on NumPy arrays of one run, equally spaced in time.

The model, after the gyro model of IEEE 952 with the sine of an open-loop interferometer:

.. math::

    y = S \, w(t) \, a(T) \, \frac{\sin\left[K(T) \, (\Omega + b)\right]}{K_0} + n

with the true rate :math:`\Omega`, the bias :math:`b` (a sum of several), the Sagnac factor
:math:`K_0` at the reference temperature and :math:`K(T)` at the coil's temperature, the relative
amplitude :math:`a(T)`, the scale factor S of the device relative to the nominal one, its warm-up
w(t), and the noise n, white and of quantisation. Since the small-signal scale factor is amplitude
times :math:`K_0`, y is the raw signal divided by the nominal small-signal scale factor.

References
----------
IEEE Std 952-1997, "Specification Format Guide and Test Procedure for Single-Axis Interferometric
Fiber Optic Gyros".

H. C. Lefevre, "The Fiber-Optic Gyroscope", Artech House.
"""

import numpy as np
from scipy.signal import lfilter

__all__ = [
    "REFERENCE_TEMPERATURE",
    "angle_random_walk_deviation",
    "bias_gain",
    "bias_instability",
    "change_of_rate_by_output",
    "coil_temperature_rate",
    "first_order_lag",
    "fixed_bias",
    "open_loop_response",
    "quantised",
    "rate_random_walk",
    "relative_amplitude",
    "relative_sagnac_factor",
    "relative_scale_factor",
    "temperature_bias",
    "thermal_rate_bias",
    "warm_up_bias",
    "warm_up_scale_factor",
]

REFERENCE_TEMPERATURE = 25.0  # degC, where the factory calibrates the scale factor
_DEGREES_PER_HOUR = 1.0 / 3600.0  # in deg/s
_PPM = 1e-6
_SECONDS_PER_MINUTE = 60.0
_ARC_SECOND = 1.0 / 3600.0  # in deg

# The Allan deviation of a first-order Gauss-Markov process of standard deviation sigma has its
# maximum, 0.437 sqrt(2) sigma, at 1.89 correlation times; that of flicker noise B is flat, 0.664 B
# (IEEE 952, annex on Allan variance).
_ALLAN_MAXIMUM_OF_GAUSS_MARKOV = 0.437 * np.sqrt(2.0)
_ALLAN_FLOOR_OF_FLICKER = np.sqrt(2.0 * np.log(2.0) / np.pi)


def open_loop_response(rate, sagnac_factor, relative_factor=1.0, amplitude=1.0):
    """Rate that an open-loop interferometer indicates, a sin(K Omega) / K0.

    The Sagnac phase is K Omega with K = 2 pi L D / (lambda c), for a coil of length L and diameter
    D; the phase modulation makes the signal its sine. K = ``relative_factor * sagnac_factor``.

    Parameters
    ----------
    rate : ndarray
        Rate, bias included [deg/s].
    sagnac_factor : float
        K0 [rad/(rad/s)].
    relative_factor, amplitude : ndarray or float
        K(T) / K0 and a(T).
    """
    phase = sagnac_factor * relative_factor * np.deg2rad(rate)
    return amplitude * np.rad2deg(np.sin(phase)) / sagnac_factor


def bias_gain(rate, bias, sagnac_factor, relative_factor, amplitude):
    """Change of the indicated rate per unit of bias, [f(Omega + b) - f(Omega)] / b.

    f is :func:`open_loop_response`. By the sum-to-product rule this is
    a K / K0 cos(K (Omega + b / 2)) sinc(K b / 2), which is exact, and loses no digits where b is
    small. It shares the effect of the whole bias out among its parts in proportion.
    """
    factor = sagnac_factor * relative_factor
    half_phase = 0.5 * factor * np.deg2rad(bias)
    phase = factor * np.deg2rad(rate) + half_phase
    return amplitude * relative_factor * np.cos(phase) * np.sinc(half_phase / np.pi)


def change_of_rate_by_output(rate, sagnac_factor, relative_factor, amplitude):
    """Change of the rate per unit of the indicated rate, 1 / f'(rate); f: the response above.

    What noise of the output is worth at the input: f is flatter at large rates, where the same
    noise stands for more of the rate.
    """
    factor = sagnac_factor * relative_factor
    return 1.0 / (amplitude * relative_factor * np.cos(factor * np.deg2rad(rate)))


def relative_sagnac_factor(temperature, coefficient):
    """K(T) / K0 = 1 + c (T - T0), c in ppm/degC.

    The mean wavelength of a superluminescent diode grows by some 350 to 450 ppm/degC, and K falls
    as 1 / wavelength.
    """
    return 1.0 + _PPM * coefficient * (temperature - REFERENCE_TEMPERATURE)


def relative_amplitude(temperature, coefficient, curvature):
    """Amplitude a(T) = 1 + c1 (T - T0) + c2 (T - T0)^2, in ppm/degC and ppm/degC^2.

    The source's power, the loss of the optics and the modulation depth depend on temperature.
    """
    difference = temperature - REFERENCE_TEMPERATURE
    return 1.0 + _PPM * difference * (coefficient + curvature * difference)


def relative_scale_factor(deviation):
    """Scale factor relative to the nominal one, S = 1 + e, with e in ppm."""
    return 1.0 + _PPM * deviation


def warm_up_scale_factor(time, deviation, time_constant):
    """Scale factor while warming up, relative to the warm one: 1 + e exp(-t / tau_w), e in ppm.

    The source's power and its mean wavelength settle after power-on.
    """
    return 1.0 + _PPM * deviation * np.exp(-time / time_constant)


def fixed_bias(bias):
    """Bias that does not change during a run, from deg/h; IEEE 952's D_F."""
    return _DEGREES_PER_HOUR * bias


def temperature_bias(temperature, coefficient, curvature):
    """Bias b_T = c1 (T - T0) + c2 (T - T0)^2, in deg/h/degC and deg/h/degC^2; IEEE 952's D_T."""
    difference = temperature - REFERENCE_TEMPERATURE
    return _DEGREES_PER_HOUR * difference * (coefficient + curvature * difference)


def warm_up_bias(time, amplitude, time_constant):
    """Bias b_w exp(-t / tau_w) after power-on, b_w in deg/h: the electronics' transient."""
    return _DEGREES_PER_HOUR * amplitude * np.exp(-time / time_constant)


def thermal_rate_bias(temperature_rate, coefficient):
    """Bias k_S dT/dt of the coil, k_S in deg/h/(degC/min), dT/dt in degC/s: the Shupe effect.

    A change of temperature that is not symmetric about the coil's middle reaches the two waves at
    different times (D. M. Shupe, Applied Optics 19, 1980, 654-655); here the integral over the
    fiber is lumped into one coefficient, IEEE 952's bias temperature-ramp sensitivity.
    """
    return _DEGREES_PER_HOUR * coefficient * _SECONDS_PER_MINUTE * temperature_rate


def first_order_lag(values, start, time_constant, sampling_interval):
    """Solution y of tau dy/dt = u - y with y(0) = ``start``.

    Exact for an input that is linear between its samples (first-order hold), so that no relation
    between the sampling interval and the time constant is needed. ``time_constant=0`` is no lag.
    """
    if time_constant == 0:
        return np.array(values, dtype=float)
    ratio = sampling_interval / time_constant
    decay = np.exp(-ratio)
    mean_decay = -np.expm1(-ratio) / ratio  # of exp(-t / tau), over one interval
    new, old = 1.0 - mean_decay, mean_decay - decay
    filtered, _ = lfilter([new, old], [1.0, -decay], values, zi=[start - new * values[0]])
    return filtered


def coil_temperature_rate(equilibrium, coil_temperature, time_constant):
    """dT/dt = (T_equilibrium - T) / tau_th of the coil [degC/s], its heat balance.

    With a constant ambient temperature and a cold start this is the derivative of
    T = T_ambient + dT_self (1 - exp(-t / tau_th)).
    """
    return (equilibrium - coil_temperature) / time_constant


def angle_random_walk_deviation(coefficient, sampling_interval):
    """Standard deviation of one sample of white rate noise [deg/s].

    A sample is the mean rate over one sampling interval h, so sigma = N / sqrt(h); N is the angle
    random walk in deg/sqrt(h), that is N / 60 in deg/sqrt(s) (IEEE 952).
    """
    return coefficient / 60.0 / np.sqrt(sampling_interval)


def rate_random_walk(standard_normal, coefficient, sampling_interval):
    """Bias that walks at random from zero at power-on [deg/s].

    b(k+1) = b(k) + K sqrt(h) w(k); K is the rate random walk in deg/h/sqrt(h), that is K / 216000
    in deg/s/sqrt(s). Its Allan deviation is K sqrt(tau / 3) (IEEE 952).

    Parameters
    ----------
    standard_normal : ndarray of shape (n_samples,)
        Independent standard normal numbers w; the last one would only act on the sample to come.
    coefficient, sampling_interval : float
        K [deg/h/sqrt(h)], h [s].
    """
    step = coefficient * _DEGREES_PER_HOUR / 60.0 * np.sqrt(sampling_interval)
    return step * np.concatenate([[0.0], np.cumsum(standard_normal[:-1])])


def quantised(rate, coefficient, sampling_interval):
    """The rate as read from a counter of angle increments [deg/s].

    The integral of the rate is rounded to whole increments q = sqrt(12) Q, and a sample is what
    was added to it during one interval. The error of the angle is uniform, of standard deviation
    Q [arcsec], so that the Allan deviation is sqrt(3) Q / tau (IEEE 952). Zero is no quantisation.
    """
    if coefficient == 0:
        return rate
    increment = np.sqrt(12.0) * coefficient * _ARC_SECOND / sampling_interval
    return increment * np.diff(np.rint(np.cumsum(rate) / increment), prepend=0.0)


def bias_instability(standard_normal, coefficient, correlation_time, sampling_interval):
    """First-order Gauss-Markov noise [deg/s] whose Allan deviation peaks where flicker lies flat.

    x(k+1) = exp(-h / T_c) x(k) + w(k), from its stationary state on. It stands in for the flicker
    noise of bias instability B [deg/h] (IEEE 952): the maximum of its Allan deviation is 0.664 B.

    Parameters
    ----------
    standard_normal : ndarray of shape (n_samples,)
        Independent standard normal numbers, the innovations.
    coefficient, correlation_time, sampling_interval : float
        B [deg/h], T_c [s], h [s].
    """
    ratio = _ALLAN_FLOOR_OF_FLICKER / _ALLAN_MAXIMUM_OF_GAUSS_MARKOV
    deviation = ratio * coefficient * _DEGREES_PER_HOUR
    interval = sampling_interval / correlation_time
    innovations = np.sqrt(-np.expm1(-2.0 * interval)) * standard_normal
    innovations[0] = standard_normal[0]
    return deviation * lfilter([1.0], [1.0, -np.exp(-interval)], innovations)
