"""What the parameters of an estimator may be, and ask for in the words of structure and training.

Names of columns, families and solvers are resolved here, and parameters that contradict one another
refused; each by itself is checked by scikit-learn before.
"""

from numbers import Integral, Real
from typing import Any, ClassVar, Self

import numpy as np
from sklearn.base import BaseEstimator
from sklearn.utils import check_random_state

from ._sklearn import HasMethods, Hidden, Interval, StrOptions
from ._validation import feature_indices
from .bounds import FixedPoint, OutputLimits
from .learning import SOLVERS, Solver, VariableProjection
from .membership import MEMBERSHIPS, NAMES_IN_MATLAB, TRIED_FAMILIES, membership_families
from .model import TSKModel
from .options import EarlyStopping, Huber, LinearExtrapolation
from .policies import OUT_OF_BOUNDS
from .search import StructureRequest, check_inputs

__all__ = [
    "SettingsMixin",
    "found_weights",
    "given_weights",
    "keep_weights",
    "solver_of",
    "structure_request",
]


# Parameters of which a word stands for an object's defaults.
_OBJECTS: dict[str, type] = {
    "solver": VariableProjection,
    "loss": Huber,
    "early_stopping": EarlyStopping,
    "out_of_bounds": LinearExtrapolation,
}


class SettingsMixin(BaseEstimator):
    """What each parameter may be; settings of the objects among them, such as ``solver__tol``."""

    _parameter_constraints: ClassVar[dict] = {
        "n_mfs": [StrOptions({"auto"}), Integral, "array-like"],
        "partition": [
            StrOptions({"auto", "grid", "subtractive", "fcm"}),
            HasMethods(["fit", "fit_predict"]),
            HasMethods(["predict", "strengths"]),
        ],
        "mf": [
            StrOptions({"auto", *MEMBERSHIPS}),
            # Refused with the name that they have here.
            Hidden(StrOptions(set(NAMES_IN_MATLAB))),
            type,
            list,
            tuple,
            np.ndarray,
        ],
        "premise_features": ["array-like", str, Integral, None],
        "consequent_features": ["array-like", str, Integral, None],
        "order": [Interval(Integral, 0, 1, closed="both")],
        "monotonic_cst": ["array-like", dict, None],
        "constraints": [list, tuple, OutputLimits, FixedPoint, None],
        "loss": [StrOptions({"squared_error", "huber"}), Huber],
        "solver": [StrOptions(set(SOLVERS)), Solver],
        "agreement": [StrOptions({"auto"}), Interval(Real, 0, None, closed="left")],
        "alpha": [StrOptions({"auto"}), Interval(Real, 0, None, closed="left")],
        "max_iter": [Interval(Integral, 0, None, closed="left")],
        "early_stopping": ["boolean", EarlyStopping],
        "out_of_bounds": [StrOptions(set(OUT_OF_BOUNDS)), LinearExtrapolation],
        "verbose": ["verbose"],
        "random_state": ["random_state"],
        "n_jobs": [Integral, None],
    }

    def set_params(self, **params: Any) -> Self:
        """Set parameters, and settings of objects among them, such as ``solver__tol``.

        Parameters
        ----------
        **params : dict
            By name; ``solver__tol`` is the setting ``tol`` of the object given as ``solver``.

        Returns
        -------
        self : ANFISRegressor

        Raises
        ------
        ValueError
            If there is no such parameter, or a setting is given where there is a word and no
            object, such as ``solver__tol`` with ``solver="varpro"``.
        """
        for key in params:
            name, _, setting = key.partition("__")
            if not setting or name not in _OBJECTS:
                continue
            given = params.get(name, getattr(self, name))
            if isinstance(given, str | bool):
                of_word = _OBJECTS[name]
                if name == "solver":
                    of_word = SOLVERS.get(str(given), of_word)
                raise ValueError(
                    f"{key} is a setting of an object, but {name}={given!r} is a word for its "
                    f"defaults: give {name}={of_word.__name__}(), of "
                    f"skanfis.{'learning' if name == 'solver' else 'options'}, in its place."
                )
        return super().set_params(**params)


def structure_request(estimator, names):
    """What training starts from, with all names of columns and families resolved."""
    solver, start = solver_of(estimator), _imported(estimator, names)
    if estimator.order == 0 and estimator.consequent_features is not None:
        raise ValueError(
            f"consequent_features={estimator.consequent_features!r} means nothing with order=0, "
            "whose consequents are constants: leave it at None."
        )
    consequent = feature_indices(estimator.consequent_features, names, "consequent_features")
    # random_state=None stands for one fixed seed: the same data give the same model.
    state = estimator.random_state
    seed = 0 if state is None else check_random_state(state).randint(2**31 - 1)
    return StructureRequest(
        n_mfs=estimator.n_mfs,
        partition=start,
        families=membership_families(estimator.mf, names),
        order=estimator.order,
        premise_inputs=feature_indices(estimator.premise_features, names, "premise_features"),
        consequent_inputs=consequent if estimator.order == 1 else consequent[:0],
        weights=given_weights(estimator),
        premises_move=solver.moves_premises and estimator.max_iter > 0,
        seed=seed,
        names=names,
        other_families=TRIED_FAMILIES[1:]
        if isinstance(estimator.mf, str) and estimator.mf == "auto"
        else (),
    )


def solver_of(estimator) -> Solver:
    """The solver, by its word or as it is given."""
    return SOLVERS[estimator.solver]() if isinstance(estimator.solver, str) else estimator.solver


def given_weights(estimator):
    """The weights of the penalty that are given, by their names in ``evidence.FREE``."""
    stiffness = solver_of(estimator).stiffness
    given = {"agreement": estimator.agreement, "alpha": estimator.alpha, "stiffness": stiffness}
    weights = {k: float(weight) for k, weight in given.items() if not isinstance(weight, str)}
    if "alpha" in weights:
        weights["slope"] = weights["alpha"]
    return weights


def found_weights(estimator):
    """The weights of the penalty that training has used, by their names in ``Penalty``."""
    return {
        "agreement": estimator.agreement_,
        "alpha": estimator.alpha_,
        "slope": estimator.slope_alpha_,
        "stiffness": estimator.stiffness_,
        **_by_place(estimator),
    }


def keep_weights(estimator, penalty):
    """Set the attributes that say which weights on the consequents were used."""
    estimator.agreement_, estimator.alpha_ = penalty.agreement, penalty.alpha
    estimator.slope_alpha_, names = penalty.rho, estimator.model_.input_names
    estimator.slope_pulls_ = {names[j]: pull for j, pull in penalty.slope_pulls.items()}
    estimator.pulls_ = [
        {"inputs": [names[j] for j in component], "pull": pull}
        for component, pull in penalty.pulls.items()
    ]


def _by_place(estimator):
    """The pulls that training has used, of inputs by their places."""
    place = {name: j for j, name in enumerate(estimator.model_.input_names)}
    return {
        "slope_pulls": {place[name]: pull for name, pull in estimator.slope_pulls_.items()},
        "pulls": {
            tuple(place[name] for name in component["inputs"]): component["pull"]
            for component in estimator.pulls_
        },
    }


def _imported(estimator, names):
    """``partition``, with the model in place of the estimator that holds it."""
    given = estimator.partition
    if isinstance(given, type):
        raise ValueError(
            f"partition={given!r} is a class: give an object of it, {given.__name__}(...)."
        )
    if isinstance(given, str) or hasattr(given, "fit_predict"):
        return given
    model = getattr(given, "model_", given)
    if not isinstance(model, TSKModel):
        raise ValueError(
            f"partition={given!r} has no rules: it has not been fitted, or was cloned, which "
            "takes the fit away, as scikit-learn's searches do. Give its model_ instead."
        )
    check_inputs(model, names, "partition")
    if estimator.max_iter == 0 and not (
        estimator.monotonic_cst is None and estimator.constraints is None
    ):
        raise ValueError(
            "monotonic_cst and constraints mean nothing where imported rules are taken as they "
            "are (max_iter=0): leave them at None, or use solver='lse'."
        )
    if estimator.premise_features is not None:
        raise ValueError(
            f"premise_features={estimator.premise_features!r} means nothing to imported rules, "
            "which are on the inputs that they are on: leave it at None."
        )
    if estimator.max_iter == 0 and estimator.consequent_features is not None:
        raise ValueError(
            f"consequent_features={estimator.consequent_features!r} means nothing where imported "
            "rules are taken as they are (max_iter=0): leave it at None, or use solver='lse'."
        )
    return model
