"""The conditions of a simulated test, given or usual, checked: clock, chamber, rate table."""

from dataclasses import replace

import numpy as np

from ._ofog_chamber import PROFILES, Schedule
from ._ofog_population import RATE_ORDERS, RateTable
from ._validation import check_choice, check_count, check_real

__all__ = ["given_conditions", "rate_table_of", "schedule_of"]

# Outside, neither the polynomials in temperature nor any chamber for gyros would hold.
_COLDEST, _HOTTEST = -60.0, 100.0  # degC


def given_conditions(usual, **given):
    """The usual conditions but for what the caller gave; None is not given."""
    given = {name: value for name, value in given.items() if value is not None}
    levels = {"max_rate", "n_rate_levels"} & set(given)
    if levels and "rates" in given:
        raise ValueError(f"rates is given together with {sorted(levels)}; it takes their place.")
    if levels:
        given["rates"] = None
    return replace(usual, **given)


def schedule_of(conditions, profile, n_power_ups, off_time, n_soaks):
    """The clock and the chamber's program, checked."""
    interval = check_real(
        conditions.sampling_interval, "sampling_interval", min_val=0, include_boundaries="neither"
    )
    duration = check_real(conditions.duration, "duration", min_val=interval)
    return Schedule(
        # 0.3 / 0.1 is 2.9999999999999996, and three samples are meant.
        n_samples=int(duration / interval * (1.0 + 1e-12)),
        sampling_interval=interval,
        n_power_ups=n_power_ups,
        n_off=round(check_real(off_time, "off_time", min_val=0) / interval),
        profile=check_choice(profile, "profile", PROFILES),
        ambient_range=_check_ambient_range(conditions.ambient_range),
        n_soaks=check_count(n_soaks, "n_soaks", min_val=2),
    )


def _check_ambient_range(ambient_range):
    try:
        low, high = ambient_range
    except (TypeError, ValueError) as error:
        message = f"ambient_range must be two temperatures; got {ambient_range!r}."
        raise ValueError(message) from error
    low = check_real(low, "ambient_range[0]", min_val=_COLDEST, max_val=_HOTTEST)
    high = check_real(high, "ambient_range[1]", min_val=low, max_val=_HOTTEST)
    return low, high


def rate_table_of(conditions, order):
    """The rates of the table, checked."""
    interval = conditions.sampling_interval
    dwell_time = check_real(conditions.dwell_time, "dwell_time", min_val=interval)
    check_choice(order, "rate_order", RATE_ORDERS)
    if conditions.rates is not None:
        levels = np.unique(np.asarray(conditions.rates, dtype=float))
        if np.ndim(conditions.rates) != 1 or levels.size == 0 or not np.isfinite(levels).all():
            raise ValueError(
                f"rates must be a list of finite rates in deg/s; got {conditions.rates!r}."
            )
        largest = float(np.abs(levels).max())
    else:
        largest = check_real(
            conditions.max_rate, "max_rate", min_val=0, include_boundaries="neither"
        )
        levels = None
        if conditions.n_rate_levels is not None:
            n_levels = check_count(conditions.n_rate_levels, "n_rate_levels", min_val=2)
            levels = np.linspace(-largest, largest, n_levels)
    return RateTable(levels, largest, round(dwell_time / interval), order)
