"""The inputs of a folded model, read from the user's tables; levels of one-hot encoded columns."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .._sklearn import safe_indexing
from .._validation import as_numbers, check_finite, refuse_lazy


class Level(NamedTuple):
    """A level of a raw column, and all other levels; none of these if there may be unknown ones."""

    column: str
    level: str
    others: tuple[str, ...]

    def said(self, value):
        """Say "fibre is PM" of a 1; of a 0 "fibre is not PM", or, of two levels, the other."""
        is_not = self.others[0] if len(self.others) == 1 else f"not {self.level}"
        return f"{self.column} is {self.level if value else is_not}"


@dataclass(frozen=True)
class Column:
    """An input z: raw column ``source`` is offset + scale z, or z is an output of an encoder."""

    source: int
    name: str
    offset: float = 0.0
    scale: float = 1.0
    encode: Callable[..., np.ndarray] | None = None
    place: int = -1  # of the output
    level: Level | None = None  # that an encoder's output indicates
    fill: Any = None  # replaces missing values
    imputed: Callable[..., np.ndarray] | None = None  # the column as an imputer hands it on

    def values(self, X, encoded):
        """The input, in raw units, from the user's table and the outputs of encoders."""
        if self.encode is not None:
            return encoded[self.encode][:, self.place].astype(np.float64)
        numbers = as_numbers(part_of(X, [self.source]))[:, 0]
        return numbers if self.fill is None else np.where(np.isnan(numbers), self.fill, numbers)


def by_column(levels):
    """By raw column the names of its indicators, and the names of its levels without one."""
    found: dict[str, list[str]] = {}
    for name, level in levels.items():
        found.setdefault(level.column, []).append(name)
    unnamed = {}
    for column, names in found.items():
        named = {levels[name].level for name in names}
        others = [other for other in levels[names[0]].others if other not in named]
        unnamed[column] = others or ["other"]
    return found, unnamed


@dataclass(frozen=True)
class Reader:
    """Takes the inputs of a model out of tables with columns of these names."""

    inputs: list[Column]
    names: list[str]
    is_named: bool

    @property
    def levels(self) -> dict[str, Level]:
        """What each indicator tells, by its name, such as "fibre_PM"."""
        return {one.name: one.level for one in self.inputs if one.level is not None}

    def __call__(self, X) -> np.ndarray:
        """The rows; ValueError for other columns, and for numbers that are not finite."""
        refuse_lazy(X=X)
        given, known = getattr(X, "columns", None), ", ".join(map(repr, self.names))
        if self.is_named and given is not None and list(given) != self.names:
            raise ValueError(
                f"X must have the columns {known}, in this order; it has "
                f"{', '.join(map(repr, given))}."
            )
        # What does not reach the model need not be numbers.
        encoders = {one.encode for one in self.inputs if one.encode}
        table = X if given is not None or encoders else as_numbers(X)
        if (shape := np.shape(table))[1:] != (len(self.names),) or shape[0] == 0:
            raise ValueError(f"X has the shape {shape}: the estimator takes rows of {known}.")
        encoded = {encode: encode(table) for encode in encoders}
        rows = np.column_stack([one.values(table, encoded) for one in self.inputs])
        check_finite(rows, "X", [one.name for one in self.inputs])
        return rows


def part_of(X, columns):
    """Columns of a frame, or of anything that is an array, by their positions."""
    table = X if hasattr(X, "columns") else np.asarray(X, dtype=object)
    return safe_indexing(table, columns, axis=1)
