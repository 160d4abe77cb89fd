"""Training, a piece at a time: the start, a run of the solver, and what is done around runs."""

from .learner import Learned, Learner
from .progress import CallbackBridge, Keeper, Printer, watch_all
from .pruning import redundant_rules, rule_statistics, without_rules
from .restarts import learn_from_starts
from .ridge import learn_with_best_alpha
from .robust import learn_robustly
from .start import ENOUGH_ROWS, Partition, report_constant
from .stopping import EarlyStopping, hold_out
from .structure import Structure

__all__ = [
    "ENOUGH_ROWS",
    "CallbackBridge",
    "EarlyStopping",
    "Keeper",
    "Learned",
    "Learner",
    "Partition",
    "Printer",
    "Structure",
    "hold_out",
    "learn_from_starts",
    "learn_robustly",
    "learn_with_best_alpha",
    "redundant_rules",
    "report_constant",
    "rule_statistics",
    "watch_all",
    "without_rules",
]
