"""A seeded simulator of thermal runs of open-loop fiber-optic gyros on a rate table."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.utils import check_random_state

from ._ofog_chamber import thermal_history
from ._ofog_conditions import given_conditions, rate_table_of, schedule_of
from ._ofog_population import check_phase, draw_devices, draw_runs, nominal_device, with_noise
from ._ofog_presets import PRESETS
from ._ofog_run import simulate_power_up
from ._validation import check_choice, check_count, check_real

__all__ = ["make_ofog"]


def make_ofog(
    *,
    preset: str = "open_loop",
    profile: str = "constant",
    n_devices: int = 3,
    n_runs: int = 8,
    n_power_ups: int = 1,
    off_time: float = 600.0,
    duration: float | None = None,
    sampling_interval: float | None = None,
    max_rate: float | None = None,
    n_rate_levels: int | None = None,
    rates: ArrayLike | None = None,
    rate_order: str = "random",
    dwell_time: float | None = None,
    ambient_range: Any = None,
    n_soaks: int = 5,
    max_residual_heat: float = 0.5,
    noise: float = 1.0,
    device_spread: float = 1.0,
    coefficients: dict[str, Any] | None = None,
    random_state: int | np.random.RandomState | None = None,
) -> Any:
    r"""Simulate thermal runs of open-loop fiber-optic gyros on a rate table (regression).

    Every device is drawn from a population and goes through ``n_runs`` thermal runs, while the
    table steps through rates of both signs. The gyro heats itself, and its thermometer lags behind
    the coil: at one indicated temperature, the error depends on the time since power-on and on the
    rate of the temperature too. Beside the error, which a compensation has to learn, every part of
    it is given, so that a compensation can be judged effect by effect. A compensator at work in a
    gyro has the columns time, temperature and output (or counts), and no others.

    The split matters. Neighbouring rows are nearly equal: a random split of rows tests on what was
    trained on. Hold out whole runs (``run`` as the groups) or devices (``device``). With the rate
    levels of a table (``n_rate_levels``), which every run then meets, hold out levels too: a
    flexible model memorises the list of levels, and an indicated rate tells which one it is.

    Parameters
    ----------
    preset : {"open_loop", "linearised", "paper"}, default="open_loop"
        Where to start from: the nominal gyro and the conditions of the test.

        * "open_loop": after a small gyro measured on a rate table, counts = A sin(K rate) with
          A = 6.29e6 and K = 0.2536 rad/(rad/s), its scale factor changing by -410 ppm/degC
        * "linearised": the same with what an internal linearisation leaves of the sine, 1000 ppm
          RMS of full scale up to 375 deg/s, and of the scale factor's temperature, -50 ppm/degC
        * "paper": the conditions of the founding paper's Table 1 (see :func:`load_ofog`): 19 rows,
          one each 20 s, at 38.69 deg/s and some 20.5 to 21.3 degC; here as many runs as asked for
    profile : {"constant", "soaks", "ramps"}, default="constant"
        Temperature of the chamber during a run.

        * "constant": another one for each run: power-ups at different temperatures
        * "soaks": ``n_soaks`` temperatures in turn, up and down the ambient range
        * "ramps": up and down the ambient range at constant speed

        The way up and down takes ``duration``. Each run begins somewhere else on it.
    n_devices : int, default=3
        Number of gyros, at least 1.
    n_runs : int, default=8
        Number of runs per device, at least 1. The ambient range is cut into as many equal parts,
        and in each part one run of each device begins.
    n_power_ups : int, default=1
        Number of power-ups in each run, at least 1, ``off_time`` apart: the later ones begin as
        warm as the earlier ones left the gyro.
    off_time : float, default=600
        Time without power between two power-ups of a run [s], not negative, rounded to a multiple
        of ``sampling_interval``.
    duration : float, default=None
        Length of each power-up [s], at least ``sampling_interval``. Default: 3600; "paper" 380.
    sampling_interval : float, default=None
        Time between rows [s], positive; a row is the mean over the interval that follows its time.
        Default: 10; "paper" 20.
    max_rate : float, default=None
        Largest rate of the table [deg/s], positive and below the rate at which the Sagnac phase
        of some device of the population could reach pi/2 (some 340 deg/s for "open_loop"). Beyond
        a phase of 1.2 rad (271 deg/s nominally) inverting the sine is possible but magnifies
        noise. Default: 100; "linearised" 375.
    n_rate_levels : int, default=None
        Number of equally spaced rates from ``-max_rate`` to ``max_rate``, at least 2; an odd number
        includes rest. Default: every dwell has a rate of its own, one in each of as many equal
        parts of the range as a power-up has dwells, so that no two runs share a level.
    rates : array-like of shape (n_rates,), default=None
        The rates of the table themselves [deg/s], in place of ``max_rate`` and ``n_rate_levels``;
        ``rates=[0]`` is a gyro at rest. "paper": 38.69.
    rate_order : {"random", "sweep"}, default="random"
        Order of the rates: at random, each once before any comes again; or up from the lowest to
        the highest and down again.
    dwell_time : float, default=None
        Time at each rate [s], at least ``sampling_interval``, rounded to a multiple of it.
        Default: 120.
    ambient_range : tuple of two floats, default=None
        Lowest and highest temperature of the chamber [degC], within -60 and 100. Default: -20 and
        50; "paper" 20.4 and 20.8.
    n_soaks : int, default=5
        Number of temperatures of the profile "soaks", at least 2.
    max_residual_heat : float, default=0.5
        In [0, 1]. A run starts with a part of the self-heating, uniform between 0 and this, still
        in the coil: a warm start after a short break. 0: cold starts only.
    noise : float, default=1.0
        Factor on all that is random within a device, not negative: bias repeatability, bias
        instability, rate and angle random walk, quantisation, noise of the thermometer.
    device_spread : float, default=1.0
        Factor in [0, 1] on the tolerances of the population; 0 makes all devices nominal.
    coefficients : dict of str to float, default=None
        Nominal values in place of the preset's; names and units in the table below. Zero turns an
        effect off.
    random_state : int, RandomState instance or None, default=None
        Seed; an int makes the result reproducible. Changing ``noise``, ``coefficients`` or
        ``device_spread`` leaves all that is drawn as it was, up to its size.

    Returns
    -------
    data : DataFrame of shape (n_devices * n_runs * n_power_ups * n_samples, 26)
        One row per sample, n_samples = duration / sampling_interval rounded down; runs one after
        another, in time's order. First the measurement:

        * time: since power-on [s], from 0
        * temperature: indicated by the gyro's thermometer [degC]
        * temperature_rate: derivative of what the thermometer indicates [degC/s], without noise
        * ambient: temperature of the chamber [degC]
        * rate: true rate about the input axis, the earth's rate included [deg/s]
        * counts: raw output [counts]
        * output: indicated rate without compensation [deg/s], that is the raw output divided by the
          nominal small-signal scale factor
        * error: output - rate [deg/s], the target of a compensation
        * noise: what no compensation can foresee [deg/s], referred to the input: the random biases,
          and the noise of the output times what it stands for at this rate. Its RMS is the noise
          floor of a compensated rate
        * run: number of the run, unique over all devices
        * power_up: number of the power-up, unique over all runs
        * device: number of the device

        then the parts of the error [deg/s], whose sum it is but for rounding:

        * nonlinearity: sin(K0 rate) / K0 - rate, the arcsine law at the reference temperature
        * scale_factor: deviation of the device from the nominal scale factor
        * wavelength: what the coil's temperature changes by way of the wavelength, K(T)
        * amplitude: what it changes by way of the amplitude, a(T)
        * warm_up_scale_factor: scale factor that dies away after power-on
        * bias: fixed bias of the device
        * bias_temperature: bias by the coil's temperature
        * warm_up: bias that dies away after power-on
        * bias_temperature_rate: bias by the coil's rate of temperature change (Shupe effect)
        * bias_repeatability: bias of the power-up
        * bias_instability: slow random bias
        * rate_random_walk: bias that walks away from power-on
        * angle_random_walk: white noise
        * quantisation: of the angle that is counted

    Raises
    ------
    TypeError, ValueError
        If a parameter is of the wrong type or out of its range, or ``rates`` is given together with
        ``max_rate`` or ``n_rate_levels``.

    See Also
    --------
    load_ofog : The founding paper's Table 1, as printed.

    Notes
    -----
    The indicated rate is

    .. math::

        y = S \, w(t) \, a(T) \, \frac{\sin\left[K(T) \, (\Omega + b)\right]}{K_0} + n

    with the coil's temperature :math:`T`, S = 1 + scale_factor, its warm-up w, and the bias
    :math:`b` a sum of seven; each part's share of the error is the part of b times
    [y(b) - y(0)] / b. Temperature coefficients count from 25 degC. Counts are
    :math:`A K_0 y` with the amplitude A and the Sagnac factor of the nominal gyro, y in rad/s.

    The coil follows :math:`\tau_{th} \, \dot T = T_{ambient} + \Delta T_{self} - T`, and the
    thermometer the coil with a lag :math:`\tau_s \, \dot T_s = T - T_s`, both starting equal;
    without power there is no self-heating. From :math:`T_s` and its rate, the coil's temperature
    :math:`T = T_s + \tau_s \, \dot T_s` is known.

    The random errors have the Allan deviations of IEEE 952 over the averaging time :math:`\tau`:
    :math:`N / \sqrt{\tau}` (angle random walk), a maximum of 0.664 B (bias instability, a
    first-order Gauss-Markov process), :math:`K \sqrt{\tau / 3}` (rate random walk) and
    :math:`\sqrt{3} Q / \tau` (quantisation).

    Coefficients of the population "open_loop": nominal value, and tolerance, the half width of a
    uniform distribution. Amplitude, Sagnac factor and the sum of its and the amplitude's
    temperature coefficients (-410 ppm/degC) are like those of a small gyro measured on a rate
    table; the rest are typical of tactical-grade gyros, and no measurement of one device.

    ========================== ======= =========== ==================== ==============
    Name                       Nominal Tolerance   Unit                 Part of
    ========================== ======= =========== ==================== ==============
    amplitude                  6.29e6  none        counts               A
    sagnac_factor              0.2536  2 %         rad/(rad/s)          K0
    sagnac_temperature         -370    10 %        ppm/degC             K(T)
    amplitude_temperature      -40     50 %        ppm/degC             a(T)
    amplitude_curvature        -0.5    50 %        ppm/degC^2           a(T)
    scale_factor               0       500 ppm     ppm                  S
    bias                       0       10 deg/h    deg/h                b
    bias_repeatability         1       none        deg/h, std           b
    bias_temperature           0.5     50 %        deg/h/degC           b
    bias_temperature_curvature 0.01    50 %        deg/h/degC^2         b
    warm_up                    30      50 %        deg/h                b
    warm_up_scale_factor       200     50 %        ppm                  w
    warm_up_time               180     20 %        s                    b, w
    self_heating               15      20 %        degC                 T
    thermal_time               1200    20 %        s                    T
    thermometer_lag            180     20 %        s                    T_s
    bias_temperature_rate      5       50 %        deg/h/(degC/min)     b
    angle_random_walk          0.05    20 %        deg/sqrt(h)          n
    bias_instability           0.5     20 %        deg/h                b
    correlation_time           300     20 %        s                    b
    rate_random_walk           0.3     20 %        deg/h/sqrt(h)        b
    quantisation               0.5     none        arcsec               n
    thermometer_noise          0       20 %        degC, std            T_s
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
    Cold starts at twelve temperatures, of one gyro:

    >>> from skanfis.datasets import make_ofog
    >>> data = make_ofog(n_devices=1, n_runs=12, max_residual_heat=0, random_state=0)
    >>> data.shape
    (4320, 26)
    >>> parts = data.loc[:, "nonlinearity":]
    >>> bool((parts.sum(axis=1) - data["error"]).abs().max() < 1e-12)
    True

    Three power-ups at each of four temperatures; a day of slow ramps; an hour at rest:

    >>> power_ups = make_ofog(n_runs=4, n_power_ups=3, off_time=900, random_state=0)
    >>> day = make_ofog(profile="ramps", duration=86_400, sampling_interval=60, random_state=0)
    >>> at_rest = make_ofog(rates=[0], sampling_interval=0.1, n_runs=1, random_state=0)
    """
    check_choice(preset, "preset", tuple(PRESETS))
    nominal = nominal_device(coefficients, PRESETS[preset].device)
    n_devices = check_count(n_devices, "n_devices", min_val=1)
    n_runs = check_count(n_runs, "n_runs", min_val=1)
    n_power_ups = check_count(n_power_ups, "n_power_ups", min_val=1)
    max_residual_heat = check_real(max_residual_heat, "max_residual_heat", min_val=0, max_val=1)
    noise = check_real(noise, "noise", min_val=0)
    device_spread = check_real(device_spread, "device_spread", min_val=0, max_val=1)
    conditions = given_conditions(
        PRESETS[preset].conditions,
        duration=duration,
        sampling_interval=sampling_interval,
        max_rate=max_rate,
        n_rate_levels=n_rate_levels,
        rates=rates,
        dwell_time=dwell_time,
        ambient_range=ambient_range,
    )
    schedule = schedule_of(conditions, profile, n_power_ups, off_time, n_soaks)
    table = rate_table_of(conditions, rate_order)
    check_phase(
        nominal,
        device_spread,
        table.largest_rate,
        schedule.ambient_range,
        name="max_rate" if conditions.rates is None else "largest of abs(rates)",
    )

    random_state = check_random_state(random_state)
    drawn = draw_devices(nominal, n_devices, device_spread, random_state)
    devices = [with_noise(device, noise) for device in drawn]
    runs = draw_runs(
        devices, n_runs, n_power_ups, schedule.ambient_range, max_residual_heat, random_state
    )
    power_ups = [
        columns
        for number, run in enumerate(runs)
        for columns in _power_ups(number, run, schedule, table, random_state)
    ]
    # Each piece goes as soon as it is joined, so that the table is in memory once.
    names = list(power_ups[0])
    data = {name: np.concatenate([each.pop(name) for each in power_ups]) for name in names}
    counts_per_rate = nominal.amplitude * np.deg2rad(nominal.sagnac_factor)
    data["counts"] = counts_per_rate * data["output"]
    return pd.DataFrame(data, copy=False)


def _power_ups(number, run, schedule, table, random_state):
    """Yield the columns of each power-up of a run; the counts are still to be filled in."""
    for place, temperatures in enumerate(thermal_history(run, schedule)):
        rate = table.draw(schedule.n_samples, random_state)
        normals = random_state.standard_normal((4, rate.size))
        measurement, parts = simulate_power_up(
            run.device,
            run.biases[place],
            schedule.time,
            rate,
            temperatures,
            normals,
            schedule.sampling_interval,
        )
        power_up = number * schedule.n_power_ups + place
        labels = {"run": number, "power_up": power_up, "device": run.device_id}
        columns = measurement | {name: np.full(rate.size, label) for name, label in labels.items()}
        yield columns | parts
