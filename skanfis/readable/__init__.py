"""Whether the rules of a model can be read one by one: measured on rows, judged by limits."""

from .findings import (
    GREATEST_ALONE,
    GREATEST_BEYOND,
    GREATEST_CROSSING,
    GREATEST_SUM,
    GREATEST_WORDLESS,
    LEAST_TRUTH,
    findings_without_rows,
)
from .measures import Measures, Source, TargetScale, measure, rule_sums
from .report import Readability, readability_of_rows
from .terms import crossings, distinct_terms, greatest_truth_in_box, own_terms

__all__ = [
    "GREATEST_ALONE",
    "GREATEST_BEYOND",
    "GREATEST_CROSSING",
    "GREATEST_SUM",
    "GREATEST_WORDLESS",
    "LEAST_TRUTH",
    "Measures",
    "Readability",
    "Source",
    "TargetScale",
    "crossings",
    "distinct_terms",
    "findings_without_rows",
    "greatest_truth_in_box",
    "measure",
    "own_terms",
    "readability_of_rows",
    "rule_sums",
]
