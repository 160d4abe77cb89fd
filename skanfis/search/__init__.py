"""Structure: what decides on the rule base that training starts from, and on nothing else."""

from .clusters import clustered_antecedent
from .grid import Spacing, grid_antecedent
from .imported import check_inputs, imported_antecedent
from .readable_terms import has_idle_term
from .request import StructureRequest, report_constant
from .sample import SampleSize, effective_weight, representative_rows, weighted_quantile
from .size import GridSize, term_counts
from .start import Start
from .terms import TermsFound, search_terms
from .tuning import is_affordable, more_agreement, with_premises

__all__ = [
    "GridSize",
    "SampleSize",
    "Spacing",
    "Start",
    "StructureRequest",
    "TermsFound",
    "check_inputs",
    "clustered_antecedent",
    "effective_weight",
    "grid_antecedent",
    "has_idle_term",
    "imported_antecedent",
    "is_affordable",
    "more_agreement",
    "report_constant",
    "representative_rows",
    "search_terms",
    "term_counts",
    "weighted_quantile",
    "with_premises",
]
