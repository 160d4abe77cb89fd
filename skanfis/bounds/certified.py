"""The public functions: bounds of predictions, and of their slopes, over a box."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from .._validation import check_count, feature_indices
from ..digits import limits_in_digits
from ..export import fold
from ..membership import FAMILIES
from ..model import TSKModel
from ..policies import SILENT
from .construction import is_in_order
from .enclosure import Enclosure, reach_of
from .search import largest
from .terms import size

# Number of points all over a box that are tried first; up to this many inputs, all corners too.
_POINTS, _MOST_INPUTS_OF_CORNERS = 1024, 8


@dataclass(frozen=True, eq=False, repr=False)
class Bounds:
    """Bounds of outputs, or of slopes, on a box.

    Parameters
    ----------
    lower, upper : ndarray of shape (n_outputs,)
        Proven: no value in the box is below ``lower``, or above ``upper``.
    lowest, highest : ndarray of shape (n_outputs,)
        The lowest and highest values that were found in the box.
    at_lowest, at_highest : ndarray of shape (n_outputs, n_inputs)
        The points where they were found.
    box : ndarray of shape (n_inputs, 2)
    n_boxes : int
        Number of parts of the box that were evaluated.
    converged : bool
        Whether ``tol`` was reached, for every output.
    input_names, output_names : tuple of str

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.bounds import bounds
    >>> from skanfis.datasets import make_jang_sinc
    >>> X, y = make_jang_sinc()
    >>> found = bounds(ANFISRegressor(n_mfs=4).fit(X, y))
    >>> bool(found.lower[0] <= y.min() + 1e-3 and y.max() - 1e-3 <= found.upper[0])
    True
    """

    lower: np.ndarray
    upper: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray
    at_lowest: np.ndarray
    at_highest: np.ndarray
    box: np.ndarray
    n_boxes: int
    converged: bool
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]

    @property
    def tightness(self) -> np.ndarray:
        """The larger gap between bound and value, as part of ``highest - lowest``, (n_outputs,)."""
        gap = np.maximum(self.upper - self.highest, self.lowest - self.lower)
        with np.errstate(divide="ignore", invalid="ignore"):
            # If the output is constant, rounding may leave the lowest above the highest.
            return np.where(gap > 0.0, gap / np.maximum(self.highest - self.lowest, 0.0), 0.0)

    def __repr__(self):
        ends = zip(self.output_names, self.lower, self.upper, strict=True)
        parts = [
            f"{name} in [{', '.join(limits_in_digits(low, high, 6))}]" for name, low, high in ends
        ]
        return f"Bounds({'; '.join(parts)})"


def bounds(
    model: Any,
    box: ArrayLike | dict[str, Any] | None = None,
    *,
    tol: float = 0.01,
    max_boxes: int = 200_000,
) -> Bounds:
    """Enclose every prediction of a model over a box of inputs, provably.

    The bounds hold for predictions as computed, rounding included; :doc:`/bounds` has the proof.

    Parameters
    ----------
    model : fitted estimator or TSKModel
        An ANFIS estimator, or a Pipeline, TransformedTargetRegressor or search around one.
    box : array-like of shape (n_inputs, 2) or dict, default=None
        Low and high of every input, in the units of X, or {name: (low, high)}, or a frame or Series
        by name; ends may be infinite. Inputs not named, or all with None, have the range of the
        training data.
    tol : float, default=0.01
        Largest gap between a bound and the value found, relative to the output's range.
    max_boxes : int, default=200_000
        Most boxes to evaluate for each bound. The bounds hold even where this ends the search.

    Returns
    -------
    bounds : Bounds
        With ``out_of_bounds`` "nan" and "raise", those over the part of the box in range.

    Raises
    ------
    ValueError, TypeError
        As :func:`skanfis.export.fold`; if a parameter is none of the above, nothing bounds the
        model on the box, or a membership is not of skanfis.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.bounds import bounds
    >>> from skanfis.datasets import make_jang_sinc
    >>> model = ANFISRegressor(n_mfs=4).fit(*make_jang_sinc())
    >>> found = bounds(model, {"x0": (-1.0, 1.0), "x1": (-1.0, 1.0)}, tol=0.001)
    >>> print(f"{found.lower[0]:.2f} {found.upper[0]:.2f}")
    0.71 1.00
    """
    model, box = _checked(model, box, tol, max_boxes)
    return _enclosed(model, box, None, np.ptp, tol, max_boxes)


def gradient_bounds(
    model: Any,
    feature: str | int,
    box: ArrayLike | dict[str, Any] | None = None,
    *,
    tol: float = 0.01,
    max_boxes: int = 200_000,
) -> Bounds:
    """Enclose the slope of the predictions by one input over a box of inputs, provably.

    Out of range it is the slope by the policy. Where it jumps, the slopes on all sides count.

    Parameters
    ----------
    model : fitted estimator or TSKModel
    feature : str or int
        The input, by name or position.
    box : array-like of shape (n_inputs, 2) or dict, default=None
    tol : float, default=0.01
        Relative to the largest absolute slope.
    max_boxes : int, default=200_000
        This, and the others, as in :func:`bounds`.

    Returns
    -------
    bounds : Bounds
        Of the slope, in units of the output per unit of the input.

    Raises
    ------
    ValueError, TypeError
        As :func:`bounds`; if ``feature`` is no input.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.bounds import gradient_bounds
    >>> x = np.linspace(-1.0, 1.0, 200)[:, None]
    >>> slope = gradient_bounds(ANFISRegressor(n_mfs=3).fit(x, np.tanh(2.0 * x[:, 0])), "x0")
    >>> bool(slope.lower[0] > 0.0 and slope.upper[0] < 2.2)
    True
    """
    model, box = _checked(model, box, tol, max_boxes)
    (j,) = feature_indices([feature], model.input_names, "feature")
    found = _enclosed(model, box, j, size, tol, max_boxes)
    names = tuple(f"d {y} / d {model.input_names[j]}" for y in model.output_names)
    return replace(found, output_names=names)


def monotonicity(
    model: Any,
    feature: str | int,
    box: ArrayLike | dict[str, Any] | None = None,
    *,
    max_boxes: int = 200_000,
) -> np.ndarray:
    """Prove that the predictions rise, or fall, with one input all over a box.

    Parameters
    ----------
    model : fitted estimator or TSKModel
    feature : str or int
    box : array-like of shape (n_inputs, 2) or dict, default=None
    max_boxes : int, default=200_000
        As in :func:`gradient_bounds`.

    Returns
    -------
    sign : ndarray of int of shape (n_outputs,)
        1: no prediction falls as the input rises; -1: none rises; 0: neither has been proven.

    Raises
    ------
    ValueError, TypeError
        As :func:`gradient_bounds`.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.bounds import monotonicity
    >>> x = np.linspace(-1.0, 1.0, 200)[:, None]
    >>> monotonicity(ANFISRegressor(n_mfs=3).fit(x, np.tanh(2.0 * x[:, 0])), "x0")
    array([1])
    """
    model, box = _checked(model, box, 0.0, max_boxes)
    (j,) = feature_indices([feature], model.input_names, "feature")
    low, high = varying_part(box, model, of_slopes=True)
    is_in_range = (low >= model.minimum).all() and (high <= model.maximum).all()
    # What holds all over the range also holds beyond it if the value is held there, or if the
    # tangent does not change with other inputs.
    is_steady = model.tangent_at is not None and np.isfinite(model.tangent_at[j])
    is_enough = is_in_range or is_steady or model.out_of_bounds != "linear"
    boxes = [(low, high)]
    if is_enough and not is_in_range:
        boxes.insert(0, (model.minimum, model.maximum))

    def is_proven(k, sign):
        if is_enough and is_in_order(model, k, sign * (np.arange(model.n_inputs) == j)):
            return True
        slope, cuts = Enclosure(model, k, -float(sign)).evaluate(j), training_box(model)
        found = (largest(slope, *ends, 0.0, max_boxes, cuts, until=0.0) for ends in boxes)
        return any(one.bound <= 0.0 for one in found)

    outputs = range(model.n_outputs)
    return np.array([next((s for s in (1, -1) if is_proven(k, s)), 0) for k in outputs])


def training_box(model):
    """The range of the training data, (n_inputs, 2); larger boxes are cut first at its ends."""
    return np.stack([model.minimum, model.maximum], axis=1)


def _enclosed(model, box, j, scale, tol, max_boxes):
    """Bounds of outputs, or of their slopes by input j; ``tol`` is in units of ``scale(ends)``."""
    low, high = varying_part(box, model, of_slopes=j is not None)
    X, found = spread_points(low, high).T, []
    for k in range(model.n_outputs):
        sides = [Enclosure(model, k, sign).evaluate(j) for sign in (-1.0, 1.0)]
        seen = [evaluate(X, X) for evaluate in sides]
        tops = [attained.max() for _, _, attained, _ in seen]
        tolerance = tol * float(scale([-tops[0], tops[1]]))
        for evaluate, (bound, points, attained, _) in zip(sides, seen, strict=True):
            top = int(attained.argmax())
            # At the same point, bound and value differ by rounding: no tolerance can be less.
            least = max(tolerance, 8.0 * float(bound[top] - attained[top]))
            first = points[:, top], float(attained[top])
            found.append(largest(evaluate, low, high, least, max_boxes, training_box(model), first))
    bound, attained, point, n_boxes, converged = map(np.array, zip(*found, strict=True))
    # Beyond the part in which predictions change, they are the same: the box has such a point too.
    point = np.clip(point, *box.T)
    return Bounds(
        lower=-bound[::2],
        upper=bound[1::2],
        lowest=-attained[::2],
        highest=attained[1::2],
        at_lowest=point[::2],
        at_highest=point[1::2],
        box=box,
        n_boxes=int(n_boxes.sum()),
        converged=bool(converged.all()),
        input_names=model.input_names,
        output_names=model.output_names,
    )


def _checked(model, box, tol, max_boxes):
    """The frozen model in the user's units, and the box."""
    model = fold(model)
    for group in model.antecedent.groups:
        if group.family not in FAMILIES.values():
            raise ValueError(
                f"The ranges of {group.family.name!r} memberships are not known, so there are no "
                "bounds: train with another mf."
            )
    if not (isinstance(tol, Real) and float(tol) >= 0.0):
        raise ValueError(f"tol={tol!r} must be a number, zero or positive.")
    check_count("max_boxes", max_boxes, 1)
    return model, read_box(box, model)


def read_box(box, model: TSKModel):
    """The box as an array (n_inputs, 2); inputs not given have the range of the training data."""
    rows, given = training_box(model).tolist(), {} if box is None else box
    if hasattr(given, "keys") and not isinstance(given, Mapping):
        # A Series or frame, with the inputs' names as labels of its columns or of its rows.
        given = dict(given if set(given.keys()) <= set(model.input_names) else given.T)
    if isinstance(given, Mapping):
        feature_indices(list(given) or None, model.input_names, "box")  # no column twice
        for name, ends in given.items():
            rows[feature_indices([name], model.input_names, "box")[0]] = ends
    else:
        rows = given
    try:
        found = np.array(rows, dtype=float)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (model.n_inputs, 2):
        raise ValueError(
            "box must have one (low, high) for each input ("
            f"{', '.join(map(repr, model.input_names))}), or be a dict from their names to (low, "
            f"high); got {box!r}."
        )
    for name, (low, high) in zip(model.input_names, found, strict=True):
        if not low <= high:
            raise ValueError(
                f"box has ({low:g}, {high:g}) for {name!r}: low must not be above high, and "
                "neither may be NaN."
            )
    return found


def varying_part(box, model: TSKModel, of_slopes):
    """Lows and highs of the part of a box in which predictions change, up to rounding."""
    reach, is_silent = reach_of(model), model.out_of_bounds in SILENT
    is_endless = model.out_of_bounds == "linear" and np.isinf(model.max_extrapolation)
    # Beyond the end of the way out, slopes are zero. That end is rounded: go past it by a few units
    # in the last place.
    rounding = 8.0 * np.finfo(float).eps * (np.abs(model.minimum) + np.abs(model.maximum) + reach)
    more = np.where((reach > 0.0) | (of_slopes and not is_silent), reach + rounding, 0.0)
    edges = np.stack([model.minimum - more, model.maximum + more])
    for name, (start, stop), (low, high) in zip(model.input_names, box, edges.T, strict=True):
        if is_silent and (start > high or stop < low):
            raise ValueError(
                f"box has ({start:g}, {stop:g}) for {name!r}, outside the range of the training "
                f"data: with out_of_bounds={model.out_of_bounds!r} the model predicts nothing "
                "there. Give a box that overlaps the range, or use another out_of_bounds."
            )
        if is_endless and not np.isfinite([start, stop]).all():
            raise ValueError(
                f"box has ({start:g}, {stop:g}) for {name!r}, but the model extrapolates without "
                "limit (max_extrapolation=inf), so its predictions there have no bounds. Give "
                "finite ends, or a finite max_extrapolation."
            )
    return np.clip(box.T, *edges)


def spread_points(low, high):
    """Points (n_points, n_inputs) all over a box, with all its corners if inputs are few."""
    unit = qmc.Halton(low.size, scramble=False).random(_POINTS)
    if low.size <= _MOST_INPUTS_OF_CORNERS:
        unit = np.vstack([np.indices((2,) * low.size).reshape(low.size, -1).T, unit])
    return np.clip(low + unit * (high - low), low, high)
