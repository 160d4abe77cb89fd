"""A trained model as text, tables and pictures; whether its rules can be read."""

from .model_displays import MembershipDisplay, ResponseSurfaceDisplay
from .readability import Readability, readability
from .rule_displays import RuleActivationDisplay, RuleContributionDisplay
from .tables import explain, memberships_table, rules_table
from .text import export_text, rules_html

__all__ = [
    "MembershipDisplay",
    "Readability",
    "ResponseSurfaceDisplay",
    "RuleActivationDisplay",
    "RuleContributionDisplay",
    "explain",
    "export_text",
    "memberships_table",
    "readability",
    "rules_html",
    "rules_table",
]
