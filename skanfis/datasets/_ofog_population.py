"""What differs between gyros and between runs: a population of devices, and the plan of a test."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace

import numpy as np

from ._ofog_physics import REFERENCE_TEMPERATURE
from ._validation import check_real

__all__ = [
    "RATE_ORDERS",
    "Device",
    "RateTable",
    "Run",
    "check_phase",
    "draw_devices",
    "draw_runs",
    "nominal_device",
    "with_noise",
]


RATE_ORDERS = ("random", "sweep")


def _coefficient(nominal, *, relative=0.0, absolute=0.0, bounds=(None, None), positive=False):
    """A coefficient, its tolerance over the population, and the values that make sense."""
    metadata = {
        "relative": relative,
        "absolute": absolute,
        "bounds": bounds,
        "include_boundaries": "neither" if positive else "both",
    }
    return field(default=nominal, metadata=metadata)


_NOT_NEGATIVE = {"bounds": (0.0, None)}
_POSITIVE = {"bounds": (0.0, None), "positive": True}


@dataclass(frozen=True)
class Device:
    """Coefficients of one gyro; the defaults are the nominal gyro of the population.

    Tolerances, relative to the nominal value or absolute, are the half width of the uniform
    distribution that :func:`draw_devices` draws from. Units stand beside each coefficient.
    """

    amplitude: float = _coefficient(6.29e6, **_POSITIVE)  # counts
    sagnac_factor: float = _coefficient(0.2536, relative=0.02, **_POSITIVE)  # rad/(rad/s)
    # Bounds: they keep amplitude and Sagnac factor positive at every temperature allowed.
    sagnac_temperature: float = _coefficient(-370.0, relative=0.1, bounds=(-2e3, 2e3))  # ppm/degC
    amplitude_temperature: float = _coefficient(-40.0, relative=0.5, bounds=(-2e3, 2e3))  # ppm/degC
    amplitude_curvature: float = _coefficient(-0.5, relative=0.5, bounds=(-10, 10))  # ppm/degC^2
    scale_factor: float = _coefficient(0.0, absolute=500.0, bounds=(-1e5, 1e5))  # ppm
    bias: float = _coefficient(0.0, absolute=10.0)  # deg/h
    bias_repeatability: float = _coefficient(1.0, **_NOT_NEGATIVE)  # deg/h
    bias_temperature: float = _coefficient(0.5, relative=0.5)  # deg/h/degC
    bias_temperature_curvature: float = _coefficient(0.01, relative=0.5)  # deg/h/degC^2
    warm_up: float = _coefficient(30.0, relative=0.5)  # deg/h
    warm_up_scale_factor: float = _coefficient(200.0, relative=0.5, bounds=(-1e5, 1e5))  # ppm
    warm_up_time: float = _coefficient(180.0, relative=0.2, **_POSITIVE)  # s
    self_heating: float = _coefficient(15.0, relative=0.2, bounds=(0.0, 50.0))  # degC
    thermal_time: float = _coefficient(1200.0, relative=0.2, **_POSITIVE)  # s
    thermometer_lag: float = _coefficient(180.0, relative=0.2, **_NOT_NEGATIVE)  # s
    bias_temperature_rate: float = _coefficient(5.0, relative=0.5)  # deg/h/(degC/min)
    angle_random_walk: float = _coefficient(0.05, relative=0.2, **_NOT_NEGATIVE)  # deg/sqrt(h)
    bias_instability: float = _coefficient(0.5, relative=0.2, **_NOT_NEGATIVE)  # deg/h
    correlation_time: float = _coefficient(300.0, relative=0.2, **_POSITIVE)  # s
    rate_random_walk: float = _coefficient(0.3, relative=0.2, **_NOT_NEGATIVE)  # deg/h/sqrt(h)
    quantisation: float = _coefficient(0.5, **_NOT_NEGATIVE)  # arcsec
    thermometer_noise: float = _coefficient(0.0, relative=0.2, **_NOT_NEGATIVE)  # degC


# What the factor on the noise multiplies.
_RANDOM = (
    "bias_repeatability",
    "angle_random_walk",
    "bias_instability",
    "rate_random_walk",
    "quantisation",
    "thermometer_noise",
)


_NOMINAL = Device()


@dataclass(frozen=True)
class Run:
    """One thermal run: one device in the chamber, powered up once or several times."""

    device: Device
    device_id: int
    ambient: float  # degC, at the start
    rising: bool  # which way the chamber goes first, if its temperature changes
    residual_heat: float  # part of the self-heating still in the coil at the first power-on
    biases: tuple[float, ...]  # deg/h, one per power-up


def nominal_device(coefficients, base=_NOMINAL):
    """The nominal device ``base`` with some coefficients replaced.

    Raises
    ------
    TypeError, ValueError
        If ``coefficients`` is no mapping, or a name or value in it is not allowed.
    """
    if coefficients is None:
        return base
    if not isinstance(coefficients, Mapping):
        kind = type(coefficients).__qualname__
        raise TypeError(f"coefficients must be a dict of names to numbers, not {kind}.")
    known = {entry.name: entry for entry in fields(Device)}
    unknown = [name for name in coefficients if name not in known]
    if unknown:
        raise ValueError(f"coefficients has unknown names {unknown}; known are {list(known)}.")
    checked = {name: _check_coefficient(value, known[name]) for name, value in coefficients.items()}
    return replace(base, **checked)


def _check_coefficient(value, entry):
    low, high = entry.metadata["bounds"]
    boundaries = entry.metadata["include_boundaries"]
    name = f"coefficients[{entry.name!r}]"
    return check_real(value, name, min_val=low, max_val=high, include_boundaries=boundaries)


def draw_devices(nominal, n_devices, spread, random_state):
    """Devices whose coefficients are uniform within ``spread`` times their tolerance."""
    tolerances = [_tolerance(nominal, entry) for entry in fields(Device)]
    draws = random_state.uniform(-spread, spread, size=(n_devices, len(tolerances)))
    return [_with_offsets(nominal, offsets) for offsets in draws * tolerances]


def _tolerance(nominal, entry):
    """Half width of a coefficient's distribution, in the coefficient's unit."""
    value = getattr(nominal, entry.name)
    return entry.metadata["relative"] * abs(value) + entry.metadata["absolute"]


def _with_offsets(nominal, offsets):
    names = [entry.name for entry in fields(Device)]
    moved = {
        name: getattr(nominal, name) + float(d) for name, d in zip(names, offsets, strict=True)
    }
    return replace(nominal, **moved)


def with_noise(device, factor):
    """The device with its random errors multiplied by a factor."""
    return replace(device, **{name: factor * getattr(device, name) for name in _RANDOM})


def draw_runs(devices, n_runs, n_power_ups, ambient_range, max_residual_heat, random_state):
    """Runs of every device, each device's ambient temperatures spread over the whole range.

    The range is cut into ``n_runs`` equal parts, and each holds one run, in random order: with
    independent draws, a device of few runs could miss half of the range.
    """
    low, high = ambient_range
    runs: list[Run] = []
    for device_id, device in enumerate(devices):
        parts = random_state.permutation(n_runs) + random_state.uniform(size=n_runs)
        ambients = low + (high - low) * parts / n_runs
        rising = random_state.randint(2, size=n_runs)
        heats = random_state.uniform(0.0, max_residual_heat, size=n_runs)
        biases = device.bias_repeatability * random_state.standard_normal((n_runs, n_power_ups))
        for ambient, up, heat, each in zip(ambients, rising, heats, biases, strict=True):
            start = (float(ambient), bool(up), float(heat))
            runs.append(Run(device, device_id, *start, tuple(map(float, each))))
    return runs


@dataclass(frozen=True)
class RateTable:
    """How the table turns during a power-up."""

    levels: np.ndarray | None  # deg/s, ascending; None: every dwell has a rate of its own
    largest_rate: float  # deg/s
    dwell_samples: int
    order: str

    def draw(self, n_samples, random_state):
        """True rate of each sample of one power-up [deg/s].

        Each level comes once before any comes again. Without levels there is one rate in each of
        as many equal parts of the range as there are dwells.
        """
        n_dwells = -(-n_samples // self.dwell_samples)
        if self.levels is None:
            rates = _rates_of_their_own(n_dwells, self.largest_rate, self.order, random_state)
        else:
            rates = _rates_by_turns(n_dwells, self.levels, self.order, random_state)
        return np.repeat(rates, self.dwell_samples)[:n_samples]


def _rates_of_their_own(n_dwells, largest_rate, order, random_state):
    parts = np.arange(n_dwells) + random_state.uniform(size=n_dwells)
    rates = largest_rate * (2.0 * parts / n_dwells - 1.0)
    if order == "sweep":
        return np.concatenate([rates[::2], rates[1::2][::-1]])
    return random_state.permutation(rates)


def _rates_by_turns(n_dwells, levels, order, random_state):
    if order == "sweep":
        return np.resize(np.concatenate([levels, levels[-2:0:-1]]), n_dwells)
    n_passes = -(-n_dwells // levels.size)
    passes = [random_state.permutation(levels) for _ in range(n_passes)]
    return np.concatenate(passes)[:n_dwells]


def check_phase(nominal, spread, max_rate, ambient_range, name):
    """Refuse rates at which some device of the population would leave the sine's rising branch.

    Beyond a Sagnac phase of pi / 2 two rates give one output: the arcsine, and with it every
    compensation from the output alone, is not defined. ``name`` is of the parameter to blame.
    """
    bounds = [
        abs(getattr(nominal, entry.name)) + spread * _tolerance(nominal, entry)
        for entry in fields(Device)
        if entry.name in ("sagnac_factor", "sagnac_temperature", "self_heating")
    ]
    factor, temperature_coefficient, self_heating = bounds
    coldest, hottest = ambient_range[0], ambient_range[1] + self_heating
    difference = max(REFERENCE_TEMPERATURE - coldest, hottest - REFERENCE_TEMPERATURE)
    largest_factor = factor * (1.0 + 1e-6 * temperature_coefficient * difference)
    limit = 90.0 / largest_factor
    if max_rate >= limit:
        raise ValueError(
            f"{name} == {max_rate}, must be < {limit:.4g} deg/s: from there on the Sagnac phase "
            "reaches pi / 2 in some device of this population, and the arcsine is not defined."
        )
