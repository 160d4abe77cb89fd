"""ANFIS, the adaptive neuro-fuzzy inference system, as a scikit-learn estimator."""

from .regressor import ANFISRegressor

__all__ = ["ANFISRegressor", "__version__"]

__version__ = "0.1.0"
