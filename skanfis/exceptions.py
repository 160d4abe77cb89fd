"""Warnings of skanfis and one error; other errors are ValueError, TypeError, NotFittedError.

To silence one, or to make it an error, name it in a filter of :mod:`warnings`:

>>> import warnings
>>> from skanfis.exceptions import OutOfBoundsWarning
>>> warnings.filterwarnings("ignore", category=OutOfBoundsWarning)
"""

__all__ = [
    "ConstantInputWarning",
    "ConstraintWarning",
    "ForgottenRowsWarning",
    "InfeasibleConstraintsError",
    "OutOfBoundsWarning",
    "UnderdeterminedWarning",
]


class ConstantInputWarning(UserWarning):
    """An input never changes in the training data, so that ``fit`` can learn nothing of it.

    Drop the column, or train on data in which it varies.
    """


class ConstraintWarning(UserWarning):
    """The data contradict the constraints of ``fit``, or keeping these makes it much worse.

    Look at the data, or at the sign of the constraint.
    """


class ForgottenRowsWarning(UserWarning):
    """``partial_fit`` was called after ``fit``: the rows of ``fit`` no longer count.

    Give all rows that count to ``partial_fit``.
    """


class InfeasibleConstraintsError(ValueError):
    """No consequents of the rule base satisfy all constraints of ``fit``.

    The message names the constraints that cannot be met.
    """


class OutOfBoundsWarning(UserWarning):
    """Rows to predict lie outside the range of the training data, input by input.

    ``predict`` and ``score`` warn with ``out_of_bounds="linear"``; ``in_bounds(X)`` tells the rows.
    """


class UnderdeterminedWarning(UserWarning):
    """The training rows determine fewer rules than ``fit`` was given.

    Take fewer rules, or ``order=0``, and judge the model on rows held out.
    """
