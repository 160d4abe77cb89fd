r"""Structure by itself: how many terms or rules, chosen by the error to be expected on new rows.

What is compared are short trainings of candidate models on the rows themselves; no row is held out.
The weights of every candidate's penalty are found by the evidence (``tuning``). The candidate wins
whose error is the smallest on rows that are left out one by one, which of the consequents is known
without further training (``Tuned.expected_error``); those are begun that promise most by it before
any premise moves, and those trained out that lead after a turn. docs/mathematics.rst has the other
criteria on the same data: the evidence itself, which ranks penalties well, but is too sparing with
rules, and the final prediction error. A candidate with a term that is hardly true on any row is out
of the running; one whose strongest rule does not hold alone must be as much better as rules that
hold are worth.

The search is greedy and small. Grids grow from the linear model, one term at a time, on the input
where it pays most, from where the terms of the others are already; inputs that need no terms get
none. Where there are many inputs, only those are tried on which the slope of the evidence is the
steepest: the squared correlations of what the linear model leaves with what terms would add.
Scattered rules come in a short sequence of numbers.

Rows that come in groups, runs of an instrument say, are more alike within a group than any
criterion on the same rows can know. Where the groups are given, the score is instead the error of
short trainings on the groups that are left out, a fifth of them at a time. Where they are not, a
candidate is out of the running that the rows do not tell between them (``between``).

Beyond two thousand rows, one thousand in groups, the candidates see representative rows only: the
search then takes no longer, whatever the number of rows.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import reduce
from math import prod

import numpy as np
from sklearn.model_selection import GroupKFold

from ..data import StandardisedData
from ..evidence import FREE, ROWS_EACH
from ..membership import Membership
from ..objective import SeparableProblem
from ..premise import Premise
from .between import is_told, places_between, unknown_between
from .candidate import MOST_RULES, Candidate, RuleBases
from .grid import Spacing
from .held_out import held_out_loss
from .readable_terms import has_idle_term
from .sample import effective_weight, search_sample, unit_scale
from .screening import residual_asks_for
from .start import Start
from .tuning import (
    FIRST_PENALTY,
    FIRST_STEPS,
    HOLDING,
    Tuned,
    held_for_nothing,
    scaled,
    settled,
    tune,
)

__all__ = ["SEARCHED", "StructureSearch"]

# The partitions whose size the data decide on: which candidates each of them has.
SEARCHED = ("auto", "grid", "subtractive", "fcm")

# Candidates are compared on at most so many representative rows. Twice as many as rules that are
# given need: to tell candidates apart takes more than to find the weights of one. Rows of one group
# are alike, and every candidate is trained once for each part that is left out.
_MOST_ROWS, _MOST_ROWS_IN_GROUPS = 2000, 1000
# Consequent parameters of a candidate, of which a pass costs the square; of many inputs, so many
# rules' worth, up to a limit of time.
_MOST_COLUMNS = 256
_RULES_OF_MANY = 3
_MOST_OF_MANY = 1000
# More names for one input nobody reads.
_MOST_TERMS = 6
# After each round, so many inputs stay in the running for a further term.
_MOST_GROWING = 8
# Of those that are tried in a round, so many are trained: the most promising at their start.
_MOST_TRAINED = 3
# Steps of the weights that tell what a candidate promises; training goes on from there.
_STEPS_TO_PROMISE = 2
# More inputs than this are screened before terms are tried on them.
_MOST_UNSCREENED = 16
# Turns of weights and premises of a candidate; after the first of them, those whose expected error
# is beyond the best one's by this factor are left as they are.
_TURNS, _FIRST_TURNS = 4, 1
_BEHIND = 1.05
# But where less than this is left of the target's variance, premises have a long way to go, and the
# first turn says little of the last.
_NEARLY_EXACT = 0.01
# Of k-means and fuzzy c-means: each about half as many again.
_RULE_NUMBERS = (2, 3, 5, 8, 12)
# Of subtractive clustering in one input and target, from few clusters to many.
_RADII = (0.6, 0.5, 0.42, 0.35, 0.3)
# As cross-validation has by custom: more cost time, and tell little more.
_MOST_FOLDS = 5
# What a larger model must gain in n log of the error: "very strong" in the words of Kass and
# Raftery (1995). The best of many candidates gains up to this on a plane with noise. Where the
# score is an error, a part of it and a part over the root of the rows.
_DECISIVE = 10.0
_WORTHWHILE_ERROR = 0.005
_ERROR_OF_ERROR = 0.5


class StructureSearch:
    """A search over structures for one set of rows.

    Parameters
    ----------
    rows : StandardisedData
        The rows that the final model will be trained on.
    families : sequence of type of Membership
        One per input.
    order : {0, 1}
    premise_inputs, consequent_inputs : ndarray of int
        The inputs that may have terms, and those that the consequents are linear in.
    seed : int or RandomState
        Of the clustering.
    fixed : dict
        The weights of the penalty that are given, by their names in ``evidence.FREE``.
    overlap : float
        Membership at which neighbouring terms of a grid cross.
    other_families : sequence of type of Membership
        For all inputs in place of ``families``, tried on the structure that is found.
    max_rules : int, optional
        Most rules of a candidate. Where it is not given, the number of consequent parameters is
        bounded too.
    split : callable
        From the groups of some rows to training and held-out positions of every fold; none where
        the groups say nothing.
    """

    def __init__(
        self,
        rows: StandardisedData,
        families: Sequence[type[Membership]],
        order: int,
        premise_inputs: np.ndarray,
        consequent_inputs: np.ndarray,
        seed,
        fixed: dict,
        overlap: float,
        other_families: Sequence[type[Membership]] = (),
        max_rules: int | None = None,
        split: Callable | None = None,
    ):
        self.rows, self.order = rows, order
        self.consequent_inputs = consequent_inputs
        self.overlap, self.other_families = overlap, other_families
        self.free = [key for key in FREE if key not in fixed]
        self.first = replace(FIRST_PENALTY, **fixed)
        is_constant = rows.inputs.is_constant
        self.inputs = premise_inputs[~is_constant[premise_inputs]]
        self.n_basis = 1 + np.count_nonzero(~is_constant[consequent_inputs])
        most = _MOST_ROWS if rows.groups is None else _MOST_ROWS_IN_GROUPS
        self.sample = search_sample(rows, most)
        self.spacing = Spacing(self.sample)
        self.rule_bases = RuleBases(families, self.inputs, self.spacing, overlap, seed)
        self.places = places_between(self.sample)
        self.n_sample = effective_weight(self.sample)
        self.n_all = effective_weight(rows)
        self.parent: Tuned | None = None  # of the grids that are tried
        self.found: dict[Candidate, Tuned] = {}
        self.untrained: dict[Candidate, Tuned] = {}  # of this round
        self.begun: dict[Candidate, Tuned] = {}
        self.scores: dict[Candidate, float] = {}
        self.unknown: dict[Candidate, float] = {}
        self.max_rules = max_rules
        self.folds = (split or _folds)(self.sample.groups)

    def run(self, partition):
        """A start from the best structure found; ``partition`` is one of ``SEARCHED``."""
        return self._start(self.choose(partition))

    def choose(self, partition):
        """The best candidate; all that were tried are keys of ``scores``, in the order of trial."""
        best = Candidate((1,) * self.rows.X.shape[1])
        if partition in ("auto", "grid"):
            best = self._grow_grid(best)
            loose = replace(best, is_loose=True)
            if max(best.counts) > 1 and self._is_beaten_loosely(best, loose):
                best = self._grow_grid(loose)
        self.parent = None
        if partition != "grid" and self.inputs.size:
            clustering = "k-means" if partition == "auto" else partition
            clusters = self._best_clusters(clustering, best)
            best = best if clusters is None else self._better(best, clusters)
        if best.counts is None or max(best.counts) > 1:
            for family in self.other_families:
                best = self._better(best, replace(best, family=family))
        return best

    def _is_beaten_loosely(self, best, loose):
        tuned = self._tuned(best)
        begun = self._train(loose, self.sample, _FIRST_TURNS)
        # The first turn goes far; those that follow leave no less.
        if not tuned.takes_for_noise(begun):
            return False
        self.begun[loose] = begun
        return tuned.is_beaten_loosely(self._tuned(loose)) and np.isfinite(self._score(loose))

    def _grow_grid(self, best):
        self._score(best)
        inputs = self._screened(best)
        while True:
            grown = {self._with_one_more(best, j): j for j in inputs}
            self.parent = self._tuned(best)
            small = self._promising(filter(self._is_small, grown))
            if not small:
                return best
            inputs = [grown[candidate] for candidate in small[:_MOST_GROWING]]
            grown_best = self._leading(small[: self._n_trained(small[0])], best)
            if not self._is_better(grown_best, best, of=self.inputs.size):
                return best
            best = grown_best
            found = self._tuned(best).penalty
            self.first = replace(self.first, slope=found.slope, slope_pulls=found.slope_pulls)

    def _screened(self, linear):
        """Inputs that are worth a try: all, or those whose terms the linear model asks for most."""
        if self.inputs.size <= _MOST_UNSCREENED:
            return list(self.inputs)
        centers = np.array([self.spacing.centers(j, 2) for j in self.inputs])
        asked = residual_asks_for(self._tuned(linear), self.inputs, centers, self.overlap)
        return [int(j) for j in self.inputs[np.argsort(-asked, kind="stable")[:_MOST_GROWING]]]

    def _promising(self, candidates):
        """Candidates by their expected error before the premises move, best first."""
        self.untrained = {
            candidate: self._train(candidate, self.sample, turns=0, first_steps=_STEPS_TO_PROMISE)
            for candidate in candidates
            if not self._is_too_many(candidate, self.sample.n_rows)
        }
        return sorted(self.untrained, key=lambda c: self._promise(self.untrained[c]))

    def _promise(self, tuned):
        """What goes first: rules that the rows tell, and among these the least expected error."""
        are_told = bool(self.folds) or is_told(unknown_between(tuned, self.places))
        return not are_told, self._expected(tuned)

    @staticmethod
    def _with_one_more(candidate, j):
        counts = list(candidate.counts)
        counts[j] += 1
        return replace(candidate, counts=tuple(counts))

    def _n_trained(self, candidate):
        """How many of the promising candidates are trained."""
        return 1 if prod(candidate.counts) * self.n_basis > _MOST_COLUMNS else _MOST_TRAINED

    @property
    def _most_columns(self):
        of_many = min(_RULES_OF_MANY * self.n_basis, _MOST_OF_MANY)
        asked_for = (self.max_rules or 0) * self.n_basis
        return min(max(_MOST_COLUMNS, of_many, asked_for), 2.0 * self.n_sample)

    def _is_small(self, candidate):
        n_rules = prod(candidate.counts)
        n_columns = n_rules * self.n_basis
        return (
            max(candidate.counts) <= _MOST_TERMS
            and all(c == 1 or c <= self.spacing.n_values(j) for j, c in enumerate(candidate.counts))
            and n_rules <= (self.max_rules or MOST_RULES)
            and n_columns <= self._most_columns
        )

    def _best_clusters(self, clustering, grid):
        sizes = list(_RADII)
        if clustering != "subtractive":
            most = min(_MOST_COLUMNS, 2.0 * self.n_sample) / self.n_basis
            sizes = [size for size in _RULE_NUMBERS if size <= most]
        promising = self._promising([Candidate(None, size, clustering) for size in sizes])
        # Beside grids, further ones hardly ever win, and take a fifth of the search.
        n_trained = 1 if clustering == "k-means" else _MOST_TRAINED
        if not promising:
            return None
        self._leading(promising[:n_trained], grid)
        # Radii fall where numbers rise: from few clusters to many.
        by_size = sorted(promising[:n_trained], key=lambda c: sizes.index(c.size))
        return reduce(self._better, by_size)

    def _better(self, smaller, larger):
        return larger if self._is_better(larger, smaller) else smaller

    def _is_better(self, candidate, than, of=1):
        """Whether a larger candidate, the best of so many, gains more than luck gives."""
        if not self.folds:
            return self._gain(candidate, than, of) > _DECISIVE
        worthwhile = max(_WORTHWHILE_ERROR, _ERROR_OF_ERROR / np.sqrt(self.n_sample))
        return self._score(candidate) < (1.0 - worthwhile) * self._score(than)

    def _gain(self, candidate, than, of):
        """By how much n log of the expected error falls.

        Where there are hardly more rows than consequents, what one row's leaving out says is said
        by few others: then that and the evidence, two readings of the same, count for half each,
        and the best of so many has to make good for having been chosen.
        """
        if not self._score(candidate) < self._score(than):  # both are exact, or neither can be had
            return 0.0
        gain = self._score(than) - self._score(candidate)
        if not np.isfinite(gain):
            return gain
        tuned, before = self._tuned(candidate), self._tuned(than)
        if self.sample.n_rows >= ROWS_EACH * tuned.problem.n_columns:
            return gain
        return 0.5 * (gain + before.score - tuned.score) - 2.0 * np.log(of)

    def _leading(self, candidates, before):
        """The best of some candidates, of which only those are trained out that may still lead.

        ``before`` is what they are to be better than.
        """
        if not self.folds:
            for candidate in candidates:
                if candidate not in self.found:
                    tuned = self._train(candidate, self.sample, _FIRST_TURNS)
                    # Without terms that move there is nothing to train out.
                    (self.begun if tuned.is_trained else self.found)[candidate] = tuned
            errors = [self._expected({**self.begun, **self.found}[c]) for c in candidates]
            least = min(*errors, self._expected(self._tuned(before)))
            for candidate, error in zip(candidates, errors, strict=True):
                is_behind = error > _BEHIND * least > _NEARLY_EXACT
                if is_behind and candidate in self.begun:
                    self.found[candidate] = self.begun.pop(candidate)
        return min(candidates, key=self._score)

    def _score(self, candidate):
        """N log of the expected error, or the error on groups left out."""
        if candidate not in self.scores:
            self.scores[candidate] = self._train_and_score(candidate)
        return self.scores[candidate]

    def _train_and_score(self, candidate):
        if self._is_too_many(candidate, self.sample.n_rows):
            return np.inf
        if self.folds:
            return self._held_out_score(candidate)
        tuned = self._tuned(candidate)
        self.unknown[candidate] = unknown_between(tuned, self.places)
        if not is_told(self.unknown[candidate]):
            return np.inf
        if has_idle_term(self.sample, tuned.evaluation.antecedent):
            return np.inf
        # What it would have cost is the least that rules which hold are worth.
        error = (HOLDING if tuned.is_apart else 1.0) * self._expected(tuned)
        # As the evidence, in units of twice the logarithm of a probability.
        with np.errstate(divide="ignore"):
            return self.n_sample * tuned.posterior.n_outputs * np.log(error)

    def _expected(self, tuned):
        """Mean squared error expected on new rows, of a training on all rows and not the sample.

        What the parameters cost, k / n of the noise's variance, falls as the rows rise.
        """
        n_effective = tuned.posterior.n_effective
        on_sample, on_all = n_effective / self.n_sample, n_effective / self.n_all
        return tuned.expected_error * (1.0 + on_all) / (1.0 + on_sample)

    def error(self, candidate):
        """RMS on the rows left out, or what is expected on new ones; of the standardised target."""
        return (
            self._score(candidate)
            if self.folds
            else np.sqrt(self._expected(self._tuned(candidate)))
        )

    def _tuned(self, candidate):
        if candidate not in self.found:
            begun = self.begun.pop(candidate, None)
            self.found[candidate] = self._train(candidate, self.sample, begun=begun)
        return self.found[candidate]

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
            scale = unit_scale(part.X)
            tuned = self._train(candidate, replace(part, inputs=scale))
            rest = replace(rest, inputs=scale)
            loss = held_out_loss(rest, self.consequent_inputs, tuned.evaluation)
            total += rest.total_weight * loss
            weight += rest.total_weight
        return np.sqrt(total / weight) if weight else np.inf

    def _train(self, candidate, rows, turns=_TURNS, first_steps=FIRST_STEPS, begun=None):
        """A short training on some rows, from the weights that were best so far."""
        is_last = turns == _TURNS
        if begun is None and rows is self.sample:
            begun = self.untrained.get(candidate)
        if begun is None:
            problem = SeparableProblem(
                rows,
                self.rule_bases.of(candidate, rows),
                self.order,
                self.first,
                consequent_inputs=self.consequent_inputs,
            )
        elif begun.is_trained:
            problem, turns = begun.problem, turns - _FIRST_TURNS
        else:
            problem, first_steps = begun.problem, first_steps - _STEPS_TO_PROMISE
        antecedent = problem.antecedent
        premise = Premise.of(antecedent, rows.inputs.minimum, rows.inputs.maximum)
        return tune(
            problem,
            premise,
            self.free,
            effective_weight(rows),
            turns,
            first_steps,
            self._inherited(antecedent, premise) if begun is None else None,
            is_loose=candidate.is_loose,
            begun=begun,
            is_last=is_last,
        )

    def _inherited(self, antecedent, premise):
        """Displacements at which a grid has its parent's terms, where it has as many of them."""
        if self.parent is None or antecedent.grid_counts is None:
            return None
        before = self.parent.evaluation.antecedent
        theta = [group.theta.copy() for group in antecedent.groups]
        for group, own in zip(antecedent.groups, theta, strict=True):
            for j in np.unique(group.inputs):
                mine = group.inputs == j
                for other in before.groups:
                    its = other.inputs == j
                    if other.family is group.family and its.sum() == mine.sum():
                        own[:, mine] = other.theta[:, its]
        raw = np.concatenate([own.ravel() for own in theta] or [np.empty(0)])
        return np.clip(premise.displacement(raw), premise.lower, premise.upper)

    def _start(self, best):
        tuned = self._tuned(best)
        premise = Premise.of(tuned.problem.antecedent, *self.sample.inputs.box)
        tuned = held_for_nothing(tuned, premise, self.free, self.n_sample, self.n_all)
        penalty = scaled(tuned.penalty, self.free, self.n_sample / self.n_all, tuned.is_held)
        return Start(
            tuned.problem.antecedent,
            penalty,
            settled(tuned.displacement),
            is_apart=tuned.is_apart,
            is_held=tuned.is_held,
            candidates=self._report(),
        )

    def _report(self):
        """Every candidate in words and numbers, best first."""
        lines = []
        for candidate in sorted(self.scores, key=self._score):
            counts = None if candidate.counts is None else list(candidate.counts)
            line: dict = {"structure": candidate.describe(), "n_mfs": counts}
            if candidate in self.found:
                found = self.found[candidate]
                line["expected_error"] = float(np.sqrt(self._expected(found)))
                line["log_evidence"] = float(-0.5 * found.score)
                for key in ("agreement", "alpha", "stiffness"):
                    line[key] = float(getattr(found.penalty, key))
            if candidate in self.unknown:
                line["unknown_between"] = self.unknown[candidate]
            if self.folds:
                line["held_out_error"] = float(self.scores[candidate])
            lines.append(line)
        return lines


def _folds(groups):
    """Training and held-out rows of every fold; none where there are no two groups."""
    if groups is None or np.unique(groups).size < 2:
        return []
    n_folds = min(_MOST_FOLDS, np.unique(groups).size)
    return list(GroupKFold(n_folds).split(np.empty((groups.size, 0)), groups=groups))
