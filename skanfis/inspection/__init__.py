"""A trained model as text, tables and pictures; whether its rules can be read."""

from .activation import RuleActivationDisplay
from .contribution import RuleContributionDisplay
from .html import rules_html
from .loss import LossCurveDisplay
from .memberships import MembershipDisplay
from .reading import Readability, ReadabilityDisplay, readability
from .surface import ResponseSurfaceDisplay
from .table import explain, memberships_table, rules_table
from .text import export_text

__all__ = [
    "LossCurveDisplay",
    "MembershipDisplay",
    "Readability",
    "ReadabilityDisplay",
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
