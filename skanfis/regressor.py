"""ANFISRegressor: the estimator."""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin

from ._memory import keeps_freed_memory
from ._notebook import RulesReprMixin
from ._sklearn import CallbackSupportMixin, check_parameters, fit_context
from ._threads import one_blas_thread
from .fitted_rules import TellsOfRulesMixin
from .inspection.readability import readability_of_rows
from .learning import Solver
from .membership import Membership
from .options import EarlyStopping, Huber, LinearExtrapolation
from .parameters import SettingsMixin, keep_weights, structure_request
from .prediction import PredictsMixin
from .row_checks import ChecksRowsMixin
from .training import Callbacks, fit_rules
from .training.partial_fit import LearnsFromChunksMixin

__all__ = ["ANFISRegressor"]


class ANFISRegressor(
    PredictsMixin,
    LearnsFromChunksMixin,
    TellsOfRulesMixin,
    ChecksRowsMixin,
    SettingsMixin,
    RulesReprMixin,
    CallbackSupportMixin,
    RegressorMixin,
    BaseEstimator,
):
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
    partition : {"auto", "grid", "subtractive", "fcm"}, clusterer or model, default="auto"
        Where the rules come from, if ``n_mfs`` is "auto". "grid": a grid grown from the data, one
        term at a time on the input where it pays most. "auto": such a grid, or scattered rules from
        k-means, whichever promises the smaller error on new rows; see Notes. "subtractive" and
        "fcm": a rule per cluster of :class:`~skanfis.cluster.SubtractiveClustering` or
        :class:`~skanfis.cluster.FuzzyCMeans`, of such a radius, or as many, as promise the smallest
        error. Any
        scikit-learn clusterer, such as ``KMeans(n_clusters=5)``: a rule per cluster. Scattered
        rules have terms of their own; clusters are sought in standardised inputs and targets
        together, as is the custom since Chiu's subtractive clustering. A fitted ANFISRegressor, or
        a model such as its ``model_`` or what a file was read into: training starts from its rules
        and memberships, in the units of X: so ``partition=model`` goes on with further rows, or for
        further iterations. With ``solver="lse"`` only the consequents are then
        learnt, with ``max_iter=0`` nothing is, and the model's own ``order`` holds.
    mf : str, type of Membership, or sequence of these of shape (n_features,), default="gaussian"
        Family of the membership functions, one for all inputs or one each: "gaussian",
        :math:`\exp(-(x-c)^2 / 2\sigma^2)`; "bell", Jang's generalised bell
        :math:`1 / (1 + |(x-c)/a|^{2b})`; "triangular", "trapezoidal", "two_sided_gaussian",
        "pi_shaped", "s_shaped", "z_shaped", "sigmoid_difference" or "sigmoid_product"; or a class
        of one's own. The first two are the sturdiest between sparse points. "auto" trains the
        structure that Gaussians have found, or that is given, with each of the first six as well,
        for all inputs alike, and takes the one that promises the smallest error on new rows. Not
        looked at where ``partition`` is a model, which brings its own.
    premise_features, consequent_features : array-like of str, int or bool, default=None
        Columns of X in the rules' IF parts, and in their THEN parts, by name, position or mask;
        None is all. With rules on temperature and consequents in rate alone, say, the scale factor
        is scheduled by temperature. What ``n_mfs`` gives terms to must be among the former.
    order : {0, 1}, default=1
        Order of the consequents: 0 is a constant per rule, 1 a linear function of the inputs.
    monotonic_cst : array-like of shape (n_features,) or dict, default=None
        What is known of the target: 1 where it does not fall as the feature rises, -1 where it does
        not rise, 0 where nothing is known; or these by the features' names; of several outputs also
        a row for each, (n_outputs, n_features). Kept by the predictions all over the range of the
        training data, and proven; see Notes.
    constraints : list of OutputLimits and FixedPoint, default=None
        More that is known: limits of the output, which hold for every row, and values at points;
        see :mod:`skanfis.bounds`. In the units of X as it comes here, behind any scaler.
    loss : {"squared_error", "huber"} or Huber, default="squared_error"
        What is minimised. "huber", or :class:`~skanfis.options.Huber` with its ``epsilon``: rows
        far from the model count by the size of their residual and not its square, so that outliers
        in the target do little.
    solver : {"varpro", "hybrid", "gradient", "lse"} or Solver, default="varpro"
        How the premises are learnt; an object of :mod:`skanfis.learning` has settings of its own.
        "varpro", :class:`~skanfis.learning.VariableProjection`: trust-region Gauss-Newton steps;
        its ``tol`` says when to stop, its ``stiffness`` holds the premises near their start.
        "hybrid", :class:`~skanfis.learning.Hybrid`: Jang's rule, least squares forward and a
        gradient step of his own step size backward [1]_. "gradient",
        :class:`~skanfis.learning.GradientDescent`: on premises and consequents together, as in
        back-propagation. "lse", :class:`~skanfis.learning.LeastSquares`: premises stay as they
        start.
    agreement : "auto" or float, default="auto"
        Weight of the penalty on rules that disagree where they fire together, zero or positive:
        agreement / 2 times the mean over rows of :math:`\sum_r \bar w_r (f_r - \hat y)^2`, in
        variances of the target, is added to half its mean squared error. 0 lets rules compensate
        one another at will, 1 is local learning, where every rule is a model of the rows on which
        it fires; the more, the more alike the rules. "auto": found by the evidence, and raised
        until the strongest rule alone is within half a standard deviation of the model, unless that
        would cost more than a tenth of the error, see Notes.
    alpha : "auto" or float, default="auto"
        Ridge penalty on the consequents, zero or positive, in standard deviations of inputs and
        target: alpha / 2 times the squares of each rule's departure from the rules' common line, in
        its value at its own centre and in its slopes, and of the slopes of that line. Of a single
        rule it is scikit-learn's ``Ridge``. "auto": each slope of the common line has a weight, and
        so has each component of the departures, what concerns one input alone and what two
        together; the evidence finds them. At zero, a ridge at the level of rounding errors remains.
    max_iter : int, default=500
        Most iterations (epochs). With 0, premises stay as they start.
    early_stopping : bool or EarlyStopping, default=False
        Whether to hold out rows, stop when the error on them falls no more, and keep the parameters
        of its minimum. With ``groups`` given to ``fit``, whole groups are held out.
        :class:`~skanfis.options.EarlyStopping` says how many rows, and how patient to be.
    out_of_bounds : {"linear", "clip", "nan", "raise"} or LinearExtrapolation, default="linear"
        What ``predict`` does with rows outside the range of the training data, input by input:
        "linear" warns, goes on along the tangent at the edge for half a standard deviation of the
        input, or further where the outermost rows speak for it
        (:class:`~skanfis.options.LinearExtrapolation`, which takes another distance too), and
        holds the value reached; "clip" holds the value at the edge; "nan" returns NaN; "raise"
        raises ValueError. It may be changed by ``set_params`` after training.
    verbose : bool, default=False
        Whether to write a line per iteration. scikit-learn's callbacks (``set_callbacks``) work
        from scikit-learn 1.9 on.
    random_state : int, RandomState instance or None, default=None
        Seed of everything random: the clusterings of "auto" and "fcm", the rows that early stopping
        holds out. None stands for one fixed seed, so that the same
        data always give the same model. A clusterer given as ``partition`` has a seed of its own.
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
        Every term after training, and before: its "input", "name", "function" and parameters by
        name ("center" and "width" of a Gaussian), in the user's units.
    consequents_ : ndarray of shape (n_rules, 1 + n_features[, n_outputs])
        p0, p1, ..., pd of every rule, in the user's units.
    n_iter_ : int
        Iterations run, of the last run of the solver; 1 where there was nothing to iterate on.
    loss_curve_ : ndarray of shape (n_iter + 1,)
        Mean squared error of the standardised target, from the start on, in the last run.
    status_ : str
        Why the solver stopped.
    agreement_, alpha_, slope_alpha_, stiffness_ : float
        The values used; ``slope_alpha_`` is that on the slopes of the rules' common line.
    pulls_ : list of dict
        For the "inputs" that a component of the departures concerns, its weight, "pull", in
        ``alpha_``, which is the geometric mean of all. ["time"] is how the output bends with time
        alone, ["time", "temperature"] how that changes with temperature, [] the rest: the larger,
        the less of it the data show. Of scattered rules, [] are their values and ["time"] their
        slopes by time. Empty where alpha is given, or there are no departures.
    slope_pulls_ : dict of str to float
        The weight on the common line's slope by each input, in ``slope_alpha_``, which is their
        geometric mean. Empty where alpha is given, or there is one slope or none.
    structures_ : list of dict
        The candidates that were compared where the structure was chosen by itself, best first:
        "structure", "n_mfs" (a list, terms per input; None for scattered rules), "expected_error"
        on new rows like these, "log_evidence", "agreement", "alpha", "stiffness"; without groups
        "unknown_between", the part of places half-way between rows at which a single row would tell
        more than all do, while the smaller model that is to be beaten errs by less (above 0.075 the
        candidate is out of the running); with groups "held_out_error", which then decides. Both
        errors are in standard deviations of the target. Empty where the structure was given.
    noise_std_ : float or ndarray of shape (n_outputs,) or None
        Standard deviation of the noise of a row of mean weight, in the units of y: what remains of
        the residual after the effective number of parameters. None where
        ``predict(return_std=True)`` has nothing to go by.
    readability_ : skanfis.inspection.Readability
        How far the rules can be read one by one, measured on the training rows.
    redundant_rules_ : list of dict
        Rules that do nothing: "rule", its number; "reason", "never fires" (nowhere in the
        training data above a hundredth) or "repeats rule ..." (strengths in proportion on all
        rows); "weight", its part of the data's weight. ``without_rules`` drops them.
    constraints_ : dict or None
        With ``monotonic_cst`` or ``constraints``: "certified", whether it is proven that they all
        hold; "loss_before" and "loss_after", as in ``loss_curve_``; "margin", by which they are
        held at points, in standard deviations of the target and the inputs; "rows", the number of
        these points; "boxes", of boxes that the proofs took.
    validation_loss_curve_ : ndarray of shape (n_iter,) or None
        With ``early_stopping``: as ``loss_curve_``, of the rows held out, from the first iteration.
    robust_weights_ : ndarray of shape (n_samples,) or None
        With ``loss="huber"``: the weight that was left to each row, 1 for those near the model;
        NaN for rows that had no part in the training.
    n_samples_seen_ : int
        After ``partial_fit``: rows with weight, of all calls.
    information_ : skanfis.training.Information or None
        After ``partial_fit``: how well the consequents are determined; None after ``fit``.
    n_features_in_ : int
        Number of inputs.
    feature_names_in_ : ndarray of shape (n_features,)
        Names of the inputs, where X had names that are all strings.

    Warns
    -----
    ConvergenceWarning
        If ``max_iter`` was reached first; if constraints hold at all points that were looked at but
        were not proven to hold between them.
    ConstantInputWarning
        If an input is constant in the training data; it gets no terms and no slope.
    UnderdeterminedWarning
        If rules that are given are more than the rows tell: more consequent parameters than
        distinct rows, or places between the rows at which less is known than a row there would
        tell. A structure found by itself has none such, and the evidence bounds what few rows tell.
    OutOfBoundsWarning
        From ``predict`` and ``score``, of rows that are extrapolated to: with
        ``out_of_bounds="linear"``. "clip" and "nan" are answers that were asked for, as in
        scikit-learn's IsotonicRegression, and are given without a word.

    Notes
    -----
    What is trained is not the sum of the rules alone: rules that fire on the same row pay for their
    disagreement (``agreement``), and every rule for its departure from the line that all have in
    common (``alpha``), so that each can be read by itself. Where these weights and the pull of the
    premises (the solver's ``stiffness``) are "auto", they are found by the evidence, the
    probability of the data with all parameters averaged out [3]_, on at most 1,000 representative
    rows; with data that seem free of noise, from two sides. ``readability_`` says how far the rules
    can be read.

    Constraints (``monotonic_cst``, ``constraints``) are kept by the consequents, the solution of a
    convex quadratic programme at the premises that were learnt without them. Bounds on the model
    (:mod:`skanfis.bounds`) prove that they hold at every point in the range of the training data,
    not only at rows; with ``out_of_bounds="clip"`` then everywhere. Limits of the output hold
    everywhere. A structure that the data decide on grows on under them, term by term, where they
    cost it something.

    Where the structure is chosen by itself, a few dozen small models are trained on these rows, and
    compared by their error on rows that are left out one by one, which for the consequents takes no
    training [4]_, times what the effective number k of the premises' parameters costs in Akaike's
    final prediction error, (1 + k / n) / (1 - k / n) [5]_. Nothing is random. A row left out may
    have others of its run beside it: where rows come in runs, give these to ``fit`` as ``groups``.
    The structures are then compared by their error on the groups left out, a fifth of them at a
    time.

    References
    ----------
    .. [1] J.-S. R. Jang, "ANFIS: adaptive-network-based fuzzy inference system", IEEE Transactions
       on Systems, Man, and Cybernetics 23 (1993) 665-685.
    .. [2] G. H. Golub and V. Pereyra, "The differentiation of pseudo-inverses and nonlinear least
       squares problems whose variables separate", SIAM Journal on Numerical Analysis 10 (1973)
       413-432.
    .. [3] D. J. C. MacKay, "Bayesian interpolation", Neural Computation 4 (1992) 415-447.
    .. [4] D. M. Allen, "The relationship between variable selection and data augmentation and a
       method for prediction", Technometrics 16 (1974) 125-127.
    .. [5] H. Akaike, "Fitting autoregressive models for prediction", Annals of the Institute of
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

    def __init__(
        self,
        n_mfs: str | int | ArrayLike = "auto",
        *,
        partition: Any = "auto",
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
            Weights, zero or positive. A whole number counts as so many copies of the row, zero as
            the row's absence, in initialisation and scaling too.
        groups : array-like of shape (n_samples,), default=None
            The run, device or level that each row belongs to. Where the structure is chosen from
            the data, it is by its error on groups left out, if there are two or more;
            ``early_stopping`` holds out whole groups. Not looked at otherwise.

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
        context = None
        if hasattr(self, "_skl_callbacks"):
            most = max(self.max_iter, 1) if self.loss == "squared_error" else None
            context = self._init_callback_context(max_subtasks=most)
        before = self.__dict__.copy()
        try:
            for option in (self.solver, self.loss, self.early_stopping, self.out_of_bounds):
                if isinstance(option, BaseEstimator):
                    check_parameters(option)
            data = self._check_training_data(X, y, sample_weight, groups)
            request = structure_request(self, data.input_names)
            callbacks = None
            if context is not None:
                metadata = None if sample_weight is None else {"sample_weight": sample_weight}
                callbacks = Callbacks(self, context, {"X": X, "y": y, "metadata": metadata})
                callbacks.begin()
            with one_blas_thread(), keeps_freed_memory():
                fitted = fit_rules(self, data, request, callbacks)
        except BaseException:
            # What was fitted before keeps its inputs' number and names: it can go on predicting.
            self.__dict__ = before
            raise
        self.model_ = fitted.model
        self.n_iter_ = max(fitted.result.n_iter, 1)
        self.loss_curve_ = fitted.result.loss_curve
        self.status_ = fitted.result.message
        self._tell_noise()
        start = fitted.start
        keep_weights(self, start.penalty)
        self.stiffness_ = start.penalty.stiffness
        self.structures_ = start.candidates
        self.redundant_rules_ = fitted.redundant_rules
        self.constraints_ = fitted.constraints
        self.robust_weights_ = fitted.robust_weights
        losses = fitted.validation_losses
        self.validation_loss_curve_ = None if losses is None else np.array(losses)
        self.readability_ = self._readability(data)
        self._forget_chunks()
        if callbacks is not None:
            callbacks.end(self.model_)
        return self

    def _readability(self, data):
        with keeps_freed_memory():
            return readability_of_rows(self.model_, data.X, data.y, data.sample_weight)

    def _tell_noise(self):
        posterior = self.model_.posterior
        noise = None if posterior is None else posterior.noise
        self.noise_std_ = noise[0] if noise is not None and self._single_output else noise
