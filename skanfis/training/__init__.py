"""Training, a piece at a time: a run of the solver, and what is done around runs."""

from .learner import Learned, Learner
from .progress import CallbackBridge, Printer, watch_all
from .pruning import model_without_rules, redundant_rules, rule_statistics, without_rules
from .restarts import learn_from_starts
from .robust import learn_robustly, resistant
from .stopping import ValidationLoss, hold_out

__all__ = [
    "CallbackBridge",
    "Learned",
    "Learner",
    "Printer",
    "ValidationLoss",
    "hold_out",
    "learn_from_starts",
    "learn_robustly",
    "model_without_rules",
    "redundant_rules",
    "resistant",
    "rule_statistics",
    "watch_all",
    "without_rules",
]
