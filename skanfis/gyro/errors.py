"""Errors of the gyro application: bad logs or options, existing files, missing packages."""

from importlib import import_module


class LogError(ValueError):
    """A log, or a column or row of it, from which no compensator should be learnt.

    Parameters
    ----------
    reason : str
        What was found, and what to do about it.
    column : str, default=None
        The column's part: "time", "temperature", "output", "rate", "run" or "device".
    row : int, default=None
        Position of the first bad row, counted from 0.

    Examples
    --------
    >>> from skanfis.gyro import LogError
    >>> print(LogError("is missing.", column="rate", row=7))
    column 'rate', row 7: is missing.
    """

    def __init__(self, reason: str, column: str | None = None, row: int | None = None) -> None:
        super().__init__(reason, column, row)
        self.reason, self.column, self.row = reason, column, row

    def __str__(self):
        place = [] if self.column is None else [f"column {self.column!r}"]
        place += [] if self.row is None else [f"row {self.row}"]
        return f"{', '.join(place)}: {self.reason}" if place else self.reason


class UsageError(ValueError):
    """Options of the command that make no sense."""


class ExistsError(Exception):
    """A file that would be replaced."""


def needed(module, told):
    """Import an optional module; if it is missing, raise ImportError with the text ``told``."""
    try:
        return import_module(module)
    except ImportError as error:
        raise ImportError(told) from error
