"""Warnings of skanfis, and one error; others are ValueError, TypeError and NotFittedError."""

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
    """An input never changes in the training data, so that nothing can be learnt of it."""


class ConstraintWarning(UserWarning):
    """The data contradict what a fit was constrained to."""


class ForgottenRowsWarning(UserWarning):
    """``partial_fit`` follows ``fit``, whose rows do not count any more."""


class InfeasibleConstraintsError(ValueError):
    """No consequents of a rule base keep what a fit was constrained to, all at once."""


class OutOfBoundsWarning(UserWarning):
    """Rows asked for lie outside the box of the training data."""


class ReadabilityWarning(UserWarning):
    """The rules of a model are not fit to be read one by one."""


class SplitLeakWarning(UserWarning):
    """A split tests on rate levels or runs that it was trained on."""


class UnderdeterminedWarning(UserWarning):
    """There are more consequent parameters than distinct training rows."""
