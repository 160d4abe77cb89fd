"""Models in less time: where it matters that a model is fitted, and not which."""

from sklearn.base import clone

from skanfis import ANFISRegressor
from skanfis.consequent import in_user_units
from skanfis.learning import SOLVERS
from skanfis.model import TSKModel
from skanfis.search import judging, lasso, search, trials

STIFFNESS = 1e-3


def quick(n_mfs=2, **settings):
    """What finds no weights by the evidence, and so is fitted in a fifth of the time."""
    given = {"agreement": 0.1, "alpha": 1e-5} | settings
    given["solver"] = of_given_stiffness(given.get("solver", "varpro"))
    if "partition" in settings:
        return ANFISRegressor(**given)
    return ANFISRegressor(n_mfs, **given)


def of_given_stiffness(solver):
    """The same where it is given or means nothing."""
    solver = SOLVERS[solver]() if isinstance(solver, str) else clone(solver)
    if solver.get_params().get("stiffness") == "auto":
        solver.set_params(stiffness=STIFFNESS)
    return solver


def with_few_candidates(patch):
    """Let the search for a structure go all of its ways, but not as often."""
    patch.setattr(search, "_FURTHER", 1)
    patch.setattr(trials, "_TRIED", 1)
    every = judging.folds
    for module in (judging, lasso):
        patch.setattr(module, "folds", lambda rows: every(rows)[:2])


def frozen(problem, evaluation, coefficients=None, **changes):
    """The model of an evaluation in the units of its rows, or that of other consequents."""
    inputs, targets = problem.rows.inputs, problem.rows.targets
    coefficients = evaluation.coefficients if coefficients is None else coefficients
    units = inputs, targets, problem.consequent_inputs, int(problem.n_basis > 1)
    antecedent = evaluation.antecedent.change_units(inputs.offset, inputs.scale)
    settings = {
        "antecedent": antecedent,
        "initial_antecedent": antecedent,
        "coefficients": in_user_units(coefficients, *units),
        "reference": inputs.offset,
        "spread": inputs.scale,
        "minimum": inputs.minimum,
        "maximum": inputs.maximum,
        "rule_weights": evaluation.masses,
        "rule_rows": evaluation.masses,
        "input_names": tuple(f"x{j}" for j in range(inputs.scale.size)),
        "out_of_bounds": "clip",
    }
    return TSKModel(**settings | changes)
