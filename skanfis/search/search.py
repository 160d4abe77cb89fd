"""Structure by itself: how many terms or rules, chosen by the error to be expected on new rows.

The search is greedy and small; ``trials`` knows what each candidate is worth. Grids grow from the
linear model, one term at a time, on the input where it pays most, from where the terms of the
others are already; inputs that need no terms get none. Where there are many inputs, only those are
tried on which the slope of the evidence is the steepest: the squared correlations of what the
linear model leaves with what terms would add. Scattered rules come in a short sequence of numbers.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import reduce
from math import prod

import numpy as np

from ..learning.data import StandardisedData
from ..learning.evidence import ROWS_EACH
from ..membership import Membership
from .candidate import MOST_RULES, Candidate
from .screening import residual_asks_for
from .start import Start
from .trials import Trials
from .tuning import scaled, settled

__all__ = ["SEARCHED", "StructureSearch"]

# The partitions whose size the data decide on: which candidates each of them has.
SEARCHED = ("auto", "grid", "subtractive", "fcm")

# Consequent parameters of a candidate, of which a pass costs the square; of many inputs, so many
# rules' worth, up to a limit of time.
_MOST_COLUMNS = 256
_RULES_OF_MANY = 3
_MOST_OF_MANY = 1000
# More names for one input nobody reads.
_MOST_TERMS = 6
# Of those that are tried in a round, so many are trained; more where hardly any noise is left:
# there, where premises stand decides, and what is promised before they move says little.
_MOST_TRAINED, _MOST_TRAINED_NEARLY_EXACT = 3, 6
# More inputs than this are screened before terms are tried on them, and so many are left.
_MOST_UNSCREENED, _SCREENED = 16, 8
# Of k-means and fuzzy c-means: each about half as many again.
_RULE_NUMBERS = (2, 3, 5, 8, 12)
# Of subtractive clustering in one input and target, from few clusters to many.
_RADII = (0.6, 0.5, 0.42, 0.35, 0.3)
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
    rows, families, order, consequent_inputs, seed, fixed, overlap, split
        As ``trials.Trials`` takes them.
    premise_inputs : ndarray of int
        The inputs that may have terms, where they vary.
    other_families : sequence of type of Membership
        For all inputs in place of ``families``, tried on the structure that is found.
    max_rules : int, optional
        Most rules of a candidate. Where it is not given, the number of consequent parameters is
        bounded too.

    Attributes
    ----------
    trials : Trials
        What is known of the candidates.
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
        is_constant = rows.inputs.is_constant
        self.inputs = premise_inputs[~is_constant[premise_inputs]]
        self.n_inputs = rows.X.shape[1]
        self.n_basis = 1 + np.count_nonzero(~is_constant[consequent_inputs])
        self.overlap, self.other_families = overlap, other_families
        self.max_rules = max_rules
        self.trials = Trials(
            rows, families, order, self.inputs, consequent_inputs, seed, fixed, overlap, split
        )

    def run(self, partition):
        """A start from the best structure found; ``partition`` is one of ``SEARCHED``."""
        return self._start(self.choose(partition))

    def choose(self, partition):
        """The best candidate; all that were tried are in ``trials.scores``."""
        best = Candidate((1,) * self.n_inputs)
        self.trials.beat(best)
        if partition in ("auto", "grid"):
            best = self._grow_grid(best)
        if partition != "grid" and self.inputs.size:
            clustering = "k-means" if partition == "auto" else partition
            clusters = self._best_clusters(clustering, best)
            best = best if clusters is None else self._better(best, clusters)
        if best.counts is None or max(best.counts) > 1:
            for family in self.other_families:
                self.trials.beat(best)
                best = self._better(best, replace(best, family=family))
        return best

    def _grow_grid(self, best):
        trials, inputs = self.trials, self._screened(best)
        trials.score(best)
        while True:
            # One that promises little now may promise more beside others' terms: none is dropped.
            grown = [self._with_one_more(best, j) for j in inputs]
            trials.beat(best)
            small = trials.promising(filter(self._is_small, grown))
            if not small:
                return best
            grown_best = trials.leading(small[: self._n_trained(small[0], best)], best)
            if not self._is_better(grown_best, best, of=self.inputs.size):
                return best
            best = grown_best
            found = trials.tuned(best).penalty
            trials.first = replace(trials.first, slope=found.slope, slope_pulls=found.slope_pulls)

    def _screened(self, linear):
        """Inputs that are worth a try: all, or those whose terms the linear model asks for most."""
        if self.inputs.size <= _MOST_UNSCREENED:
            return list(self.inputs)
        centers = np.array([self.trials.spacing.centers(j, 2) for j in self.inputs])
        asked = residual_asks_for(self.trials.tuned(linear), self.inputs, centers, self.overlap)
        return [int(j) for j in self.inputs[np.argsort(-asked, kind="stable")[:_SCREENED]]]

    @staticmethod
    def _with_one_more(candidate, j):
        counts = list(candidate.counts)
        counts[j] += 1
        return replace(candidate, counts=tuple(counts))

    def _n_trained(self, candidate, best):
        """How many of the promising candidates are trained."""
        if prod(candidate.counts) * self.n_basis > _MOST_COLUMNS:
            return 1
        if self.trials.folds or self.trials.leaves_noise(best):
            return _MOST_TRAINED
        return _MOST_TRAINED_NEARLY_EXACT

    @property
    def _most_columns(self):
        of_many = min(_RULES_OF_MANY * self.n_basis, _MOST_OF_MANY)
        asked_for = (self.max_rules or 0) * self.n_basis
        return min(max(_MOST_COLUMNS, of_many, asked_for), 2.0 * self.trials.n_sample)

    def _is_small(self, candidate):
        n_rules = prod(candidate.counts)
        n_columns = n_rules * self.n_basis
        return (
            max(candidate.counts) <= _MOST_TERMS
            and all(
                c == 1 or c <= self.trials.spacing.n_values(j)
                for j, c in enumerate(candidate.counts)
            )
            and n_rules <= (self.max_rules or MOST_RULES)
            and n_columns <= self._most_columns
        )

    def _best_clusters(self, clustering, grid):
        sizes = list(_RADII)
        if clustering != "subtractive":
            most = min(_MOST_COLUMNS, 2.0 * self.trials.n_sample) / self.n_basis
            sizes = [size for size in _RULE_NUMBERS if size <= most]
        promising = self.trials.promising([Candidate(None, size, clustering) for size in sizes])
        # Beside grids, further ones hardly ever win, and take a fifth of the search.
        n_trained = 1 if clustering == "k-means" else _MOST_TRAINED
        if not promising:
            return None
        self.trials.leading(promising[:n_trained], grid)
        # Radii fall where numbers rise: from few clusters to many.
        by_size = sorted(promising[:n_trained], key=lambda c: sizes.index(c.size))
        return reduce(self._better, by_size)

    def _better(self, smaller, larger):
        return larger if self._is_better(larger, smaller) else smaller

    def _is_better(self, candidate, than, of=1):
        """Whether a larger candidate, the best of so many, gains more than luck gives."""
        if not self.trials.folds:
            return self._gain(candidate, than, of) > _DECISIVE
        worthwhile = max(_WORTHWHILE_ERROR, _ERROR_OF_ERROR / np.sqrt(self.trials.n_sample))
        return self.trials.score(candidate) < (1.0 - worthwhile) * self.trials.score(than)

    def _gain(self, candidate, than, of):
        """By how much n log of the expected error falls.

        Where there are hardly more rows than consequents, what one row's leaving out says is said
        by few others: then that and the evidence, two readings of the same, count for half each,
        and the best of so many has to make good for having been chosen.
        """
        trials = self.trials
        if not trials.score(candidate) < trials.score(than):
            return 0.0  # both are exact, or neither can be had
        gain = trials.score(than) - trials.score(candidate)
        tuned, before = trials.tuned(candidate), trials.tuned(than)
        is_plenty = trials.sample.n_rows >= ROWS_EACH * tuned.problem.n_columns
        if is_plenty or not np.isfinite(gain):
            return gain
        return 0.5 * (gain + before.score - tuned.score) - 2.0 * np.log(of)

    def _start(self, best):
        trials, tuned = self.trials, self.trials.tuned(best)
        n_sample, n_all, free = trials.n_sample, trials.n_all, trials.free
        return Start(
            tuned.problem.antecedent,
            scaled(tuned.penalty, free, n_sample / n_all, tuned.is_held),
            settled(tuned.displacement),
            is_apart=tuned.is_apart,
            is_held=tuned.is_held,
            candidates=trials.report(),
        )
