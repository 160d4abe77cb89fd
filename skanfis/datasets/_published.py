"""Data from papers: the benchmarks of Jang 1993, by formula, and Table 1 of Sun et al. 2009."""

from importlib.resources import files

import numpy as np
import pandas as pd
from sklearn.utils import Bunch

from .._sklearn import StrOptions, validate_parameter_constraints

_SUBSET = {"subset": [StrOptions({"train", "check", "all"})]}


def load_ofog() -> Bunch:
    """Load Table 1 of the founding paper: 19 rows of an open-loop fiber-optic gyro (regression).

    It is a historical document, kept as printed, and no benchmark; see ``DESCR``. For data to
    develop a compensation, see :func:`make_ofog`.

    Returns
    -------
    table : :class:`~sklearn.utils.Bunch`
        With DataFrames ``data`` (19, 3): time since power-on [s], temperature [degC], angular rate
        [deg/s]; ``target`` (19,): output of the gyro [deg/s]; ``frame``, both together; and
        ``DESCR``.

    Examples
    --------
    >>> from skanfis.datasets import load_ofog
    >>> load_ofog().data.shape
    (19, 3)
    """
    folder = files("skanfis.datasets")
    with folder.joinpath("sun_2009.csv").open(encoding="utf-8") as table:
        frame = pd.read_csv(table, dtype=float)
    data, target = frame.drop(columns="output"), frame["output"]
    description = folder.joinpath("sun_2009.txt").read_text(encoding="utf-8")
    return Bunch(data=data, target=target, frame=frame, DESCR=description)


def make_jang_sinc(*, midpoints: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Make Jang's first problem: y = sin(x1) / x1 * sin(x2) / x2 on a grid over [-10, 10]^2.

    Parameters
    ----------
    midpoints : bool, default=False
        Give the centres of the grid's cells in place of its corners.

    Returns
    -------
    X : ndarray of shape (121, 2), or (100, 2) for the midpoints
        The second input changes fastest.
    y : ndarray of shape (121,) or (100,)

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
    axis = np.linspace(-10.0, 10.0, 11)
    if midpoints:
        axis = 0.5 * (axis[1:] + axis[:-1])
    X = _grid(axis, 2)
    # numpy's sinc(u) is sin(pi u) / (pi u).
    return X, np.sinc(X / np.pi).prod(axis=1)


def make_jang_three_input(subset: str = "train") -> tuple[np.ndarray, np.ndarray]:
    """Make Jang's second problem: y = (1 + x1^0.5 + x2^-1 + x3^-1.5)^2.

    It is example 2 of the paper that :func:`make_jang_sinc` names. Jang's figure of merit is the
    mean of 100 abs(y - prediction) / abs(y).

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

    Examples
    --------
    >>> from skanfis.datasets import make_jang_three_input
    >>> X, y = make_jang_three_input()
    >>> X.shape, float(y[0])
    ((216, 3), 16.0)
    """
    validate_parameter_constraints(_SUBSET, {"subset": subset}, "make_jang_three_input")
    train, check = _grid(np.arange(1.0, 7.0), 3), _grid(np.arange(1.5, 6.0), 3)
    X = {"train": train, "check": check, "all": np.vstack([train, check])}[subset]
    return X, (1.0 + X[:, 0] ** 0.5 + 1.0 / X[:, 1] + X[:, 2] ** -1.5) ** 2


def make_mackey_glass(subset: str = "train") -> tuple[np.ndarray, np.ndarray]:
    """Make Jang's fourth problem: predict the chaotic Mackey-Glass series (Science 197, 1977).

    The series solves dx/dt = 0.2 x(t - 17) / (1 + x(t - 17)^10) - 0.1 x(t) with x(0) = 1.2, and
    zero before. From its values at t - 18, t - 12, t - 6 and t, the value at t + 6 is to be
    predicted, for t = 118, ..., 1117.

    Parameters
    ----------
    subset : {"train", "check", "all"}, default="train"
        The first 500 rows, the last 500, or all 1000.

    Returns
    -------
    X : ndarray of shape (500, 4) or (1000, 4)
        x(t - 18), x(t - 12), x(t - 6), x(t), in time's order.
    y : ndarray of shape (500,) or (1000,)
        x(t + 6).

    Examples
    --------
    >>> from skanfis.datasets import make_mackey_glass
    >>> X, y = make_mackey_glass()
    >>> X.shape, round(float(y[0]), 4)
    ((500, 4), 1.0243)
    """
    validate_parameter_constraints(_SUBSET, {"subset": subset}, "make_mackey_glass")
    t = np.arange(118, 1118)
    series = _mackey_glass_series(t[-1] + 6)
    rows = {"train": slice(None, 500), "check": slice(500, None), "all": slice(None)}[subset]
    X = np.column_stack([series[t - lag] for lag in (18, 12, 6, 0)])
    return X[rows], series[t + 6][rows]


def _mackey_glass_series(last_time, steps_per_unit=10):
    """x(0), x(1), ..., x(last_time) by Runge and Kutta's method of order 4.

    In the middle of a step the delayed value is a mean. Published errors use 10 steps per unit; the
    number matters, because chaos magnifies the error of the step across the jump at t = 0.
    """
    step = 1.0 / steps_per_unit
    x = [0.0] * (17 * steps_per_unit) + [1.2]  # from t = -17 on
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
    return np.array(x[17 * steps_per_unit :: steps_per_unit])


def _grid(axis, n_inputs):
    """All combinations of the values of one axis, the last input changing fastest."""
    return np.stack(np.meshgrid(*[axis] * n_inputs, indexing="ij"), axis=-1).reshape(-1, n_inputs)
