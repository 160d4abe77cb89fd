"""Partitions: from data to the rule base that training starts from."""

from .clustered import clustered_antecedent
from .grid import grid_antecedent
from .structure import (
    GridSize,
    automatic_counts,
    automatic_n_rules,
    count_distinct_inputs,
    term_counts,
)

__all__ = [
    "GridSize",
    "automatic_counts",
    "automatic_n_rules",
    "clustered_antecedent",
    "count_distinct_inputs",
    "grid_antecedent",
    "term_counts",
]
