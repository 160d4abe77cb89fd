"""Whether figures of merit keep the limits of a specification, with what their scatter leaves."""

from dataclasses import dataclass

import numpy as np

from ._limits import Limit

__all__ = ["Check", "check_limits"]


@dataclass(frozen=True)
class Check:
    """A limit and the figure after compensation, in one unit, and whether that keeps it.

    ``is_kept`` is None where the figure could not be measured, which is no pass. ``remark`` says so
    of an interval that reaches over the limit: the next log may say otherwise.
    """

    limit: Limit
    value: float
    is_kept: bool | None
    remark: str

    @property
    def words(self):
        """Name of the figure."""
        return self.limit.figure.replace("_", " ")

    @property
    def result(self):
        """In a word."""
        return {True: "pass", False: "fail", None: "not measured"}[self.is_kept]


def check_limits(limits, table):
    """A check for each limit, by the lines of "all" in a table of :func:`gyro_report`."""
    lines = table[table["group"] == "all"].set_index("figure")
    return [_check(limit, lines) for limit in limits]


def _check(limit, lines):
    if limit.figure not in lines.index:
        return Check(limit, float("nan"), None, "the log does not give this figure")
    line = lines.loc[limit.figure]
    limit = limit.in_unit(line["unit"])
    value, low, high = (line[name] for name in ("after", "after_low", "after_high"))
    if np.isnan(value):
        return Check(limit, value, None, line["note"])
    is_kept = limit.keeps(value)
    is_sure = np.isnan(low) or limit.keeps(low) == limit.keeps(high) == is_kept
    return Check(limit, value, is_kept, "" if is_sure else "its interval reaches over the limit")
