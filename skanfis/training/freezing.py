"""From the end of a run to the frozen model, in the user's units."""

from dataclasses import replace

import numpy as np

from ..consequent import in_user_units
from ..learning import SolverResult
from ..learning.data import StandardisedData
from ..learning.firing import RuleFiring, rule_support
from ..learning.objective import Evaluation
from ..learning.penalty import Penalty
from ..model import TSKModel
from ..options import policy_of
from ..policies import TargetRange
from ..search import (
    Start,
    StructureRequest,
    imported_antecedent,
    representative_rows,
    weighted_quantile,
)
from .data import Fitted, ValidatedData
from .pruning import redundant_rules

# Rows that medians are taken of: more would hardly move them.
_MOST_ROWS = 2000


def frozen_model(
    data: ValidatedData,
    rows: StandardisedData,
    request: StructureRequest,
    start: Start,
    evaluation: Evaluation,
) -> tuple[TSKModel, list[dict]]:
    """The model of an evaluation on ``rows``, in the user's units, and its redundant rules."""
    trained, inputs = evaluation.antecedent, start.consequent_inputs
    offset, scale, n_coefficients = rows.inputs.offset, rows.inputs.scale, 1 + inputs.size
    firing = RuleFiring.of(rows, trained, n_coefficients)
    units = rows.inputs, rows.targets, inputs, request.order
    common = start.penalty.common, evaluation.masses
    support = rule_support(rows, trained, n_coefficients, firing)
    model = TSKModel(
        antecedent=trained.change_units(offset, scale),
        initial_antecedent=start.antecedent.change_units(offset, scale),
        coefficients=in_user_units(evaluation.coefficients, *units, *common),
        reference=offset,
        spread=scale,
        minimum=rows.inputs.minimum,
        maximum=rows.inputs.maximum,
        rule_weights=evaluation.masses,
        rule_rows=firing.strongest * (rows.effective_weight / rows.total_weight),
        input_names=data.input_names,
        support=support.change_units(offset, scale),
        term_names=start.term_names,
        output_names=data.output_names,
        target=TargetRange(rows.targets.minimum, rows.targets.maximum, rows.targets.scale),
        tangent_at=_tangent_at(data.constraints, rows),
    )
    return model, redundant_rules(firing.overlap / rows.total_weight, firing.peak)


def _tangent_at(constraints, rows):
    """The medians of the inputs with a monotonic constraint, NaN elsewhere; None without any."""
    if constraints is None or not constraints.signs.any():
        return None
    table, weight, _ = representative_rows(rows.sample or rows, _MOST_ROWS)
    held = constraints.signs.any(axis=0)
    medians = [weighted_quantile(column, weight, 0.5, 1) for column in table.T[: held.size]]
    found = rows.inputs.offset + rows.inputs.scale * np.array(medians)
    found = np.clip(found, rows.inputs.minimum, rows.inputs.maximum)
    return np.where(held, found, np.nan)


def as_given(estimator, data, model) -> Fitted:
    """The imported model itself, with its error on the data."""
    if model.n_outputs != data.y.shape[1]:
        raise ValueError(
            f"partition is a model of {', '.join(model.output_names)}, but y has "
            f"{', '.join(data.output_names)}. "
            "max_iter=0 keeps the model as it is: give y the same outputs, or use solver='lse'."
        )
    model = replace(
        model.with_out_of_bounds(*policy_of(estimator.out_of_bounds)),
        initial_antecedent=model.antecedent,
        input_names=data.input_names,
        output_names=data.output_names,
    )
    rows = data.rows()
    # Rows beyond the model's range count as predicted; if the policy gives no value, as clipped.
    answering = model if model.out_of_bounds == "linear" else model.with_out_of_bounds("clip")
    residual = (data.y - answering.predict(data.X)) / rows.targets.scale
    loss = np.average(np.sum(residual**2, axis=1), weights=data.sample_weight)
    firing = RuleFiring.of(rows, imported_antecedent(model, rows), 0)
    redundant = redundant_rules(firing.overlap / rows.total_weight, firing.peak)
    result = SolverResult(None, np.full(2, loss), 0, "as_given")
    start = Start(model.antecedent, Penalty(), np.arange(model.n_inputs))
    return Fitted(model, result, start, redundant)
