"""Pictures of a trained model, after scikit-learn's convention; whether its rules can be read."""

from .activation import RuleActivationDisplay
from .contribution import RuleContributionDisplay
from .html import rules_html
from .loss import LossCurveDisplay
from .memberships import MembershipDisplay
from .reading import Readability, ReadabilityDisplay, readability
from .surface import ResponseSurfaceDisplay

__all__ = [
    "LossCurveDisplay",
    "MembershipDisplay",
    "Readability",
    "ReadabilityDisplay",
    "ResponseSurfaceDisplay",
    "RuleActivationDisplay",
    "RuleContributionDisplay",
    "readability",
    "rules_html",
]
