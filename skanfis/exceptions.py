"""Warnings of skanfis, and one error; others are ValueError, TypeError and NotFittedError.

To silence one, or to make it an error, name it in a filter of :mod:`warnings`:
``warnings.filterwarnings("ignore", category=OutOfBoundsWarning)``.
"""

__all__ = [
    "ConstantInputWarning",
    "ConstraintWarning",
    "ForgottenRowsWarning",
    "InfeasibleConstraintsError",
    "OutOfBoundsWarning",
    "ReadabilityWarning",
    "SplitLeakWarning",
    "UnderdeterminedWarning",
]


class ConstantInputWarning(UserWarning):
    """An input never changes in the training data, so that nothing can be learnt of it.

    From ``fit``. Drop the column, or train on data in which it varies.

    Examples
    --------
    >>> import warnings
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.exceptions import ConstantInputWarning
    >>> warnings.simplefilter("error", ConstantInputWarning)
    >>> ANFISRegressor(n_mfs=1).fit([[0.0, 5.0], [1.0, 5.0]], [0.0, 1.0])
    Traceback (most recent call last):
        ...
    skanfis.exceptions.ConstantInputWarning: Constant in the training data: column 'x1' ...
    """


class ConstraintWarning(UserWarning):
    """The data contradict what a fit was constrained to.

    From ``fit`` with ``monotonic_cst`` or ``constraints``, where noise alone would ask for so much
    in less than one fit of a thousand. Look at the data, or at the sign of the constraint.

    Examples
    --------
    >>> import warnings
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.exceptions import ConstraintWarning
    >>> warnings.simplefilter("error", ConstraintWarning)
    >>> X = np.linspace(0.0, 1.0, 50).reshape(-1, 1)
    >>> ANFISRegressor(n_mfs=1, monotonic_cst=[-1]).fit(X, X[:, 0])
    Traceback (most recent call last):
        ...
    skanfis.exceptions.ConstraintWarning: ...
    """


class ForgottenRowsWarning(UserWarning):
    """``partial_fit`` follows ``fit``, whose rows do not count any more.

    Give ``partition=model`` a model to go on from, and all rows that count to ``partial_fit``.

    Examples
    --------
    >>> import warnings
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.exceptions import ForgottenRowsWarning
    >>> warnings.simplefilter("error", ForgottenRowsWarning)
    >>> X, y = make_jang_sinc()
    >>> ANFISRegressor(n_mfs=2, solver="lse").fit(X, y).partial_fit(X, y)
    Traceback (most recent call last):
        ...
    skanfis.exceptions.ForgottenRowsWarning: ...
    """


class InfeasibleConstraintsError(ValueError):
    """No consequents of a rule base keep what a fit was constrained to, all at once.

    From ``fit`` with ``constraints``; the message names what cannot be kept.

    Examples
    --------
    >>> import numpy as np
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.bounds import FixedPoint
    >>> X = np.linspace(0.0, 1.0, 20).reshape(-1, 1)
    >>> points = [FixedPoint([x], y) for x, y in ((0.1, 0.0), (0.5, 1.0), (0.9, 0.0))]
    >>> ANFISRegressor(n_mfs=1, constraints=points).fit(X, X[:, 0])
    Traceback (most recent call last):
        ...
    skanfis.exceptions.InfeasibleConstraintsError: ...
    """


class OutOfBoundsWarning(UserWarning):
    """Rows asked for lie outside the range of the training data, input by input.

    From ``predict`` and ``score`` with ``out_of_bounds="linear"``; the message names the columns,
    their ranges and what was found. ``in_bounds(X)`` tells the rows.

    Examples
    --------
    >>> import warnings
    >>> from skanfis import ANFISRegressor
    >>> warnings.simplefilter("error")
    >>> ANFISRegressor(n_mfs=1).fit([[0.0], [1.0]], [0.0, 1.0]).predict([[2.0]])
    Traceback (most recent call last):
        ...
    skanfis.exceptions.OutOfBoundsWarning: X lies outside the training data: 'x0' in 1 of 1 rows ...
    """


class ReadabilityWarning(UserWarning):
    """The rules of a model are not fit to be read one by one.

    From ``export_text`` and ``rules_table``, with the findings of the fit's ``readability_``.

    Examples
    --------
    >>> import warnings
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.exceptions import ReadabilityWarning
    >>> from skanfis.inspection import export_text
    >>> warnings.simplefilter("error", ReadabilityWarning)
    >>> X, y = make_jang_sinc()
    >>> export_text(ANFISRegressor(n_mfs=4, solver="lse", agreement=0.0, alpha=0.0).fit(X, y))
    Traceback (most recent call last):
        ...
    skanfis.exceptions.ReadabilityWarning: ...
    """


class SplitLeakWarning(UserWarning):
    """A split tests on rate levels or runs that it was trained on.

    From :func:`skanfis.gyro.check_split`; hold out whole levels or runs.

    Examples
    --------
    >>> import warnings
    >>> import numpy as np
    >>> from sklearn.model_selection import KFold
    >>> from skanfis.exceptions import SplitLeakWarning
    >>> from skanfis.gyro import check_split
    >>> warnings.simplefilter("error", SplitLeakWarning)
    >>> rate = np.repeat([-100.0, 0.0, 100.0], 20)
    >>> check_split(KFold(3, shuffle=True, random_state=0).split(rate), rate=rate)
    Traceback (most recent call last):
        ...
    skanfis.exceptions.SplitLeakWarning: ...
    """


class UnderdeterminedWarning(UserWarning):
    """The training rows do not tell so many rules.

    From ``fit``, of a structure that is given: there are more consequent parameters than distinct
    training rows, or at more than 7.5 % of places half-way between rows less is known than a single
    row there would tell, as where they lie on a few curves; the latter is not sought where all
    weights of the penalty are given. Take fewer rules, or ``order=0``, and judge the model on rows
    held out.

    Examples
    --------
    >>> import warnings
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.exceptions import UnderdeterminedWarning
    >>> warnings.simplefilter("error", UnderdeterminedWarning)
    >>> ANFISRegressor(n_mfs=3).fit([[0.0], [1.0], [2.0]], [0.0, 1.0, 4.0])
    Traceback (most recent call last):
        ...
    skanfis.exceptions.UnderdeterminedWarning: 3 rules with 2 coefficients each are 6 ...
    """
