"""Structure search: it decides on the rule base that training starts from, and on nothing else."""

from .request import StructureRequest, report_constant
from .sample import representative_rows, weighted_quantile
from .start import Start, imported_antecedent

__all__ = [
    "Start",
    "StructureRequest",
    "imported_antecedent",
    "report_constant",
    "representative_rows",
    "weighted_quantile",
]
