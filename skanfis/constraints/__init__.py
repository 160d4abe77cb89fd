"""Constraints from knowledge: monotone inputs, limits of the output, fixed values at points.

They are constraints on the consequents, which are linear: at the premises that training found, the
nearest consequents that keep them are sought (``program``), and the bounds of ``skanfis.bounds``
prove that they are kept everywhere (``exchange``).
"""

from .wishes import FixedPoint, OutputLimits

__all__ = ["FixedPoint", "OutputLimits"]
