"""Partitions: from data to the rule base that training starts from."""

from .clustered import clustered_antecedent, representative_rows
from .grid import grid_antecedent
from .structure import GridSize, count_distinct_inputs, term_counts

__all__ = [
    "GridSize",
    "clustered_antecedent",
    "count_distinct_inputs",
    "grid_antecedent",
    "representative_rows",
    "term_counts",
]
