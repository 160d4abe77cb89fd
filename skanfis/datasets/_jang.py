"""The benchmarks of Jang 1993, by the formulas of that paper."""

from math import isclose

import numpy as np

from ._validation import check_choice, check_count, check_real

__all__ = ["make_jang_sinc", "make_jang_three_input", "make_mackey_glass"]


def make_jang_sinc(n_points: int = 11, *, midpoints: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Make Jang's first problem: the two-dimensional sinc surface on a regular grid.

    The target is y = sin(x1) / x1 * sin(x2) / x2 on [-10, 10] x [-10, 10].

    Parameters
    ----------
    n_points : int, default=11
        Number of grid points along each input, at least 2; Jang took 11.
    midpoints : bool, default=False
        Give the centres of the grid's cells in place of its corners: the points as far as possible
        from those a model was trained on.

    Returns
    -------
    X : ndarray of shape (n_points**2, 2), or ((n_points - 1)**2, 2) for the midpoints
        Inputs in [-10, 10], the second changing fastest.
    y : ndarray of shape (n_points**2,) or ((n_points - 1)**2,)
        Targets in [-0.22, 1], by default at least -0.19.

    Raises
    ------
    TypeError, ValueError
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
    >>> make_jang_sinc(midpoints=True)[0].shape
    (100, 2)
    """
    n_points = check_count(n_points, "n_points", min_val=2)
    axis = np.linspace(-10.0, 10.0, n_points)
    if midpoints:
        axis = 0.5 * (axis[1:] + axis[:-1])
    X = _grid(axis, 2)
    # numpy's sinc(u) is sin(pi u) / (pi u).
    return X, np.sinc(X / np.pi).prod(axis=1)


def make_jang_three_input(subset: str = "train") -> tuple[np.ndarray, np.ndarray]:
    """Make Jang's second problem: a nonlinear function of three inputs.

    The target is y = (1 + x1^0.5 + x2^-1 + x3^-1.5)^2, from Takagi and Hayashi.

    Parameters
    ----------
    subset : {"train", "check", "all"}, default="train"
        The 216 training points (1, 2, ..., 6 in each input), the 125 checking points
        (1.5, 2.5, ..., 5.5 in each), or both, in this order.

    Returns
    -------
    X : ndarray of shape (216, 3), (125, 3) or (341, 3)
        Inputs in [1, 6], the third changing fastest.
    y : ndarray of shape (216,), (125,) or (341,)
        Targets in [4.9, 29.7].

    Raises
    ------
    ValueError
        If ``subset`` is unknown.

    Notes
    -----
    Jang's figure of merit is the average percentage error, 100 mean(abs(y - prediction) / abs(y)).

    References
    ----------
    J.-S. R. Jang, "ANFIS: Adaptive-Network-Based Fuzzy Inference System", IEEE Transactions on
    Systems, Man, and Cybernetics 23(3), 1993, 665-685, example 2.

    Examples
    --------
    >>> from skanfis.datasets import make_jang_three_input
    >>> X, y = make_jang_three_input()
    >>> X.shape, float(y[0])
    ((216, 3), 16.0)
    """
    check_choice(subset, "subset", ("train", "check", "all"))
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
        Step of the integration, which must divide 1.

    Returns
    -------
    X : ndarray of shape (500, 4) or (1000, 4)
        x(t - 18), x(t - 12), x(t - 6), x(t), in time's order; in [0.4, 1.4] by default.
    y : ndarray of shape (500,) or (1000,)
        x(t + 6), of the same range.

    Raises
    ------
    TypeError, ValueError
        If a parameter is of the wrong type or range, or ``step`` does not divide 1 and ``tau``.

    Notes
    -----
    Classical fourth-order Runge-Kutta; in the middle of a step the delayed value is the mean of
    its neighbours. The series is a convention, not the solution of the equation: x jumps at t = 0,
    and the one step that reads across this jump is of the first order only, after which chaos
    magnifies the difference. Leave ``step`` at its default to compare with published errors.

    References
    ----------
    M. C. Mackey, L. Glass, "Oscillation and Chaos in Physiological Control Systems", Science 197,
    1977, 287-289.

    J.-S. R. Jang, "ANFIS: Adaptive-Network-Based Fuzzy Inference System", IEEE Transactions on
    Systems, Man, and Cybernetics 23(3), 1993, 665-685, example 4.

    Examples
    --------
    >>> from skanfis.datasets import make_mackey_glass
    >>> X, y = make_mackey_glass()
    >>> X.shape, round(float(y[0]), 4)
    ((500, 4), 1.0243)
    """
    check_choice(subset, "subset", ("train", "check", "all"))
    tau = check_real(tau, "tau", min_val=0, include_boundaries="neither")
    initial_value = check_real(initial_value, "initial_value", min_val=0)
    step = check_real(step, "step", min_val=0, max_val=1, include_boundaries="right")
    t = np.arange(118, 1118)
    series = _mackey_glass_series(t[-1] + 6, tau, initial_value, step)
    rows = {"train": slice(None, 500), "check": slice(500, None), "all": slice(None)}[subset]
    X = np.column_stack([series[t - lag] for lag in (18, 12, 6, 0)])
    return X[rows], series[t + 6][rows]


def _mackey_glass_series(last_time, tau, initial_value, step):
    """x(0), x(1), ..., x(last_time) by fourth-order Runge-Kutta."""
    steps_per_unit = _whole_steps(1.0, step, "1")
    delay = _whole_steps(tau, step, "tau")
    x = [0.0] * delay + [initial_value]  # from t = -tau on
    for i in range(last_time * steps_per_unit):
        x.append(_runge_kutta_step(x[-1], x[i], x[i + 1], step))
    return np.array(x[delay::steps_per_unit])


def _runge_kutta_step(x, delayed, delayed_next, step):
    """x one step later, from the delayed values at the step's two ends."""
    gain = _mackey_glass_gain(delayed)
    gain_middle = _mackey_glass_gain(0.5 * (delayed + delayed_next))
    gain_next = _mackey_glass_gain(delayed_next)
    slope_1 = gain - 0.1 * x
    slope_2 = gain_middle - 0.1 * (x + 0.5 * step * slope_1)
    slope_3 = gain_middle - 0.1 * (x + 0.5 * step * slope_2)
    slope_4 = gain_next - 0.1 * (x + step * slope_3)
    return x + step / 6.0 * (slope_1 + 2.0 * slope_2 + 2.0 * slope_3 + slope_4)


def _mackey_glass_gain(delayed):
    return 0.2 * delayed / (1.0 + delayed**10)


def _whole_steps(length, step, name):
    """Number of steps in a length, which must be whole."""
    n_steps = round(length / step)
    if n_steps < 1 or not isclose(n_steps * step, length, rel_tol=1e-9):
        raise ValueError(f"step == {step}, must divide {name} into a whole number of steps.")
    return n_steps


def _grid(axis, n_inputs):
    """All combinations of the values of one axis, the last input changing fastest."""
    return np.stack(np.meshgrid(*[axis] * n_inputs, indexing="ij"), axis=-1).reshape(-1, n_inputs)
