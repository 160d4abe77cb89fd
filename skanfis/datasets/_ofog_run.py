"""One power-up of one gyro: from its coefficients to its output and the parts of its error."""

import numpy as np

from . import _ofog_physics as physics

__all__ = ["RANDOM_BIASES", "simulate_power_up"]

# Biases that nobody can foresee, the one drawn at power-on included.
RANDOM_BIASES = ("bias_repeatability", "bias_instability", "rate_random_walk")


def simulate_power_up(device, turn_on_bias, time, rate, temperatures, normals, sampling_interval):
    """Simulate one power-up.

    Parameters
    ----------
    device : Device
        Coefficients of the gyro.
    turn_on_bias : float
        Bias of this power-up alone [deg/h].
    time, rate : ndarray of shape (n_samples,)
        Time since power-on [s], from 0 in steps of ``sampling_interval``; true rate [deg/s].
    temperatures : tuple of five ndarrays of shape (n_samples,)
        As :func:`thermal_history` yields them.
    normals : ndarray of shape (4, n_samples)
        Independent standard normal numbers: for bias instability, rate random walk, angle random
        walk, thermometer.
    sampling_interval : float
        Time between samples [s].

    Returns
    -------
    measurement : dict of str to ndarray of shape (n_samples,)
        Time [s], temperatures [degC] and the thermometer's rate [degC/s]; true rate, output, error
        and noise [deg/s].
    parts : dict of str to ndarray of shape (n_samples,)
        The parts of the error [deg/s], whose sum it is but for rounding.
    """
    ambient, coil, coil_rate, thermometer, thermometer_rate = temperatures
    biases = _biases(device, turn_on_bias, time, coil, coil_rate, normals, sampling_interval)
    bias = sum(biases.values())
    optics = _optics(device, time, coil)
    white_noise = normals[2] * physics.angle_random_walk_deviation(
        device.angle_random_walk, sampling_interval
    )
    noisy = physics.open_loop_response(rate + bias, *optics) + white_noise
    output = physics.quantised(noisy, device.quantisation, sampling_interval)
    gain = physics.bias_gain(rate, bias, *optics)
    parts = {
        **_scale_factor_parts(device, time, rate, coil),
        **{name: gain * part for name, part in biases.items()},
        "angle_random_walk": white_noise,
        "quantisation": output - noisy,
    }
    measurement = {
        "time": time,
        "temperature": thermometer + device.thermometer_noise * normals[3],
        "temperature_rate": thermometer_rate,
        "ambient": ambient,
        "rate": rate,
        "counts": output,
        "output": output,
        "error": output - rate,
        "noise": sum(biases[name] for name in RANDOM_BIASES)
        + physics.change_of_rate_by_output(rate + bias, *optics)
        * (parts["angle_random_walk"] + parts["quantisation"]),
    }
    return measurement, parts


def _biases(device, turn_on_bias, time, coil, coil_rate, normals, sampling_interval):
    """The parts of the bias [deg/s], at the input of the interferometer."""
    return {
        "bias": np.full(time.shape, physics.fixed_bias(device.bias)),
        "bias_temperature": physics.temperature_bias(
            coil, device.bias_temperature, device.bias_temperature_curvature
        ),
        "warm_up": physics.warm_up_bias(time, device.warm_up, device.warm_up_time),
        "bias_temperature_rate": physics.thermal_rate_bias(coil_rate, device.bias_temperature_rate),
        "bias_repeatability": np.full(time.shape, physics.fixed_bias(turn_on_bias)),
        "bias_instability": physics.bias_instability(
            normals[0], device.bias_instability, device.correlation_time, sampling_interval
        ),
        "rate_random_walk": physics.rate_random_walk(
            normals[1], device.rate_random_walk, sampling_interval
        ),
    }


def _factors(device, time, coil):
    """K(T) / K0, and the factors S, a(T), w(t) of the output."""
    return (
        physics.relative_sagnac_factor(coil, device.sagnac_temperature),
        physics.relative_scale_factor(device.scale_factor),
        physics.relative_amplitude(coil, device.amplitude_temperature, device.amplitude_curvature),
        physics.warm_up_scale_factor(time, device.warm_up_scale_factor, device.warm_up_time),
    )


def _optics(device, time, coil):
    """The response's K0, K(T) / K0, and amplitude S a(T) w(t)."""
    relative_factor, scale_factor, amplitude, warm_up = _factors(device, time, coil)
    return device.sagnac_factor, relative_factor, scale_factor * amplitude * warm_up


def _scale_factor_parts(device, time, rate, coil):
    """Error without any bias: the sine's, then what each further effect adds to it."""
    relative_factor, scale_factor, amplitude, warm_up = _factors(device, time, coil)
    nominal = physics.open_loop_response(rate, device.sagnac_factor)
    sine = physics.open_loop_response(rate, device.sagnac_factor, relative_factor)
    return {
        "nonlinearity": nominal - rate,
        "scale_factor": (scale_factor - 1.0) * nominal,
        "wavelength": scale_factor * (sine - nominal),
        "amplitude": scale_factor * (amplitude - 1.0) * sine,
        "warm_up_scale_factor": scale_factor * amplitude * (warm_up - 1.0) * sine,
    }
