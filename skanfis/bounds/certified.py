"""Bounds of predictions and of their slopes over a box: what a user calls."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from ..model import TSKModel
from .box import held_box, input_index, read_box
from .enclosure import Enclosure
from .search import largest
from .terms import is_known

__all__ = ["Bounds", "bounds", "cuts_of", "gradient_bounds", "monotonicity"]

# Rows that are looked at first: all corners, of so few inputs, and some between. They cost less
# than a batch of boxes, and the better the first answer, the more boxes need no look.
_CORNERS = 6
_POINTS = 512
# Of slopes, the strip beyond the edge in which they are zero, as part of the range.
_BEYOND = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class Bounds:
    """What outputs, or slopes, lie between on a box.

    Parameters
    ----------
    lower, upper : ndarray of shape (n_outputs,)
        Nothing in the box is below, or above.
    lowest, highest : ndarray of shape (n_outputs,)
        Values that are taken in the box: the true extremes lie between ``lower`` and ``lowest``,
        and between ``highest`` and ``upper``.
    at_lowest, at_highest : ndarray of shape (n_outputs, n_inputs)
        Where these are taken.
    box : ndarray of shape (n_inputs, 2)
        Of the inputs, low and high.
    n_boxes : int
        Boxes that were looked at.
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
        """The larger gap of either side, as part of ``highest - lowest``, (n_outputs,)."""
        gap = np.maximum(self.upper - self.highest, self.lowest - self.lower)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(gap > 0.0, gap / (self.highest - self.lowest), 0.0)

    @property
    def magnitude(self) -> np.ndarray:
        """What no absolute value in the box is above, (n_outputs,)."""
        return np.maximum(np.abs(self.lower), np.abs(self.upper))

    def __repr__(self):
        parts = [
            f"{name} in [{low:.6g}, {high:.6g}]"
            for name, low, high in zip(self.output_names, self.lower, self.upper, strict=True)
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

    By interval arithmetic on the rules, refined by branch and bound, with room for every rounding
    error. The bounds are of the model; they say nothing of how far it is from the truth.

    Parameters
    ----------
    model : fitted estimator or TSKModel
        An ANFIS estimator, or a Pipeline of scalers that ends in one, a TransformedTargetRegressor
        or a search over these, as :func:`~skanfis.export.export_c` takes them.
    box : array-like of shape (n_inputs, 2) or dict, default=None
        Low and high of every input, in the units of X; or {name: (low, high)}, the other inputs in
        the range of the training data. None is that range. Ends may be infinite, but with an
        infinite ``max_extrapolation``.
    tol : float, default=0.01
        How far bounds and values that are taken may be apart, as part of the range of the output in
        the box (of slopes: of the largest absolute one); zero or positive.
    max_boxes : int, default=200_000
        Boxes to look at for each bound, at the most; 1 or more. The bounds hold wherever this ends.

    Returns
    -------
    bounds : Bounds
        With ``out_of_bounds`` "nan" and "raise" those of the rows in range.

    Raises
    ------
    ValueError
        If the box is none; if nothing bounds the model on it; if a family of memberships is not
        one of the package, whose ranges are known.

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
    low, high = held_box(box, model)
    found = []
    for k in range(model.n_outputs):
        below, above = (Enclosure(model, k, sign) for sign in (-1.0, 1.0))
        values = above.predict(_first_points(low, high))
        sides = (below.values, -values), (above.values, values)
        found.append(_enclosed(model, low, high, sides, tol * float(np.ptp(values)), max_boxes))
    return _gathered(found, box, model, model.output_names)


def gradient_bounds(
    model: Any,
    feature: str | int,
    box: ArrayLike | dict[str, Any] | None = None,
    *,
    tol: float = 0.01,
    max_boxes: int = 200_000,
) -> Bounds:
    """Enclose the slope of the predictions by one input over a box of inputs, provably.

    Beyond the range of the training data it is the slope of what the model predicts there: of the
    tangent, and zero where the value is held. Where it jumps the slopes from all sides count.

    Parameters
    ----------
    model : fitted estimator or TSKModel
    feature : str or int
        The input, by name or position.
    box : array-like of shape (n_inputs, 2) or dict, default=None
    tol : float, default=0.01
    max_boxes : int, default=200_000
        As in :func:`bounds`.

    Returns
    -------
    bounds : Bounds
        Of the slope, in units of the output per unit of the input.

    Raises
    ------
    ValueError
        As :func:`bounds` does; if ``feature`` is no input.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.bounds import gradient_bounds
    >>> x = np.linspace(-1.0, 1.0, 200)[:, None]
    >>> model = ANFISRegressor(n_mfs=3).fit(x, np.tanh(2.0 * x[:, 0]))
    >>> slope = gradient_bounds(model, "x0")
    >>> bool(slope.lower[0] > 0.0 and slope.upper[0] < 2.2)
    True
    """
    model, box = _checked(model, box, tol, max_boxes)
    j = input_index(feature, model, "feature")
    low, high = held_box(box, model, _BEYOND)
    X, found = _first_points(low, high).T, []
    for k in range(model.n_outputs):
        slopes = [_slope_of(model, k, sign, j) for sign in (-1.0, 1.0)]
        sides = [(slope, slope(X, X)[2]) for slope in slopes]
        largest_slope = float(np.max(np.abs([values for _, values in sides])))
        found.append(_enclosed(model, low, high, sides, tol * largest_slope, max_boxes))
    name = model.input_names[j]
    return _gathered(found, box, model, tuple(f"d {y} / d {name}" for y in model.output_names))


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
        The input, by name or position.
    box : array-like of shape (n_inputs, 2) or dict, default=None
    max_boxes : int, default=200_000
        As in :func:`bounds`.

    Returns
    -------
    sign : ndarray of int of shape (n_outputs,)
        1: no prediction falls as the input rises, all else held; -1: none rises; 0: neither has
        been proven: it is not so, or by less than rounding errors, or takes more boxes.

    Raises
    ------
    ValueError
        As :func:`gradient_bounds` does.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.bounds import monotonicity
    >>> x = np.linspace(-1.0, 1.0, 200)[:, None]
    >>> model = ANFISRegressor(n_mfs=3).fit(x, np.tanh(2.0 * x[:, 0]))
    >>> monotonicity(model, "x0")
    array([1])
    """
    model, box = _checked(model, box, 0.0, max_boxes)
    j = input_index(feature, model, "feature")
    low, high = held_box(box, model, _BEYOND)
    signs = np.zeros(model.n_outputs, dtype=int)
    for k in range(model.n_outputs):
        for sign in (1, -1):
            slope = _slope_of(model, k, -float(sign), j)
            found = largest(slope, low, high, 0.0, max_boxes, cuts_of(model), until=0.0)
            if found.bound <= 0.0:
                signs[k] = sign
                break
    return signs


def cuts_of(model):
    """Where boxes are cut first: the ends of the range of the training data, (n_inputs, 2)."""
    return np.stack([model.minimum, model.maximum], axis=1)


def _enclosed(model, low, high, sides, tolerance, max_boxes):
    """What is found of the lower and the upper side of an output, on a box.

    ``sides`` has for both what bounds it on boxes, and its values at the first points.
    """
    X, ends = _first_points(low, high), []
    for evaluate, values in sides:
        top = int(values.argmax())
        point = X[top][:, None]
        bound, _, attained, _ = evaluate(point, point)
        # Bound and value are apart by rounding, beneath which no bound can go.
        least = max(tolerance, 8.0 * float(bound[0] - attained[0]))
        start = X[top], float(values[top])
        ends.append(largest(evaluate, low, high, least, max_boxes, cuts_of(model), start))
    return ends


def _slope_of(model, output, sign, j):
    enclosure = Enclosure(model, output, sign)
    return lambda low, high: enclosure.slope(low, high, j)


def _checked(model, box, tol, max_boxes):
    """The frozen model in the user's units, and the box."""
    if not isinstance(model, TSKModel):
        # What reads estimators stands above the models that training proves things of.
        from ..export import fold

        model = fold(model)
    for group in model.antecedent.groups:
        if not is_known(group.family):
            raise ValueError(
                f"The ranges of {group.family.name!r} memberships are not known: bounds can be "
                "proven for the families of skanfis.membership alone."
            )
    if not (np.ndim(tol) == 0 and tol >= 0.0):
        raise ValueError(f"tol={tol!r} must be zero or positive.")
    if not (np.ndim(max_boxes) == 0 and max_boxes >= 1):
        raise ValueError(f"max_boxes={max_boxes!r} must be 1 or more.")
    return model, read_box(box, model)


def _first_points(low, high):
    """Rows of the box to begin with."""
    unit = qmc.Halton(low.size, scramble=False).random(_POINTS)
    if low.size <= _CORNERS:
        corners = np.indices((2,) * low.size).reshape(low.size, -1).T
        unit = np.vstack([corners, unit])
    return np.clip(low + unit * (high - low), low, high)


def _gathered(found, box, model, output_names):
    lowest, highest = (tuple(ends[side] for ends in found) for side in (0, 1))
    return Bounds(
        lower=np.array([-one.bound for one in lowest]),
        upper=np.array([one.bound for one in highest]),
        lowest=np.array([-one.attained for one in lowest]),
        highest=np.array([one.attained for one in highest]),
        at_lowest=np.array([one.point for one in lowest]),
        at_highest=np.array([one.point for one in highest]),
        box=box,
        n_boxes=sum(one.n_boxes for ends in found for one in ends),
        converged=all(one.converged for ends in found for one in ends),
        input_names=model.input_names,
        output_names=output_names,
    )
