"""The only module that imports private or version-dependent names of scikit-learn.

Every name here exists at the oldest and the newest supported version. Differences between versions
are handled here and nowhere else.
"""

from collections.abc import Callable
from typing import TypeVar

from sklearn.base import _fit_context
from sklearn.utils import _safe_indexing as safe_indexing
from sklearn.utils._param_validation import (
    HasMethods,
    Hidden,
    Interval,
    StrOptions,
    validate_parameter_constraints,
)

try:
    from sklearn.callback import CallbackSupportMixin
except ImportError:  # before 1.9

    class CallbackSupportMixin:  # type: ignore[no-redef]
        """Stands in where scikit-learn has no callbacks."""


__all__ = [
    "CallbackSupportMixin",
    "HasMethods",
    "Hidden",
    "Interval",
    "StrOptions",
    "check_parameters",
    "fit_context",
    "safe_indexing",
    "validate_parameter_constraints",
]

_Method = TypeVar("_Method", bound=Callable)


def fit_context(*, prefer_skip_nested_validation: bool) -> Callable[[_Method], _Method]:
    """scikit-learn's decorator of ``fit``, typed so that checkers keep the method's signature."""
    return _fit_context(prefer_skip_nested_validation=prefer_skip_nested_validation)


def check_parameters(estimator):
    """Raise ValueError if a parameter violates ``_parameter_constraints``."""
    estimator._validate_params()
