"""Indicators that a OneHotEncoder makes of a column: 1 where it holds a category, 0 elsewhere.

They are inputs of the folded model in the place of the column, whose categories are no numbers.
The encoder itself says what a row's indicators are: unknown and infrequent categories, and those
that it drops, are its own business.
"""

from dataclasses import dataclass

import numpy as np
from sklearn.preprocessing import OneHotEncoder

__all__ = ["Indicator", "indicators", "part_of"]


@dataclass(frozen=True, eq=False)
class Indicator:
    """One column of what an encoder puts out.

    Parameters
    ----------
    encoder : OneHotEncoder
        Fitted.
    columns : tuple of int
        Positions, in the user's table, of what the encoder is given.
    place : int
        Which of the encoder's outputs it is.
    name : str
        What the encoder calls it, such as "fibre_PM".
    """

    encoder: OneHotEncoder
    columns: tuple[int, ...]
    place: int
    name: str

    def values(self, X):
        """0 or 1 for every row of the user's table, shape (n_rows,)."""
        encoded = self.encoder.transform(part_of(X, list(self.columns)))[:, [self.place]]
        dense = encoded.toarray() if hasattr(encoded, "toarray") else np.asarray(encoded)
        return dense[:, 0].astype(np.float64)


def indicators(encoder, columns, names):
    """All that a fitted encoder puts out, as pairs of the column's position and its Indicator.

    Parameters
    ----------
    encoder : OneHotEncoder
    columns : sequence of int
        Positions, in the user's table, of what it is given.
    names : sequence of str
        What the user calls these.
    """
    named = hasattr(encoder, "feature_names_in_")
    outputs = encoder.get_feature_names_out(None if named else names)
    of_output = np.repeat(columns, _n_outputs(encoder))
    return [
        (int(column), Indicator(encoder, tuple(columns), place, str(name)))
        for place, (column, name) in enumerate(zip(of_output, outputs, strict=True))
    ]


def _n_outputs(encoder):
    """How many indicators it makes of each column."""
    counts = [len(categories) for categories in encoder.categories_]
    merged = getattr(encoder, "infrequent_categories_", [None] * len(counts))
    dropped = [None] * len(counts) if encoder.drop_idx_ is None else encoder.drop_idx_
    return [
        count - (0 if few is None else len(few) - 1) - (left_out is not None)
        for count, few, left_out in zip(counts, merged, dropped, strict=True)
    ]


def part_of(X, columns):
    """Columns of a frame, or of anything that is an array of objects, by their positions."""
    if hasattr(X, "iloc"):
        return X.iloc[:, columns]
    if hasattr(X, "get_columns"):
        return X[:, columns]
    return np.asarray(X, dtype=object)[:, columns]
