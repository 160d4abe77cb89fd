"""What ``partial_fit`` is asked for: what can be had of rows that are seen but once."""

from dataclasses import replace
from numbers import Real

import numpy as np

from .._validation import warn_user
from ..exceptions import ForgottenRowsWarning
from ..model import TSKModel

__all__ = [
    "can_learn_from_chunks",
    "check_finds_structure",
    "check_first_chunk",
    "check_forgetting",
    "check_outputs",
    "check_settings",
    "faded_weights",
    "held_model",
    "structure_settings",
    "warn_of_fit",
]

# What the premises and the columns of the design depend on.
_STRUCTURE = ("n_mfs", "mf", "order", "premise_features", "consequent_features")
# Sums of squares of weights stay finite within these.
_SMALLEST_WEIGHT, _LARGEST_WEIGHT = 1e-100, 1e100


def check_forgetting(forgetting):
    """The forgetting factor as a number; ValueError where it is none above 0 and at most 1."""
    if (
        isinstance(forgetting, bool)
        or not isinstance(forgetting, Real)
        or not 0.0 < float(forgetting) <= 1.0
    ):
        raise ValueError(
            f"forgetting={forgetting!r} must be a number above 0 and at most 1: by it the weight "
            "of all rows before is multiplied with every row; 1 forgets nothing."
        )
    return float(forgetting)


def can_learn_from_chunks(estimator):
    """True; AttributeError where a parameter asks for what needs all rows again."""
    wrong = [
        ("loss", estimator.loss != "squared_error", "weighs rows anew that are no longer there"),
        ("early_stopping", estimator.early_stopping, "holds out rows for a training that iterates"),
        ("monotonic_cst", estimator.monotonic_cst is not None, "is proven of the rows of one fit"),
        ("constraints", estimator.constraints is not None, "are proven of the rows of one fit"),
    ]
    for name, is_wrong, why in wrong:
        if is_wrong:
            raise AttributeError(
                f"{name}={getattr(estimator, name)!r} {why}, and partial_fit sees rows but once: "
                "leave it at its default, or use fit."
            )
    return True


def check_settings(estimator):
    """Raise ValueError where what the premises depend on has changed since the first call."""
    before = getattr(estimator, "_stream_settings", None)
    if before is not None:
        for name, value in structure_settings(estimator).items():
            if value != before[name]:
                raise ValueError(
                    f"{name} was {before[name]} at the first partial_fit, which fixed the premises,"
                    f" and is {value} now: set it back, or start anew with fit or a clone."
                )


def warn_of_fit(estimator):
    """Warn that the rows of a fit before do not count."""
    rows = estimator.model_.rule_rows.sum()
    warn_user(
        f"partial_fit after fit: the premises stay, but fit keeps no sums over its {rows:.0f} rows "
        "that others could be added to, and the consequents are learnt from the new rows alone. To "
        "have all rows count, give them all to partial_fit, whose first call is a fit.",
        ForgottenRowsWarning,
    )


def structure_settings(estimator):
    """What must stay as it was at the first call, in a form that can be compared and kept."""
    return {name: repr(getattr(estimator, name)) for name in _STRUCTURE}


def check_first_chunk(estimator, n_rows):
    """Raise ValueError where nothing can begin."""
    if n_rows == 0:
        raise ValueError(
            "The first chunk has no row with a positive weight: there is nothing to begin with."
        )
    imported = getattr(estimator.partition, "model_", estimator.partition)
    if estimator.max_iter == 0 and isinstance(imported, TSKModel):
        raise ValueError(
            "max_iter=0 takes the imported model as it is, and partial_fit learns its "
            "consequents: use solver='lse'."
        )


def check_finds_structure(n_rows):
    """Raise ValueError where a first chunk is too small for any structure."""
    if n_rows < 2:
        raise ValueError(
            f"The first chunk has {n_rows} row; structure and premises are found on it, which "
            "takes 2 rows at least and a few hundred to be of use. Gather more, or give a trained "
            "model as partition with solver='lse'."
        )


def check_outputs(base: TSKModel, n_outputs, names):
    """Raise ValueError where a chunk has other targets than those before."""
    if n_outputs != base.n_outputs:
        raise ValueError(
            f"y has {n_outputs} outputs, but the chunks before had {base.n_outputs} "
            f"({', '.join(base.output_names)})."
        )
    before = list(base.output_names)
    if names is not None and list(names) != before and sorted(names) == sorted(before):
        raise ValueError(
            f"The columns of y are {', '.join(names)}, but those of the chunks before were "
            f"{', '.join(before)}: give them in this order."
        )


def faded_weights(sample_weight, n_rows, forgetting):
    """Weights of a chunk's rows, the last of which is the newest; None where all are one.

    ValueError where a weight is beyond what sums of squares hold.
    """
    if sample_weight is not None and n_rows:
        outside = (sample_weight < _SMALLEST_WEIGHT) | (sample_weight > _LARGEST_WEIGHT)
        if outside.any():
            raise ValueError(
                f"sample_weight holds {sample_weight[np.argmax(outside)]:.3g}; weights that count "
                f"against those of other chunks must be zero, or lie from {_SMALLEST_WEIGHT:.0e} "
                f"to {_LARGEST_WEIGHT:.0e}."
            )
    if forgetting == 1.0:
        return sample_weight
    # What is next to nothing stays above it: a row has weight or has not.
    age = np.arange(n_rows - 1, -1, -1.0)
    fading = np.maximum(forgetting**age, _SMALLEST_WEIGHT)
    return fading if sample_weight is None else sample_weight * fading


def held_model(model: TSKModel, data):
    """An imported model as the base of a stream: its premises, by the names of the data."""
    n_outputs = data.y.shape[1]
    return replace(
        model,
        initial_antecedent=model.antecedent,
        coefficients=np.zeros((model.n_rules, model.coefficients.shape[1], n_outputs)),
        input_names=data.input_names,
        output_names=data.output_names,
    )
