"""One thermal run of one gyro: from its coefficients to its output and the parts of its error."""

import numpy as np

from ._ofog_physics import (
    angle_random_walk_deviation,
    bias_gain,
    bias_instability,
    coil_temperature_rate,
    first_order_lag,
    fixed_bias,
    open_loop_response,
    relative_amplitude,
    relative_sagnac_factor,
    relative_scale_factor,
    temperature_bias,
    thermal_rate_bias,
    warm_up_bias,
)

__all__ = ["simulate_run"]


def simulate_run(run, time, rate, normals, sampling_interval):
    """Simulate one run.

    Parameters
    ----------
    run : Run
        The device, and what is particular to this run.
    time, rate : ndarray of shape (n_samples,)
        Time since power-on [s], from 0 in steps of ``sampling_interval``; true rate [deg/s].
    normals : ndarray of shape (2, n_samples)
        Independent normal numbers, of standard deviation one unless the noise is to be scaled:
        for the bias instability, for the white noise.
    sampling_interval : float
        Time between samples [s].

    Returns
    -------
    columns : dict of str to ndarray of shape (n_samples,)
        Time [s], indicated temperature [degC]; rate, output and error [deg/s]; then the parts of
        the error [deg/s], whose sum it is but for rounding.
    """
    coil, coil_rate, thermometer = _temperatures(run, time, sampling_interval)
    biases = _biases(run, time, coil, coil_rate, normals[0], sampling_interval)
    bias = sum(biases.values())
    optics = _optics(run.device, coil)
    deviation = angle_random_walk_deviation(run.device.angle_random_walk, sampling_interval)
    white_noise = deviation * normals[1]
    output = open_loop_response(rate + bias, *optics) + white_noise
    gain = bias_gain(rate, bias, *optics)
    return {
        "time": time,
        "temperature": thermometer,
        "rate": rate,
        "output": output,
        "error": output - rate,
        **_scale_factor_parts(run.device, rate, optics),
        **{name: gain * part for name, part in biases.items()},
        "angle_random_walk": white_noise,
    }


def _temperatures(run, time, sampling_interval):
    """Coil's temperature, its derivative, and the thermometer's reading."""
    device = run.device
    equilibrium = np.full(time.shape, run.ambient + device.self_heating)
    start = run.ambient + run.residual_heat * device.self_heating
    coil = first_order_lag(equilibrium, start, device.thermal_time, sampling_interval)
    coil_rate = coil_temperature_rate(equilibrium, coil, device.thermal_time)
    thermometer = first_order_lag(coil, coil[0], device.thermometer_lag, sampling_interval)
    return coil, coil_rate, thermometer


def _biases(run, time, coil, coil_rate, standard_normal, sampling_interval):
    """The parts of the bias [deg/s], at the input of the interferometer."""
    device = run.device
    return {
        "bias": np.full(time.shape, fixed_bias(device.bias + run.bias)),
        "bias_temperature": temperature_bias(
            coil, device.bias_temperature, device.bias_temperature_curvature
        ),
        "warm_up": warm_up_bias(time, device.warm_up, device.warm_up_time),
        "thermal_rate": thermal_rate_bias(coil_rate, device.thermal_rate),
        "bias_instability": bias_instability(
            standard_normal, device.bias_instability, device.correlation_time, sampling_interval
        ),
    }


def _optics(device, coil):
    """The response's K0, K(T) / K0, and amplitude S a(T)."""
    return (
        device.sagnac_factor,
        relative_sagnac_factor(coil, device.sagnac_temperature),
        relative_scale_factor(device.scale_factor)
        * relative_amplitude(coil, device.amplitude_temperature, device.amplitude_curvature),
    )


def _scale_factor_parts(device, rate, optics):
    """Error without any bias: the sine's, then what the device, then the temperature adds to it."""
    nominal = open_loop_response(rate, device.sagnac_factor)
    at_reference = relative_scale_factor(device.scale_factor) * nominal
    return {
        "nonlinearity": nominal - rate,
        "scale_factor": at_reference - nominal,
        "scale_factor_temperature": open_loop_response(rate, *optics) - at_reference,
    }
