"""The inputs of a folded model, read from the user's tables; levels of one-hot encoded columns."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from .._sklearn import safe_indexing
from .._validation import as_frame, as_numbers, check_finite, refuse_lazy

_ROUNDING = 1e-9  # of a sum of shares


class Level(NamedTuple):
    """A level of a raw column, and all other levels; these are empty if not all are known."""

    column: str
    level: str
    others: tuple[str, ...]

    def said(self, value):
        """Say "fibre is PM" for 1; for 0 "fibre is not PM", or the other one of two levels."""
        is_not = self.others[0] if len(self.others) == 1 else f"not {self.level}"
        return f"{self.column} is {self.level if value else is_not}"


@dataclass(frozen=True)
class Column:
    """An input z: raw column ``source`` is offset + scale z, or z indicates a level of it."""

    source: int
    name: str
    offset: float = 0.0
    scale: float = 1.0
    place: int = -1  # position of the indicator among an encoder's outputs
    level: Level | None = None  # the level that it indicates

    def values(self, X, z):
        """The input as in the user's table; indicators and missing values are taken from z."""
        scaled_back = self.offset + self.scale * z
        if self.level is not None:
            # 0 or 1 again, after scalers that follow the encoder.
            return np.round(scaled_back)
        numbers = as_numbers(safe_indexing(X, [self.source], axis=1))[:, 0]
        return np.where(np.isnan(numbers), scaled_back, numbers)


class Category(NamedTuple):
    """The inputs that indicate levels of one raw column, and the level of each."""

    inputs: list[int]
    levels: list[str]
    others: list[str]  # other levels, if some training rows have none of these


def columns_of(model):
    """The raw column of each input; indicators of one category share its name."""
    return [model.levels.get(name, (name,))[0] for name in model.input_names]


def categories(model, among=None):
    """The :class:`Category` of each raw column, for all inputs of a model, or those ``among``."""
    found: dict[str, Category] = {}
    for j in range(model.n_inputs) if among is None else among:
        if level := model.levels.get(model.input_names[j]):
            own = found.setdefault(level.column, Category([], [], []))
            own.inputs.append(j)
            own.levels.append(level.level)
    for column, own in found.items():
        if model.reference[own.inputs].sum() < 1.0 - _ROUNDING:
            every = [one for one in model.levels.values() if one.column == column]
            indicated = {one.level for one in every}
            own.others.extend([one for one in every[0].others if one not in indicated] or ["other"])
    return found


@dataclass(frozen=True)
class Reader:
    """Takes the inputs of a model out of tables with columns of these names.

    The steps before the model give imputed values and indicators.
    """

    inputs: list[Column]
    places: list[int]  # of these among the outputs of the last step
    steps: list[Any]
    names: list[str]
    is_named: bool

    def __call__(self, X) -> np.ndarray:
        """The rows of the inputs; ValueError for other columns or numbers that are not finite."""
        refuse_lazy(X=X)
        X = as_frame(X)
        given, known = getattr(X, "columns", None), ", ".join(map(repr, self.names))
        if self.is_named and given is not None and list(given) != self.names:
            raise ValueError(
                f"X must have the columns {known}, in this order; it has "
                f"{', '.join(map(repr, given)) or 'none'}."
            )
        # Columns that do not reach the model need not be numbers.
        X = X if hasattr(X, "shape") else np.asarray(X, dtype=object)
        if X.shape[1:] != (len(self.names),) or X.shape[0] == 0:
            raise ValueError(f"X has the shape {X.shape}: the estimator takes rows of {known}.")
        Z = X
        # Steps warn if only one of fit and transform gets names: give X the form of fit.
        if self.steps and self.is_named == (given is None):
            Z = pd.DataFrame(X, columns=self.names) if self.is_named else np.asarray(X)
        for step in self.steps:
            Z = step.transform(Z)
        pairs = zip(self.inputs, as_numbers(Z).T[self.places], strict=True)
        rows = np.column_stack([one.values(X, z) for one, z in pairs])
        check_finite(rows, "X", [one.name for one in self.inputs])
        return rows
