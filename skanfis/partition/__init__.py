"""Partitions: from data to the rule base that training starts from."""

from .clustered import clustered_antecedent, representative_rows
from .grid import grid_antecedent
from .imported import check_inputs, imported_antecedent
from .structure import GridSize, count_distinct_inputs, term_counts

__all__ = [
    "GridSize",
    "check_inputs",
    "clustered_antecedent",
    "count_distinct_inputs",
    "grid_antecedent",
    "imported_antecedent",
    "representative_rows",
    "term_counts",
]
