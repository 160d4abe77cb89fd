"""A trained model as text, tables and pictures; whether its rules can be read."""

from .displays import MembershipDisplay, ResponseSurfaceDisplay
from .readability import Readability, readability
from .rules import explain, memberships_table, rules_table
from .structures import StructureDisplay
from .text import export_text, rules_html
from .trees import TreeDisplay

__all__ = [
    "MembershipDisplay",
    "Readability",
    "ResponseSurfaceDisplay",
    "StructureDisplay",
    "TreeDisplay",
    "explain",
    "export_text",
    "memberships_table",
    "readability",
    "rules_html",
    "rules_table",
]
