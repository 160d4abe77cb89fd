"""Inequalities that outputs must keep, held at points: linear constraints on the consequents.

Slopes are held as mean slopes over a small step, [y(x + d) - y(x)] / d, which a monotone output has
of the right sign too: what is constrained is the prediction itself.

The nearest consequents that keep them: (u - u0)' M (u - u0), with M = L L' the matrix of the normal
equations, is to be least over E u = e, G u >= h. In v = L' (u - u0) equalities are eliminated by a
QR factorisation; the rest is least-distance programming by non-negative least squares (Lawson and
Hanson 1974, chapter 23).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import nnls

from ..consequent import NormalFactor
from ..model import TSKModel
from ..policies import SILENT
from .constraints import Constraints

# The step of a slope, in standard deviations of the input.
_STEP = 1e-5
# A minimum below this is zero; rows are of length one.
_ZERO = 1e-10
# Equalities of which one follows from others.
_DEPENDENT = 1e-10


@dataclass(frozen=True)
class Inequality:
    """An inequality on one output: on its slope by ``input``, or, where that is None, its value.

    sign times it must be at least sign times ``limit``.
    """

    output: int
    sign: float
    input: int | None
    limit: float
    name: str


def inequalities_of(constraints: Constraints, model: TSKModel):
    """The inequalities among the constraints, output by output."""
    found = []
    for k, name in enumerate(model.output_names):
        for j, sign in enumerate(constraints.signs[k]):
            if sign and model.minimum[j] < model.maximum[j]:
                what = f"monotonic_cst={sign} of {name!r} by {model.input_names[j]!r}"
                found.append(Inequality(k, float(sign), j, 0.0, what))
        for sign, limit in ((1.0, constraints.lower[k]), (-1.0, constraints.upper[k])):
            if np.isfinite(limit):
                found.append(Inequality(k, sign, None, limit, f"the limit {limit:g} of {name!r}"))
    return found


@dataclass(frozen=True, eq=False)
class Solved:
    """Consequents that keep what is held, at some premises."""

    local: np.ndarray  # (n_columns, n_outputs)
    paid: np.ndarray  # what each output adds to the cost
    known: tuple  # by output, what is met with equality: points, and where a slope begins or None
    active: np.ndarray  # how many points of each inequality are met so


def paid_for(local, normal):
    """What each output adds to the cost with local consequents other than the best."""
    change = local - normal.coefficients
    return 0.5 * np.sum(change * ((normal.gram + normal.penalty) @ change), axis=0)


class HeldPoints:
    """Points at which inequalities are held by a margin, and the consequents that do so."""

    def __init__(self, model: TSKModel, problem, constraints: Constraints, margin: float):
        self.model, self.problem, self.constraints = model, problem, constraints
        self.inequalities, self.margin = inequalities_of(constraints, model), margin
        # Of each, points: where a slope ends, and where it begins.
        nothing = np.empty((0, model.n_inputs))
        self.after, self.before = ([nothing] * len(self.inequalities) for _ in range(2))
        beyond = constraints.points[~model.in_bounds(constraints.points)]
        if len(beyond) and model.out_of_bounds in SILENT:
            raise ValueError(
                f"constraints has a FixedPoint at {beyond[0]}, where a model with "
                f"out_of_bounds={model.out_of_bounds!r} predicts nothing: "
                f"{model.describe_out_of_bounds(beyond)} Use out_of_bounds='linear' or 'clip'."
            )

    def standardised(self, X):
        """Points in standardised inputs."""
        inputs = self.problem.rows.inputs
        return (X - inputs.offset) / inputs.scale

    def steps(self, X, j):
        """Points before and after a small step along j, to both sides of each; and the step."""
        step = _STEP * self.model.spread[j]
        low, high = self.model.minimum[j], self.model.maximum[j] - step
        before = np.repeat(X, 2, axis=0)
        before[1::2, j] -= step
        before[:, j] = np.clip(before[:, j], low, high)
        after = before.copy()
        after[:, j] += step
        return before, after, step

    def hold(self, place, X):
        """Hold an inequality at these points too."""
        j = self.inequalities[place].input
        before, after = (X[:0], X) if j is None else self.steps(X, j)[:2]
        self.after[place] = np.vstack([self.after[place], after])
        self.before[place] = np.vstack([self.before[place], before])

    def solve(self, evaluation) -> Solved:
        """The nearest consequents."""
        columns, normal = self._columns(evaluation.antecedent), evaluation.normal
        local, problem = normal.coefficients.copy(), self.problem
        equal, values = self.equalities(evaluation.antecedent)
        known, active = [], np.zeros(len(self.inequalities), dtype=int)
        for k in range(problem.n_outputs):
            own = [p for p, one in enumerate(self.inequalities) if one.output == k]
            rows, least = self._rows(columns, own)
            try:
                local[:, k], is_active = nearest(
                    normal.factor, normal.coefficients[:, k], equal, values[:, k], rows, least
                )
            except InfeasibleError as failure:
                failure.output = k
                raise
            known.append(self._known(own, is_active, active))
        return Solved(local, paid_for(local, normal), tuple(known), active)

    def equalities(self, antecedent):
        """Local rows of the fixed points, and what they are to be, (n_points, n_outputs)."""
        model, targets = self.model, self.problem.rows.targets
        # By the policy where they lie beyond the range.
        columns = self._columns(antecedent)
        columns = columns.with_out_of_bounds(model.out_of_bounds, model.max_extrapolation)
        equal = self._in_local(columns.predict(self.standardised(self.constraints.points)))
        return equal, (self.constraints.values - targets.offset) / targets.scale

    def known_points(self):
        """What every output is known to be by fixed points, as ``Posterior.given`` takes it."""
        model, points = self.model, self.constraints.points
        if model.out_of_bounds == "linear":
            # Beyond, a tangent is known, which is more than a value: it is not counted.
            points = points[model.in_bounds(points)]
        return [(np.clip(points, model.minimum, model.maximum), None)] if len(points) else []

    def _known(self, places, is_active, active):
        """What one output meets with equality, by ``is_active`` of its rows; counts ``active``."""
        found, start = self.known_points(), 0
        for p in places:
            chosen = is_active[start : start + len(self.after[p])]
            start, active[p] = start + chosen.size, chosen.sum()
            if not chosen.any():
                continue
            before = None if self.inequalities[p].input is None else self.before[p][chosen]
            found.append((self.after[p][chosen], before))
        return found

    def _rows(self, columns, places):
        """Local rows of the inequalities of one output, and what they must be at least."""
        targets, n_columns = self.problem.rows.targets, self.problem.n_columns
        rows, least = [np.empty((0, n_columns))], [np.empty(0)]
        for p in places:
            one = self.inequalities[p]
            found, size, limit = columns.predict(self.standardised(self.after[p])), 1.0, 0.0
            if one.input is None:
                limit = (one.limit - targets.offset[one.output]) / targets.scale[one.output]
            else:
                found = (found - columns.predict(self.standardised(self.before[p]))) / _STEP
                # Where no consequents have much of a slope, none is asked for.
                size = np.minimum(np.abs(found).sum(axis=1), 1.0)
            rows.append(self._in_local(one.sign * found))
            least.append(np.full(len(found), one.sign * limit) + self.margin * size)
        return np.vstack(rows), np.concatenate(least)

    def _columns(self, antecedent):
        """A model whose outputs are the columns of the design, in standardised inputs."""
        problem = self.problem
        n_rules, n_basis, n_inputs = antecedent.n_rules, problem.n_basis, self.model.n_inputs
        unit = np.eye(problem.n_columns).reshape(n_rules, n_basis, -1)
        coefficients = unit
        if problem.order == 1:
            coefficients = np.zeros((n_rules, 1 + n_inputs, problem.n_columns))
            coefficients[:, 0] = unit[:, 0]
            coefficients[:, 1 + problem.consequent_inputs] = unit[:, 1:]
        low, high = problem.rows.inputs.box
        at = self.model.tangent_at
        at = None if at is None else self.standardised(at)
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
            out_of_bounds="clip",
            tangent_at=at,
            output_names=tuple(map(str, range(problem.n_columns))),
        )

    def _in_local(self, rows):
        """Rows (n, n_columns) by local coefficients from those by global ones."""
        if not len(rows):
            return rows
        return self.problem.local.transform_rows(np.array(rows.T, order="C")).T


class InfeasibleError(Exception):
    """No consequents keep the constraints; ``by_equalities``: not even the equalities alone."""

    def __init__(self, by_equalities):
        super().__init__()
        self.by_equalities, self.output = by_equalities, 0


def nearest(factor: NormalFactor, start, equal, equal_to, at_least, least):
    """The u nearest to ``start`` with E u = e and G u >= h, and which of these hold it back."""
    half = factor.half_solve(at_least.T)
    base, toward = np.empty((len(half), 0)), np.empty(0)
    if equal.size:
        base, triangle = np.linalg.qr(factor.half_solve(equal.T))
        sizes = np.abs(np.diagonal(triangle))
        if (sizes <= _DEPENDENT * sizes.max(initial=0.0)).any() or equal.shape[0] > start.size:
            raise InfeasibleError(True)
        toward = solve_triangular(triangle, equal_to - equal @ start, trans="T")
    short = least - at_least @ start - half.T @ (base @ toward)
    free = half - base @ (base.T @ half)
    length = np.sqrt(np.sum(free**2, axis=0))
    # What equalities decide, or nothing can change: met, or not to be met.
    fixed = length <= _DEPENDENT * np.sqrt(np.sum(half**2, axis=0)) + np.finfo(float).tiny
    if (short[fixed] > _ZERO * (1.0 + np.abs(least[fixed]))).any():
        raise InfeasibleError(False)
    multipliers = np.zeros(least.size)
    kept = ~fixed
    if (short[kept] > 0.0).any():
        found = _least_distance(free[:, kept] / length[kept], short[kept] / length[kept])
        multipliers[kept] = found / length[kept]
    step = base @ toward + free @ multipliers
    return start + factor.back_solve(step), multipliers > 0.0


def _least_distance(columns, short):
    """Multipliers of the shortest t with columns' t >= short."""
    scale = short.max()
    rows = np.vstack([columns, short / scale])
    target = np.zeros(rows.shape[0])
    target[-1] = 1.0
    multipliers, distance = nnls(rows, target, maxiter=30 * max(rows.shape))
    rest = 1.0 - (short / scale) @ multipliers
    if distance <= _ZERO or rest <= _ZERO**2:
        raise InfeasibleError(False)
    return scale * multipliers / rest
