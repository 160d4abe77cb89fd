"""A seeded simulator of thermal runs of open-loop fiber-optic gyros on a rate table."""

import numpy as np
import pandas as pd
from sklearn.utils import check_random_state

from ._ofog_population import (
    check_phase,
    draw_devices,
    draw_rate,
    draw_runs,
    nominal_device,
)
from ._ofog_run import simulate_run
from ._validation import check_count, check_real

__all__ = ["make_ofog"]

# Outside, neither the polynomials in temperature nor any chamber for gyros would hold.
_COLDEST, _HOTTEST = -60.0, 100.0  # degC


def make_ofog(
    *,
    n_devices=3,
    n_runs=8,
    duration=3600.0,
    sampling_interval=10.0,
    max_rate=100.0,
    n_rate_levels=401,
    dwell_time=120.0,
    ambient_range=(-20.0, 50.0),
    max_residual_heat=0.5,
    noise=1.0,
    device_spread=1.0,
    coefficients=None,
    random_state=None,
):
    r"""Simulate thermal runs of open-loop fiber-optic gyros on a rate table (regression).

    Every device is drawn from a population and runs ``n_runs`` times, each time from power-on, at
    another ambient temperature, while the table steps through rates of both signs. The gyro heats
    itself, and its thermometer lags behind the coil: at one indicated temperature, the error
    depends on the time since power-on too. Beside the error, which a compensation has to learn,
    every part of it is given, so that a compensation can be judged effect by effect. A compensator
    at work in a gyro has the columns time, temperature and output, and no others.

    The split matters. Neighbouring rows are nearly equal: a random split of rows tests on what was
    trained on. Hold out whole runs (``run`` as the groups) or devices (``device``). With few rate
    levels, which every run then meets, hold out levels too: a flexible model learns the list of
    levels by heart, and an indicated rate tells which one it is.

    Parameters
    ----------
    n_devices : int, default=3
        Number of gyros, at least 1.
    n_runs : int, default=8
        Number of runs per device, at least 1. The ambient range is cut into as many equal parts,
        and each device has one run in each part.
    duration : float, default=3600
        Length of each run [s], at least ``sampling_interval``.
    sampling_interval : float, default=10
        Time between rows [s], positive; a row is the mean over the interval that follows its time.
    max_rate : float, default=100
        Largest rate of the table [deg/s], positive and below the rate at which the Sagnac phase
        of some device of the population could reach pi/2 (some 340 deg/s by default). Beyond a
        phase of 1.2 rad (271 deg/s nominally) inverting the sine is possible but magnifies noise.
    n_rate_levels : int, default=401
        Number of equally spaced rates from ``-max_rate`` to ``max_rate``, at least 2; an odd number
        includes rest. They are visited in random order, each once before any comes again.
    dwell_time : float, default=120
        Time at each rate [s], at least ``sampling_interval``, rounded to a multiple of it.
    ambient_range : tuple of two floats, default=(-20, 50)
        Lowest and highest ambient temperature over the runs [degC], within -60 and 100; constant
        within a run.
    max_residual_heat : float, default=0.5
        In [0, 1]. A run starts with a part of the self-heating, uniform between 0 (cold start) and
        this, still in the coil: a warm start after a short break.
    noise : float, default=1.0
        Factor on the random errors, angle random walk and bias instability, not negative.
    device_spread : float, default=1.0
        Factor in [0, 1] on the tolerances of the population; 0 makes all devices nominal.
    coefficients : dict of str to float, default=None
        Nominal values in place of those in the table below. Zero turns an effect off.
    random_state : int, RandomState instance or None, default=None
        Seed; an int makes the result reproducible. Changing ``noise``, ``coefficients`` or
        ``device_spread`` leaves all that is drawn as it was, up to its size.

    Returns
    -------
    data : DataFrame of shape (n_devices * n_runs * n_samples, 16)
        One row per sample, n_samples = duration / sampling_interval rounded down; runs one after
        another, in time's order. First the measurement:

        * time: since power-on [s], from 0
        * temperature: indicated by the gyro's thermometer [degC]
        * rate: true rate about the input axis, the earth's rate included [deg/s]
        * output: indicated rate without compensation [deg/s], that is the raw signal divided by the
          nominal small-signal scale factor
        * error: output - rate [deg/s], the target of a compensation
        * run: number of the run, unique over all devices
        * device: number of the device

        then the parts of the error [deg/s], whose sum it is but for rounding:

        * nonlinearity: sin(K0 rate) / K0 - rate, the arcsine law at the reference temperature
        * scale_factor: deviation of the device from the nominal scale factor
        * scale_factor_temperature: what the coil's temperature changes in the indicated rate
        * bias: fixed bias of the device, and of the run
        * bias_temperature: bias by the coil's temperature
        * warm_up: bias that dies away after power-on
        * thermal_rate: bias by the coil's rate of temperature change (Shupe effect)
        * bias_instability: slow random bias
        * angle_random_walk: white noise

    Raises
    ------
    TypeError, ValueError
        If a parameter is of the wrong type or out of its range.

    Notes
    -----
    The indicated rate is

    .. math::

        y = S \, a(T) \, \frac{\sin\left[K(T) \, (\Omega + b)\right]}{K_0} + n

    with the coil's temperature :math:`T`, S = 1 + scale_factor, and the bias :math:`b` a sum of
    five; each part's share of the error is the part of b times [y(b) - y(0)] / b.
    The coil follows :math:`\tau_{th} \, \dot T = T_{ambient} + \Delta T_{self} - T`, and the
    thermometer the coil with a lag :math:`\tau_s \, \dot T_s = T - T_s`, both starting equal.
    Temperature coefficients count from 25 degC.

    Coefficients of the population: nominal value, and tolerance, the half width of a uniform
    distribution. The Sagnac factor and the sum of its and the amplitude's temperature coefficients
    (-410 ppm/degC) are like those of a small gyro measured on a rate table; the rest are typical of
    tactical-grade gyros, and no measurement of one device.

    ========================== ======= =========== ==================== ==============
    Name                       Nominal Tolerance   Unit                 Part of
    ========================== ======= =========== ==================== ==============
    sagnac_factor              0.2536  2 %         rad/(rad/s)          K0
    sagnac_temperature         -370    10 %        ppm/degC             K(T)
    amplitude_temperature      -40     50 %        ppm/degC             a(T)
    amplitude_curvature        -0.5    50 %        ppm/degC^2           a(T)
    scale_factor               0       500 ppm     ppm                  S
    bias                       0       10 deg/h    deg/h                b
    bias_repeatability         1       none        deg/h, std of runs   b
    bias_temperature           0.5     50 %        deg/h/degC           b
    bias_temperature_curvature 0.01    50 %        deg/h/degC^2         b
    warm_up                    30      50 %        deg/h                b
    warm_up_time               180     20 %        s                    b
    self_heating               15      20 %        degC                 T
    thermal_time               1200    20 %        s                    T
    thermometer_lag            180     20 %        s                    T_s
    thermal_rate               5       50 %        deg/h/(degC/min)     b
    angle_random_walk          0.05    20 %        deg/sqrt(h)          n
    bias_instability           0.5     20 %        deg/h                b
    correlation_time           300     20 %        s                    b
    ========================== ======= =========== ==================== ==============

    References
    ----------
    IEEE Std 952-1997, "Specification Format Guide and Test Procedure for Single-Axis
    Interferometric Fiber Optic Gyros".

    D. M. Shupe, "Thermally induced nonreciprocity in the fiber-optic interferometer", Applied
    Optics 19, 1980, 654-655.

    H. C. Lefevre, "The Fiber-Optic Gyroscope", Artech House.

    Examples
    --------
    >>> from skanfis.datasets import make_ofog
    >>> data = make_ofog(n_devices=2, n_runs=3, random_state=0)
    >>> data.shape
    (2160, 16)
    >>> parts = data.loc[:, "nonlinearity":]
    >>> bool((parts.sum(axis=1) - data["error"]).abs().max() < 1e-12)
    True
    """
    nominal = nominal_device(coefficients)
    n_devices = check_count(n_devices, "n_devices", min_val=1)
    n_runs = check_count(n_runs, "n_runs", min_val=1)
    ambient_range = _check_ambient_range(ambient_range)
    max_residual_heat = check_real(max_residual_heat, "max_residual_heat", min_val=0, max_val=1)
    noise = check_real(noise, "noise", min_val=0)
    device_spread = check_real(device_spread, "device_spread", min_val=0, max_val=1)
    sampling_interval = check_real(
        sampling_interval, "sampling_interval", min_val=0, include_boundaries="neither"
    )
    time = _sample_times(duration, sampling_interval)
    dwell_samples = _dwell_samples(dwell_time, sampling_interval)
    levels = _rate_levels(max_rate, n_rate_levels)
    check_phase(nominal, device_spread, levels[-1], ambient_range)

    random_state = check_random_state(random_state)
    devices = draw_devices(nominal, n_devices, device_spread, random_state)
    runs = draw_runs(devices, n_runs, ambient_range, max_residual_heat, random_state)
    simulated = []
    for number, run in enumerate(runs):
        rate = draw_rate(time.size, dwell_samples, levels, random_state)
        normals = noise * random_state.standard_normal((2, time.size))
        columns = simulate_run(run, time, rate, normals, sampling_interval)
        simulated.append(_label(columns, number, run.device_id))
    names = simulated[0]
    return pd.DataFrame({name: np.concatenate([run[name] for run in simulated]) for name in names})


def _check_ambient_range(ambient_range):
    try:
        low, high = ambient_range
    except (TypeError, ValueError) as error:
        message = f"ambient_range must be two temperatures; got {ambient_range!r}."
        raise ValueError(message) from error
    low = check_real(low, "ambient_range[0]", min_val=_COLDEST, max_val=_HOTTEST)
    high = check_real(high, "ambient_range[1]", min_val=low, max_val=_HOTTEST)
    return low, high


def _sample_times(duration, sampling_interval):
    duration = check_real(duration, "duration", min_val=sampling_interval)
    # 0.3 / 0.1 is 2.9999999999999996, and three samples are meant.
    return sampling_interval * np.arange(int(duration / sampling_interval * (1.0 + 1e-12)))


def _dwell_samples(dwell_time, sampling_interval):
    dwell_time = check_real(dwell_time, "dwell_time", min_val=sampling_interval)
    return round(dwell_time / sampling_interval)


def _rate_levels(max_rate, n_rate_levels):
    max_rate = check_real(max_rate, "max_rate", min_val=0, include_boundaries="neither")
    return np.linspace(-max_rate, max_rate, check_count(n_rate_levels, "n_rate_levels", min_val=2))


def _label(columns, number, device_id):
    """The columns of a run with its and its device's number after the measurement."""
    names = list(columns)
    n_samples = columns["time"].size
    labelled = {name: columns[name] for name in names[:5]}
    labelled["run"] = np.full(n_samples, number)
    labelled["device"] = np.full(n_samples, device_id)
    return labelled | {name: columns[name] for name in names[5:]}
