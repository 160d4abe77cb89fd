"""Training: one fit in a straight line (``fit``), and what it uses on the way."""

from .data import ValidatedData
from .fit import fit_rules
from .progress import Callbacks
from .pruning import RuleStatistics, model_without_rules, redundant_rules
from .result import Fitted, SolverRun

__all__ = [
    "Callbacks",
    "Fitted",
    "RuleStatistics",
    "SolverRun",
    "ValidatedData",
    "fit_rules",
    "model_without_rules",
    "redundant_rules",
]
