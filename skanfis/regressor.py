"""ANFISRegressor, the scikit-learn estimator: parameters, fit, predict, learning from chunks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import reduce
from numbers import Integral, Real
from typing import Any, ClassVar, Literal, Self, overload

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.cluster import KMeans
from sklearn.utils.metaestimators import available_if
from sklearn.utils.validation import check_is_fitted, validate_data

from ._sklearn import (
    CallbackSupportMixin,
    HasMethods,
    Hidden,
    Interval,
    StrOptions,
    check_parameters,
    fit_context,
)
from ._threads import N_JOBS, one_blas_thread
from ._validation import as_frame, check_finite, named_refusals, unchanged_by_failure, warn_user
from .exceptions import ForgottenRowsWarning, OutOfBoundsWarning
from .inspection import Readability, rules_html
from .inspection.effects import importances
from .inspection.measures import measure
from .learning import SOLVERS, Solver, VariableProjection
from .membership import MEMBERSHIPS, NAMES_IN_MATLAB, Membership
from .model import TSKModel
from .naming import given_term_names
from .options import EarlyStopping, Huber, LinearExtrapolation, policy_of
from .policies import OUT_OF_BOUNDS
from .search.candidates import KINDS
from .training import Callbacks, chunk_checks, fit_rules, model_without_rules, validated
from .training.chunks import RowSums, fitted_weights, inputs_with_slopes, solve
from .training.data import NUMERIC, Fitted
from .training.settings import given_weights, solver_of, structure_request

# Parameters that take a word or an object with settings: the class of such an object.
_OBJECTS: dict[str, type] = {
    "partition": KMeans,
    "solver": VariableProjection,
    "loss": Huber,
    "early_stopping": EarlyStopping,
    "out_of_bounds": LinearExtrapolation,
}


class ANFISRegressor(CallbackSupportMixin, RegressorMixin, BaseEstimator):
    r"""Adaptive neuro-fuzzy inference system for regression.

    A first-order Takagi-Sugeno-Kang model [1]_: rules "IF temperature is low AND rate is high THEN
    y = p0 + p1 temperature + p2 rate", averaged with the strengths at which they fire. Memberships
    are trained; consequents are the solution of a linear least-squares problem at every step [2]_.
    The fit does not depend on units, and all results are in the user's units.

    Parameters
    ----------
    n_mfs : "auto", int, or array-like of shape (n_features,), default="auto"
        Number of membership functions (terms) per input. Numbers make a grid: a rule for every
        combination of terms, and an input with 1 in the consequents alone. "auto": ``partition``.
    partition : {"auto", "grid", "tree", "scattered"}, clusterer or model, default="auto"
        Where the rules come from, if ``n_mfs`` is "auto". "grid": grids that grow term by term;
        "tree": cuts of the inputs, one after the other (:doc:`/trees`); "scattered": rules with
        terms of their own, around clusters; "auto": all are searched. A scikit-learn clusterer: a
        rule per cluster of standardised inputs and target. A fitted ANFISRegressor or its
        ``model_``: training starts from its rules; with ``solver="lse"`` only the consequents are
        learnt, with ``max_iter=0`` nothing is.
    simplicity : float, default=0.05
        Relative increase of the error, from 0 to 1, accepted for a model that is quicker to read;
        for weak signals at most ``(1 + simplicity)**2 - 1`` of the explained variance. Among the
        candidates within this tolerance the one with the smallest reading cost is taken, and half
        of the tolerance left is spent on ``agreement``. Given rules lose slopes, and agree, within
        the same tolerance. 0: the best. GridSearchCV by R2 always picks 0 (:doc:`/choosing`).
    max_rules : int, default=None
        Largest number of rules. None: as many as reduce the error, while several rules have at most
        464 parameters, and no more than there are distinct rows. ValueError if more are given.
    mf : str, type of Membership, or sequence of these of shape (n_features,), default="gaussian"
        Family of the membership functions, for all inputs or one each: "gaussian", "bell",
        "triangular", "trapezoidal", "two_sided_gaussian", "pi_shaped", "s_shaped", "z_shaped",
        "sigmoid_difference", "sigmoid_product", or a class of one's own. Not used with a model;
        ValueError with "tree".
    premise_features, consequent_features : array-like of str, int or bool, default=None
        Columns of X in the rules' IF parts, and in their THEN parts, by name, position or mask;
        None is all columns; with few rows, the search may give slopes to fewer of them.
    order : {0, 1}, default=1
        Order of the consequents: 0 is a constant per rule, 1 a linear function of the inputs.
    monotonic_cst : array-like of shape (n_features,) or dict, default=None
        1: the target does not fall as the feature rises; -1: it does not rise; 0: nothing is known.
        A dict gives these by name or position, a Series by name; several outputs take a row each.
        The order certainly holds in the range of the data and beyond it (:mod:`skanfis.bounds`).
    constraints : list of OutputLimits and FixedPoint, default=None
        Limits that the output keeps on every row, and values that it takes at given points. They
        are in the units of the X given here, after any scaler. See :mod:`skanfis.bounds`.
    loss : {"squared_error", "huber"} or Huber, default="squared_error"
        What is minimised. "huber", or :class:`~skanfis.options.Huber` with its ``epsilon``: large
        residuals count by their size, not by their square.
    solver : {"varpro", "hybrid", "gradient", "lse"} or Solver, default="varpro"
        How the premises are learnt: :class:`~skanfis.learning.VariableProjection`, Gauss-Newton
        steps in a trust region; :class:`~skanfis.learning.Hybrid`, Jang's rule [1]_;
        :class:`~skanfis.learning.GradientDescent`, back-propagation;
        :class:`~skanfis.learning.LeastSquares`, premises stay. Objects have settings: ``tol``, ...
    agreement : "auto" or float, default="auto"
        Weight of the penalty on rules that disagree where they fire together, in variances of the
        target. 0 lets rules compensate one another, 1 makes every rule a model of its own rows.
        "auto": found by the evidence [3]_, and raised as far as ``simplicity`` leaves room.
    alpha : "auto" or float, default="auto"
        Ridge penalty on the consequents of standardised inputs and target: on each rule's departure
        from the rules' common line, and on the slopes of that line. With a single rule it is
        scikit-learn's ``Ridge(n_samples * alpha)``. "auto": found by the evidence [3]_.
    max_iter : int, default=500
        Largest number of iterations (epochs). With 0 the premises stay as they start.
    early_stopping : bool or EarlyStopping, default=False
        Whether to hold out rows, or whole ``groups``, and keep the parameters with the smallest
        error on them; see :class:`~skanfis.options.EarlyStopping`.
    out_of_bounds : {"linear", "clip", "nan", "raise"} or LinearExtrapolation, default="linear"
        What ``predict`` does with rows outside the range of the training data, input by input:
        "linear" warns, and follows the tangent at the edge for a limited distance
        (:class:`~skanfis.options.LinearExtrapolation`); "clip" holds the value at the edge; "nan"
        returns NaN, which scores refuse; "raise" raises ValueError. May be changed after training.
    verbose : bool, default=False
        Whether to write a line per candidate structure and per iteration.
    random_state : int, RandomState instance or None, default=None
        Seed for clustering and for holding out rows. None is a fixed seed: the same data give the
        same model. The rows that judge the structure depend on their values, not on the seed.
    n_jobs : int, default=None
        Number of worker threads; -1: one per core. The result is the same to the last bit.

    Attributes
    ----------
    model_ : skanfis.model.TSKModel
        The frozen model, in the user's units.
    n_rules_ : int
        Number of rules.
    rules_ : ndarray of shape (n_rules, n_premise_inputs), or of a tree (n_rules, longest path)
        The terms of each rule: positions in ``memberships_``, -1 for none.
    memberships_, initial_memberships_ : list of dict
        Every term after training, and before: its "input", "name", "function" and parameters.
    consequents_ : ndarray of shape (n_rules, 1 + n_features[, n_outputs])
        p0, p1, ..., pd of every rule.
    feature_importances_ : ndarray of shape (n_features,) or (n_outputs, n_features)
        Sobol's total share of each input, as if inputs were independent, divided by their sum: see
        :func:`skanfis.inspection.effects`. Computed on access; not after ``partial_fit``.
    n_iter_, loss_curve_, status_ : int, ndarray of shape (n_iter + 1,), str
        The last run of the solver: its iterations, counted as one if there are none, its mean
        squared error on the standardised target, summed over outputs, from the start on, and why it
        stopped.
    agreement_, alpha_, slope_alpha_, stiffness_ : float
        Weights of the penalties. ``slope_alpha_`` penalises the slopes of the rules' common line,
        ``stiffness_`` movements of the premises.
    pulls_, slope_pulls_ : list of dict, dict
        For each component of the rules' departures: its "inputs", and "pull", its weight in
        ``alpha_``. For each input: its slope's weight in ``slope_alpha_``. Empty if alpha is given
        or there is only one.
    structures_ : list of dict
        The structures compared, or the one given: "structure" in words, "kind", "rules", "n_mfs" of
        a grid, "reading_cost" (numerals in the rules' sentences), "expected_error" (RMS on new
        rows, in standard deviations of the target; of several outputs, the root of the sum of
        squares), "rules_beat_mean" (whether the rules one by one, before they are made to agree,
        err less than the mean), "chosen". The smallest error comes first. Empty if nothing was
        fitted.
    noise_std_ : float or ndarray of shape (n_outputs,) or None
        Standard deviation of the noise of a row of mean weight, in y's units; None if not known.
    readability_ : skanfis.inspection.Readability
        How far the rules can be read one by one, measured on the training rows.
    redundant_rules_ : list of dict
        Rules that do nothing: "rule", its number; "reason", "never fires" or "repeats rule ...";
        "weight", its share of the weight of all rows. ``without_rules`` drops them.
    constraints_ : dict or None
        With constraints: "certified", that they hold everywhere; "drawn", how far the rules had to
        be moved towards order, or one line, from 0 to 1; training's "loss_before", "loss_after".
    validation_loss_curve_ : ndarray of shape (n_iter,) or None
        With ``early_stopping``: as ``loss_curve_``, on the held-out rows.
    robust_weights_ : ndarray of shape (n_samples,) or None
        With ``loss="huber"``: the weight that it leaves to each row; NaN for rows not used.
    n_samples_seen_ : int
        After ``partial_fit``: number of rows with non-zero weight in all calls.
    n_features_in_, feature_names_in_ : int, ndarray of shape (n_features,)
        Number of inputs; their names, if all columns of X have strings as names.

    References
    ----------
    .. [1] J.-S. R. Jang, "ANFIS: adaptive-network-based fuzzy inference system", IEEE Transactions
       on Systems, Man, and Cybernetics 23 (1993) 665-685.
    .. [2] G. H. Golub and V. Pereyra, "The differentiation of pseudo-inverses and nonlinear least
       squares problems whose variables separate", SIAM Journal on Numerical Analysis 10 (1973)
       413-432.
    .. [3] D. J. C. MacKay, "Bayesian interpolation", Neural Computation 4 (1992) 415-447.

    Examples
    --------
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> X, y = make_jang_sinc()
    >>> model = ANFISRegressor(n_mfs=4).fit(X, y)
    >>> model.n_rules_
    16
    >>> bool(abs(model.predict(X) - y).max() < 1e-3)
    True
    """

    _parameter_constraints: ClassVar[dict] = {
        "n_mfs": [StrOptions({"auto"}), Integral, "array-like"],
        "partition": [
            StrOptions({"auto", *KINDS}),
            HasMethods(["fit", "fit_predict"]),
            HasMethods(["predict", "strengths"]),
        ],
        "simplicity": [Interval(Real, 0, 1, closed="both")],
        "max_rules": [Interval(Integral, 1, None, closed="left"), None],
        "mf": [
            StrOptions(set(MEMBERSHIPS)),
            Hidden(StrOptions(set(NAMES_IN_MATLAB))),  # refused, with the name used here
            "array-like",
            type,
        ],
        "premise_features": ["array-like", str, Integral, None],
        "consequent_features": ["array-like", str, Integral, None],
        "order": [Interval(Integral, 0, 1, closed="both")],
        "monotonic_cst": ["array-like", dict, None],
        "constraints": "no_validation",  # checked elsewhere, with its own messages
        "loss": [StrOptions({"squared_error", "huber"}), Huber],
        "solver": [StrOptions(set(SOLVERS)), Solver],
        "agreement": [StrOptions({"auto"}), Interval(Real, 0, None, closed="left")],
        "alpha": [StrOptions({"auto"}), Interval(Real, 0, None, closed="left")],
        "max_iter": [Interval(Integral, 0, None, closed="left")],
        "early_stopping": ["boolean", EarlyStopping],
        "out_of_bounds": [StrOptions(set(OUT_OF_BOUNDS)), LinearExtrapolation],
        "verbose": ["verbose"],
        "random_state": ["random_state"],
        "n_jobs": N_JOBS,
    }

    def __init__(
        self,
        n_mfs: str | int | ArrayLike = "auto",
        *,
        partition: Any = "auto",
        simplicity: float = 0.05,
        max_rules: int | None = None,
        mf: str | type[Membership] | Sequence[str | type[Membership]] = "gaussian",
        premise_features: ArrayLike | None = None,
        consequent_features: ArrayLike | None = None,
        order: int = 1,
        monotonic_cst: ArrayLike | dict | None = None,
        constraints: Any = None,
        loss: str | Huber = "squared_error",
        solver: str | Solver = "varpro",
        agreement: str | float = "auto",
        alpha: str | float = "auto",
        max_iter: int = 500,
        early_stopping: bool | EarlyStopping = False,
        out_of_bounds: str | LinearExtrapolation = "linear",
        verbose: bool | int = False,
        random_state: int | np.random.RandomState | None = None,
        n_jobs: int | None = None,
    ) -> None:
        self.n_mfs = n_mfs
        self.partition = partition
        self.simplicity = simplicity
        self.max_rules = max_rules
        self.mf = mf
        self.premise_features = premise_features
        self.consequent_features = consequent_features
        self.order = order
        self.monotonic_cst = monotonic_cst
        self.constraints = constraints
        self.loss = loss
        self.solver = solver
        self.agreement = agreement
        self.alpha = alpha
        self.max_iter = max_iter
        self.early_stopping = early_stopping
        self.out_of_bounds = out_of_bounds
        self.verbose = verbose
        self.random_state = random_state
        self.n_jobs = n_jobs

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags

    def set_params(self, **params: Any) -> Self:
        """Set parameters by name, or settings of their objects, such as ``solver__tol``."""
        for key in params:
            name, _, setting = key.partition("__")
            given = params.get(name, getattr(self, name, None))
            if setting and name in _OBJECTS and isinstance(given, str | bool):
                of_word = SOLVERS.get(str(given), _OBJECTS[name])
                module = {"solver": "skanfis.learning", "partition": "sklearn.cluster"}
                raise ValueError(
                    f"{key} is a setting of an object, but {name}={given!r} has none: give "
                    f"{name}={of_word.__name__}(), of {module.get(name, 'skanfis.options')}, in "
                    "its place."
                )
        return super().set_params(**params)

    @fit_context(prefer_skip_nested_validation=False)
    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        sample_weight: ArrayLike | None = None,
        groups: ArrayLike | None = None,
    ) -> Self:
        """Train the model.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Inputs, in any units.
        y : array-like of shape (n_samples,) or (n_samples, n_outputs)
            Targets, in any units.
        sample_weight : array-like of shape (n_samples,), default=None
            Weights, zero or positive. A whole number n counts as n copies of the row, zero as its
            absence. Scale weights that state the precision of rows to a mean of one.
        groups : array-like of shape (n_samples,), default=None
            The run, device or level that each row belongs to. The structure is chosen by its error
            on groups left out, and ``early_stopping`` holds out whole groups. One group counts as
            none.

        Raises
        ------
        ValueError, TypeError
            If the data are a single row, not finite, or no numbers; if weights are negative; if
            parameters contradict each other or the data; if the grid has more rules than
            ``sklearn.get_config()["working_memory"]`` can hold.

        Warns
        -----
        ConvergenceWarning
            If ``max_iter`` was reached before convergence, or Huber's weights did not settle.
        ConstraintWarning
            If the data contradict the constraints, or rules moved to prove them err much more.
        ConstantInputWarning
            If an input is constant in the training data; it gets no terms and no slope.
        UnderdeterminedWarning
            If the rows cannot determine all of the given rules.
        """
        context = None
        if hasattr(self, "_skl_callbacks"):
            # Huber's loss takes several runs of the solver; their number is not known in advance.
            most = max(self.max_iter, 1) if self.loss == "squared_error" else None
            context = self._init_callback_context(max_subtasks=most)
        with unchanged_by_failure(self):
            for option in (self.solver, self.loss, self.early_stopping, self.out_of_bounds):
                if isinstance(option, BaseEstimator):
                    check_parameters(option)
            data = self._check_training_data(X, y, sample_weight, groups)
            request = structure_request(self, data.input_names, sample_weight)
            callbacks = None
            if context is not None:
                metadata = None if sample_weight is None else {"sample_weight": sample_weight}
                callbacks = Callbacks(self, context, {"X": X, "y": y, "metadata": metadata})
                callbacks.begin()
            with one_blas_thread():
                fitted = fit_rules(self, data, request, callbacks)
            self.model_ = fitted.model
            self._keep(fitted)
            self.stiffness_ = fitted.start.penalty.stiffness
            self.structures_ = fitted.start.candidates
            self.constraints_ = fitted.constraints
            self.robust_weights_ = fitted.robust_weights
            self.validation_loss_curve_ = fitted.validation_losses
            self.readability_ = self._readability(data)
            for name in ("_sums", "_chunk_settings", "_first_weights", "n_samples_seen_"):
                self.__dict__.pop(name, None)
            if callbacks is not None:
                callbacks.end(self.model_)
        return self

    @overload
    def predict(self, X: ArrayLike, return_std: Literal[False] = False) -> np.ndarray: ...

    @overload
    def predict(self, X: ArrayLike, return_std: Literal[True]) -> tuple[np.ndarray, np.ndarray]: ...

    @overload
    def predict(
        self, X: ArrayLike, return_std: bool
    ) -> np.ndarray | tuple[np.ndarray, np.ndarray]: ...

    def predict(
        self, X: ArrayLike, return_std: bool = False
    ) -> np.ndarray | tuple[np.ndarray, np.ndarray]:
        """Predict the target.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
        return_std : bool, default=False
            Whether to also return the standard deviation of a new row of mean weight. It covers the
            noise, the consequents and, by Laplace's method, the premises; structure and penalty
            weights are taken as known. It grows outside the training range.

        Returns
        -------
        y : ndarray of shape (n_samples,) or (n_samples, n_outputs)
        std : ndarray of the shape of y
            Only with ``return_std=True``.

        Raises
        ------
        ValueError, TypeError
            If X is not finite or no numbers; with ``out_of_bounds="raise"``, if it lies outside the
            training data; with ``return_std=True``, if the model has no posterior: it was read from
            a file without one, lost rules, saw a single row, or has more than 2,000 parameters.

        Warns
        -----
        OutOfBoundsWarning
            With ``out_of_bounds="linear"``, if rows lie outside the training data.
        """
        model = self._fitted_model().with_out_of_bounds(*policy_of(self.out_of_bounds))
        X = self._check_inputs(X)
        inside = model.in_bounds(X)
        if model.out_of_bounds == "linear" and not inside.all():
            message = f"{model.describe_out_of_bounds(X)} Policy: {model.policy}."
            warn_user(message, OutOfBoundsWarning)
        if not return_std:
            outputs = model.predict(X, inside)
            return outputs[:, 0] if self._single_output else outputs
        outputs, deviations = model.predict_with_deviation(X, inside)
        return (outputs[:, 0], deviations[:, 0]) if self._single_output else (outputs, deviations)

    def in_bounds(self, X: ArrayLike) -> np.ndarray:
        """Tell which rows lie in the range of the training data, input by input.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        inside : ndarray of bool of shape (n_samples,)
        """
        return self._fitted_model().in_bounds(self._check_inputs(X))

    def coverage(self, X: ArrayLike) -> np.ndarray:
        """Tell how well the training data cover each row.

        It is one where the rules that fire have enough training rows near by. It falls with the
        distance from these rows, and outside the training range.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        coverage : ndarray of shape (n_samples,)
            From 0, far from the training data, to 1.
        """
        return self._fitted_model().coverage(self._check_inputs(X))

    def strengths(self, X: ArrayLike) -> np.ndarray:
        """Tell how strongly each rule fires on each row, normalised.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        strengths : ndarray of shape (n_samples, n_rules)
            Zero or positive, with sum one in every row. Rows outside the training range are taken
            at its edge.
        """
        return self._fitted_model().strengths(self._check_inputs(X))

    def apply(self, X: ArrayLike) -> np.ndarray:
        """Tell which rule is the strongest on each row.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        rules : ndarray of int of shape (n_samples,)
            Numbers of rules, as in ``rules_``; of rules that are equally strong, the smallest.

        Examples
        --------
        >>> from skanfis import ANFISRegressor
        >>> from skanfis.datasets import make_jang_sinc
        >>> X, y = make_jang_sinc()
        >>> ANFISRegressor(n_mfs=2).fit(X, y).apply([[-10.0, -10.0], [10.0, 10.0], [0.0, 10.0]])
        array([0, 3, 1])
        """
        return self._fitted_model().apply(self._check_inputs(X))

    @available_if(chunk_checks.can_learn_from_chunks)
    @fit_context(prefer_skip_nested_validation=False)
    def partial_fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        sample_weight: ArrayLike | None = None,
        *,
        forgetting: float = 1.0,
    ) -> Self:
        r"""Learn from one more chunk of rows; the premises stay.

        The first call fits its rows, to find the structure and the premises. With ``solver="lse"``
        and a model as ``partition`` it takes both from that model. Every further call adds its rows
        to the sums from which the consequents are solved, so that the model does not depend on how
        rows are divided into calls. See :doc:`/streaming`.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Inputs, with the columns of the first call; a single row will do after the first call.
        y : array-like of shape (n_samples,) or (n_samples, n_outputs)
            Targets.
        sample_weight : array-like of shape (n_samples,), default=None
            Weights, zero or positive, relative to those of all other calls.
        forgetting : float, default=1.0
            Factor from 1e-12 to 1. Every row with non-zero weight multiplies the weights of
            all rows before it by this. 1 forgets nothing; at 0.999 about the last 1,000 rows count.
            The range of the training data and the row counts of ``coverage`` do not forget.

        Raises
        ------
        ValueError, TypeError
            If the data are not finite, no numbers, or have other columns; if the first call has a
            single row but must find the structure; if a parameter of the structure has changed.
        AttributeError
            If ``loss``, ``early_stopping`` or constraints need all rows again.

        Warns
        -----
        ForgottenRowsWarning
            If ``fit`` came before: its premises stay, its rows do not count.

        Examples
        --------
        >>> from skanfis import ANFISRegressor
        >>> from skanfis.datasets import make_jang_sinc
        >>> X, y = make_jang_sinc()
        >>> model = ANFISRegressor(n_mfs=4)
        >>> for start in (0, 60):
        ...     model = model.partial_fit(X[start : start + 60], y[start : start + 60])
        >>> model.n_samples_seen_
        120
        """
        chunk_checks.check_forgetting(forgetting)
        with unchanged_by_failure(self):
            self._learn_chunk(X, y, sample_weight, float(forgetting))
        return self

    def _learn_chunk(self, X, y, sample_weight, forgetting):
        """Add the sums of a chunk to those of earlier chunks, or begin with them."""
        before = getattr(self, "_sums", None)
        if before is not None:
            chunk_checks.check_settings(self, self._chunk_settings)
        data = self._check_training_data(X, y, sample_weight, None, is_chunk=True)
        n_rows = data.X.shape[0]
        weight = chunk_checks.faded_weights(data.sample_weight, n_rows, forgetting)
        rows, is_solved = (data.X, data.y, weight), False
        if before is None:
            is_solved = self._begin_chunks(X, y, data, weight)
        else:
            chunk_checks.check_outputs(before.base, data.output_names)
            if n_rows == 0:
                return
            latest = RowSums.of(before.base, before.consequent_inputs, *rows)
            self._sums = before.faded(forgetting**n_rows).plus(latest)
        if not is_solved:
            self._solve_chunks()
            found = measure(self.model_, *rows)
            self.readability_ = Readability(self.model_, found, is_of_chunk=True)
        self.n_samples_seen_ = getattr(self, "n_samples_seen_", 0) + n_rows

    def _begin_chunks(self, X, y, data, weight):
        """Fix the premises and sum over the first chunk; return whether ``fit`` has solved it."""
        request = structure_request(self, data.input_names)
        own = request.consequent_inputs
        after_fit = hasattr(self, "model_")
        is_imported = isinstance(request.partition, TSKModel) and not solver_of(self).moves_premises
        is_fitted = not (after_fit or is_imported)
        chunk_checks.check_begin(self, data.X.shape[0], finds_structure=is_fitted)
        self.stiffness_, self.structures_ = 0.0, []
        self.robust_weights_ = self.validation_loss_curve_ = self.constraints_ = None
        if is_fitted:
            self.fit(X, y, data.over_all(weight, 0.0))
            own = inputs_with_slopes(self.model_, own)
        elif after_fit:
            chunk_checks.check_outputs(self.model_, data.output_names)
            warn_user(
                "partial_fit after fit: the premises stay, but fit keeps no sums over its "
                f"{self.model_.rule_rows.sum():.0f} rows that others could be added to, and the "
                "consequents are learnt from the new rows alone. To have all rows count, give them "
                "all to partial_fit, whose first call is a fit.",
                ForgottenRowsWarning,
            )
        else:
            self.model_ = chunk_checks.named_premises(request.partition, data)
        self._chunk_settings = chunk_checks.structure_settings(self)
        base = replace(self.model_, posterior=None)
        self._sums = RowSums.of(base, own, data.X, data.y, weight)
        if is_fitted and not self._sums.targets.is_constant.all():
            # The penalty weights of this fit stay for later rows, as a prior of fixed strength.
            self._first_weights = fitted_weights(self, self._sums)
        return is_fitted

    def _solve_chunks(self):
        """The model of all rows so far."""
        first = getattr(self, "_first_weights", None)
        solved = solve(self._sums, given_weights(self), first)
        self.model_ = solved.model.with_out_of_bounds(*policy_of(self.out_of_bounds))
        self._keep(solved)

    @available_if(chunk_checks.can_learn_from_chunks)
    def merge(self, *others: Any) -> Self:
        """Merge models trained apart by ``partial_fit``, as if one had seen all their rows.

        Parameters
        ----------
        *others : ANFISRegressor
            Trained by ``partial_fit`` on rows of their own, with the same premises: for example
            each with ``solver="lse"`` and the same model as ``partition``.

        Returns
        -------
        merged : ANFISRegressor
            A new estimator with the parameters of this one, as after ``partial_fit`` with all rows.
            It has no ``readability_``, which needs the rows. The merged models do not change.

        Raises
        ------
        ValueError, AttributeError
            If a model has seen no chunk, the premises, inputs or outputs differ, or a parameter of
            this one needs all rows again, as for ``partial_fit``.

        Examples
        --------
        >>> from skanfis import ANFISRegressor
        >>> from skanfis.datasets import make_jang_sinc
        >>> X, y = make_jang_sinc()
        >>> first = ANFISRegressor(n_mfs=4).fit(X, y)
        >>> devices = [ANFISRegressor(partition=first, solver="lse") for _ in range(2)]
        >>> devices[0] = devices[0].partial_fit(X[:60], y[:60])
        >>> devices[1] = devices[1].partial_fit(X[60:], y[60:])
        >>> devices[0].merge(devices[1]).n_samples_seen_
        121
        """
        models, sums = (self, *others), []
        for place, model in enumerate(models):
            own = getattr(model, "_sums", None)
            if own is None:
                raise ValueError(
                    f"Model {place} of merge has not been trained by partial_fit "
                    f"({type(model).__name__}): there are no sums over its rows to add."
                )
            sums.append(own)
            chunk_checks.check_same_premises(sums[0], sums[-1], place)
        merged = copy(self)
        merged.__dict__.pop("readability_", None)
        merged._sums = reduce(RowSums.plus, sums)
        merged._solve_chunks()
        merged.n_samples_seen_ = sum(model.n_samples_seen_ for model in models)
        return merged

    def rename_terms(self, names: Sequence[str] | Mapping[str, Sequence[str]]) -> Self:
        """Give the terms other names, in the rules and wherever they are shown.

        Parameters
        ----------
        names : sequence of str or dict
            One name per term, in the order of ``memberships_``: the same for every input, or by
            input, ``{"temperature": ["cold", "hot"]}``; other inputs get their default names.

        Raises
        ------
        ValueError, TypeError
            If an input gets too few or too many names, one twice, or what is no text.
        """
        model = self._fitted_model()
        named = {"term_names": given_term_names(model, names)}
        self.model_ = replace(model, **named)
        if hasattr(self, "_sums"):
            self._sums = replace(self._sums, base=replace(self._sums.base, **named))
        if hasattr(self, "readability_"):
            self.readability_ = replace(self.readability_, model=self.model_)
        return self

    def without_rules(self, rules: ArrayLike | None = None) -> TSKModel:
        """Return the model without some of its rules, as a start for further training.

        The rules left fire in the same proportions. Their consequents were learnt together with the
        dropped ones: ``ANFISRegressor(partition=model.without_rules()).fit(X, y)`` trains again.

        Parameters
        ----------
        rules : array-like of int, default=None
            Numbers of the rules to drop; None: those of ``redundant_rules_``.

        Returns
        -------
        model : skanfis.model.TSKModel

        Raises
        ------
        ValueError, TypeError
            If there is no such rule, or none would be left.
        """
        model = self._fitted_model()
        if rules is None:
            rules = [entry["rule"] for entry in self.redundant_rules_]
        return model_without_rules(model, rules)

    @property
    def n_rules_(self) -> int:
        """Number of rules."""
        return self._fitted_model().n_rules

    @property
    def rules_(self) -> np.ndarray:
        """The terms of each rule, as positions in ``memberships_``."""
        return self._fitted_model().antecedent.rule_terms

    @property
    def memberships_(self) -> list[dict]:
        """Every term after training, in the user's units."""
        return self._fitted_model().memberships()

    @property
    def initial_memberships_(self) -> list[dict]:
        """Every term before training, in the user's units."""
        return self._fitted_model().memberships(trained=False)

    @property
    def consequents_(self) -> np.ndarray:
        """p0, p1, ..., pd of every rule, in the user's units."""
        consequents = self._fitted_model().consequents
        return consequents[:, :, 0] if self._single_output else consequents

    @property
    def feature_importances_(self) -> np.ndarray:
        """Sobol's total share of every input, divided by their sum."""
        model = self._fitted_model()
        try:
            found = importances(model)
        except ValueError as error:
            raise AttributeError(str(error)) from None
        return found[0] if self._single_output else found

    def _fitted_model(self) -> TSKModel:
        check_is_fitted(self)
        return self.model_

    def _keep(self, fitted: Fitted) -> None:
        """Set the attributes beside ``model_``, after ``fit`` or a chunk."""
        result, penalty = fitted.result, fitted.start.penalty
        self.redundant_rules_, self.status_ = fitted.redundant_rules, result.message
        self.n_iter_ = max(result.n_iter, 1)
        # Without an iteration, the loss at the end is the loss at the start.
        self.loss_curve_ = np.resize(result.loss_curve, self.n_iter_ + 1)
        self.agreement_, self.alpha_ = penalty.agreement, penalty.alpha
        self.slope_alpha_ = penalty.slope
        names = self.model_.input_names
        self.slope_pulls_ = {names[j]: pull for j, pull in penalty.slope_pulls.items()}
        self.pulls_ = [
            {"inputs": [names[j] for j in component], "pull": pull}
            for component, pull in penalty.pulls.items()
        ]
        posterior = self.model_.posterior
        noise = None if posterior is None else posterior.noise
        self.noise_std_ = noise[0] if noise is not None and self._single_output else noise

    def _readability(self, data):
        return Readability(self.model_, measure(self.model_, data.X, data.y, data.sample_weight))

    def _repr_html_inner(self):
        # For notebooks: scikit-learn 1.6 to 1.9 calls this method or the next, by version.
        return super()._repr_html_inner() + self._rules_html()

    def _repr_mimebundle_(self, **kwargs):
        bundle = super()._repr_mimebundle_(**kwargs)
        if "text/html" in bundle:
            bundle["text/html"] += self._rules_html()
        return bundle

    def _rules_html(self):
        return rules_html(self) if hasattr(self, "model_") else ""

    _check_training_data = validated

    def _check_inputs(self, X):
        """Rows to predict, as an array."""
        # scikit-learn's checks find nothing in a plain float array, but take half of a call.
        is_plain = (
            type(X) is np.ndarray
            and X.dtype == np.float64
            and X.shape[1:] == (self.n_features_in_,)
            and X.size > 0
            and not hasattr(self, "feature_names_in_")
        )
        if not is_plain:
            X = as_frame(X)
            with named_refusals(X=X):
                X = validate_data(self, X, reset=False, **NUMERIC)
        check_finite(X, "X", self.model_.input_names)
        return X
