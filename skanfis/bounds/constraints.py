"""Constraints on the outputs, read from the user's parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._validation import feature_indices, in_column_order, position_of


@dataclass(frozen=True)
class OutputLimits:
    """Limits of all predictions: in range the rules provably keep them, beyond outputs are held.

    Parameters
    ----------
    lower, upper : float or array-like of shape (n_outputs,), default=None
        In the units of y. None is no limit; among several numbers, an infinite one is none.

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
    """A value that the model must have at a point.

    Parameters
    ----------
    x : array-like of shape (n_features,) or dict
        The point, in the units of X; a dict or a Series by the inputs' names.
    y : float or array-like of shape (n_outputs,)
        The value there.

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


@dataclass(frozen=True)
class Inequality:
    """An inequality on one output: on its slope by ``input``, or on its value if that is None.

    ``sign`` times the slope or value must be at least ``sign`` times ``limit``.
    """

    output: int
    sign: float
    input: int | None
    limit: float
    name: str

    def of(self, model, points):
        """Sign times the slope or value of every output at points, (n_points, n_outputs)."""
        if self.input is None:
            return self.sign * model.predict(points)
        return self.sign * model.gradient(points)[:, self.input]

    def excess(self, model, points):
        """By how much the inequality is violated at points, (n_points,); negative if it holds."""
        return self.sign * self.limit - self.of(model, points)[:, self.output]


@dataclass(frozen=True, eq=False)
class Constraints:
    """All constraints, by output, in the user's units."""

    signs: np.ndarray  # (n_outputs, n_inputs): 1 must not fall, -1 must not rise, 0 is free
    lower: np.ndarray  # (n_outputs,), infinite where there is no limit
    upper: np.ndarray
    points: np.ndarray  # (n_points, n_inputs)
    values: np.ndarray  # (n_points, n_outputs)

    @classmethod
    def read(cls, monotonic_cst, constraints, input_names, n_outputs):
        """The constraints that the parameters ask for; None if they ask for none."""
        signs, n_inputs = _signs(monotonic_cst, input_names, n_outputs), len(input_names)
        lower, upper = np.full(n_outputs, -np.inf), np.full(n_outputs, np.inf)
        points, values = [], []
        one_given = constraints is not None and not isinstance(constraints, Sequence)
        for one in [constraints] if one_given else constraints or ():
            if isinstance(one, OutputLimits):
                lower = np.maximum(lower, _per_output(one.lower, -np.inf, "lower", n_outputs))
                upper = np.minimum(upper, _per_output(one.upper, np.inf, "upper", n_outputs))
            elif isinstance(one, FixedPoint):
                points.append(_point(one.x, input_names))
                values.append(_per_output(one.y, np.nan, "y", n_outputs))
            else:
                raise ValueError(
                    f"constraints holds {one!r}: it must be a list of OutputLimits and FixedPoint "
                    "objects of skanfis.bounds."
                )
        at, fixed = np.reshape(points, (-1, n_inputs)), np.reshape(values, (-1, n_outputs))
        distinct = np.unique(np.hstack([at, fixed]), axis=0)
        found = cls(signs, lower, upper, *np.hsplit(distinct, [n_inputs]))
        found._check()
        asks = signs.any() or np.isfinite([lower, upper]).any() or points
        return found if asks else None

    def inequalities(self, model):
        """The inequalities on the outputs of a model, output by output."""
        found = []
        for k, name in enumerate(model.output_names):
            for j, sign in enumerate(self.signs[k]):
                if sign and model.minimum[j] < model.maximum[j]:
                    what = f"monotonic_cst={sign} of {name!r} by {model.input_names[j]!r}"
                    found.append(Inequality(k, float(sign), j, 0.0, what))
            for sign, limit in ((1.0, self.lower[k]), (-1.0, self.upper[k])):
                if np.isfinite(limit):
                    what = f"the {'lower' if sign > 0.0 else 'upper'} limit {limit:g} of {name!r}"
                    found.append(Inequality(k, sign, None, limit, what))
        return found

    def _check(self):
        """Raise ValueError where constraints contradict one another."""
        for k, (low, high) in enumerate(zip(self.lower, self.upper, strict=True)):
            if not low < high:
                which = "the output" if len(self.lower) == 1 else f"output {k}"
                raise ValueError(
                    f"constraints limits {which} to [{low:g}, {high:g}]: lower must be below upper."
                )
        for point, value in zip(self.points, self.values, strict=True):
            if not np.isfinite(point).all() or not np.isfinite(value).all():
                raise ValueError(f"FixedPoint({point}, {value}) must hold finite numbers only.")
            if (value <= self.lower).any() or (value >= self.upper).any():
                raise ValueError(
                    f"FixedPoint({point}, {value}) is not strictly within the OutputLimits "
                    f"{self.lower} to {self.upper}: move the point, or widen the limits."
                )
            for k, signs in enumerate(self.signs):
                way, free = self.points - point, signs == 0
                is_above = (way[:, free] == 0.0).all(axis=1) & (way * signs >= 0.0).all(axis=1)
                is_above &= self.values[:, k] < value[k]
                if is_above.any():
                    other = is_above.argmax()
                    raise ValueError(
                        f"constraints contradicts itself or monotonic_cst: output {k} is "
                        f"fixed to {value[k]:g} at {point}, so it must be at least that at "
                        f"{self.points[other]}, where it is fixed to {self.values[other, k]:g}."
                    )


def _signs(given, input_names, n_outputs):
    n_inputs, told = len(input_names), f"monotonic_cst={given!r}"
    given = {} if given is None else given
    if isinstance(given, Mapping):
        # The key 7 also stands for a column named "7".
        names = [str(name) if str(name) in input_names else name for name in given]
        if names:
            feature_indices(names, input_names, "monotonic_cst")
        places = [position_of(name, input_names) for name in names]
        by_place = dict(zip(places, given.values(), strict=True))
        given = [by_place.get(j, 0) for j in range(n_inputs)]
    given = in_column_order(given, input_names, "monotonic_cst")
    signs = _numbers(given, told)
    if signs.shape not in ((n_inputs,), (n_outputs, n_inputs)):
        raise ValueError(
            f"monotonic_cst has shape {signs.shape}, not {(n_inputs,)} or {(n_outputs, n_inputs)}: "
            "give one number per column of X, or one row of such numbers per output."
        )
    if not np.isin(signs, (-1, 0, 1)).all():
        raise ValueError(f"{told} must hold only -1 (falling), 0 (free) and 1 (rising).")
    return np.broadcast_to(signs, (n_outputs, n_inputs)).astype(int)


def _numbers(given, what):
    try:
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{what} must hold numbers only.") from None


def _per_output(given, nothing, what, n_outputs):
    values = _numbers(nothing if given is None else given, f"{what}={given!r} in constraints")
    if values.ndim > 1 or values.size not in (1, n_outputs) or np.isnan(values).any():
        raise ValueError(
            f"{what}={given!r} must be a number, or one per output of the model ({n_outputs})."
        )
    return np.broadcast_to(values, (n_outputs,))


def _point(given, input_names):
    names = ", ".join(map(repr, input_names))
    if isinstance(given, Mapping):
        if set(given) != set(input_names):
            raise ValueError(
                f"FixedPoint.x names {', '.join(map(repr, given))}: it must name every column of "
                f"X ({names}) and no other."
            )
        given = [given[name] for name in input_names]
    point = _numbers(in_column_order(given, input_names, "FixedPoint.x"), f"FixedPoint.x={given!r}")
    if point.shape != (len(input_names),):
        raise ValueError(
            f"FixedPoint.x={given!r} must have a number for each of the {len(input_names)} "
            f"columns of X: {names}."
        )
    return point
