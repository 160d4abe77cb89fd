"""Training: one fit in a straight line (``fit``), and what it uses on the way."""

from .data import validated
from .fit import fit_rules
from .pruning import model_without_rules
from .watching import Callbacks

__all__ = ["Callbacks", "fit_rules", "model_without_rules", "validated"]
