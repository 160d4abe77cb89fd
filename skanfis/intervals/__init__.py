"""Prediction intervals that cover: split, cross and leave-one-out conformal, by row or by group."""

from .conformal import ConformalRegressor

__all__ = ["ConformalRegressor"]
