"""Pipelines whose rules are on categories."""

from sklearn.compose import make_column_transformer
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import OneHotEncoder


def encoded(columns, model, **options):
    """A column of zeros and ones for every level of these, in front of all others."""
    encoder = OneHotEncoder(**{"sparse_output": False} | options)
    columns = make_column_transformer((encoder, columns), remainder="passthrough")
    return make_pipeline(columns, model)
