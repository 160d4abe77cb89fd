"""Training: one fit in a straight line (``fit``), and what it uses on the way."""

from .data import Fitted, SolverRun, ValidatedData, validated
from .fit import fit_rules
from .pruning import RuleStatistics, model_without_rules, redundant_rules
from .watching import Callbacks

__all__ = [
    "Callbacks",
    "Fitted",
    "RuleStatistics",
    "SolverRun",
    "ValidatedData",
    "fit_rules",
    "model_without_rules",
    "redundant_rules",
    "validated",
]
