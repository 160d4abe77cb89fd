"""Table 1 of the founding paper, as printed."""

from typing import Any

import numpy as np
import pandas as pd
from sklearn.utils import Bunch

__all__ = ["load_ofog"]

_FEATURE_NAMES = ["time", "temperature", "rate"]
_TARGET_NAME = "output"

# Columns: time [s], temperature [degC], rate [deg/s], output [deg/s].
_TABLE = (
    (0, 20.55, 38.6839, 39.5906),
    (20, 21.03, 37.6859, 39.9941),
    (40, 20.56, 38.6894, 39.9914),
    (60, 20.96, 38.6858, 39.9903),
    (80, 21.22, 39.6885, 39.9928),
    (100, 20.99, 39.6773, 39.9900),
    (120, 20.65, 38.6969, 39.9812),
    (140, 20.54, 37.6788, 39.9906),
    (160, 20.47, 39.6916, 40.0014),
    (180, 21.01, 38.6919, 39.9826),
    (200, 21.32, 37.6808, 39.9964),
    (220, 21.06, 38.6837, 39.8965),
    (240, 20.93, 39.6786, 39.9924),
    (260, 20.82, 38.6911, 39.9890),
    (280, 20.64, 38.6887, 39.7843),
    (300, 20.74, 38.6931, 39.9880),
    (320, 20.98, 38.6858, 39.8967),
    (340, 20.82, 38.6901, 39.9930),
    (360, 20.59, 38.6930, 39.9820),
)

_DESCRIPTION = """\
Open-loop fiber-optic gyro, Table 1 of Sun et al. 2009
------------------------------------------------------

:Number of rows: 19, one every 20 s from 0 to 360 s
:Features: time since power-on [s], temperature [degC], angular rate [deg/s]
:Target: output of the gyro [deg/s]
:Missing values: none

Source: Y. Liu, Y. Sun, Y. Lu, D. Li, L. Li, Y. Pan, "Study of ANFIS Modeling Algorithm for
Eliminating the Fiber Optic Gyro Nonlinear Error", Chinese Journal of Lasers 36 (Supplement 2),
2009, 27-29, doi:10.3788/CJL200936s2.0027. The values are kept exactly as printed.

Do not judge a model by its fit to this table:

* The text speaks of 20 rows; 19 are printed.
* The rate column is damaged. Its fractional parts agree (standard deviation 0.005 deg/s), while
  the digit before the point jumps between 7, 8 and 9 from row to row, without any trace of the
  jump in the output, which stays at 39.99 deg/s.
* The outputs 39.5906 (at 0 s) and 39.7843 (at 280 s) stand apart from all others by far more than
  these differ among themselves.
* All temperatures lie between 20.47 and 21.32 degC: one window of 1 degC.
* The paper trains 36 rules, that is 108 linear parameters, on these rows, and tests only on
  0 to 120 s of the same rows. No row is left to test a model on.
"""


def load_ofog(*, return_X_y: bool = False, as_frame: bool = True) -> Any:
    """Load Table 1 of the founding paper: 19 rows of an open-loop fiber-optic gyro (regression).

    A historical document, kept as printed, and no benchmark: the column of rates is damaged, two
    outputs stand apart, and all rows lie in one window of 1 degC. ``DESCR`` has the details. For
    data to develop a compensation on, see :func:`make_ofog`.

    Parameters
    ----------
    return_X_y : bool, default=False
        Return ``(data, target)`` in place of a Bunch.
    as_frame : bool, default=True
        Give data and target as pandas objects; otherwise as NumPy arrays.

    Returns
    -------
    data : :class:`~sklearn.utils.Bunch`
        With ``data``, of shape (19, 3): time since power-on [s], temperature [degC], angular rate
        [deg/s]; ``target``, of shape (19,): output of the gyro [deg/s]; ``frame``, both together
        if ``as_frame=True``; ``feature_names``, ``target_names`` and ``DESCR``.
    (data, target) : tuple, if ``return_X_y=True``
        The first two of these.

    References
    ----------
    Y. Liu, Y. Sun, Y. Lu, D. Li, L. Li, Y. Pan, "Study of ANFIS Modeling Algorithm for Eliminating
    the Fiber Optic Gyro Nonlinear Error", Chinese Journal of Lasers 36 (Supplement 2), 2009,
    27-29, doi:10.3788/CJL200936s2.0027, Table 1.

    Examples
    --------
    >>> from skanfis.datasets import load_ofog
    >>> load_ofog().data.shape
    (19, 3)
    """
    frame = pd.DataFrame(_TABLE, columns=[*_FEATURE_NAMES, _TARGET_NAME], dtype=np.float64)
    columns = frame[_FEATURE_NAMES], frame[_TARGET_NAME]
    data, target = columns if as_frame else (column.to_numpy() for column in columns)
    if return_X_y:
        return data, target
    return Bunch(
        data=data,
        target=target,
        frame=frame if as_frame else None,
        feature_names=list(_FEATURE_NAMES),
        target_names=[_TARGET_NAME],
        DESCR=_DESCRIPTION,
    )
