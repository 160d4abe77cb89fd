"""Prior knowledge: training starts from the rules of a model that is there already."""

import numpy as np

from ..antecedent import Antecedent, GridAntecedent, RuleTableAntecedent
from ..learning.data import StandardisedData
from ..model import TSKModel

__all__ = ["check_inputs", "imported_antecedent"]


def check_inputs(model: TSKModel, names, what):
    """ValueError where a model is of other inputs than the data; names count if both have them."""
    if model.n_inputs != len(names):
        raise ValueError(
            f"{what} has rules on {model.n_inputs} inputs ({', '.join(model.input_names)}), but X "
            f"has {len(names)} columns ({', '.join(names)})."
        )
    numbered = [f"x{j}" for j in range(len(names))]
    if list(model.input_names) != list(names) and numbered not in (
        list(model.input_names),
        list(names),
    ):
        raise ValueError(
            f"{what} has rules on the inputs {', '.join(model.input_names)}, but the columns of X "
            f"are {', '.join(names)}: give them in this order and by these names."
        )


def imported_antecedent(model: TSKModel, rows: StandardisedData) -> Antecedent:
    """The rule base of a model in the rows' standardised units, ready to be moved."""
    scale = rows.inputs
    antecedent = model.antecedent.change_units(-scale.offset / scale.scale, 1.0 / scale.scale)
    if isinstance(antecedent, GridAntecedent) and not _is_in_order(antecedent):
        # Terms of a grid move with their distances, which must be positive.
        return RuleTableAntecedent(antecedent.groups, antecedent.rule_terms)
    return antecedent


def _is_in_order(antecedent):
    """Whether the terms of every input stand one after another."""
    return all(
        (np.diff(group.theta[0, group.inputs == j]) > 0.0).all()
        for group in antecedent.groups
        for j in np.unique(group.inputs)
    )
