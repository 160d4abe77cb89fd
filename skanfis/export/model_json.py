"""Write and read a model as JSON, which people can read and which needs no pickle.

docs/files.rst has the format. Numbers are written so that the same double comes back.
"""

import json
from math import isfinite, nan
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..model import TSKModel
from ._families import check_own
from .folding import fold
from .json_reader import FORMAT, INPUT, OUTPUT, RULE_BASES, VERSION, key_of, model_of, parse_json
from .limits import MOST_BYTES, read_bytes


def export_json(
    estimator: Any, path: str | PathLike[str] | None = None, *, posterior: bool = False
) -> str:
    """Write a trained model as JSON, exact to the last bit.

    Parameters
    ----------
    estimator : fitted estimator or TSKModel
        As :func:`fold` takes it.
    path : str or path-like, default=None
        The file to write; None writes nothing.
    posterior : bool, default=False
        Whether to write what ``predict(X, return_std=True)`` needs: some p^2 / 2 numbers for p
        consequent parameters.

    Returns
    -------
    text : str
        A JSON object, versioned, one line per input, term and rule.

    Raises
    ------
    ValueError, TypeError
        As :func:`fold`; ValueError if :func:`read_json` would refuse the text, or if ``posterior``
        is asked of a model that has none.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import export_json
    >>> export_json(ANFISRegressor(n_mfs=2).fit(*make_jang_sinc())).splitlines()[1]
    '  "format": "skanfis-model",'
    """
    model = fold(estimator)
    support, no_target = model.support, dict.fromkeys(list(OUTPUT)[1:], nan)
    at = np.full(model.n_inputs, nan) if model.tangent_at is None else model.tangent_at
    of_inputs = vars(model) | {"name": model.input_names, "tangent_at": at}
    of_outputs = {
        key: np.broadcast_to(values, model.n_outputs)
        for key, values in (vars(model.target) if model.target else no_target).items()
    }
    document = {
        "format": FORMAT,
        "version": VERSION,
        "inputs": _items(**{key: of_inputs[key] for key in INPUT}),
        "outputs": _items(name=model.output_names, **of_outputs),
        "out_of_bounds": model.out_of_bounds,
        "max_extrapolation": _or_null(model.max_extrapolation),
        "rule_base": RULE_BASES[type(model.antecedent)],
        "terms": list(_terms(model)),
        "rules": _items(
            terms=model.antecedent.rule_terms,
            weight=model.rule_weights,
            rows=model.rule_rows,
            consequents=model.coefficients.transpose(0, 2, 1),
        ),
        "support": support
        and _items(
            share=support.share,
            radius=support.radius,
            center=support.center,
            factor=support.factor[:, *np.tril_indices(model.n_inputs)],
        ),
    }
    if posterior:
        if model.posterior is None:
            raise ValueError(
                "posterior=True, but the model has none, as one that was read from a .fis file or "
                "is too large to keep one."
            )
        state = model.posterior.__getstate__()
        document["posterior"] = {key: values.tolist() for key, values in state.items()}
    try:
        model_of(document)
        text = _laid_out(document)
        if (n_bytes := len(text.encode())) > MOST_BYTES:
            raise ValueError(f"{n_bytes:,} bytes, of at most {MOST_BYTES:,}. joblib can keep it.")
    except ValueError as error:
        raise ValueError(f"cannot write what read_json would refuse: {error}") from None
    if path is not None:
        Path(path).write_text(text, encoding="utf-8", newline="\n")
    return text


def read_json(path: str | PathLike[str]) -> TSKModel:
    """Read a model that :func:`export_json` has written, without pickle and running no code.

    Parameters
    ----------
    path : str or path-like

    Returns
    -------
    model : skanfis.model.TSKModel
        It predicts what the written model does, to the last bit. Give it to ``ANFISRegressor`` as
        ``partition`` to train it further, or with ``max_iter=0`` to predict with it as it is.

    Raises
    ------
    ValueError
        If the file is not such a model, is of a later version, or has more than 16 MiB.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import export_json, read_json
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "sinc.json"
    ...     text = export_json(ANFISRegressor(n_mfs=2).fit(*make_jang_sinc()), path)
    ...     read_json(path).n_rules
    4
    """
    data = read_bytes(path, MOST_BYTES)
    try:
        return parse_json(data.decode("utf-8-sig"))
    except RecursionError:
        raise ValueError(f"{path}: nested too deeply to be a model.") from None
    except ValueError as error:
        kind = "no JSON: " if isinstance(error, json.JSONDecodeError | UnicodeDecodeError) else ""
        raise ValueError(f"{path}: {kind}{error}") from None


def _terms(model):
    """Every term's name, input, function and named parameters, after training and before it."""
    before = [theta for _, _, theta in model.initial_antecedent.terms]
    every = zip(model.term_names, model.antecedent.terms, before, strict=True)
    for name, (j, family, theta), start in every:
        check_own(family)
        term = {"name": name, "input": j, "function": family.name}
        after, start = (
            {key_of(one): float(value) for one, value in zip(family.parameters, own, strict=True)}
            for own in (theta, start)
        )
        yield term | after | {"before_training": start}


def _laid_out(document):
    """JSON text with one item of every list per line."""
    write, entries = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode, []
    for key, value in document.items():
        if isinstance(value, list):
            text = "[" + ",".join(f"\n    {write(item)}" for item in value) + "\n  ]"
        else:
            text = write(value)
        entries.append(f'  "{key}": {text}')
    return "{\n" + ",\n".join(entries) + "\n}\n"


def _items(**columns):
    """One object per row, from columns by key."""
    lists = [getattr(values, "tolist", lambda v=values: v)() for values in columns.values()]
    return [dict(zip(columns, map(_or_null, row), strict=True)) for row in zip(*lists, strict=True)]


def _or_null(value):
    """Null for NaN and infinity, which JSON lacks: not known, or no limit."""
    return None if isinstance(value, float) and not isfinite(value) else value
