"""The thermal chamber, and the temperatures of a gyro in it from power-up to power-up."""

from dataclasses import dataclass

import numpy as np

from ._ofog_physics import coil_temperature_rate, first_order_lag

__all__ = ["PROFILES", "Schedule", "ambient_temperature", "thermal_history"]

PROFILES = ("constant", "soaks", "ramps")


@dataclass(frozen=True)
class Schedule:
    """What all runs have in common: their clock, and the chamber's program."""

    n_samples: int  # of one power-up
    sampling_interval: float  # s
    n_power_ups: int
    n_off: int  # samples between two power-ups, without power
    profile: str
    ambient_range: tuple[float, float]  # degC
    n_soaks: int

    @property
    def time(self):
        """Time since power-on [s]."""
        return self.sampling_interval * np.arange(self.n_samples)

    @property
    def period(self):
        """Of the chamber's way up and down [s]: one power-up sees all of it."""
        return self.sampling_interval * self.n_samples


def ambient_temperature(schedule, clock, start, rising):
    """Temperature of the chamber [degC] at times of the run's clock [s].

    "ramps" is a triangle over the range, which begins at ``start`` and goes up first where
    ``rising``; "soaks" is the same, rounded to the nearest of ``n_soaks`` temperatures.
    """
    if schedule.profile == "constant":
        return np.full(clock.shape, start)
    low, high = schedule.ambient_range
    span = high - low
    place = (start - low) / span if span > 0 else 0.0
    phase = 0.5 * place if rising else 1.0 - 0.5 * place
    triangle = 1.0 - np.abs(2.0 * ((phase + clock / schedule.period) % 1.0) - 1.0)
    if schedule.profile == "soaks":
        n_steps = schedule.n_soaks - 1
        triangle = np.rint(n_steps * triangle) / n_steps
    return low + span * triangle


def thermal_history(run, schedule):
    """Yield the temperatures of one power-up after another.

    Yields
    ------
    ambient, coil, coil_rate, thermometer, thermometer_rate : ndarray of shape (n_samples,)
        Temperatures [degC] and their derivatives [degC/s].
    """
    device, n_on, n_off = run.device, schedule.n_samples, schedule.n_off
    coil_start = ambient_temperature(schedule, np.zeros(1), run.ambient, run.rising)[0]
    coil_start += run.residual_heat * device.self_heating
    thermometer_start = coil_start
    for power_up in range(schedule.n_power_ups):
        # One sample more than is read: the state when the power changes.
        first = power_up * (n_on + n_off)
        on = _stretch(run, schedule, first, n_on + 1)
        coil, thermometer = _follow(run, schedule, on, coil_start, thermometer_start, powered=True)
        equilibrium = on + device.self_heating
        coil_rate = coil_temperature_rate(equilibrium, coil, device.thermal_time)
        thermometer_rate = coil_rate
        if device.thermometer_lag:
            thermometer_rate = coil_temperature_rate(coil, thermometer, device.thermometer_lag)
        histories = (on, coil, coil_rate, thermometer, thermometer_rate)
        yield tuple(each[:-1] for each in histories)
        off = _stretch(run, schedule, first + n_on, n_off + 1)
        coil, thermometer = _follow(run, schedule, off, coil[-1], thermometer[-1], powered=False)
        coil_start, thermometer_start = coil[-1], thermometer[-1]


def _stretch(run, schedule, first, n_samples):
    """Ambient temperature at some samples of the run's clock."""
    clock = schedule.sampling_interval * (first + np.arange(n_samples))
    return ambient_temperature(schedule, clock, run.ambient, run.rising)


def _follow(run, schedule, ambient, coil_start, thermometer_start, *, powered):
    """Coil and thermometer while the power is on, or off."""
    device, interval = run.device, schedule.sampling_interval
    equilibrium = ambient + device.self_heating if powered else ambient
    coil = first_order_lag(equilibrium, coil_start, device.thermal_time, interval)
    return coil, first_order_lag(coil, thermometer_start, device.thermometer_lag, interval)
