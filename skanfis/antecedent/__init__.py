"""Rule bases: the IF parts of a set of rules, over terms of any families."""

from .base import Antecedent, TermGroup, by_group, by_parameter, groups_of, strongest_rules
from .grid import GridAntecedent
from .rule_table import RuleTableAntecedent
from .tree import TreeAntecedent

__all__ = [
    "Antecedent",
    "GridAntecedent",
    "RuleTableAntecedent",
    "TermGroup",
    "TreeAntecedent",
    "by_group",
    "by_parameter",
    "groups_of",
    "strongest_rules",
]
