"""A trained model as text, tables and pictures; whether its rules can be read."""

from .displays import MembershipDisplay, ResponseSurfaceDisplay
from .effects import effects
from .effects_display import EffectsDisplay
from .readability import Readability, readability
from .rules import explain, rules_table
from .structures import StructureDisplay
from .text import export_text, rules_html
from .trees import TreeDisplay

__all__ = [
    "EffectsDisplay",
    "MembershipDisplay",
    "Readability",
    "ResponseSurfaceDisplay",
    "StructureDisplay",
    "TreeDisplay",
    "effects",
    "explain",
    "export_text",
    "readability",
    "rules_html",
    "rules_table",
]
