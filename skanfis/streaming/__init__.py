"""Rows that keep coming: sums over rows that consequents are solved from, and their addition."""

from .information import Information

__all__ = ["Information"]
