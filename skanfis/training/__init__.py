"""Training, a piece at a time: a run of the solver, and what is done around runs."""

from .learner import Learned, Learner
from .progress import CallbackBridge, Keeper, Printer, watch_all
from .pruning import RuleStatistics, redundant_rules, rule_statistics, without_rules
from .restarts import learn_from_starts
from .robust import learn_robustly, resistant
from .stopping import EarlyStopping, hold_out

__all__ = [
    "CallbackBridge",
    "EarlyStopping",
    "Keeper",
    "Learned",
    "Learner",
    "Printer",
    "RuleStatistics",
    "hold_out",
    "learn_from_starts",
    "learn_robustly",
    "redundant_rules",
    "resistant",
    "rule_statistics",
    "watch_all",
    "without_rules",
]
