"""Constraints on the outputs, read from what a user gives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["Constraints", "FixedPoint", "OutputLimits"]


@dataclass(frozen=True)
class OutputLimits:
    """Limits that no prediction passes.

    In the range of the training data the rules themselves keep them, provably; beyond it, where a
    tangent may lead across them, the prediction is held at them.

    Parameters
    ----------
    lower, upper : float or array-like of shape (n_outputs,), default=None
        In the units of y; None, or an infinite number, is no limit.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.bounds import OutputLimits
    >>> x = np.linspace(0.0, 1.0, 50)[:, None]
    >>> y = np.sin(3.0 * x[:, 0])
    >>> model = ANFISRegressor(n_mfs=3, constraints=[OutputLimits(upper=1.0)]).fit(x, y)
    >>> bool(model.predict(x).max() <= 1.0)
    True
    """

    lower: Any = None
    upper: Any = None


@dataclass(frozen=True)
class FixedPoint:
    """A value that the model is to have at a point.

    Parameters
    ----------
    x : array-like of shape (n_features,) or dict
        The point, in the units of X; or by the inputs' names. Beyond the range of the training data
        it holds by ``out_of_bounds``: of the tangent with "linear", of the edge with "clip".
    y : float or array-like of shape (n_outputs,)
        What is predicted there.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.bounds import FixedPoint
    >>> x = np.linspace(0.0, 1.0, 50)[:, None]
    >>> y = np.cos(3.0 * x[:, 0])
    >>> model = ANFISRegressor(n_mfs=3, constraints=[FixedPoint([0.0], 1.0)]).fit(x, y)
    >>> print(f"{model.predict([[0.0]])[0]:.6f}")
    1.000000
    """

    x: Any
    y: Any


@dataclass(frozen=True, eq=False)
class Constraints:
    """Constraints of every output, in the user's units.

    Attributes
    ----------
    signs : ndarray of shape (n_outputs, n_inputs)
        1 where the output must not fall with the input, -1 where it must not rise, else 0.
    lower, upper : ndarray of shape (n_outputs,)
        Infinite where there is no limit.
    points : ndarray of shape (n_points, n_inputs)
    values : ndarray of shape (n_points, n_outputs)
    """

    signs: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    points: np.ndarray
    values: np.ndarray

    @classmethod
    def read(cls, monotonic_cst, constraints, input_names, n_outputs):
        """What the parameters say; None where they ask for nothing."""
        n_inputs = len(input_names)
        signs = _signs(monotonic_cst, input_names, n_outputs)
        lower, upper = np.full(n_outputs, -np.inf), np.full(n_outputs, np.inf)
        points, values = [], []
        for one in _listed(constraints):
            if isinstance(one, OutputLimits):
                lower = np.maximum(lower, _per_output(one.lower, -np.inf, "lower", n_outputs))
                upper = np.minimum(upper, _per_output(one.upper, np.inf, "upper", n_outputs))
            else:
                points.append(_point(one, input_names))
                values.append(_per_output(one.y, np.nan, "y", n_outputs))
        found = cls(
            signs,
            lower,
            upper,
            np.reshape(points, (-1, n_inputs)),
            np.reshape(values, (-1, n_outputs)),
        )
        found._check()
        asks = signs.any() or np.isfinite([lower, upper]).any() or points
        return found if asks else None

    def _check(self):
        for k, (low, high) in enumerate(zip(self.lower, self.upper, strict=True)):
            if not low < high:
                which = "the output" if len(self.lower) == 1 else f"output {k}"
                raise ValueError(
                    f"constraints limits {which} to [{low:g}, {high:g}], between which nothing "
                    "lies: lower must be below upper."
                )
        for point, value in zip(self.points, self.values, strict=True):
            if not np.isfinite(point).all() or not np.isfinite(value).all():
                raise ValueError(f"FixedPoint({point}, {value}) must be of finite numbers.")
            if (value <= self.lower).any() or (value >= self.upper).any():
                raise ValueError(
                    f"FixedPoint({point}, {value}) is not within the OutputLimits "
                    f"{self.lower} to {self.upper}: leave some room between."
                )
        for k, signs in enumerate(self.signs):
            self._check_order(k, signs)

    def _check_order(self, k, signs):
        """Raise ValueError where two fixed points are in the wrong order."""
        for one, value in zip(self.points, self.values[:, k], strict=True):
            way = self.points - one
            is_above = (way[:, signs == 0] == 0.0).all(axis=1) & (way * signs >= 0.0).all(axis=1)
            is_above &= way.any(axis=1)
            for other in np.flatnonzero(is_above & (self.values[:, k] < value)):
                raise ValueError(
                    f"monotonic_cst and constraints contradict one another: output {k} is fixed to "
                    f"{value:g} at {one}, and to {self.values[other, k]:g} at "
                    f"{self.points[other]}, where it must not be less."
                )


def _signs(given, input_names, n_outputs):
    n_inputs = len(input_names)
    if given is None:
        return np.zeros((n_outputs, n_inputs), dtype=int)
    if isinstance(given, Mapping):
        signs = np.zeros(n_inputs)
        for name, sign in given.items():
            if name not in input_names:
                raise ValueError(
                    f"monotonic_cst names {name!r}, which is no column of X; its columns are "
                    f"{', '.join(map(repr, input_names))}."
                )
            signs[list(input_names).index(name)] = sign
    else:
        signs = _as_numbers(given, "monotonic_cst")
    if signs.shape not in ((n_inputs,), (n_outputs, n_inputs)):
        raise ValueError(
            f"monotonic_cst has shape {signs.shape}, but X has {n_inputs} columns and y "
            f"{n_outputs}: give one number per column of X, or a row of these per output."
        )
    if not np.isin(signs, (-1, 0, 1)).all():
        raise ValueError(
            f"monotonic_cst={given!r} must hold -1 (falling), 0 (free) and 1 (rising) alone."
        )
    return np.broadcast_to(signs, (n_outputs, n_inputs)).astype(int)


def _listed(constraints):
    if isinstance(constraints, OutputLimits | FixedPoint):
        return [constraints]
    found = constraints if isinstance(constraints, Sequence) else [constraints]
    for one in found if constraints is not None else ():
        if not isinstance(one, OutputLimits | FixedPoint):
            raise ValueError(
                f"constraints holds {one!r}: it must be OutputLimits and FixedPoints of "
                "skanfis.bounds, in a list."
            )
    return [] if constraints is None else list(found)


def _as_numbers(given, what):
    """An array of numbers; ValueError, with its name, where it holds something else."""
    try:
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{what}={given!r} must hold numbers alone.") from None


def _per_output(given, nothing, what, n_outputs):
    values = _as_numbers(nothing if given is None else given, f"{what} in constraints")
    if values.ndim > 1 or values.size not in (1, n_outputs) or np.isnan(values).any():
        raise ValueError(
            f"{what}={given!r} in constraints must be a number, or one for each of the "
            f"{n_outputs} outputs."
        )
    return np.broadcast_to(values, (n_outputs,))


def _point(fixed, input_names):
    given = fixed.x
    if isinstance(given, Mapping):
        if set(given) != set(input_names):
            raise ValueError(
                f"FixedPoint.x names {', '.join(map(repr, given))}: it must name every column of "
                f"X, {', '.join(map(repr, input_names))}, and no other."
            )
        given = [given[name] for name in input_names]
    point = _as_numbers(given, "FixedPoint.x")
    if point.shape != (len(input_names),):
        raise ValueError(
            f"FixedPoint.x={fixed.x!r} must have a number for each of the {len(input_names)} "
            f"columns of X: {', '.join(map(repr, input_names))}."
        )
    return point
