r"""Constraints held at rows, and proven between them: rows are added until the proof succeeds.

That an output rises with an input, or stays below a limit, is a linear constraint on the
consequents at every point of a continuum. It is held at some points, with a margin; the largest
violation is sought, by a sample first and then by branch and bound; its place is added; until the
bounds prove that there is none (exchange, as in Remez's and in cutting-plane methods). Where a proof
takes too many boxes, the margin is raised.

Slopes are held as mean slopes over a small step, [y(x + d) - y(x)] / d, which a monotone output has
of the right sign too: what is constrained is the prediction itself.

The promise is of the range of the training data, and so, where predictions are held at its edge, of
all inputs. Along a tangent it would cost too much: two tangents at a corner add up to slopes that
no data have asked for.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc
from sklearn.exceptions import ConvergenceWarning

from .._validation import warn_user
from ..bounds.enclosure import Enclosure
from ..bounds.search import largest
from ..bounds.terms import is_known
from ..model import TSKModel
from .program import Infeasible, nearest
from .wishes import Wishes

__all__ = ["constrained"]

# Margins, in standard deviations of the target (and of the input): the first, and the last tried.
_FIRST_MARGIN, _LAST_MARGIN, _RAISE = 1e-3, 0.03, 3.0
_MOST_ROUNDS = 40
_SAMPLE, _ROWS_A_ROUND = 2048, 40
_MOST_BOXES = 30_000
# The step of a slope, in standard deviations of the input.
_STEP = 1e-5


@dataclass(frozen=True)
class _Demand:
    """One inequality on one output: of its slope by ``input``, or, where that is None, its value.

    sign times it must be at least sign times ``limit``.
    """

    output: int
    sign: float
    input: int | None
    limit: float
    name: str


def constrained(model: TSKModel, evaluation, problem, wishes: Wishes, in_user_units):
    """The nearest model that keeps all wishes.

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

    Returns
    -------
    model : TSKModel
    evaluation : Evaluation
    report : dict

    Raises
    ------
    ValueError
        If no consequents keep the wishes; it says which.
    """
    return _Exchange(model, evaluation, problem, wishes, in_user_units).run()


class _Exchange:
    def __init__(self, model, evaluation, problem, wishes, in_user_units):
        self.wishes, self.in_user_units = wishes, in_user_units
        self.evaluation, self.problem = evaluation, problem
        self.is_known = all(is_known(group.family) for group in model.antecedent.groups)
        # The promise is of the range of the training data, beyond which "clip" keeps it too.
        self.given, self.model = model, model.with_out_of_bounds("clip")
        self.scale = model.spread
        self.columns = self._unit_model()
        self.demands = list(self._demands())
        self.rows = [np.empty((0, problem.n_columns)) for _ in self.demands]
        self.sizes = [np.empty(0) for _ in self.demands]
        self.margin, self.n_boxes = _FIRST_MARGIN, 0
        rows = problem.rows
        low, high = self.model.minimum, self.model.maximum
        unit = qmc.Halton(low.size, scramble=False).random(_SAMPLE)
        some = rows.X[:: max(rows.n_rows // _SAMPLE, 1)]
        self.sample = np.vstack([low + unit * (high - low), some, *self._corners(low, high)])

    @staticmethod
    def _corners(low, high):
        if low.size > 8:
            return []
        corners = np.indices((2,) * low.size).reshape(low.size, -1).T
        return [np.where(corners == 1, high, low)]

    def _unit_model(self):
        """A model whose outputs are the columns of the design, in standardised inputs."""
        problem, antecedent = self.problem, self.evaluation.antecedent
        n_rules, n_basis = antecedent.n_rules, problem.n_basis
        n_inputs = problem.rows.X.shape[1]
        unit = np.eye(problem.n_columns).reshape(n_rules, n_basis, -1)
        coefficients = unit
        if problem.order == 1:
            coefficients = np.zeros((n_rules, 1 + n_inputs, problem.n_columns))
            coefficients[:, 0] = unit[:, 0]
            coefficients[:, 1 + problem.consequent_inputs] = unit[:, 1:]
        low, high = problem.rows.inputs.box
        return replace(
            self.model,
            antecedent=antecedent,
            initial_antecedent=antecedent,
            coefficients=coefficients,
            reference=np.zeros(n_inputs),
            spread=np.ones(n_inputs),
            minimum=low,
            maximum=high,
            support=None,
            output_names=tuple(map(str, range(problem.n_columns))),
        )

    def _demands(self):
        wishes, model = self.wishes, self.model
        for k, name in enumerate(model.output_names):
            for j, sign in enumerate(wishes.signs[k]):
                if sign and model.minimum[j] < model.maximum[j]:
                    what = f"monotonic_cst={sign} of {name!r} by {model.input_names[j]!r}"
                    yield _Demand(k, float(sign), j, 0.0, what)
            for sign, limit in ((1.0, wishes.lower[k]), (-1.0, wishes.upper[k])):
                if np.isfinite(limit):
                    yield _Demand(k, sign, None, limit, f"the limit {limit:g} of {name!r}")

    def run(self):
        is_proven = False
        local = self._solve()
        for _ in range(_MOST_ROUNDS):
            model = self._model(local)
            worst = [self._violations(demand, model) for demand in self.demands]
            if not any(len(points) for points in worst):
                if not self.is_known:
                    break
                worst, undecided = self._prove(model)
                if not any(len(points) for points in worst):
                    is_proven = not undecided
                    if is_proven or self.margin * _RAISE > _LAST_MARGIN:
                        break
                    self.margin *= _RAISE
            for place, points in enumerate(worst):
                self._hold(place, points)
            local = self._solve()
        else:
            names = [d.name for d, points in zip(self.demands, worst, strict=True) if len(points)]
            self._give_up(names)
        if not is_proven:
            # A margin that does not help is not paid for.
            self.margin = _FIRST_MARGIN
            local = self._solve()
            model = self._model(local)
            self._warn()
        return self._ended(model, local, is_proven)

    def _warn(self):
        names = ", ".join(demand.name for demand in self.demands)
        why = "" if self.is_known else ": the ranges of its memberships are not known"
        warn_user(
            f"Not proven to hold everywhere{why}: {names}. It holds on the training data and a "
            f"sample of {_SAMPLE} points. Use fewer rules or Gaussian terms, or "
            "out_of_bounds='clip', and see skanfis.bounds.",
            ConvergenceWarning,
        )

    def _ended(self, model, local, is_proven):
        evaluation, normal = self.evaluation, self.evaluation.normal
        change = local - normal.coefficients
        moved = 0.5 * np.sum(change * ((normal.gram + normal.penalty) @ change))
        cost = evaluation.cost + float(moved)
        error = max(2.0 * cost - float(np.sum(local * (normal.penalty @ local))), 0.0)
        report = {
            "certified": is_proven,
            "margin": self.margin,
            "rows": sum(len(rows) for rows in self.rows),
            "boxes": self.n_boxes,
            "loss_before": evaluation.mean_squared_error,
            "loss_after": error,
        }
        ended = replace(
            evaluation,
            cost=cost,
            coefficients=self.problem.local.to_global(local),
            mean_squared_error=error,
            normal=replace(normal, coefficients=local),
        )
        return replace(self.given, coefficients=model.coefficients), ended, report

    def _model(self, local):
        coefficients = self.in_user_units(self.problem.local.to_global(local))
        return replace(self.model, coefficients=coefficients)

    def _standardised(self, X):
        rows = self.problem.rows
        return (X - rows.inputs.offset) / rows.inputs.scale

    def _in_local(self, rows):
        """Rows (n, n_columns) by local coefficients from those by global ones."""
        if not len(rows):
            return rows
        # In place, on a copy.
        return self.problem.local.transform_rows(np.array(rows.T, order="C")).T

    def _at(self, points):
        """Columns of the design at points, (n_points, n_columns)."""
        if not len(points):
            return np.empty((0, self.problem.n_columns))
        return self.columns.predict(self._standardised(points))

    def _steps(self, X, j):
        """A small step along j at each point, to both sides of it: a slope may jump there.

        Where the prediction changes along j; the points before and after, and the step.
        """
        step = _STEP * self.scale[j]
        low, high = self.model.minimum[j], self.model.maximum[j] - step
        before = np.repeat(X, 2, axis=0)
        before[1::2, j] -= step
        before[:, j] = np.clip(before[:, j], low, high)
        after = before.copy()
        after[:, j] += step
        return before, after, step

    def _hold(self, place, points):
        """Hold a demand at these points too."""
        if not len(points):
            return
        demand = self.demands[place]
        if demand.input is None:
            found = self._at(points)
            size = np.ones(len(points))
        else:
            before, after, _ = self._steps(points, demand.input)
            found = (self._at(after) - self._at(before)) / _STEP
            # Where no consequents have much of a slope, none is asked for.
            size = np.minimum(np.abs(found).sum(axis=1), 1.0)
        self.rows[place] = np.vstack([self.rows[place], demand.sign * found])
        self.sizes[place] = np.append(self.sizes[place], size)

    def _solve(self, chosen=None):
        """Local coefficients that keep the demands, all or chosen, at the points held so far."""
        normal, problem = self.evaluation.normal, self.problem
        targets = problem.rows.targets
        local = normal.coefficients.copy()
        equal = self._in_local(self._at(self.wishes.points))
        values = (self.wishes.values - targets.offset) / targets.scale
        places = range(len(self.demands)) if chosen is None else chosen
        for k in range(problem.n_outputs):
            own = [p for p in places if self.demands[p].output == k]
            rows, least = [np.empty((0, len(local)))], [np.empty(0)]
            for p in own:
                demand = self.demands[p]
                limit = demand.limit
                if demand.input is None:
                    limit = (limit - targets.offset[k]) / targets.scale[k]
                rows.append(self._in_local(self.rows[p]))
                least.append(demand.sign * limit + self.margin * self.sizes[p])
            if not len(equal) and not own:
                continue
            try:
                local[:, k] = nearest(
                    normal.factor,
                    normal.coefficients[:, k],
                    equal,
                    values[:, k],
                    np.vstack(rows),
                    np.concatenate(least),
                )
            except Infeasible as failure:
                if chosen is not None:
                    raise
                self._refuse(k, own, failure.by_equalities)
        return local

    def _refuse(self, output, own, by_equalities):
        name = self.model.output_names[output]
        n_points = len(self.wishes.points)
        if by_equalities:
            raise ValueError(
                f"constraints fixes {name!r} at {n_points} points, which {self.given.n_rules} "
                "rules cannot all meet: two are the same, or there are more than consequents. "
                "Give fewer points, or use more rules."
            ) from None
        guilty = []
        for p in own:
            try:
                self._solve([p])
            except Infeasible:
                guilty.append(self.demands[p].name)
        names = guilty or [self.demands[p].name for p in own]
        self._give_up(names)

    def _give_up(self, names):
        n_points = len(self.wishes.points)
        with_points = f", with the {n_points} fixed points of constraints," if n_points else ""
        raise ValueError(
            f"No consequents of these {self.given.n_rules} rules keep {' and '.join(names)}"
            f"{with_points} all at once. Drop one of them, or use order=1 or more rules."
        ) from None

    def _violations(self, demand, model):
        """Points of the sample at which a demand is violated, the worst and some others."""
        if demand.input is None:
            excess = demand.limit - model.predict(self.sample)[:, demand.output]
        else:
            before, after, step = self._steps(self.sample, demand.input)
            change = model.predict(after) - model.predict(before)
            excess = -(change[:, demand.output] / step).reshape(-1, 2)
            excess = (demand.sign * excess).max(axis=1) * demand.sign
        excess = demand.sign * excess
        size = np.abs(model.coefficients).max() * 1e-12
        return self._chosen(self.sample, excess, size)

    def _chosen(self, points, excess, above):
        bad = np.flatnonzero(excess > above)
        worst = bad[np.argsort(-excess[bad], kind="stable")]
        half = _ROWS_A_ROUND // 2
        others = worst[half:][:: max((worst.size - half) // half, 1)][:half]
        return points[np.concatenate([worst[:half], others])]

    def _prove(self, model):
        """Points of violation of every demand, and whether any proof ran out of boxes."""
        low, high = model.minimum, model.maximum
        cuts = np.stack([model.minimum, model.maximum], axis=1)
        worst, undecided = [], False
        for demand in self.demands:
            enclosure = Enclosure(model, demand.output, -demand.sign)
            until, seen = -demand.sign * demand.limit, []

            def evaluate(lows, highs, enclosure=enclosure, demand=demand, until=until, seen=seen):
                if demand.input is None:
                    found = enclosure.values(lows, highs)
                else:
                    found = enclosure.slope(lows, highs, demand.input)
                seen.append((found[1][:, found[2] > until], found[2][found[2] > until]))
                return found

            found = largest(evaluate, low, high, 0.0, _MOST_BOXES, cuts, until=until)
            self.n_boxes += found.n_boxes
            points = np.concatenate([points for points, _ in seen], axis=1).T
            excess = np.concatenate([values for _, values in seen])
            worst.append(self._chosen(points, excess, until))
            undecided |= found.bound > until and not len(points)
        return worst, undecided
