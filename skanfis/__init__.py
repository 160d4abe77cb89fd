"""ANFIS, the adaptive neuro-fuzzy inference system, as a scikit-learn estimator."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .regressor import ANFISRegressor

__all__ = ["ANFISRegressor", "__version__"]

__version__ = "0.1.0"


def __dir__():
    return __all__


def __getattr__(name):
    # Imported on demand: libraries load slowly, and a command must handle Ctrl-C before that.
    if name == "ANFISRegressor":
        from .regressor import ANFISRegressor

        return ANFISRegressor
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
