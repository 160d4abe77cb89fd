"""Sugeno systems in the .fis format of MATLAB and Octave, both ways."""

from .reader import read_fis
from .writer import export_fis, write_fis

__all__ = ["export_fis", "read_fis", "write_fis"]
