"""Clusterers in their own right, which know a rule base when they see one."""

from .fuzzy_cmeans import FuzzyCMeans
from .subtractive import SubtractiveClustering

__all__ = ["FuzzyCMeans", "SubtractiveClustering"]
