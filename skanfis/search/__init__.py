"""Structure: what decides on the rule base that training starts from, and on nothing else."""

from .clusters import clustered_antecedent
from .grid import Spacing, grid_antecedent
from .request import StructureRequest, report_constant
from .sample import effective_weight, representative_rows, weighted_quantile
from .start import Start, check_inputs, imported_antecedent

__all__ = [
    "Spacing",
    "Start",
    "StructureRequest",
    "check_inputs",
    "clustered_antecedent",
    "effective_weight",
    "grid_antecedent",
    "imported_antecedent",
    "report_constant",
    "representative_rows",
    "weighted_quantile",
]
