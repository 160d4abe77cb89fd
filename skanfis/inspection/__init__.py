"""Pictures of a trained model, after scikit-learn's convention for displays."""

from .activation import RuleActivationDisplay
from .contribution import RuleContributionDisplay
from .html import rules_html
from .loss import LossCurveDisplay
from .memberships import MembershipDisplay
from .surface import ResponseSurfaceDisplay

__all__ = [
    "LossCurveDisplay",
    "MembershipDisplay",
    "ResponseSurfaceDisplay",
    "RuleActivationDisplay",
    "RuleContributionDisplay",
    "rules_html",
]
