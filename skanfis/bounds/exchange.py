r"""Constraints held at points, and proven between them: points are added until the proof succeeds.

That an output rises with an input, or stays below a limit, is a linear constraint on the
consequents at every point of a continuum. It is held at some points, with a margin; the largest
violation is sought, by a sample first, then more closely where that leaves least room, and then by
branch and bound; its place is added; until the bounds prove that there is none (exchange, as in
Remez's and in cutting-plane methods). Where a proof takes too many boxes, the margin is raised.

Slopes are held as mean slopes over a small step, [y(x + d) - y(x)] / d, which a monotone output has
of the right sign too: what is constrained is the prediction itself.

The premises stay as they were learnt without the constraints: to learn them on with these held
takes a fifth more time for a hundredth of the error.

The promise is of the range of the training data, and so, where predictions are held at its edge, of
all inputs. Along a tangent it would cost too much: two tangents at a corner add up to slopes that
no data have asked for.
"""

from dataclasses import replace

import numpy as np
from scipy.special import chdtri
from scipy.stats import qmc
from sklearn.exceptions import ConvergenceWarning

from .._validation import warn_user
from ..exceptions import ConstraintWarning, InfeasibleConstraintsError
from ..model import TSKModel
from .enclosure import Enclosure
from .held import Held
from .program import InfeasibleError
from .search import largest
from .terms import is_known
from .wishes import Wishes

__all__ = ["constrained"]

# Margins, in standard deviations of the target (and of the input): the first, and the last tried.
_FIRST_MARGIN, _LAST_MARGIN, _RAISE = 1e-3, 0.03, 3.0
# A bound on time, where constraints nearly contradict one another: what is not proven by then is
# said not to be.
_MOST_ROUNDS = 40
# A sample is looked at in milliseconds; each point of a round is a row of the quadratic program
# from there on, so that half of them are the worst, and half are spread over the others.
_SAMPLE, _POINTS_A_ROUND = 2048, 40
# Of the sample the places with least room, and about each so many points, within these parts of the
# range one after another: a tenth of the time of the proof that would find as much.
_N_NARROW, _N_ABOUT, _REACHES = 32, 32, (2.0**-4, 2.0**-6, 2.0**-8)
# Of one proof: about a second's worth; beyond, a larger margin makes fewer do.
_MOST_BOXES = 30_000
# That data which keep the constraints are said to contradict them.
_CHANCE = 1e-3
# Inputs up to which a sample has all corners of the range.
_CORNERS = 8


def constrained(model: TSKModel, evaluation, problem, wishes, in_user_units, is_trial=False):
    """The consequents nearest to those of an evaluation that keep all wishes.

    Parameters
    ----------
    model : TSKModel
        The model of ``evaluation``, in the user's units.
    evaluation : Evaluation
        With its normal equations.
    problem : SeparableProblem
    wishes : Wishes
    in_user_units : callable
        Coefficients of a TSKModel from those on [1, z].
    is_trial : bool
        A sample will do: nothing is proven, nothing warned of.

    Returns
    -------
    evaluation : Evaluation
        Its coefficients keep the wishes.
    report : dict
    solved : Solved
        What is met with equality.

    Raises
    ------
    InfeasibleConstraintsError
        If no consequents keep the wishes; it says which.
    """
    exchange = _Exchange(model, problem, wishes, in_user_units)
    return exchange.run(evaluation, is_trial)


class _Exchange:
    def __init__(self, model, problem, wishes: Wishes, in_user_units):
        self.problem, self.in_user_units, self.n_boxes = problem, in_user_units, 0
        # That outputs are held on top is monotone: what rules keep, predictions do.
        self.model = replace(model.with_out_of_bounds("clip"), target=None)
        self.held = Held(replace(model, target=None), problem, wishes, _FIRST_MARGIN)
        self.is_known = all(is_known(group.family) for group in model.antecedent.groups)
        low, high = model.minimum, model.maximum
        rows = problem.rows.sample or problem.rows
        unit = qmc.Halton(low.size, scramble=False).random(_SAMPLE)
        parts = [low + unit * (high - low), rows.X[:: max(rows.n_rows // _SAMPLE, 1)]]
        if low.size <= _CORNERS:
            corners = np.indices((2,) * low.size).reshape(low.size, -1).T
            parts.append(np.where(corners == 1, high, low))
        # A row that is there twice is asked about once.
        self.sample = np.unique(np.vstack(parts), axis=0)
        self.about = (high - low) * (unit[:_N_ABOUT] - 0.5)
        self.about[0] = 0.0

    def run(self, evaluation, is_trial):
        solved, is_proven = (
            (self._on_sample(evaluation), False) if is_trial else self._proven(evaluation)
        )
        if not (is_proven or is_trial):
            # A margin that does not help is not paid for.
            self.held.margin = _FIRST_MARGIN
            solved = self._on_sample(evaluation)
            self._warn()
        ended = self._ended(evaluation, solved)
        if not is_trial:
            self._warn_of_contradictions(evaluation, solved, ended)
        report = {
            "certified": is_proven,
            "margin": self.held.margin,
            "rows": self.held.n_rows,
            "boxes": self.n_boxes,
            "loss_before": float(evaluation.mean_squared_error),
            "loss_after": float(ended.mean_squared_error),
        }
        return ended, report, solved

    @property
    def wishes(self):
        return self.held.wishes

    def _on_sample(self, evaluation, closely=False):
        """Consequents without a violation in the sample, or about its narrowest places."""
        for _ in range(_MOST_ROUNDS):
            solved = self._solve(evaluation)
            model, demands = self._model(evaluation, solved), self.held.demands
            worst = [self._violations(demand, model, self.sample) for demand in demands]
            if closely and not any(map(len, worst)):
                worst = [
                    self._violations(demand, model, self._narrowest(demand, model))
                    for demand in demands
                ]
            if not any(map(len, worst)):
                return solved
            self._hold(worst)
        return self._give_up(map(len, worst))

    def _proven(self, evaluation):
        """Consequents without a violation, and whether that is proven."""
        for _ in range(_MOST_ROUNDS):
            solved = self._on_sample(evaluation, closely=True)
            if not self.is_known:
                return solved, False
            worst, is_undecided = self._prove(self._model(evaluation, solved))
            if any(map(len, worst)):
                self._hold(worst)
            elif not is_undecided:
                return solved, True
            elif self.held.margin * _RAISE > _LAST_MARGIN:
                return solved, False
            else:
                self.held.margin *= _RAISE
        return self._solve(evaluation), False

    def _hold(self, worst):
        for place, points in enumerate(worst):
            self.held.hold(place, points)

    def _solve(self, evaluation):
        try:
            return self.held.solve(evaluation)
        except InfeasibleError as failure:
            self._refuse(evaluation, failure)
            raise

    def _refuse(self, evaluation, failure):
        """Say which wishes cannot be kept."""
        name, n_points = self.model.output_names[failure.output], len(self.wishes.points)
        if failure.by_equalities:
            raise InfeasibleConstraintsError(
                f"constraints fixes {name!r} at {n_points} points, which {self.model.n_rules} "
                "rules cannot all meet: two are the same, or there are more than consequents. "
                "Give fewer points, or use more rules."
            ) from None
        own = [p for p, demand in enumerate(self.held.demands) if demand.output == failure.output]
        guilty = []
        for p in own:
            try:
                self.held.solve(evaluation, [p])
            except InfeasibleError:
                guilty.append(p)
        self._give_up([p in (guilty or own) for p in range(len(self.held.demands))])

    def _give_up(self, is_guilty):
        """Raise an error; ``is_guilty`` has, of every demand, whether it is not kept."""
        pairs = zip(self.held.demands, is_guilty, strict=True)
        names = " and ".join(
            demand.name for demand, guilty in pairs if np.size(guilty) and np.any(guilty)
        )
        n_points = len(self.wishes.points)
        with_points = f", with the {n_points} fixed points of constraints," if n_points else ""
        raise InfeasibleConstraintsError(
            f"No consequents of these {self.model.n_rules} rules keep {names}{with_points} all at "
            "once. Drop one of them, or use order=1 or more rules."
        ) from None

    def _warn(self):
        names = ", ".join(demand.name for demand in self.held.demands)
        why = "" if self.is_known else ": the ranges of its memberships are not known"
        warn_user(
            f"Not proven to hold everywhere{why}: {names}. It holds on the training data and a "
            f"sample of {_SAMPLE} points. Use fewer rules, or Gaussian terms; see "
            "skanfis.bounds.",
            ConvergenceWarning,
        )

    def _warn_of_contradictions(self, evaluation, solved, ended):
        """Warn where less than one fit in a thousand to such data would have to give up so much.

        What is paid is half a Mahalanobis distance, over sigma^2 / n, in the posterior of the
        consequents: of so many active points, its tail is no heavier than that of chi-squared.
        """
        n_rows, scale = self.problem.rows.total_weight, self.problem.rows.targets.scale
        for k, name in enumerate(self.model.output_names):
            guilty = [
                (demand.name, active)
                for demand, active in zip(self.held.demands, solved.active, strict=True)
                if demand.output == k and active
            ]
            if self.model.posterior is None or not guilty:
                continue
            noise = max(self.model.posterior.noise[k] / scale[k], np.sqrt(np.finfo(float).eps))
            distance = 2.0 * n_rows * solved.paid[k] / noise**2
            count = sum(active for _, active in guilty) + len(self.wishes.points)
            if distance <= chdtri(count, _CHANCE):
                continue
            names = " and ".join(name for name, _ in guilty)
            before, after = evaluation.mean_squared_error, ended.mean_squared_error
            warn_user(
                f"The data contradict {names}: kept, it raises the mean squared error of training "
                f"from {before:.3g} to {after:.3g} of the variance of {name!r}, far more than "
                "noise would. Where the data go the other way, the model is flat. Leave the "
                "constraint out, or look at the data; constraints_ has both losses.",
                ConstraintWarning,
            )

    def _ended(self, evaluation, solved):
        normal, local = evaluation.normal, solved.local
        error = 2.0 * solved.cost - float(np.sum(local * (normal.penalty @ local)))
        return replace(
            evaluation,
            cost=solved.cost,
            coefficients=self.problem.local.to_global(local),
            mean_squared_error=max(error, 0.0),
            normal=replace(normal, coefficients=local),
        )

    def _model(self, evaluation, solved):
        inputs = self.problem.rows.inputs
        return replace(
            self.model,
            antecedent=evaluation.antecedent.change_units(inputs.offset, inputs.scale),
            coefficients=self.in_user_units(self.problem.local.to_global(solved.local)),
        )

    def _violations(self, demand, model, points):
        """Those of some points at which a demand is violated, the worst and some others."""
        # A slope over a small step has so many digits, no more.
        size = 1e-9 * self.problem.rows.targets.scale[demand.output]
        if demand.input is not None:
            size /= self.model.spread[demand.input]
        return self._chosen(points, self._excess(demand, model, points), size)

    def _narrowest(self, demand, model):
        """Places at which a demand has least room, found more and more closely from the sample."""
        low, high, points = self.model.minimum, self.model.maximum, self.sample
        excess = self._excess(demand, model, points)
        points = points[np.argsort(-excess, kind="stable")[:_N_NARROW]]
        for reach in _REACHES:
            about = np.clip(points[:, None] + 2.0 * reach * self.about, low, high)
            excess = self._excess(demand, model, about.reshape(-1, low.size))
            best = excess.reshape(len(points), -1).argmax(axis=1)
            points = about[np.arange(len(points)), best]
        return points

    def _excess(self, demand, model, points):
        """By how much a demand is violated at each point, (n_points,); negative where it is not."""
        if demand.input is None:
            excess = demand.limit - model.predict(points)[:, demand.output]
            return demand.sign * excess
        before, after, step = self.held.steps(points, demand.input)
        change = (model.predict(after) - model.predict(before))[:, demand.output]
        return (-demand.sign * change / step).reshape(-1, 2).max(axis=1)

    def _chosen(self, points, excess, above):
        bad = np.flatnonzero(excess > above)
        worst = bad[np.argsort(-excess[bad], kind="stable")]
        half = _POINTS_A_ROUND // 2
        others = worst[half:][:: max((worst.size - half) // half, 1)][:half]
        return points[np.concatenate([worst[:half], others])]

    def _prove(self, model):
        """Points of violation of every demand, and whether a proof ran out of boxes."""
        cuts = np.stack([model.minimum, model.maximum], axis=1)
        worst, is_undecided = [], False
        for demand in self.held.demands:
            if demand.input is not None and _is_constant(model, demand.output):
                # Its slopes are nothing but rounding, which no bound is below.
                worst.append(self.sample[:0])
                continue
            enclosure = Enclosure(model, demand.output, -demand.sign)
            until = -demand.sign * demand.limit
            seen: list[tuple[np.ndarray, np.ndarray]] = []

            def evaluate(low, high, enclosure=enclosure, demand=demand, until=until, seen=seen):
                if demand.input is None:
                    found = enclosure.values(low, high)
                else:
                    found = enclosure.slope(low, high, demand.input)
                violates = found[2] > until
                seen.append((found[1][:, violates], found[2][violates]))
                return found

            found = largest(
                evaluate, model.minimum, model.maximum, 0.0, _MOST_BOXES, cuts, until=until
            )
            self.n_boxes += found.n_boxes
            points = np.concatenate([places for places, _ in seen], axis=1).T
            excess = np.concatenate([values for _, values in seen])
            worst.append(self._chosen(points, excess, until))
            is_undecided |= found.bound > until and not len(points)
        return worst, is_undecided


def _is_constant(model, output):
    """Whether all rules say the same, whatever the row."""
    coefficients = model.coefficients[:, :, output]
    return not coefficients[:, 1:].any() and not np.ptp(coefficients[:, 0])
