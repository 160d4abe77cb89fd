"""Structure by itself: how many terms or rules, chosen by the error to be expected on new rows.

The search is greedy and small; ``trials`` knows what each candidate is worth. Grids grow from the
linear model, one term at a time, on the input where it pays most; inputs that need no terms get
none. Where there are many inputs, only those are tried on which the slope of the evidence is the
steepest: the squared correlations of what the linear model leaves with what terms would add.
Scattered rules come in a short sequence of numbers.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from math import prod

import numpy as np

from ..learning.data import StandardisedData
from ..learning.evidence import ROWS_EACH
from ..learning.premise import Premise
from ..membership import Membership
from .candidates import MOST_RULES, Candidate, term_scores
from .start import Start
from .trials import Trials
from .tuning import scaled, settled, with_rules_that_hold

# The partitions whose size the data decide on.
SEARCHED = ("auto", "grid", "subtractive", "fcm")

# Consequent parameters of a candidate, of which a pass costs the square; of many inputs, so many
# rules' worth, up to a limit of time.
_MOST_COLUMNS = 256
_RULES_OF_MANY, _MOST_OF_MANY = 3, 1000
# More names for one input nobody reads.
_MOST_TERMS = 6
# Of those that are tried in a round, so many are trained.
_MOST_TRAINED = 4
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
_WORTHWHILE_ERROR, _ERROR_OF_ERROR = 0.005, 0.5


class StructureSearch:
    """A search over structures for one set of rows.

    Parameters
    ----------
    rows, families, order, consequent_inputs, seed, fixed
        As ``trials.Trials`` takes them.
    premise_inputs : ndarray of int
        The inputs that may have terms, where they vary.
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
    ):
        is_constant = rows.inputs.is_constant
        self.inputs = premise_inputs[~is_constant[premise_inputs]]
        self.n_inputs = rows.X.shape[1]
        self.n_basis = 1 + np.count_nonzero(~is_constant[consequent_inputs])
        self.trials = Trials(rows, families, order, self.inputs, consequent_inputs, seed, fixed)

    def run(self, partition) -> Start:
        """A start from the best structure found; ``partition`` is one of ``SEARCHED``."""
        trials, best = self.trials, self.choose(partition)
        tuned, n_sample = trials.tuned(best), trials.n_sample
        premise = Premise.of(tuned.problem.antecedent, *trials.sample.inputs.box)
        tuned = with_rules_that_hold(tuned, premise, trials.free, n_sample, trials.n_all)
        return Start(
            tuned.problem.antecedent,
            scaled(tuned.penalty, trials.free, n_sample / trials.n_all, tuned.agreement_is_raised),
            settled(tuned.displacement),
            agreement_is_raised=tuned.agreement_is_raised,
            candidates=trials.report(),
        )

    def choose(self, partition) -> Candidate:
        """The best candidate; all that were tried are in ``trials.scores``."""
        best = Candidate((1,) * self.n_inputs)
        self.trials.compare_with(best)
        self._screen(best)
        if partition in ("auto", "grid"):
            best = self._grow_grid(best)
        if partition != "grid" and self.inputs.size:
            clustering = "k-means" if partition == "auto" else partition
            clusters = self._best_clusters(clustering)
            best = best if clusters is None else self._better(best, clusters)
        return best

    def _grow_grid(self, best):
        trials = self.trials
        trials.score(best)
        while True:
            trials.compare_with(best)
            # One that promises little now may promise more beside others' terms: none is dropped.
            grown = filter(self._is_small, [_with_one_more(best, j) for j in self.inputs])
            promising = trials.promising(grown)
            if not promising:
                return best
            leading = min(promising[: self._n_trained(promising[0])], key=trials.score)
            if not self._is_better(leading, best):
                return best
            best = leading

    def _screen(self, linear):
        """Leave of many inputs those whose terms the linear model asks for most."""
        if self.inputs.size <= _MOST_UNSCREENED:
            return
        trials = self.trials
        centers = np.array([trials.spacing.centers(j, 2) for j in self.inputs])
        scores = term_scores(trials.tuned(linear), self.inputs, centers)
        self.inputs = self.inputs[np.argsort(-scores, kind="stable")[:_SCREENED]]
        trials.rule_bases = replace(trials.rule_bases, inputs=self.inputs)

    def _n_trained(self, candidate):
        """How many of the promising candidates are trained."""
        return 1 if prod(candidate.counts) * self.n_basis > _MOST_COLUMNS else _MOST_TRAINED

    def _is_small(self, candidate):
        n_rules = prod(candidate.counts)
        of_many = min(_RULES_OF_MANY * self.n_basis, _MOST_OF_MANY)
        most = max(_MOST_COLUMNS, of_many)
        return (
            max(candidate.counts) <= _MOST_TERMS
            and all(
                c == 1 or c <= self.trials.spacing.n_values(j)
                for j, c in enumerate(candidate.counts)
            )
            and n_rules <= MOST_RULES
            and n_rules * self.n_basis <= min(most, 2.0 * self.trials.n_sample)
        )

    def _best_clusters(self, clustering):
        sizes = list(_RADII)
        if clustering != "subtractive":
            # Every rule has terms of its own, a place and a width each: fewer parameters than rows.
            of_rule = self.n_basis + 2 * self.inputs.size
            most = min(_MOST_COLUMNS / self.n_basis, self.trials.n_sample / of_rule)
            sizes = [size for size in _RULE_NUMBERS if size <= most]
        promising = self.trials.promising([Candidate(None, size, clustering) for size in sizes])
        if not promising:
            return None
        # Beside grids, further ones hardly ever win, and take a fifth of the search.
        trained = promising[: 1 if clustering == "k-means" else _MOST_TRAINED]
        # Radii fall where numbers rise: from few clusters to many.
        return reduce(self._better, sorted(trained, key=lambda c: sizes.index(c.size)))

    def _better(self, smaller, larger):
        return larger if self._is_better(larger, smaller) else smaller

    def _is_better(self, candidate, than):
        """Whether a larger candidate gains more than luck gives.

        Where there are hardly more rows than consequents, what one row's leaving out says is said
        by few others: then the evidence has to say so too.
        """
        trials = self.trials
        score, to_beat = trials.score(candidate), trials.score(than)
        if not trials.folds:
            tuned, before = trials.tuned(candidate), trials.tuned(than)
            is_plenty = trials.sample.n_rows >= ROWS_EACH * tuned.problem.n_columns
            is_likelier = is_plenty or before.score - tuned.score > _DECISIVE
            return score < to_beat and to_beat - score > _DECISIVE and is_likelier
        worthwhile = max(_WORTHWHILE_ERROR, _ERROR_OF_ERROR / np.sqrt(trials.n_sample))
        return score < (1.0 - worthwhile) * to_beat


def _with_one_more(candidate, j):
    counts = list(candidate.counts)
    counts[j] += 1
    return replace(candidate, counts=tuple(counts))
