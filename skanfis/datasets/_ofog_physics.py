"""Physics of one simulated run of an open-loop gyro: temperatures, output, parts of its error.

Units are those of data sheets: rates in deg/s, biases and their coefficients per hour (deg/h),
scale factors in ppm, temperatures in degC, time in s. :func:`make_ofog` has the formulas.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from scipy.signal import lfilter

REFERENCE_TEMPERATURE = 25.0  # degC, where the factory calibrates the scale factor
# Biases that no compensation can foresee, including the one drawn at power-on.
_RANDOM_BIASES = ("bias_repeatability", "bias_instability", "rate_random_walk")

_PER_HOUR = 1.0 / 3600.0  # deg/h in deg/s, and an arc second in deg
_PPM = 1e-6
_N_SOAKS = 5
# Flat Allan deviation of flicker noise, in units of its coefficient, divided by the largest Allan
# deviation of a Gauss-Markov process, in units of its standard deviation (IEEE 952).
_GAUSS_MARKOV = np.sqrt(2.0 * np.log(2.0) / np.pi) / (0.437 * np.sqrt(2.0))


@dataclass(frozen=True)
class Schedule:
    """The settings that all runs share: their clock, and the chamber's program."""

    n_samples: int  # of one power-up
    sampling_interval: float  # s
    n_power_ups: int
    n_off: int  # samples between two power-ups, without power
    profile: str
    ambient_range: tuple[float, float]  # degC

    def ambient(self, first, n_samples, start, rising):
        """Temperature of the chamber [degC] at samples of the run's clock, from ``first`` on."""
        if self.profile == "constant":
            return np.full(n_samples, start)
        low, high = self.ambient_range
        span = high - low
        place = (start - low) / span if span > 0 else 0.0
        phase = 0.5 * place if rising else 1.0 - 0.5 * place
        # One power-up lasts for one full cycle up and down.
        period = self.sampling_interval * self.n_samples
        clock = self.sampling_interval * (first + np.arange(n_samples))
        triangle = 1.0 - np.abs(2.0 * ((phase + clock / period) % 1.0) - 1.0)
        if self.profile == "soaks":
            triangle = np.rint((_N_SOAKS - 1) * triangle) / (_N_SOAKS - 1)
        return low + span * triangle


def temperatures(device, schedule, start, rising, residual_heat):
    """Yield the temperatures [degC] and their rates [degC/s] of one power-up after another.

    The chamber begins at ``start``; coil and thermometer are warmer by ``residual_heat`` times the
    self-heating.
    """
    n_on, interval = schedule.n_samples, schedule.sampling_interval
    coil_start = schedule.ambient(0, 1, start, rising)[0] + residual_heat * device.self_heating
    thermometer_start = coil_start
    for power_up in range(schedule.n_power_ups):
        first = power_up * (n_on + schedule.n_off)
        # One sample more than is recorded: the state when the power is switched.
        on = schedule.ambient(first, n_on + 1, start, rising)
        off = schedule.ambient(first + n_on, schedule.n_off + 1, start, rising)
        warm = on + device.self_heating
        coil = first_order_lag(warm, coil_start, device.thermal_time, interval)
        lag = device.thermometer_lag
        thermometer = first_order_lag(coil, thermometer_start, lag, interval)
        coil_rate = (warm - coil) / device.thermal_time
        thermometer_rate = (coil - thermometer) / lag if lag else coil_rate
        yield SimpleNamespace(
            ambient=on[:-1],
            coil=coil[:-1],
            coil_rate=coil_rate[:-1],
            thermometer=thermometer[:-1],
            thermometer_rate=thermometer_rate[:-1],
        )
        coil = first_order_lag(off, coil[-1], device.thermal_time, interval)
        thermometer_start = first_order_lag(coil, thermometer[-1], lag, interval)[-1]
        coil_start = coil[-1]


def simulate_power_up(device, turn_on_bias, rate, thermal, normals, sampling_interval):
    """Columns of the measurement and of the parts of its error, for one power-up.

    ``thermal`` comes from :func:`temperatures`; ``normals`` are four rows of standard normal
    numbers, for bias instability, rate random walk, angle random walk and thermometer.
    """
    h, time = sampling_interval, sampling_interval * np.arange(rate.size)
    warm = thermal.coil - REFERENCE_TEMPERATURE
    settling = np.exp(-time / device.warm_up_time)
    relative = 1.0 + _PPM * device.sagnac_temperature * warm  # K(T) / K0
    scale = 1.0 + _PPM * device.scale_factor
    curved = device.amplitude_temperature + device.amplitude_curvature * warm
    amplitude = 1.0 + _PPM * warm * curved
    warm_up = 1.0 + _PPM * device.warm_up_scale_factor * settling
    optics = (device.sagnac_factor, relative, scale * amplitude * warm_up)
    curved = device.bias_temperature + device.bias_temperature_curvature * warm
    biases = {
        "bias": np.full(time.shape, _PER_HOUR * device.bias),
        "bias_temperature": _PER_HOUR * warm * curved,
        "warm_up": _PER_HOUR * device.warm_up * settling,
        "bias_temperature_rate": (
            _PER_HOUR * device.bias_temperature_rate * 60.0 * thermal.coil_rate
        ),
        "bias_repeatability": np.full(time.shape, _PER_HOUR * turn_on_bias),
        "bias_instability": bias_instability(
            normals[0], device.bias_instability, device.correlation_time, h
        ),
        "rate_random_walk": rate_random_walk(normals[1], device.rate_random_walk, h),
    }
    bias = sum(biases.values())
    # N in deg/sqrt(h) is N / 60 in deg/sqrt(s); a sample is the mean rate over an interval.
    white = normals[2] * (device.angle_random_walk / 60.0 / np.sqrt(h))
    noisy = open_loop_response(rate + bias, *optics) + white
    output = quantised(noisy, device.quantisation, h)
    gain = bias_gain(rate, bias, *optics)
    nominal = open_loop_response(rate, device.sagnac_factor)
    sine = open_loop_response(rate, device.sagnac_factor, relative)
    parts = {
        # First without any bias: the error of the sine, then what each further effect adds.
        "nonlinearity": nominal - rate,
        "scale_factor": (scale - 1.0) * nominal,
        "wavelength": scale * (sine - nominal),
        "amplitude": scale * (amplitude - 1.0) * sine,
        "warm_up_scale_factor": scale * amplitude * (warm_up - 1.0) * sine,
        **{name: gain * part for name, part in biases.items()},
        "angle_random_walk": white,
        "quantisation": output - noisy,
    }
    measurement = {
        "time": time,
        "temperature": thermal.thermometer + device.thermometer_noise * normals[3],
        "temperature_rate": thermal.thermometer_rate,
        "ambient": thermal.ambient,
        "rate": rate,
        "counts": output,  # placeholder, replaced later
        "output": output,
        "error": output - rate,
        "noise": sum(biases[name] for name in _RANDOM_BIASES)
        # Noise of the output, divided by the slope of the response, is noise at the input.
        + (1.0 / bias_gain(rate + bias, 0.0, *optics)) * (white + parts["quantisation"]),
    }
    return measurement, parts


def open_loop_response(rate, sagnac_factor, relative_factor=1.0, amplitude=1.0):
    """Indicated rate a sin(K rate) / K0 [deg/s], bias included in ``rate``."""
    phase = sagnac_factor * relative_factor * np.deg2rad(rate)
    return amplitude * np.rad2deg(np.sin(phase)) / sagnac_factor


def bias_gain(rate, bias, sagnac_factor, relative_factor, amplitude):
    """Change of the indicated rate per unit of bias, exact and without loss of digits.

    By the sum-to-product rule it is a K / K0 cos(K (Omega + b / 2)) sinc(K b / 2). Times each part
    of the bias b, it divides the effect of the whole bias among its parts in proportion.
    """
    factor = sagnac_factor * relative_factor
    half_phase = 0.5 * factor * np.deg2rad(bias)
    phase = factor * np.deg2rad(rate) + half_phase
    return amplitude * relative_factor * np.cos(phase) * np.sinc(half_phase / np.pi)


def first_order_lag(values, start, time_constant, sampling_interval):
    """Solution y of tau dy/dt = u - y with y(0) = ``start``; none for a time constant of zero.

    Exact for an input that is linear between its samples, whatever the sampling interval.
    """
    if time_constant == 0:
        return np.array(values, dtype=float)
    ratio = sampling_interval / time_constant
    decay = np.exp(-ratio)
    mean_decay = -np.expm1(-ratio) / ratio  # mean of exp(-t / tau) over one interval
    new, old = 1.0 - mean_decay, mean_decay - decay
    filtered, _ = lfilter([new, old], [1.0, -decay], values, zi=[start - new * values[0]])
    return filtered


def rate_random_walk(standard_normal, coefficient, sampling_interval):
    """Bias [deg/s] that walks at random from zero at power-on, ``coefficient`` in deg/h/sqrt(h)."""
    step = coefficient * _PER_HOUR / 60.0 * np.sqrt(sampling_interval)
    return step * np.concatenate([[0.0], np.cumsum(standard_normal[:-1])])


def quantised(rate, coefficient, sampling_interval):
    """The rate [deg/s] as read from a counter of angle increments sqrt(12) Q, Q in arcsec."""
    if coefficient == 0:
        return rate
    increment = np.sqrt(12.0) * coefficient * _PER_HOUR / sampling_interval
    return increment * np.diff(np.rint(np.cumsum(rate) / increment), prepend=0.0)


def bias_instability(standard_normal, coefficient, correlation_time, sampling_interval):
    """Stationary Gauss-Markov noise [deg/s], whose Allan deviation peaks at 0.664 B, B in deg/h."""
    deviation = _GAUSS_MARKOV * coefficient * _PER_HOUR
    interval = sampling_interval / correlation_time
    innovations = np.sqrt(-np.expm1(-2.0 * interval)) * standard_normal
    innovations[0] = standard_normal[0]
    return deviation * lfilter([1.0], [1.0, -np.exp(-interval)], innovations)
