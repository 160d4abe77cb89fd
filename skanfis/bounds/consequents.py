"""Any local consequents at the premises of one fit: as a model, as an evaluation, and certified."""

from dataclasses import replace

import numpy as np

from ..consequent import in_user_units
from ..search.sample import unit_scale
from .construction import is_in_order

# Standard deviations of the target that rounding may leave between a fixed point and a prediction.
_OFF = 1e-8


class Consequents:
    """What other consequents make of a free fit, and whether they keep the constraints.

    ``model`` is in the user's units; ``free`` is the evaluation of the free fit, at premises for
    which there is an order of the rules, if there is any.
    """

    def __init__(self, model, free, problem, constraints):
        self.problem, self.free, self.constraints = problem, free, constraints
        # That outputs are held on top is monotone: what rules keep, predictions do.
        self._base = replace(model, target=None)
        self.inequalities, self.output_names = constraints.inequalities(model), model.output_names
        # A model with an output for each local consequent: what it adds to the standardised target.
        each = np.eye(problem.n_columns)
        self.columns = self._model(each, unit_scale(each))
        # E and e of the fixed points, for the local consequents.
        targets = problem.rows.targets
        values = (constraints.values - targets.offset) / targets.scale
        self.fixed = self.columns.predict(constraints.points), values

    def model(self, local, is_line=False):
        """The model; of one line for all rules, one to the last bit."""
        found = self._model(local, self.problem.rows.targets)
        if not is_line:
            return found
        line = np.broadcast_to(found.coefficients[:1], found.coefficients.shape)
        return replace(found, coefficients=line)

    def _model(self, local, targets):
        """The model for targets of this scale."""
        problem, inputs = self.problem, self.problem.rows.inputs
        design = problem.consequent_inputs, self._base.order
        common = problem.penalty.common, self._base.rule_weights
        coefficients = problem.local.to_global(local)
        return replace(
            self._base,
            antecedent=self.free.antecedent.change_units(inputs.offset, inputs.scale),
            coefficients=in_user_units(coefficients, inputs, targets, *design, *common),
            output_names=tuple(map(str, range(targets.scale.size))),
        )

    def evaluation(self, local):
        """The evaluation of the free fit, with these consequents in place of its own."""
        normal = self.free.normal
        change, weighed = local - normal.coefficients, normal.gram + normal.penalty
        cost = self.free.cost + 0.5 * float(np.sum(change * (weighed @ change)))
        error = 2.0 * cost - float(np.sum(local * (normal.penalty @ local)))
        return replace(
            self.free,
            cost=cost,
            coefficients=self.problem.local.to_global(local),
            mean_squared_error=max(error, 0.0),
            normal=replace(normal, coefficients=local),
        )

    def is_certified(self, local, is_line):
        """Whether all constraints are kept, by the order of the rules."""
        model, constraints = self.model(local, is_line), self.constraints
        limits = zip(constraints.lower, constraints.upper, strict=True)
        return self.meets_points(model) and all(
            is_in_order(model, k, signs, of_output)
            for k, (signs, of_output) in enumerate(zip(constraints.signs, limits, strict=True))
        )

    def meets_points(self, model):
        """Whether a model predicts all fixed points, to rounding."""
        off = np.abs(model.predict(self.constraints.points) - self.constraints.values)
        off /= self.problem.rows.targets.scale
        return bool((off <= _OFF).all())
