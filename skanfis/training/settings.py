"""The parameters of an estimator, with names of columns, families and solvers resolved."""

from sklearn.utils import check_random_state
from sklearn.utils.validation import has_fit_parameter

from .._validation import feature_indices, in_column_order
from ..learning import SOLVERS, Solver
from ..membership import Gaussian, membership_families
from ..model import TSKModel
from ..search import StructureRequest


def solver_of(estimator) -> Solver:
    """The solver that the estimator names, or holds."""
    return SOLVERS[estimator.solver]() if isinstance(estimator.solver, str) else estimator.solver


def given_weights(estimator):
    """The given weights of the penalty, by their names in ``Penalty``."""
    stiffness = solver_of(estimator).stiffness
    given = {"agreement": estimator.agreement, "alpha": estimator.alpha, "stiffness": stiffness}
    weights = {key: float(weight) for key, weight in given.items() if not isinstance(weight, str)}
    if "alpha" in weights:
        weights["slope"] = weights["alpha"]
    return weights


def structure_request(estimator, names, sample_weight=None):
    """The request that a start is found for, with all names of columns and families resolved."""
    partition = _partition(estimator, names, sample_weight)
    families = membership_families(in_column_order(estimator.mf, names, "mf"), names)
    if isinstance(partition, str) and partition == "tree" and set(families) != {Gaussian}:
        raise ValueError(
            f"mf={estimator.mf!r} has no effect with partition='tree', whose terms are the sides "
            "of cuts: leave mf at 'gaussian', its default, or use another partition."
        )
    if estimator.order == 0 and estimator.consequent_features is not None:
        raise ValueError(
            f"consequent_features={estimator.consequent_features!r} has no effect with order=0, "
            "whose consequents are constants: leave it at None, or use order=1."
        )
    consequent = feature_indices(estimator.consequent_features, names, "consequent_features")
    # random_state=None stands for one fixed seed: the same data give the same model.
    state = estimator.random_state
    return StructureRequest(
        n_mfs=in_column_order(estimator.n_mfs, names, "n_mfs"),
        partition=partition,
        families=families,
        order=estimator.order,
        premise_inputs=feature_indices(estimator.premise_features, names, "premise_features"),
        consequent_inputs=consequent if estimator.order == 1 else consequent[:0],
        weights=given_weights(estimator),
        premises_move=solver_of(estimator).moves_premises and estimator.max_iter > 0,
        seed=0 if state is None else check_random_state(state).randint(2**31 - 1),
        names=names,
        simplicity=float(estimator.simplicity),
        max_rules=estimator.max_rules,
    )


def _partition(estimator, names, sample_weight):
    """``partition``; for an estimator, the model that it holds."""
    given = estimator.partition
    if isinstance(given, type):
        raise ValueError(
            f"partition={given!r} is a class: give an instance of it, {given.__name__}(...)."
        )
    if isinstance(given, str):
        return given
    if hasattr(given, "fit_predict"):
        if sample_weight is not None and not has_fit_parameter(given, "sample_weight"):
            raise ValueError(
                f"partition={given!r} takes no sample_weight, but fit was given one: use a "
                "clusterer that does, such as KMeans, or partition='grid'."
            )
        return given
    model = getattr(given, "model_", given)
    if not isinstance(model, TSKModel):
        raise ValueError(
            f"partition={given!r} has no rules: it has not been fitted, or it was cloned, which "
            "discards the fit (scikit-learn's searches clone estimators). Give the model_ of the "
            "fitted estimator instead."
        )
    _check_inputs(model, names)
    refused = {"premise_features": "has no effect on imported rules, which have their own inputs:"}
    if model.n_rules > (estimator.max_rules or model.n_rules):
        what = f"partition has {model.n_rules:,} rules"
        refused["max_rules"] = f"is too low: {what}. Give a smaller model, or"
    if estimator.max_iter == 0:
        kept = "which keeps the imported rules as they are"
        why = f"has no effect with max_iter=0, {kept}: use solver='lse', or"
        refused |= dict.fromkeys(("monotonic_cst", "constraints", "consequent_features"), why)
        if estimator.order < model.order:
            raise ValueError(f"order={estimator.order} {why} leave it at 1.")
    for name, why in refused.items():
        if getattr(estimator, name) is not None:
            given = f"{name}={getattr(estimator, name)!r}"
            raise ValueError(f"{given} {why} leave it at None.")
    return model


def _check_inputs(model, names):
    """Raise ValueError where a model has other inputs than the data; default names match any."""
    own, given, advice = tuple(model.input_names), tuple(names), ""
    if len(own) == len(given):
        if own == given or tuple(f"x{j}" for j in range(len(names))) in (own, given):
            return
        advice = ", with the same names and in the same order"
    raise ValueError(
        f"partition has rules on the inputs {', '.join(own)}, but the columns of X are "
        f"{', '.join(given)}: give X the inputs of the rules{advice}."
    )
