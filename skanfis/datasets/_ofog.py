"""Simulated data: thermal runs of open-loop fiber-optic gyros on a rate table, from a seed."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Integral, Real
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.utils import check_random_state

from .._sklearn import Interval, StrOptions, validate_parameter_constraints
from ._ofog_physics import REFERENCE_TEMPERATURE, Schedule, simulate_power_up, temperatures

_ANY = Interval(Real, None, None, closed="neither")
_NOT_NEGATIVE = Interval(Real, 0, None, closed="left")
_POSITIVE = Interval(Real, 0, None, closed="neither")
_AT_LEAST_ONE = Interval(Integral, 1, None, closed="left")


def _within(limit):
    return Interval(Real, -limit, limit, closed="both")


# Nominal value, relative tolerance, absolute tolerance, and allowed values, which keep amplitude
# and Sagnac factor positive at every temperature. Units: docs/gyro_simulator.
_POPULATION = {
    "amplitude": (6.29e6, 0.0, 0.0, _POSITIVE),
    "sagnac_factor": (0.2536, 0.02, 0.0, _POSITIVE),
    "sagnac_temperature": (-370.0, 0.1, 0.0, _within(2e3)),
    "amplitude_temperature": (-40.0, 0.5, 0.0, _within(2e3)),
    "amplitude_curvature": (-0.5, 0.5, 0.0, _within(10.0)),
    "scale_factor": (0.0, 0.0, 500.0, _within(1e5)),
    "bias": (0.0, 0.0, 10.0, _ANY),
    "bias_repeatability": (1.0, 0.0, 0.0, _NOT_NEGATIVE),
    "bias_temperature": (0.5, 0.5, 0.0, _ANY),
    "bias_temperature_curvature": (0.01, 0.5, 0.0, _ANY),
    "warm_up": (30.0, 0.5, 0.0, _ANY),
    "warm_up_scale_factor": (200.0, 0.5, 0.0, _within(1e5)),
    "warm_up_time": (180.0, 0.2, 0.0, _POSITIVE),
    "self_heating": (15.0, 0.2, 0.0, Interval(Real, 0, 50, closed="both")),
    "thermal_time": (1200.0, 0.2, 0.0, _POSITIVE),
    "thermometer_lag": (180.0, 0.2, 0.0, _NOT_NEGATIVE),
    "bias_temperature_rate": (5.0, 0.5, 0.0, _ANY),
    "angle_random_walk": (0.05, 0.2, 0.0, _NOT_NEGATIVE),
    "bias_instability": (0.5, 0.2, 0.0, _NOT_NEGATIVE),
    "correlation_time": (300.0, 0.2, 0.0, _POSITIVE),
    "rate_random_walk": (0.3, 0.2, 0.0, _NOT_NEGATIVE),
    "quantisation": (0.5, 0.0, 0.0, _NOT_NEGATIVE),
    "thermometer_noise": (0.0, 0.2, 0.0, _NOT_NEGATIVE),
}
# Coefficients that the parameter ``noise`` multiplies.
_RANDOM = [
    "bias_repeatability", "angle_random_walk", "bias_instability", "rate_random_walk",
    "quantisation", "thermometer_noise",
]  # fmt: skip
_CONSTRAINTS = {
    "profile": [StrOptions({"constant", "soaks", "ramps"})],
    **dict.fromkeys(["n_devices", "n_runs", "n_power_ups"], (_AT_LEAST_ONE,)),
    **dict.fromkeys(["off_time", "noise"], (_NOT_NEGATIVE,)),
    **dict.fromkeys(["duration", "sampling_interval", "dwell_time"], (_POSITIVE,)),
    "max_rate": [_POSITIVE, None],
    **dict.fromkeys(["max_residual_heat", "device_spread"], (Interval(Real, 0, 1, closed="both"),)),
    "coefficients": [Mapping, None],
}
# Beyond these, neither the polynomials in temperature nor chambers for gyros are meant to work.
_COLDEST, _HOTTEST = -60.0, 100.0  # degC


def make_ofog(
    *,
    profile: str = "constant",
    n_devices: int = 3,
    n_runs: int = 8,
    n_power_ups: int = 1,
    off_time: float = 600.0,
    duration: float = 3600.0,
    sampling_interval: float = 10.0,
    max_rate: float | None = None,
    rates: ArrayLike | None = None,
    dwell_time: float = 120.0,
    ambient_range: Any = (-20.0, 50.0),
    max_residual_heat: float = 0.5,
    noise: float = 1.0,
    device_spread: float = 1.0,
    coefficients: dict[str, Any] | None = None,
    random_state: int | np.random.RandomState | None = None,
) -> Any:
    """Simulate thermal runs of open-loop fiber-optic gyros on a rate table (regression).

    Every device is drawn from a population and goes through ``n_runs`` thermal runs, while the
    table steps through rates of both signs. A compensator on board knows only the columns time,
    temperature and output (or counts). Hold out whole runs (``run``) or devices (``device``), never
    single rows, because neighbours are nearly equal. Formulas are in :doc:`/gyro_simulator`.

    Parameters
    ----------
    profile : {"constant", "soaks", "ramps"}, default="constant"
        Chamber during a run: one temperature, five of them up and down, or a ramp up and down,
        which takes ``duration``.
    n_devices, n_runs : int, default=3, 8
        Number of gyros, and of runs of each. Runs start in equal parts of the ambient range.
    n_power_ups, off_time : int, float, default=1, 600.0
        Power-ups in each run, and the time without power between two of them [s].
    duration, sampling_interval : float, default=3600.0, 10.0
        Length of each power-up, and time between rows [s]; a row is the mean over the interval.
    max_rate : float, default=None
        Largest rate of the table [deg/s], 100 by default. The Sagnac phase of every device must be
        below pi/2 at this rate. Every dwell has a different rate.
    rates : array-like of shape (n_rates,), default=None
        The rates of the table [deg/s], which all runs share, in place of ``max_rate``; ``[0]`` is a
        gyro at rest.
    dwell_time : float, default=120.0
        Time at each rate [s], rounded to ``sampling_interval``.
    ambient_range : tuple of two floats, default=(-20.0, 50.0)
        Temperatures of the chamber [degC], within -60 and 100.
    max_residual_heat : float, default=0.5
        A run starts with a fraction of the self-heating in the coil, up to this; 0: cold starts.
    noise, device_spread : float, default=1.0
        Factor on all random effects within a device; factor, in [0, 1], on the tolerances of the
        population.
    coefficients : dict of str to float, default=None
        Nominal values by their names in :doc:`/gyro_simulator`. Zero turns an effect off.
    random_state : int, RandomState instance or None, default=None
        Seed. Another ``noise``, ``device_spread`` or ``coefficients`` only scales the same draws.

    Returns
    -------
    data : DataFrame of shape (n_devices * n_runs * n_power_ups * n_samples, 26)
        Runs in turn: time since power-on [s]; temperature of the gyro's thermometer [degC] and its
        rate without noise [degC/s]; ambient [degC]; true rate [deg/s]; counts; output, the
        indicated rate; error, output - rate; noise, which no compensation can foresee, at the
        input; run, power_up and device; then the parts of the error [deg/s], which sum to it.

    Examples
    --------
    >>> from skanfis.datasets import make_ofog
    >>> data = make_ofog(n_devices=1, n_runs=12, max_residual_heat=0, random_state=0)
    >>> data.shape
    (4320, 26)
    >>> parts = data.loc[:, "nonlinearity":]
    >>> bool((parts.sum(axis=1) - data["error"]).abs().max() < 1e-12)
    True
    """
    given = locals()
    validate_parameter_constraints(_CONSTRAINTS, given, "make_ofog")
    for name in ("duration", "dwell_time"):
        if given[name] < sampling_interval:
            raise ValueError(
                f"{name}={given[name]} must be at least the sampling_interval, "
                f"{sampling_interval} s."
            )
    nominal = _nominal_device(coefficients)
    schedule = Schedule(
        # 0.3 / 0.1 is 2.9999999999999996, and three samples are meant.
        n_samples=int(duration / sampling_interval * (1.0 + 1e-12)),
        sampling_interval=sampling_interval,
        n_power_ups=n_power_ups,
        n_off=round(off_time / sampling_interval),
        profile=profile,
        ambient_range=_ambient_range(ambient_range),
    )
    largest, levels = _table_rates(max_rate, rates)
    _check_phase(nominal, device_spread, schedule.ambient_range, largest)
    generator: np.random.RandomState = check_random_state(random_state)
    devices = _draw_devices(nominal, n_devices, device_spread, noise, generator)
    # All runs are drawn before the first row, so that their starts do not depend on the rows.
    runs = list(_draw_runs(devices, n_runs, schedule, max_residual_heat, generator))
    n_held = round(dwell_time / sampling_interval)
    n_dwells = -(-schedule.n_samples // n_held)
    power_ups: list[pd.DataFrame] = []
    for run, (device, start, biases) in enumerate(runs):
        thermal_history = temperatures(devices[device], schedule, *start)
        for thermal, bias in zip(thermal_history, biases, strict=True):
            dwells = _draw_rates(n_dwells, largest, levels, generator)
            rate = np.repeat(dwells, n_held)[: schedule.n_samples]
            normals = generator.standard_normal((4, rate.size))
            measurement, parts = simulate_power_up(
                devices[device], bias, rate, thermal, normals, sampling_interval
            )
            labels = {"run": run, "power_up": len(power_ups), "device": device}
            power_ups.append(pd.DataFrame(measurement | labels | parts))
    data = pd.concat(power_ups, ignore_index=True)
    data["counts"] = nominal["amplitude"] * np.deg2rad(nominal["sagnac_factor"]) * data["output"]
    return data


def _nominal_device(coefficients):
    given = {} if coefficients is None else dict(coefficients)
    unknown = [name for name in given if name not in _POPULATION]
    if unknown:
        raise ValueError(
            f"coefficients has unknown names {unknown}; known are {list(_POPULATION)}."
        )
    constraints = {name: [entry[-1]] for name, entry in _POPULATION.items()}
    validate_parameter_constraints(constraints, given, "make_ofog's coefficients")
    nominal = {name: entry[0] for name, entry in _POPULATION.items()}
    return nominal | {name: float(value) for name, value in given.items()}


def _table_rates(max_rate, rates):
    """Largest rate of the table, and its levels; None if every dwell has its own rate."""
    if rates is None:
        return (100.0 if max_rate is None else max_rate), None
    if max_rate is not None:
        raise ValueError("rates is given together with max_rate; it takes its place.")
    found = np.asarray(rates, dtype=float)
    if found.ndim != 1 or not found.size or not np.isfinite(found).all():
        raise ValueError(f"rates must be a list of finite rates in deg/s; got {rates!r}.")
    return float(np.abs(found).max()), np.unique(found)


def _ambient_range(given):
    is_pair = np.shape(given) == (2,) and all(isinstance(end, Real) for end in given)
    if not is_pair or not _COLDEST <= given[0] <= given[1] <= _HOTTEST:
        raise ValueError(
            f"ambient_range={given!r} must be two temperatures that do not fall, from {_COLDEST:g} "
            f"or more to {_HOTTEST:g} degC or less."
        )
    return tuple(map(float, given))


def _tolerances(nominal):
    """Half widths of the coefficients' distributions, in their units."""
    return {
        name: relative * abs(nominal[name]) + absolute
        for name, (_, relative, absolute, _) in _POPULATION.items()
    }


def _check_phase(nominal, spread, ambient_range, largest):
    """Refuse rates with a Sagnac phase of pi / 2: beyond it, two rates give one output."""
    tolerances = _tolerances(nominal)
    factor, by_temperature, self_heating = (
        abs(nominal[name]) + spread * tolerances[name]
        for name in ("sagnac_factor", "sagnac_temperature", "self_heating")
    )
    cold, warm = (end - REFERENCE_TEMPERATURE for end in ambient_range)
    difference = max(-cold, warm + self_heating)
    limit = 90.0 / (factor * (1.0 + 1e-6 * by_temperature * difference))
    if largest >= limit:
        raise ValueError(
            f"The largest rate is {largest} and must be < {limit:.4g} deg/s: from there on the "
            "Sagnac phase reaches pi / 2 in some device of this population, and the arcsine is not "
            "defined."
        )


def _draw_devices(nominal, n_devices, spread, noise, random_state):
    tolerances = np.array(list(_tolerances(nominal).values()))
    draws = random_state.uniform(-spread, spread, size=(n_devices, tolerances.size))
    offsets = draws * tolerances
    devices = pd.DataFrame(offsets + np.array(list(nominal.values())), columns=list(nominal))
    devices[_RANDOM] *= noise
    return [SimpleNamespace(**device) for device in devices.to_dict("records")]


def _draw_runs(devices, n_runs, schedule, max_residual_heat, random_state):
    """Device, start (ambient, rising, residual heat) and bias of each power-up, for every run.

    The ambient range is cut into as many equal parts as there are runs, with one run in each.
    Otherwise a device with few runs could miss half of the range.
    """
    low, high = schedule.ambient_range
    for number, device in enumerate(devices):
        parts = random_state.permutation(n_runs) + random_state.uniform(size=n_runs)
        ambients = low + (high - low) * parts / n_runs
        rising = random_state.randint(2, size=n_runs)
        heats = random_state.uniform(0.0, max_residual_heat, size=n_runs)
        normals = random_state.standard_normal((n_runs, schedule.n_power_ups))
        starts = zip(ambients, rising, heats, strict=True)
        for start, each in zip(starts, normals, strict=True):
            yield number, start, device.bias_repeatability * each


def _draw_rates(n_dwells, largest, levels, random_state):
    """True rate of each dwell of a power-up; all levels occur once before any occurs again.

    Without levels, the range is cut into as many equal parts as dwells, with one rate in each.
    """
    if levels is None:
        parts = np.arange(n_dwells) + random_state.uniform(size=n_dwells)
        return random_state.permutation(largest * (2.0 * parts / n_dwells - 1.0))
    n_passes = -(-n_dwells // levels.size)
    passes = [random_state.permutation(levels) for _ in range(n_passes)]
    return np.concatenate(passes)[:n_dwells]
