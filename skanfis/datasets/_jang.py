"""The benchmarks of Jang 1993, by the formulas of that paper."""

from math import isclose
from numbers import Integral, Real

import numpy as np

from .._sklearn import Interval, StrOptions, validate_parameter_constraints

__all__ = ["make_jang_sinc", "make_jang_three_input", "make_mackey_glass"]

_SUBSET = [StrOptions({"train", "check", "all"})]


def make_jang_sinc(n_points: int = 11, *, midpoints: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Make Jang's first problem: y = sin(x1) / x1 * sin(x2) / x2 on a grid over [-10, 10]^2.

    Parameters
    ----------
    n_points : int, default=11
        Number of grid points along each input, at least 2; Jang took 11.
    midpoints : bool, default=False
        Give the centres of the grid's cells in place of its corners.

    Returns
    -------
    X : ndarray of shape (n_points**2, 2), or ((n_points - 1)**2, 2) for the midpoints
        The second input changes fastest.
    y : ndarray of shape (n_points**2,) or ((n_points - 1)**2,)

    Raises
    ------
    ValueError
        If ``n_points`` is not an integer of at least 2.

    References
    ----------
    J.-S. R. Jang, "ANFIS: Adaptive-Network-Based Fuzzy Inference System", IEEE Transactions on
    Systems, Man, and Cybernetics 23(3), 1993, 665-685, example 1.

    Examples
    --------
    >>> from skanfis.datasets import make_jang_sinc
    >>> X, y = make_jang_sinc()
    >>> X.shape, float(y.max())
    ((121, 2), 1.0)
    """
    constraints = {"n_points": [Interval(Integral, 2, None, closed="left")]}
    validate_parameter_constraints(constraints, {"n_points": n_points}, "make_jang_sinc")
    axis = np.linspace(-10.0, 10.0, n_points)
    if midpoints:
        axis = 0.5 * (axis[1:] + axis[:-1])
    X = _grid(axis, 2)
    # numpy's sinc(u) is sin(pi u) / (pi u).
    return X, np.sinc(X / np.pi).prod(axis=1)


def make_jang_three_input(subset: str = "train") -> tuple[np.ndarray, np.ndarray]:
    """Make Jang's second problem: y = (1 + x1^0.5 + x2^-1 + x3^-1.5)^2.

    Jang's figure of merit is the mean of 100 abs(y - prediction) / abs(y).

    Parameters
    ----------
    subset : {"train", "check", "all"}, default="train"
        The 216 training points (1, 2, ..., 6 in each input), the 125 checking points
        (1.5, 2.5, ..., 5.5 in each), or both, in this order.

    Returns
    -------
    X : ndarray of shape (216, 3), (125, 3) or (341, 3)
        The third input changes fastest.
    y : ndarray of shape (216,), (125,) or (341,)

    Raises
    ------
    ValueError
        If ``subset`` is unknown.

    References
    ----------
    As for :func:`make_jang_sinc`, example 2.

    Examples
    --------
    >>> from skanfis.datasets import make_jang_three_input
    >>> X, y = make_jang_three_input()
    >>> X.shape, float(y[0])
    ((216, 3), 16.0)
    """
    validate_parameter_constraints({"subset": _SUBSET}, {"subset": subset}, "make_jang_three_input")
    train, check = _grid(np.arange(1.0, 7.0), 3), _grid(np.arange(1.5, 6.0), 3)
    X = {"train": train, "check": check, "all": np.vstack([train, check])}[subset]
    return X, (1.0 + X[:, 0] ** 0.5 + 1.0 / X[:, 1] + X[:, 2] ** -1.5) ** 2


def make_mackey_glass(
    subset: str = "train", *, tau: float = 17, initial_value: float = 1.2, step: float = 0.1
) -> tuple[np.ndarray, np.ndarray]:
    """Make Jang's fourth problem: predict the chaotic Mackey-Glass series.

    The series solves dx/dt = 0.2 x(t - tau) / (1 + x(t - tau)^10) - 0.1 x(t). From its values at
    t - 18, t - 12, t - 6 and t, the value at t + 6 is to be predicted, for t = 118, ..., 1117.

    Parameters
    ----------
    subset : {"train", "check", "all"}, default="train"
        The first 500 rows, the last 500, or all 1000.
    tau : float, default=17
        Delay, a positive multiple of ``step``; chaotic above about 16.8.
    initial_value : float, default=1.2
        x(0); before it the series is zero.
    step : float, default=0.1
        Step of the integration (Runge-Kutta of order 4), which must divide 1. Leave it as it is to
        compare with published errors: chaos magnifies the error of the step that reads across the
        jump at t = 0.

    Returns
    -------
    X : ndarray of shape (500, 4) or (1000, 4)
        x(t - 18), x(t - 12), x(t - 6), x(t), in time's order.
    y : ndarray of shape (500,) or (1000,)
        x(t + 6).

    Raises
    ------
    ValueError
        If a parameter is of the wrong type or range, or ``step`` does not divide 1 and ``tau``.

    References
    ----------
    M. C. Mackey, L. Glass, "Oscillation and Chaos in Physiological Control Systems", Science 197,
    1977, 287-289. Jang as for :func:`make_jang_sinc`, example 4.

    Examples
    --------
    >>> from skanfis.datasets import make_mackey_glass
    >>> X, y = make_mackey_glass()
    >>> X.shape, round(float(y[0]), 4)
    ((500, 4), 1.0243)
    """
    constraints = {
        "subset": _SUBSET,
        "tau": [Interval(Real, 0, None, closed="neither")],
        "initial_value": [Interval(Real, 0, None, closed="left")],
        "step": [Interval(Real, 0, 1, closed="right")],
    }
    validate_parameter_constraints(constraints, locals(), "make_mackey_glass")
    t = np.arange(118, 1118)
    series = _mackey_glass_series(t[-1] + 6, tau, initial_value, step)
    rows = {"train": slice(None, 500), "check": slice(500, None), "all": slice(None)}[subset]
    X = np.column_stack([series[t - lag] for lag in (18, 12, 6, 0)])
    return X[rows], series[t + 6][rows]


def _mackey_glass_series(last_time, tau, initial_value, step):
    """x(0), x(1), ..., x(last_time); in the middle of a step the delayed value is a mean."""
    steps_per_unit = _whole_steps(1.0, step, "1")
    delay = _whole_steps(tau, step, "tau")
    x = [0.0] * delay + [float(initial_value)]  # from t = -tau on
    for i in range(last_time * steps_per_unit):
        now, delayed, delayed_next = x[-1], x[i], x[i + 1]
        gain, gain_middle, gain_next = (
            0.2 * value / (1.0 + value**10)
            for value in (delayed, 0.5 * (delayed + delayed_next), delayed_next)
        )
        slope_1 = gain - 0.1 * now
        slope_2 = gain_middle - 0.1 * (now + 0.5 * step * slope_1)
        slope_3 = gain_middle - 0.1 * (now + 0.5 * step * slope_2)
        slope_4 = gain_next - 0.1 * (now + step * slope_3)
        x.append(now + step / 6.0 * (slope_1 + 2.0 * slope_2 + 2.0 * slope_3 + slope_4))
    return np.array(x[delay::steps_per_unit])


def _whole_steps(length, step, name):
    """Number of steps in a length, which must be whole."""
    n_steps = round(length / step)
    if n_steps < 1 or not isclose(n_steps * step, length, rel_tol=1e-9):
        raise ValueError(f"step == {step}, must divide {name} into a whole number of steps.")
    return n_steps


def _grid(axis, n_inputs):
    """All combinations of the values of one axis, the last input changing fastest."""
    return np.stack(np.meshgrid(*[axis] * n_inputs, indexing="ij"), axis=-1).reshape(-1, n_inputs)
