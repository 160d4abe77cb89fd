"""What ``partial_fit`` and ``merge`` refuse, and why: they see every row only once."""

from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np

from ..learning.data import LARGEST_NUMBER
from ..model import TSKModel

# Parameters that the premises and the columns of the design depend on.
_STRUCTURE = ("n_mfs", "mf", "order", "premise_features", "consequent_features")
# Between this and its inverse, sums of squares of weights and of standardised rows stay finite.
_SMALLEST_WEIGHT = 1.0 / LARGEST_NUMBER
# With less, what is left of the rows before the latest is lost in rounding.
_LEAST_FORGETTING = 1e-12
# Tolerance for equal parameters, relative: a file may round the last digits.
_ROUNDING = 1e-12


def check_forgetting(forgetting):
    """Raise ValueError where a forgetting factor is out of range."""
    is_number = isinstance(forgetting, Real) and not isinstance(forgetting, bool)
    if not is_number or not _LEAST_FORGETTING <= float(forgetting) <= 1.0:
        raise ValueError(
            f"forgetting={forgetting!r} must be a number from {_LEAST_FORGETTING:.0e} to 1: every "
            "new row multiplies the weights of all earlier rows by it; 1 forgets nothing."
        )


def can_learn_from_chunks(estimator: Any) -> bool:
    """Return True, or raise AttributeError where a parameter needs all rows again."""
    wrong = [
        ("loss", estimator.loss != "squared_error", "reweights earlier rows"),
        ("early_stopping", estimator.early_stopping, "checks held-out rows in every iteration"),
        ("monotonic_cst", estimator.monotonic_cst is not None, "needs all rows together"),
        ("constraints", estimator.constraints is not None, "need all rows together"),
    ]
    for name, is_wrong, why in wrong:
        if is_wrong:
            raise AttributeError(
                f"{name}={getattr(estimator, name)!r} {why}, but partial_fit sees every row only "
                f"once: leave {name} at its default, or use fit."
            )
    return True


def structure_settings(estimator):
    """The parameters that must stay as at the first call, as strings that can be kept."""
    return {name: repr(getattr(estimator, name)) for name in _STRUCTURE}


def check_settings(estimator, before):
    """Raise ValueError where a parameter of the premises has changed since the first call."""
    for name, value in structure_settings(estimator).items():
        if value != before[name]:
            raise ValueError(
                f"{name} was {before[name]} at the first partial_fit, which fixed the premises, "
                f"but is {value} now: set it back to {before[name]}, or start again with fit or a "
                "clone."
            )


def check_begin(estimator, n_rows, finds_structure):
    """Raise ValueError where a first chunk does not suffice to begin with."""
    if n_rows == 0:
        raise ValueError(
            "The first chunk has no row with a positive weight, so there is nothing to learn from: "
            "give rows whose sample_weight is positive."
        )
    imported = getattr(estimator.partition, "model_", estimator.partition)
    if estimator.max_iter == 0 and isinstance(imported, TSKModel):
        raise ValueError(
            "max_iter=0 keeps the imported model as it is, but partial_fit learns its "
            "consequents: leave max_iter at its default, with solver='lse'."
        )
    if finds_structure and n_rows < 2:
        raise ValueError(
            f"The first chunk has {n_rows} row, but structure and premises are learnt from it: "
            "that takes at least 2 rows, and a few hundred for a useful model. Give a larger first "
            "chunk, or a trained model as partition with solver='lse'."
        )


def check_outputs(base: TSKModel, names):
    """Raise ValueError where a chunk has other targets than those before, or another order."""
    before = base.output_names
    if len(names) != len(before):
        raise ValueError(
            f"Earlier chunks had the outputs {', '.join(before)}, and y has {len(names)}: give "
            "every chunk the same outputs."
        )
    if any(name != old and name in before for name, old in zip(names, before, strict=True)):
        raise ValueError(
            f"The columns of y are {', '.join(names)}, but in earlier chunks they were "
            f"{', '.join(before)}: give every chunk the same columns in the same order."
        )


def check_distance(base: TSKModel, scale):
    """Raise ValueError where rows are so far from the premises that their squares overflow."""
    for j, name in enumerate(base.input_names):
        for end in (scale.minimum[j], scale.maximum[j]):
            # Divide before subtracting: the difference might overflow.
            away = abs(end / base.spread[j] - base.reference[j] / base.spread[j])
            if not away <= LARGEST_NUMBER:
                raise ValueError(
                    f"Column {name!r} of X holds {end:.3g}, more than {LARGEST_NUMBER:.0e} "
                    f"standard deviations from the data that the premises were learnt from (mean "
                    f"{base.reference[j]:.6g}, standard deviation {base.spread[j]:.3g}): drop such "
                    "rows."
                )


def faded_weights(sample_weight, n_rows, forgetting):
    """Weights of a chunk's rows, oldest first; None if all are one.

    ValueError where the square of a weight would overflow or vanish.
    """
    if sample_weight is not None and n_rows:
        outside = (sample_weight < _SMALLEST_WEIGHT) | (sample_weight > LARGEST_NUMBER)
        if outside.any():
            raise ValueError(
                f"sample_weight holds {sample_weight[np.argmax(outside)]:.3g}, but weights in "
                f"partial_fit must be zero or between {_SMALLEST_WEIGHT:.0e} and "
                f"{LARGEST_NUMBER:.0e}."
            )
    if forgetting == 1.0:
        return sample_weight
    # Weights do not fade to zero: a row of weight zero is no row.
    fading = np.maximum(forgetting ** np.arange(n_rows - 1, -1, -1.0), _SMALLEST_WEIGHT)
    return fading if sample_weight is None else sample_weight * fading


def named_premises(model: TSKModel, data):
    """An imported model as the base of chunks: its premises, with the names of the data."""
    n_outputs = data.y.shape[1]
    return replace(
        model,
        initial_antecedent=model.antecedent,
        coefficients=np.zeros((model.n_rules, model.coefficients.shape[1], n_outputs)),
        input_names=data.input_names,
        output_names=data.output_names,
        posterior=None,
    )


def check_same_premises(one, other, place):
    """Raise ValueError where the sums of two models differ; the second has the number ``place``."""
    difference = _difference(one, other)
    if difference:
        raise ValueError(
            f"Models 0 and {place} of merge do not match: {difference}. Only models with the same "
            "premises can be merged: train each with solver='lse' and the same model as partition."
        )


def _difference(one, other):
    mine, theirs = one.base, other.base
    for what in ("inputs", "outputs"):
        names = [", ".join(getattr(base, f"{what[:-1]}_names")) for base in (mine, theirs)]
        if names[0] != names[1]:
            return f"their {what} are {names[0]} and {names[1]}"
    if mine.n_rules != theirs.n_rules:
        return f"they have {mine.n_rules} and {theirs.n_rules} rules"
    inputs = [sums.consequent_inputs for sums in (one, other)]
    if not np.array_equal(*inputs):
        names = [", ".join(mine.input_names[j] for j in own) or "none" for own in inputs]
        return f"their consequents are linear in {names[0]} and in {names[1]}"
    is_same = np.array_equal(mine.antecedent.rule_terms, theirs.antecedent.rule_terms)
    otherwise = "" if is_same else "their rules combine the terms differently"
    return _difference_of_terms(mine.memberships(), theirs.memberships()) or otherwise


def _difference_of_terms(mine, theirs):
    if len(mine) != len(theirs):
        return f"they have {len(mine)} and {len(theirs)} terms"
    for place, (a, b) in enumerate(zip(mine, theirs, strict=True)):
        what = f"term {place}, {a['name']!r} of {a['input']!r},"
        for key in ("input", "function"):
            if a[key] != b[key]:
                return f"{what} has {key} {a[key]!r} in one and {b[key]!r} in the other"
        for key in (key for key in a if key not in ("input", "name", "function")):
            size = max(abs(a[key]), abs(b[key]))
            if abs(a[key] - b[key]) > _ROUNDING * size:
                return f"{what} has {key} {a[key]:.10g} in one and {b[key]:.10g} in the other"
    return ""
