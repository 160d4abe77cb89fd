"""Sugeno systems in the .fis format of MATLAB and Octave, both ways.

``syntax`` turns text into sections with line numbers and knows nothing of models, ``functions``
says which membership function is which family, ``reader`` and ``writer`` do the rest.
"""

from .reader import read_fis
from .writer import export_fis, write_fis

__all__ = ["export_fis", "read_fis", "write_fis"]
