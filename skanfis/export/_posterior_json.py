"""The posterior of a model as JSON: what the standard deviation of a prediction needs.

::

    {
        "noise": [...],
        "inputs": [0, 1],
        "consequents": [[...], [..., ...], ...],
        "premises": [[...]],
        "cross": [[[...]]],
    }

"noise" has a number per output; "inputs" are those that the consequents are linear in;
"consequents" is a triangle, row by row up to the diagonal, of as many rows as there are rules times
1 + inputs; "premises" has a row per displacement and a column per parameter of a term; "cross", for
every output, a row per displacement and a column per row of the triangle. Where constraints are met
with equality there is "pinned" too, for every output rows of a column per row of the triangle and
per displacement. ``posterior`` says what they are.
"""

import numpy as np

from ..posterior import MOST_PARAMETERS, Posterior
from .limits import numbers, shown

__all__ = ["posterior_item", "read_posterior"]

_KEYS = ["noise", "inputs", "consequents", "premises", "cross"]


def posterior_item(posterior: Posterior):
    """The object that describes a posterior."""
    item = {
        "noise": posterior.noise.tolist(),
        "inputs": posterior.inputs.tolist(),
        "consequents": [row[: i + 1] for i, row in enumerate(posterior.consequents.tolist())],
        "premises": posterior.premises.tolist(),
        "cross": posterior.cross.tolist(),
    }
    if posterior.pinned.size:
        item["pinned"] = posterior.pinned.tolist()
    return item


def read_posterior(item, antecedent, n_inputs, n_outputs, order):
    """The posterior that an object describes; ValueError where it is not one of such a model."""
    if not isinstance(item, dict) or sorted({**item, "pinned": None}) != sorted([*_KEYS, "pinned"]):
        raise ValueError(f'"posterior" is {shown(item)}, not an object of {", ".join(_KEYS)}.')
    where = "posterior.inputs"
    inputs = item["inputs"]
    if not isinstance(inputs, list) or len(inputs) > n_inputs * order:
        raise ValueError(f"{where}: {shown(inputs)} is not a list of inputs of the consequents.")
    for value in inputs:
        if type(value) is not int or not 0 <= value < n_inputs or inputs.count(value) > 1:
            raise ValueError(f"{where}: {shown(value)} is not an input, or not for the first time.")
    n_parameters = antecedent.parameters.size
    n_columns = antecedent.n_rules * (1 + len(inputs))
    if n_columns + n_parameters > MOST_PARAMETERS:
        raise ValueError(f"posterior: more than {MOST_PARAMETERS} parameters.")
    rows = item["premises"]
    n_rows = len(rows) if isinstance(rows, list) else 0
    if n_rows not in (0, n_parameters):
        raise ValueError(f"posterior.premises has {n_rows} rows, not 0 or {n_parameters}.")
    triangle = item["consequents"]
    if not isinstance(triangle, list) or len(triangle) != n_columns:
        raise ValueError(f"posterior.consequents is not a triangle of {n_columns} rows.")
    consequents = np.zeros((n_columns, n_columns))
    for i, row in enumerate(triangle):
        consequents[i, : i + 1] = numbers(row, (i + 1,), f"posterior.consequents[{i}]")
    pinned = item.get("pinned", [[]] * n_outputs)
    first = pinned[0] if isinstance(pinned, list) and pinned else []
    n_pinned = len(first) if isinstance(first, list) else 0
    if n_pinned > n_columns + n_rows:
        raise ValueError(f"posterior.pinned has {n_pinned} rows, more than columns.")
    return Posterior(
        np.abs(numbers(item["noise"], (n_outputs,), "posterior.noise")),
        np.array(inputs, dtype=int),
        consequents,
        numbers(rows, (n_rows, n_parameters), "posterior.premises"),
        numbers(item["cross"], (n_outputs, n_rows, n_columns), "posterior.cross"),
        numbers(pinned, (n_outputs, n_pinned, n_columns + n_rows), "posterior.pinned"),
    )
