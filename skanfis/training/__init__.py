"""Training: one fit in a straight line (``fit``), and what it uses on the way."""

from .data import Fitted, SolverRun, ValidatedData, validated
from .fit import fit_rules
from .pruning import model_without_rules, redundant_rules
from .watching import Callbacks

__all__ = [
    "Callbacks",
    "Fitted",
    "SolverRun",
    "ValidatedData",
    "fit_rules",
    "model_without_rules",
    "redundant_rules",
    "validated",
]
