r"""Structure by itself: how many terms or rules, and how stiff, chosen from the data.

What is compared are short trainings of candidate models on the rows themselves; no row is held out.
A candidate's score is Akaike's final prediction error, the mean squared error to be expected on
new rows,

    FPE = MSE (1 + k / N) / (1 - k / n) ,    k = k_consequent + 2 k_premise ,

with n the rows trained on and N those that the final model will be trained on. k_consequent is the
trace of the ridge regression's hat matrix, k_premise that of H (H + stiffness I)^-1 with H the
Gauss-Newton matrix of the reduced cost. A premise parameter counts twice: it was not only estimated
but sought among many local solutions, and weighed so, the score ranks models as held-out rows do
(benchmarks/structure.py). Candidates with k beyond a third of the rows are out of the question.

The search is greedy and small. Grids grow from the linear model, one term at a time, on the input
where it pays most: inputs that need no terms get none. Scattered rules grow along a short sequence
of numbers. The best of both is tried with stiffer and looser regularisation.

Rows that come in groups, runs of an instrument say, are more alike within a group than the
criterion can know. Where the groups are given, the score is instead the error of short trainings on
the groups that are left out, a fifth of them at a time.

Beyond a thousand rows, the candidates see representative rows only: the search then takes no
longer, whatever the number of rows.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod

import numpy as np
from sklearn.cluster import KMeans
from sklearn.model_selection import GroupKFold

from ..cluster import FuzzyCMeans, SubtractiveClustering
from ..membership import Membership
from ..objective import SeparableProblem
from ..partition import clustered_antecedent, grid_antecedent, representative_rows
from ..premise import Premise
from ..rows import Rows, Scale
from ..solvers import varpro
from .stopping import held_out_loss
from .structure import Structure

__all__ = ["SEARCHED", "Candidate", "StructureSearch"]

# The partitions whose size the data decide on: which candidates each of them has.
SEARCHED = ("auto", "grid", "subtractive", "fcm")

_MOST_ROWS = 1000
_MOST_COLUMNS = 256
_MOST_RULES = 36
_MOST_TERMS = 6
# After each round, so many inputs stay in the running for a further term.
_MOST_GROWING = 8
_RULE_NUMBERS = (2, 3, 5, 8, 12)
# Of subtractive clustering in one input and target, from few clusters to many.
_RADII = (0.6, 0.5, 0.42, 0.35, 0.3)
_IN_WORDS = {
    "k-means": "{} scattered rules",
    "fcm": "{} fuzzy clusters",
    "subtractive": "clusters of radius {}",
}
# Pairs of alpha and stiffness from loose to stiff. The first two are for data with little noise.
_LEVELS = ((1e-12, 0.0), (1e-8, 0.0), (1e-6, 1e-5), (1e-4, 1e-4), (1e-3, 1e-3), (1e-2, 1e-2))
_FIRST_LEVEL = 1
# Without any pull, a model of noisy data can be wild where rows are few, which a mean over training
# rows hardly shows: the levels before this one have to be better by _MUCH_BETTER.
_FIRST_FIRM_LEVEL = 2
_MOST_ITERATIONS = 12
_MOST_FOLDS = 5
_TOLERANCE = 1e-3
# A larger model must promise to be better by this part ...
_WORTHWHILE = 0.005
# ... and by this part over the root of the rows, about the error of the score itself.
_SCORE_ERROR = 0.5
# Models with more effective parameters than this part of the rows are out of the question.
_MOST_PARAMETERS = 1 / 3
# The linear model is the last resort; where it has too many, its ridge grows until it has fewer.
_MOST_OF_LINEAR = 0.8
# Of the levels within the first part of the best score the stiffest is taken; within the second,
# the next one is tried.
_AS_GOOD, _MUCH_BETTER = 0.01, 0.03


@dataclass(frozen=True)
class Candidate:
    """A structure to be tried: terms per input, or the clusters of a clustering."""

    counts: tuple[int, ...] | None
    size: float | None  # number of clusters, or the radius that they have
    level: int
    clustering: str = ""  # "k-means", "subtractive" or "fcm"

    def describe(self):
        """In words."""
        if self.counts is not None:
            return f"grid {list(self.counts)}"
        return _IN_WORDS[self.clustering].format(self.size)


class StructureSearch:
    """A search over structures for one set of rows.

    Parameters
    ----------
    rows : Rows
        The rows that the final model will be trained on.
    families : sequence of type of Membership
        One per input.
    order : {0, 1}
    premise_inputs, consequent_inputs : ndarray of int
        The inputs that may have terms, and those that the consequents are linear in.
    n_distinct : int
        Number of distinct rows, as far as it has been counted.
    seed : int or RandomState
        Of the clustering.
    alpha, stiffness : float, optional
        Where given, not searched for.
    overlap : float
        Membership at which neighbouring terms of a grid cross.
    """

    def __init__(
        self,
        rows: Rows,
        families: Sequence[type[Membership]],
        order: int,
        premise_inputs: np.ndarray,
        consequent_inputs: np.ndarray,
        n_distinct: int,
        seed,
        alpha: float | None,
        stiffness: float | None,
        overlap: float,
    ):
        self.rows, self.families, self.order, self.seed = rows, families, order, seed
        self.consequent_inputs = consequent_inputs
        self.alpha, self.stiffness, self.overlap = alpha, stiffness, overlap
        is_constant = rows.inputs.is_constant
        self.inputs = premise_inputs[~is_constant[premise_inputs]]
        self.n_basis = 1 + np.count_nonzero(~is_constant[consequent_inputs])
        self.sample = _sample(rows)
        self.n_sample = min(self.sample.n_rows, n_distinct)
        self.n_final = max(n_distinct, self.n_sample)
        self.scores: dict[Candidate, float] = {}
        self.folds = _folds(self.sample.groups)

    def run(self, partition):
        """The best structure found; ``partition`` is one of ``SEARCHED``."""
        best = Candidate((1,) * self.rows.X.shape[1], None, _FIRST_LEVEL)
        if partition in ("auto", "grid"):
            best = self._grow_grid(best)
        if partition != "grid" and self.inputs.size:
            clustering = "k-means" if partition == "auto" else partition
            best = self._better(best, self._grow_clusters(clustering))
        best = self._tune(best)
        return self._structure(best)

    def _grow_grid(self, best):
        inputs = list(self.inputs)
        while True:
            grown = {self._with_one_more(best, j): j for j in inputs}
            small = sorted(filter(self._is_small, grown), key=self._score)
            if not small or not self._is_better(small[0], best):
                return best
            best = small[0]
            inputs = [grown[candidate] for candidate in small[:_MOST_GROWING]]

    @staticmethod
    def _with_one_more(candidate, j):
        counts = list(candidate.counts)
        counts[j] += 1
        return replace(candidate, counts=tuple(counts))

    def _is_small(self, candidate):
        n_rules = prod(candidate.counts)
        n_columns = n_rules * self.n_basis
        return (
            max(candidate.counts) <= _MOST_TERMS
            and n_rules <= _MOST_RULES
            and n_columns <= min(_MOST_COLUMNS, self.n_sample / 2)
        )

    def _grow_clusters(self, clustering):
        sizes = _RADII if clustering == "subtractive" else _RULE_NUMBERS
        best, failures = Candidate(None, sizes[0], _FIRST_LEVEL, clustering), 0
        for size in sizes[1:]:
            candidate = replace(best, size=size)
            better = self._is_better(candidate, best)
            best = candidate if better else best
            failures = 0 if better else failures + 1
            if failures == 2:
                break
        return best

    def _tune(self, best):
        """The stiffest regularisation that is as good as any."""
        if self.alpha is not None and self.stiffness is not None:
            return best
        tried = [best]
        for direction in (1, -1):
            level = best.level + direction
            while 0 <= level < len(_LEVELS):
                candidate = replace(best, level=level)
                if self._score(candidate) > (1.0 + _MUCH_BETTER) * self._score(best):
                    break
                tried.append(candidate)
                level += direction
        best_score = min(map(self._score, tried))
        enough = [c for c in tried if self._score(c) <= (1.0 + _AS_GOOD) * best_score]
        stiffest = max(enough, key=lambda c: c.level)
        firm = [c for c in tried if c.level == _FIRST_FIRM_LEVEL]
        if firm and stiffest.level < _FIRST_FIRM_LEVEL:
            is_much_worse = self._score(firm[0]) > (1.0 + _MUCH_BETTER) * best_score
            return stiffest if is_much_worse else firm[0]
        return stiffest

    def _better(self, smaller, larger):
        return larger if self._is_better(larger, smaller) else smaller

    def _is_better(self, candidate, than):
        worthwhile = max(_WORTHWHILE, _SCORE_ERROR / np.sqrt(self.n_sample))
        return self._score(candidate) < (1.0 - worthwhile) * self._score(than)

    def _regularisation(self, candidate):
        alpha, stiffness = _LEVELS[candidate.level]
        return (
            alpha if self.alpha is None else self.alpha,
            stiffness if self.stiffness is None else self.stiffness,
        )

    def _antecedent(self, candidate, rows):
        if candidate.counts is None:
            clusterer = self._clusterer(candidate, rows.y.shape[1])
            return clustered_antecedent(
                self.families,
                rows,
                lambda t, w: clusterer.fit(t, sample_weight=w).labels_,
                self.inputs,
            )
        low, high = self.rows.inputs.box
        return grid_antecedent(self.families, candidate.counts, low, high, self.overlap)

    def _clusterer(self, candidate, n_outputs):
        if candidate.clustering == "subtractive":
            # Distances grow with the root of the columns' number.
            radius = candidate.size * np.sqrt(0.5 * (self.inputs.size + n_outputs))
            return SubtractiveClustering(radius=radius, max_clusters=_MOST_RULES)
        if candidate.clustering == "fcm":
            return FuzzyCMeans(candidate.size, m="auto", random_state=self.seed)
        return KMeans(candidate.size, n_init=3, random_state=self.seed)

    def _score(self, candidate):
        """Root of the final prediction error; infinite where there are too few rows."""
        if candidate not in self.scores:
            self.scores[candidate] = self._train_and_score(candidate)
        return self.scores[candidate]

    def _train_and_score(self, candidate):
        if self._is_too_many(candidate, self.n_sample):
            return np.inf
        if self.folds:
            return self._held_out_score(candidate)
        problem, premise, result, stiffness = self._train(candidate, self.sample)
        k = _effective_parameters(problem, premise, result, stiffness)
        most = _MOST_OF_LINEAR if problem.antecedent.n_rules == 1 else _MOST_PARAMETERS
        if k > most * self.n_sample:
            return np.inf
        error = result.evaluation.mean_squared_error
        return np.sqrt(error * (1.0 + k / self.n_final) / (1.0 - k / self.n_sample))

    @staticmethod
    def _is_too_many(candidate, n_rows):
        return candidate.clustering in ("k-means", "fcm") and candidate.size > n_rows

    def _held_out_score(self, candidate):
        """Root of the mean squared error on groups left out, in the range of the others.

        What is beyond it is for the policy out of bounds, not for the structure: a handful of such
        rows would otherwise decide.
        """
        total = weight = 0.0
        for training, held_out in self.folds:
            part, rest = self.sample.part(training), self.sample.part(held_out)
            low, high = part.X.min(axis=0), part.X.max(axis=0)
            rest = rest.part(((low <= rest.X) & (high >= rest.X)).all(axis=1))
            if self._is_too_many(candidate, part.n_rows):
                return np.inf
            if rest.n_rows == 0:
                continue
            scale = _unit_scale(part.X)
            _, _, result, _ = self._train(candidate, replace(part, inputs=scale))
            rest = replace(rest, inputs=scale)
            loss = held_out_loss(rest, self.consequent_inputs, result.evaluation)
            total += rest.total_weight * loss
            weight += rest.total_weight
        return np.sqrt(total / weight) if weight else np.inf

    def _train(self, candidate, rows):
        """A short training on some rows."""
        alpha, stiffness = self._regularisation(candidate)
        antecedent = self._antecedent(candidate, rows)
        problem = SeparableProblem(
            rows, antecedent, self.order, alpha, consequent_inputs=self.consequent_inputs
        )
        premise = Premise.of(antecedent, rows.inputs.minimum, rows.inputs.maximum)
        result = varpro(
            problem, premise, max_iter=_MOST_ITERATIONS, tol=_TOLERANCE, stiffness=stiffness
        )
        return problem, premise, result, stiffness

    def _structure(self, best):
        alpha, stiffness = self._regularisation(best)
        # What a radius finds depends on the number of rows: the very clusters that were scored.
        rows = self.sample if best.clustering == "subtractive" else self.rows
        return Structure(self._antecedent(best, rows), alpha, stiffness, self._report())

    def _report(self):
        """Every candidate in words and numbers, best first."""
        lines = []
        for candidate in sorted(self.scores, key=self._score):
            alpha, stiffness = self._regularisation(candidate)
            lines.append(
                {
                    "structure": candidate.describe(),
                    "alpha": alpha,
                    "stiffness": stiffness,
                    "expected_error": float(self.scores[candidate]),
                }
            )
        return lines


def _sample(rows):
    """Representative rows, already in the standardised units of all rows."""
    table, weight, indices = representative_rows(rows, _MOST_ROWS)
    n_inputs = rows.X.shape[1]
    X, y = table[:, :n_inputs], table[:, n_inputs:]
    groups = None if rows.groups is None else rows.groups[indices]
    return Rows(X, y, weight, _unit_scale(X), _unit_scale(y), groups)


def _folds(groups):
    """Training and held-out rows of every fold; none where there are no two groups."""
    if groups is None or np.unique(groups).size < 2:
        return []
    n_folds = min(_MOST_FOLDS, np.unique(groups).size)
    return list(GroupKFold(n_folds).split(np.empty((groups.size, 0)), groups=groups))


def _unit_scale(values):
    n_columns = values.shape[1]
    return Scale(np.zeros(n_columns), np.ones(n_columns), values.min(axis=0), values.max(axis=0))


def _effective_parameters(problem, premise, result, stiffness):
    k_consequent = result.evaluation.factor.effective_parameters()
    if premise.size == 0:
        return k_consequent
    raw = problem.linearise(result.evaluation)
    x = premise.displacement(result.evaluation.antecedent.parameters)
    _, hessian = premise.pull_back(x, raw.gradient, raw.gauss_newton)
    curvature = np.maximum(np.linalg.eigvalsh(hessian), 0.0)
    # Directions in which nothing changes are no parameters.
    floor = 1e-6 * curvature[-1] + np.finfo(float).tiny
    return k_consequent + 2.0 * np.sum(curvature / (curvature + max(stiffness, floor)))
