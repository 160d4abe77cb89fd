"""Two regressors in a row: the second learns what the first leaves."""

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn import get_config
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.pipeline import Pipeline
from sklearn.utils import Bunch, get_tags
from sklearn.utils.metadata_routing import MetadataRouter, MethodMapping, process_routing
from sklearn.utils.metaestimators import available_if
from sklearn.utils.validation import (
    check_is_fitted,
    check_scalar,
    column_or_1d,
    has_fit_parameter,
    validate_data,
)

from .. import ANFISRegressor
from ._columns import ask
from .physics import OpenLoopArcsineRegressor

__all__ = ["ResidualRegressor"]


def _some_part_has(method):
    """A check for ``available_if``: that the base or the residual model offers ``method``."""

    def check(self):
        for part in self._parts():
            # AttributeError with the part's own words where it has no such method.
            if hasattr(_last_step(part), method):
                return True
        raise AttributeError(f"Neither base nor residual of {self!r} has the method {method!r}.")

    return check


class ResidualRegressor(RegressorMixin, BaseEstimator):
    """A base regressor, and another that learns what it leaves.

    The base is fitted to the target, the residual model to the target minus what the base predicts;
    the prediction is the sum of both. With the physics of the sensor as the base, the residual
    model stays small, and far from the data the sum falls back to physics plus an edge value.

    Parameters
    ----------
    base : regressor, default=None
        Fitted to the target; None is ``OpenLoopArcsineRegressor()``. It is fitted and its residual
        taken on the same rows: it must be stiff, as a law of few coefficients is. A flexible base
        would leave nothing there.
    residual : regressor, default=None
        Fitted to what the base leaves; None is ``ANFISRegressor()``. A Pipeline will do, and may
        begin with a selection of columns.
    n_rounds : int, default=1
        How often both are fitted in turn, 1 or more. From the second round on, the base is fitted
        to the target minus what the residual model predicts (backfitting [1]_): an effect that the
        base does not have then stops pulling at its coefficients. Three rounds are usually enough.
        It needs a residual model that cannot do the base's work: give it few columns and rules.

    Attributes
    ----------
    base_, residual_ : regressor
        The fitted parts. ``residual_`` is an estimator like any other: its rules can be shown and
        exported by themselves.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of shape (n_features,)
        Their names, where X had names that are all strings.

    See Also
    --------
    OpenLoopArcsineRegressor : The law of an open-loop fiber-optic gyro.

    References
    ----------
    .. [1] A. Buja, T. Hastie and R. Tibshirani, "Linear smoothers and additive models", The Annals
       of Statistics 17 (1989) 453-510.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_ofog
    >>> from skanfis.gyro import OpenLoopArcsineRegressor, ResidualRegressor
    >>> log = make_ofog(n_devices=1, n_runs=4, random_state=0)
    >>> X, rate = log[["output", "temperature", "time"]], log["rate"]
    >>> physics = OpenLoopArcsineRegressor("output", "temperature")
    >>> compensator = ResidualRegressor(physics, ANFISRegressor(n_mfs=2)).fit(X, rate)
    >>> before, after = [model.predict(X) - rate for model in (compensator.base_, compensator)]
    >>> bool(after.std() < before.std() / 3)
    True
    """

    def __init__(self, base: Any = None, residual: Any = None, *, n_rounds: int = 1) -> None:
        self.base = base
        self.residual = residual
        self.n_rounds = n_rounds

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = self.base is None
        tags.input_tags.sparse = all(get_tags(part).input_tags.sparse for part in self._unfitted())
        return tags

    def get_metadata_routing(self) -> MetadataRouter:
        """Metadata routing of this object, with both parts; see scikit-learn's user guide.

        Returns
        -------
        routing : MetadataRouter
        """
        to_both = MethodMapping().add(caller="fit", callee="fit")
        base, residual = self._unfitted()
        router = MetadataRouter(owner=type(self).__name__)
        return router.add(base=base, residual=residual, method_mapping=to_both)

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        sample_weight: ArrayLike | None = None,
        groups: ArrayLike | None = None,
    ) -> Self:
        """Fit the base, then the residual model.

        To a Pipeline weights and groups are given for its last step. With
        ``sklearn.set_config(enable_metadata_routing=True)`` they go where the parts request them.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Inputs of both.
        y : array-like of shape (n_samples,)
            Target.
        sample_weight : array-like of shape (n_samples,), default=None
            Weights, given to both parts.
        groups : array-like of shape (n_samples,), default=None
            The run, device or day that each row belongs to, given to every part whose ``fit`` takes
            groups, and to a search for its splitter: an ANFISRegressor then chooses its structure
            by runs left out.

        Returns
        -------
        self : ResidualRegressor

        Raises
        ------
        ValueError
            If ``n_rounds`` is less than 1, if the base has no finite prediction for some training
            row, if a part takes no weights, or if neither takes groups.
        """
        check_scalar(self.n_rounds, "n_rounds", (int, np.integer), min_val=1)
        # Each part checks X for itself, here and in predict; only its columns are taken note of.
        validate_data(self, X, skip_check_array=True)
        target: np.ndarray = column_or_1d(y, dtype=float, warn=True)
        base, residual = self._unfitted()
        given = self._given_by_part(base, residual, sample_weight, groups)
        learnt = np.zeros(target.size)
        for _ in range(self.n_rounds):
            self.base_ = clone(base).fit(X, target - learnt, **given.base)
            left = target - self.base_.predict(X)
            _check_answered(left)
            self.residual_ = clone(residual).fit(X, left, **given.residual)
            learnt = self.residual_.predict(X)
        return self

    def predict(self, X: ArrayLike) -> np.ndarray:
        """Predict the target, as the sum of both parts.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        y : ndarray of shape (n_samples,)

        Raises
        ------
        ValueError
            If X is refused by either part.
        """
        check_is_fitted(self)
        return self.base_.predict(X) + self.residual_.predict(X)

    @available_if(_some_part_has("in_bounds"))
    def in_bounds(self, X: ArrayLike):
        """Tell which rows lie in bounds of every part that has such; through Pipelines too.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        inside : ndarray of bool of shape (n_samples,)

        Raises
        ------
        ValueError
            If X is refused by either part.
        """
        check_is_fitted(self)
        return np.logical_and.reduce(self._answers("in_bounds", X))

    @available_if(_some_part_has("coverage"))
    def coverage(self, X: ArrayLike):
        """Tell how well the training data cover each row: the least that a part says.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        coverage : ndarray of shape (n_samples,)
            From 0 to 1; see :meth:`skanfis.ANFISRegressor.coverage`.

        Raises
        ------
        ValueError
            If X is refused by either part.
        """
        check_is_fitted(self)
        return np.minimum.reduce(self._answers("coverage", X))

    def _unfitted(self):
        """Both parts, with the defaults in the place of None."""
        base = OpenLoopArcsineRegressor() if self.base is None else self.base
        residual = ANFISRegressor() if self.residual is None else self.residual
        return base, residual

    def _parts(self):
        return (self.base_, self.residual_) if hasattr(self, "residual_") else self._unfitted()

    def _answers(self, method, X):
        """What the parts that have ``method`` answer."""
        return [ask(part, method, X) for part in self._parts() if hasattr(_last_step(part), method)]

    def _given_by_part(self, base, residual, sample_weight, groups):
        """Keyword arguments of each part's fit."""
        given = {"sample_weight": sample_weight, "groups": groups}
        given = {name: value for name, value in given.items() if value is not None}
        if given and get_config()["enable_metadata_routing"]:
            routed = process_routing(self, "fit", **given)
            return Bunch(base=routed.base.fit, residual=routed.residual.fit)
        parts = Bunch(base=base, residual=residual)
        for role, part in parts.items():
            if "sample_weight" in given and not _takes(part, "sample_weight"):
                raise ValueError(f"sample_weight was given, but {role}={part!r} takes no weights.")
        if "groups" in given and not any(_takes(part, "groups") for part in parts.values()):
            raise ValueError(
                f"groups was given, but neither base={base!r} nor residual={residual!r} takes any."
            )
        return Bunch(**{role: _arguments(part, given) for role, part in parts.items()})


def _check_answered(left):
    refused = ~np.isfinite(left)
    if refused.any():
        raise ValueError(
            f"base has no finite prediction for {refused.sum()} of {refused.size} training rows: "
            "nothing is left there for the residual model to learn. Drop these rows, or give the "
            "base a policy that answers."
        )


def _last_step(estimator):
    return estimator.steps[-1][1] if isinstance(estimator, Pipeline) else estimator


def _takes(estimator, name):
    """Whether the fit of what predicts in the end takes an argument."""
    last = _last_step(estimator)
    # A search takes groups for its splitter, by ``**params``.
    return has_fit_parameter(last, name) or (name == "groups" and hasattr(last, "refit"))


def _arguments(estimator, given):
    """What of the given ones the estimator's fit takes, by the names that it goes by there."""
    step = f"{estimator.steps[-1][0]}__" if isinstance(estimator, Pipeline) else ""
    return {f"{step}{name}": value for name, value in given.items() if _takes(estimator, name)}
