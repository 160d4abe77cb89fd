"""Conformal prediction intervals (split, cross, leave-one-out) with coverage by row or group."""

from .conformal import ConformalRegressor

__all__ = ["ConformalRegressor"]
