"""ANFISRegressor: the estimator."""

import warnings
from numbers import Integral, Real
from typing import ClassVar

import numpy as np
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_consistent_length, check_is_fitted, validate_data

from ._anfis import train
from ._sklearn import HasMethods, Interval, StrOptions, check_sample_weight, fit_context
from ._validation import check_finite, positive_weights
from .exceptions import OutOfBoundsWarning
from .membership import MEMBERSHIPS
from .model import OUT_OF_BOUNDS
from .solvers import SOLVERS

__all__ = ["ANFISRegressor"]


class ANFISRegressor(RegressorMixin, BaseEstimator):
    r"""Adaptive neuro-fuzzy inference system for regression.

    A first-order Takagi-Sugeno-Kang model [1]_: rules "IF temperature is low AND rate is high THEN
    y = p0 + p1 temperature + p2 rate", whose outputs are averaged with the strengths at which the
    rules fire,

    .. math:: \hat y(x) = \sum_r \bar w_r(x) \, (p_{r0} + p_{r1} x_1 + \dots + p_{rd} x_d) ,
       \qquad \bar w_r \propto \prod_j \mu_{rj}(x_j) .

    Memberships and consequents are learnt together, by variable projection [2]_: the consequents
    are the solution of a linear least-squares problem at every step, and only the memberships are
    iterated on. Inputs and targets are standardised inside: the fit does not depend on their
    units, and everything that comes out is in the user's units.

    Parameters
    ----------
    n_mfs : "auto", int, or array-like of shape (n_features,), default="auto"
        Number of membership functions (terms) per input, one number for all or one each. A number
        makes a grid partition, with a rule for every combination of terms. 1 means that the input
        has no fuzzy terms and takes part in the consequents alone. "auto" leaves it to
        ``partition``.
    partition : {"auto", "grid"} or clusterer, default="auto"
        Where the rules come from, if ``n_mfs`` is "auto". "grid": a grid grown from the data, one
        term at a time on the input where it pays most. "auto": such a grid, or scattered rules from
        k-means, whichever promises the smaller error on new rows; see Notes. A scikit-learn
        clusterer, such as ``KMeans(n_clusters=5)``: one rule per cluster, with terms of its own,
        from clusters sought in standardised inputs and targets together.
    mf : str, default="gaussian"
        Family of the membership functions: "gaussian", :math:`\exp(-(x-c)^2 / 2\sigma^2)`;
        "bell", Jang's generalised bell :math:`1 / (1 + |(x-c)/a|^{2b})`; "triangular",
        "trapezoidal", "two_sided_gaussian", "pi_shaped", "s_shaped", "z_shaped",
        "sigmoid_difference" or "sigmoid_product". The first two are the sturdiest between sparse
        points.
    order : {0, 1}, default=1
        Order of the consequents: 0 is a constant per rule, 1 a linear function of all inputs.
    solver : {"varpro", "hybrid", "gradient", "lbfgs", "lse"}, default="varpro"
        How the premises are learnt. "varpro": variable projection with trust-region Gauss-Newton
        steps. "hybrid": Jang's rule, least squares forward and a gradient step of his own step size
        backward [1]_. "gradient": gradient descent on premises and consequents together, as in
        back-propagation. "lbfgs": the same by L-BFGS-B. "lse": premises stay as they start.
    step_size : float, default=None
        Length of the first step of "hybrid" and "gradient", positive; None is 0.01.
    error_goal : float, default=None
        "hybrid" and "gradient" stop at this root mean square error, in standard deviations of the
        target.
    alpha : "auto" or float, default="auto"
        Ridge penalty on the consequents, zero or positive: alpha / 2 times their squared norm is
        added to half the mean squared error of the standardised target. It acts on each rule's
        value at its centre and on its change over one standard deviation of the inputs there.
        "auto" is chosen together with the structure where that is; else it is 1e-12, next to
        nothing, or 1e-7 where there are fewer than two distinct rows per consequent parameter:
        raise it (1e-6 to 1e-2) for noisy data with many rules. At zero, a ridge at the level of
        rounding errors remains.
    stiffness : "auto" or float, default="auto"
        Pull of the premises to their start, zero or positive: stiffness / 2 times the squared norm
        of their displacements (in spacings of terms and logarithms of widths) is added likewise.
        "auto" is chosen together with the structure where that is; else it is zero.
    max_iter : int, default=500
        Most iterations (epochs), 1 or more.
    tol : float, default=1e-3
        Stop when the relative decrease of the cost, expected and found, stays below ``tol`` twice,
        or when the gradient says as much. Zero or positive.
    out_of_bounds : {"clip", "linear", "nan", "raise"}, default="clip"
        What ``predict`` does with rows outside the range of the training data, input by input:
        "clip" holds the value at the edge; "linear" goes on along the tangent there; "nan"
        returns NaN; "raise" raises ValueError. It may be
        changed by ``set_params`` after training.
    warn_out_of_bounds : bool, default=True
        Whether ``predict`` warns of such rows.
    random_state : int, RandomState instance or None, default=None
        Seed of the clusterings that ``partition="auto"`` tries; everything else is deterministic.
        None stands for one fixed seed, so that the same data always give the same model. A
        clusterer given as ``partition`` has a seed of its own.
    n_jobs : int, default=None
        Worker threads for the passes over the data; None is one, -1 is one per core. The result is
        the same to the last bit for any number. It pays from some 100,000 rows on.

    Attributes
    ----------
    model_ : skanfis.model.TSKModel
        The frozen model, in the user's units.
    n_rules_ : int
        Number of rules.
    rules_ : ndarray of shape (n_rules, n_premise_inputs)
        The terms of each rule: positions in ``memberships_``.
    memberships_, initial_memberships_ : list of dict
        Every term after training, and before: its "input", "function" and parameters by name
        ("center" and "width" of a Gaussian), in the user's units.
    consequents_ : ndarray of shape (n_rules, 1 + n_features[, n_outputs])
        p0, p1, ..., pd of every rule, in the user's units.
    n_iter_ : int
        Iterations run; 1 where there was nothing to iterate on.
    loss_curve_ : ndarray of shape (n_iter + 1,)
        Mean squared error of the standardised target, from the start on.
    status_ : str
        Why the solver stopped.
    alpha_, stiffness_ : float
        The values used.
    structures_ : list of dict
        The candidates that were compared where the structure was chosen by itself, best first:
        "structure", "alpha", "stiffness", and "expected_error" on new rows in standard deviations
        of the target. Empty where the structure was given.
    n_features_in_ : int
        Number of inputs.
    feature_names_in_ : ndarray of shape (n_features,)
        Names of the inputs, where X had names that are all strings.

    Warns
    -----
    ConvergenceWarning
        If ``max_iter`` was reached first.
    ConstantInputWarning
        If an input is constant in the training data; it gets no terms and no slope.
    UnderdeterminedWarning
        If there are more consequent parameters than distinct training rows.
    OutOfBoundsWarning
        From ``predict`` and ``score``; see ``out_of_bounds``.

    Notes
    -----
    Where the structure is chosen by itself, a few dozen small models are trained for a few
    iterations on at most 1,000 representative rows. They are compared by Akaike's final prediction
    error [3]_, MSE (1 + k / N) / (1 - k / n), with the effective number of parameters k, those of
    the premises counted twice. Nothing is held out, and nothing is random. It counts rows, and
    cannot see that the rows of one run are alike: with few runs of many rows each, choose ``n_mfs``
    by cross-validation over the runs.

    References
    ----------
    .. [1] J.-S. R. Jang, "ANFIS: adaptive-network-based fuzzy inference system", IEEE Transactions
       on Systems, Man, and Cybernetics 23 (1993) 665-685.
    .. [2] G. H. Golub and V. Pereyra, "The differentiation of pseudo-inverses and nonlinear least
       squares problems whose variables separate", SIAM Journal on Numerical Analysis 10 (1973)
       413-432.
    .. [3] H. Akaike, "Fitting autoregressive models for prediction", Annals of the Institute of
       Statistical Mathematics 21 (1969) 243-247.

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
        "partition": [StrOptions({"auto", "grid"}), HasMethods(["fit", "fit_predict"])],
        "mf": [StrOptions(set(MEMBERSHIPS))],
        "order": [Interval(Integral, 0, 1, closed="both")],
        "solver": [StrOptions(set(SOLVERS))],
        "step_size": [Interval(Real, 0, None, closed="neither"), None],
        "error_goal": [Interval(Real, 0, None, closed="left"), None],
        "alpha": [StrOptions({"auto"}), Interval(Real, 0, None, closed="left")],
        "stiffness": [StrOptions({"auto"}), Interval(Real, 0, None, closed="left")],
        "max_iter": [Interval(Integral, 1, None, closed="left")],
        "tol": [Interval(Real, 0, None, closed="left")],
        "out_of_bounds": [StrOptions(set(OUT_OF_BOUNDS))],
        "warn_out_of_bounds": ["boolean"],
        "random_state": ["random_state"],
        "n_jobs": [Integral, None],
    }

    def __init__(
        self,
        n_mfs="auto",
        *,
        partition="auto",
        mf="gaussian",
        order=1,
        solver="varpro",
        step_size=None,
        error_goal=None,
        alpha="auto",
        stiffness="auto",
        max_iter=500,
        tol=1e-3,
        out_of_bounds="clip",
        warn_out_of_bounds=True,
        random_state=None,
        n_jobs=None,
    ):
        self.n_mfs = n_mfs
        self.partition = partition
        self.mf = mf
        self.order = order
        self.solver = solver
        self.step_size = step_size
        self.error_goal = error_goal
        self.alpha = alpha
        self.stiffness = stiffness
        self.max_iter = max_iter
        self.tol = tol
        self.out_of_bounds = out_of_bounds
        self.warn_out_of_bounds = warn_out_of_bounds
        self.random_state = random_state
        self.n_jobs = n_jobs

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags

    @fit_context(prefer_skip_nested_validation=False)
    def fit(self, X, y, sample_weight=None):
        """Train the model.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Inputs, in any units.
        y : array-like of shape (n_samples,) or (n_samples, n_outputs)
            Targets, in any units.
        sample_weight : array-like of shape (n_samples,), default=None
            Weights, zero or positive. A whole number counts as so many copies of the row, zero as
            the row's absence, in initialisation and scaling too.

        Returns
        -------
        self : ANFISRegressor

        Raises
        ------
        ValueError
            If the data are empty, a single row, or not finite; if weights are negative or leave
            fewer than two rows; if parameters contradict each other or the data; if the grid has
            more rules than ``sklearn.get_config()["working_memory"]`` can hold.
        """
        before = self.__dict__.copy()
        try:
            X, targets, sample_weight = self._check_training_data(X, y, sample_weight)
            training = train(self, X, targets, sample_weight, self._input_names())
        except BaseException:
            # What was fitted before keeps its inputs' number and names: it can go on predicting.
            self.__dict__ = before
            raise
        self.model_ = training.model
        self.n_iter_ = max(training.result.n_iter, 1)
        self.loss_curve_ = training.result.loss_curve
        self.status_ = training.result.message
        self.alpha_, self.stiffness_ = training.start.alpha, training.start.stiffness
        self.structures_ = training.start.candidates
        return self

    def predict(self, X):
        """Predict the target.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        y : ndarray of shape (n_samples,) or (n_samples, n_outputs)

        Raises
        ------
        ValueError
            If X is not finite; or, with ``out_of_bounds="raise"``, lies outside the training data.

        Warns
        -----
        OutOfBoundsWarning
            If rows lie outside the training data, unless ``warn_out_of_bounds=False``.
        """
        X = self._check_inputs(X)
        model = self.model_.with_out_of_bounds(self.out_of_bounds)
        inside = model.in_bounds(X)
        outputs = model.predict(X, inside)
        if self.warn_out_of_bounds and not inside.all():
            message = model.describe_out_of_bounds(X)
            warnings.warn(
                f"{message} Policy: out_of_bounds={model.out_of_bounds!r}.",
                OutOfBoundsWarning,
                stacklevel=2,
            )
        return outputs[:, 0] if self._single_output else outputs

    def in_bounds(self, X):
        """Tell which rows lie in the range of the training data, input by input.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        inside : ndarray of bool of shape (n_samples,)
        """
        X = self._check_inputs(X)
        return self.model_.in_bounds(X)

    def coverage(self, X):
        """Tell how well the training data cover each row.

        The sum over rules of strength times support, where a rule's support is the number of
        distinct training rows on which it is the strongest over the number of its coefficients, at
        most one; times exp(-delta^2 / 2) with delta the distance from the training range in
        standard deviations.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        coverage : ndarray of shape (n_samples,)
            From 0, where no data speak, to 1.
        """
        X = self._check_inputs(X)
        return self.model_.coverage(X)

    def strengths(self, X):
        """Tell how strongly each rule fires on each row, normalised.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)

        Returns
        -------
        strengths : ndarray of shape (n_samples, n_rules)
            Positive, with sum one in every row. Rows outside the training range are taken at its
            edge.
        """
        X = self._check_inputs(X)
        return self.model_.strengths(X)

    @property
    def n_rules_(self):
        """Number of rules."""
        return self._fitted_model().n_rules

    @property
    def rules_(self):
        """The terms of each rule, as positions in ``memberships_``."""
        return self._fitted_model().antecedent.rule_terms

    @property
    def memberships_(self):
        """Every term after training, in the user's units."""
        return self._fitted_model().memberships()

    @property
    def initial_memberships_(self):
        """Every term before training, in the user's units."""
        return self._fitted_model().memberships(trained=False)

    @property
    def consequents_(self):
        """p0, p1, ..., pd of every rule, in the user's units."""
        consequents = self._fitted_model().consequents
        return consequents[:, :, 0] if self._single_output else consequents

    def _fitted_model(self):
        check_is_fitted(self)
        return self.model_

    def _input_names(self):
        names = getattr(self, "feature_names_in_", None)
        return [f"x{j}" for j in range(self.n_features_in_)] if names is None else list(names)

    def _check_training_data(self, X, y, sample_weight):
        """X, targets (n_rows, n_outputs) and weights or None, all of rows with weight."""
        numeric = {"dtype": (np.float64, np.float32), "ensure_all_finite": False}
        X, y = validate_data(
            self,
            X,
            y,
            validate_separately=(
                {**numeric, "ensure_min_samples": 2},
                {**numeric, "ensure_2d": False},
            ),
        )
        check_consistent_length(X, y)
        self._single_output = y.ndim == 1
        targets = y.reshape(-1, 1) if y.ndim == 1 else y
        check_finite(X, "X", self._input_names())
        check_finite(targets, "y", [f"y{k}" for k in range(targets.shape[1])])
        if sample_weight is None:
            return X, targets, None
        sample_weight = check_sample_weight(sample_weight, X, dtype=np.float64)
        keep = positive_weights(sample_weight, X.shape[0])
        if keep is None:
            return X, targets, sample_weight
        return X[keep], targets[keep], sample_weight[keep]

    def _check_inputs(self, X):
        check_is_fitted(self)
        if not self._is_plain_input(X):
            X = validate_data(
                self, X, reset=False, dtype=(np.float64, np.float32), ensure_all_finite=False
            )
        check_finite(X, "X", self.model_.input_names)
        return X

    def _is_plain_input(self, X):
        """Whether X is an array in which scikit-learn's checks, half of a call, find nothing."""
        return (
            type(X) is np.ndarray
            and X.dtype == np.float64
            and X.ndim == 2
            and X.shape[0] > 0
            and X.shape[1] == self.n_features_in_
            and not hasattr(self, "feature_names_in_")
        )
