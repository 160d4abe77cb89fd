r"""Short trainings of candidate structures on a sample of the rows, and what each is worth.

No row is held out where the rows are all that is known: the weights of every candidate's penalty
are found by the evidence (``tuning``), and its error on rows that are left out one by one follows
from the training on all of them (``Tuned.expected_error``). A candidate with a term that is hardly
true on any row is out of the running, as is one that the rows do not tell between them
(``between``); one whose strongest rule does not hold alone must be as much better as rules that
hold are worth. docs/mathematics.rst has the other criteria on the same data: the evidence itself,
which ranks penalties well, but is too sparing with rules, and the final prediction error.

Those that are tried together are begun where they promise most, before any premise moves, and
trained out where they lead after a turn.

Rows that come in groups, runs of an instrument say, are more alike within a group than any
criterion on the same rows can know. Where the groups are given, the score is instead the error of
short trainings on the groups that are left out, a fifth of them at a time.

Beyond two thousand rows, one thousand in groups, the candidates see representative rows only: all
then takes no longer, whatever the number of rows.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from sklearn.model_selection import GroupKFold

from ..learning.data import StandardisedData
from ..learning.evidence import FREE
from ..learning.objective import SeparableProblem
from ..learning.premise import Premise
from ..membership import Membership
from .between import expected_between, is_told, places_between, unknown_between
from .candidate import Candidate, RuleBases
from .grid import Spacing
from .held_out import held_out_loss
from .readable_terms import has_idle_term
from .sample import effective_weight, search_sample, unit_scale
from .tuning import FIRST_PENALTY, FIRST_STEPS, HOLDING, Tuned, tune

__all__ = ["Trials"]

# Candidates are compared on at most so many representative rows. Twice as many as rules that are
# given need: to tell candidates apart takes more than to find the weights of one. Rows of one group
# are alike, and every candidate is trained once for each part that is left out.
_MOST_ROWS, _MOST_ROWS_IN_GROUPS = 2000, 1000
# Steps of the weights that tell what a candidate promises; training goes on from there.
_STEPS_TO_PROMISE = 2
# Turns of weights and premises of a candidate; after the first of them, those whose expected error
# is beyond the best one's by this factor are left as they are.
_TURNS, _FIRST_TURNS = 4, 1
_BEHIND = 1.15
# But where less than this is left of the target's variance, premises have a long way to go, and the
# first turn says little of the last.
_NEARLY_EXACT = 0.01
# As cross-validation has by custom: more cost time, and tell little more.
_MOST_FOLDS = 5


class Trials:
    """What is known of candidates for one set of rows: trained when they are first asked about.

    Parameters
    ----------
    rows : StandardisedData
        The rows that the final model will be trained on.
    families : sequence of type of Membership
        One per input.
    order : {0, 1}
    inputs, consequent_inputs : ndarray of int
        The inputs that may have terms, and those that the consequents are linear in.
    seed : int or RandomState
        Of the clustering.
    fixed : dict
        The weights of the penalty that are given, by their names in ``evidence.FREE``.
    overlap : float
        Membership at which neighbouring terms of a grid cross.
    split : callable, optional
        From the groups of some rows to training and held-out positions of every fold; none where
        the groups say nothing.

    Attributes
    ----------
    scores : dict of Candidate to float
        Of all that were tried, in the order of trial.
    sample : StandardisedData
        The rows that candidates see.
    first : Penalty
        The weights that candidates begin with, which may be set to the best so far.
    """

    def __init__(
        self,
        rows: StandardisedData,
        families: Sequence[type[Membership]],
        order: int,
        inputs: np.ndarray,
        consequent_inputs: np.ndarray,
        seed,
        fixed: dict,
        overlap: float,
        split: Callable | None = None,
    ):
        self.order, self.consequent_inputs = order, consequent_inputs
        self.free = [key for key in FREE if key not in fixed]
        self.first = replace(FIRST_PENALTY, **fixed)
        most = _MOST_ROWS if rows.groups is None else _MOST_ROWS_IN_GROUPS
        self.sample = search_sample(rows, most)
        self.spacing = Spacing(self.sample)
        self.rule_bases = RuleBases(families, inputs, self.spacing, overlap, seed)
        self.places = places_between(self.sample)
        self.n_sample = effective_weight(self.sample)
        self.n_all = effective_weight(rows)
        self._incumbent: Tuned | None = None
        self._to_beat: np.ndarray | float = 0.0
        self.scores: dict[Candidate, float] = {}
        self.folds = (split or _folds)(self.sample.groups)
        self._found: dict[Candidate, Tuned] = {}
        self._untrained: dict[Candidate, Tuned] = {}  # of this round
        self._begun: dict[Candidate, Tuned] = {}
        self._unknown: dict[Candidate, float] = {}

    def beat(self, best: Candidate):
        """Have candidates compared with the best so far, and grids begin with its terms."""
        incumbent = self.tuned(best)
        if incumbent is not self._incumbent:
            self._incumbent = incumbent
            self._to_beat = expected_between(incumbent, self.places)

    def promising(self, candidates):
        """Candidates by their expected error before the premises move, best first."""
        self._untrained = {
            candidate: self.train(candidate, self.sample, turns=0, first_steps=_STEPS_TO_PROMISE)
            for candidate in candidates
            if not self._is_too_many(candidate, self.sample.n_rows)
        }
        return sorted(self._untrained, key=lambda c: self._promise(self._untrained[c]))

    def _promise(self, tuned):
        """What goes first: rules that the rows tell, and among these the least expected error."""
        are_told = bool(self.folds) or is_told(unknown_between(tuned, self.places, self._to_beat))
        return not are_told, self.expected(tuned)

    def leading(self, candidates, before):
        """The best of some candidates, of which only those are trained out that may still lead.

        ``before`` is what they are to be better than.
        """
        if not self.folds:
            for candidate in candidates:
                if candidate not in self._found:
                    tuned = self.train(candidate, self.sample, _FIRST_TURNS)
                    # Without terms that move there is nothing to train out.
                    (self._begun if tuned.is_trained else self._found)[candidate] = tuned
            errors = [self.expected({**self._begun, **self._found}[c]) for c in candidates]
            least = min(*errors, self.expected(self.tuned(before)))
            for candidate, error in zip(candidates, errors, strict=True):
                is_behind = error > _BEHIND * least > _NEARLY_EXACT
                if is_behind and candidate in self._begun:
                    self._found[candidate] = self._begun.pop(candidate)
        return min(candidates, key=self.score)

    def leaves_noise(self, best: Candidate):
        """Whether the best so far leaves more than data next to exact do."""
        return self.expected(self.tuned(best)) > _NEARLY_EXACT

    def score(self, candidate):
        """N log of the expected error, or the error on groups left out."""
        if candidate not in self.scores:
            self.scores[candidate] = self._train_and_score(candidate)
        return self.scores[candidate]

    def _train_and_score(self, candidate):
        if self._is_too_many(candidate, self.sample.n_rows):
            return np.inf
        if self.folds:
            return self._held_out_score(candidate)
        tuned = self.tuned(candidate)
        self._unknown[candidate] = unknown_between(tuned, self.places, self._to_beat)
        if not is_told(self._unknown[candidate]):
            return np.inf
        if has_idle_term(self.sample, tuned.evaluation.antecedent):
            return np.inf
        # What it would have cost is the least that rules which hold are worth.
        error = (HOLDING if tuned.is_apart else 1.0) * self.expected(tuned)
        # As the evidence, in units of twice the logarithm of a probability.
        with np.errstate(divide="ignore"):
            return self.n_sample * tuned.posterior.n_outputs * np.log(error)

    def expected(self, tuned):
        """Squared error expected on new rows, of a training on all rows and not the sample.

        The mean over rows, summed over outputs.

        What the parameters cost, k / n of the noise's variance, falls as the rows rise.
        """
        n_effective = tuned.posterior.n_effective
        on_sample, on_all = n_effective / self.n_sample, n_effective / self.n_all
        return tuned.expected_error * (1.0 + on_all) / (1.0 + on_sample)

    def error(self, candidate):
        """RMS on the rows left out, or what is expected on new ones; of the standardised target."""
        if self.folds:
            return self.score(candidate)
        return np.sqrt(self.expected(self.tuned(candidate)))

    def tuned(self, candidate):
        """The end of a candidate's training."""
        if candidate not in self._found:
            begun = self._begun.pop(candidate, None)
            self._found[candidate] = self.train(candidate, self.sample, begun=begun)
        return self._found[candidate]

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
            tuned = self.train(candidate, replace(part, inputs=scale))
            rest = replace(rest, inputs=scale)
            loss = held_out_loss(rest, self.consequent_inputs, tuned.evaluation)
            total += rest.total_weight * loss
            weight += rest.total_weight
        return np.sqrt(total / weight) if weight else np.inf

    def train(self, candidate, rows, turns=_TURNS, first_steps=FIRST_STEPS, begun=None):
        """A short training on some rows, from the weights that were best so far."""
        is_last = turns == _TURNS
        if begun is None and rows is self.sample:
            begun = self._untrained.get(candidate)
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
            begun=begun,
            is_last=is_last,
        )

    def _inherited(self, antecedent, premise):
        """Displacements at which a grid has the incumbent's terms, where it has as many of them."""
        if self._incumbent is None or antecedent.grid_counts is None:
            return None
        before = self._incumbent.evaluation.antecedent
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

    def report(self):
        """Every candidate in words and numbers, best first."""
        lines = []
        for candidate in sorted(self.scores, key=self.score):
            counts = None if candidate.counts is None else list(candidate.counts)
            line: dict = {"structure": candidate.describe(), "n_mfs": counts}
            if candidate in self._found:
                found = self._found[candidate]
                line["expected_error"] = float(np.sqrt(self.expected(found)))
                line["log_evidence"] = float(-0.5 * found.score)
                for key in ("agreement", "alpha", "stiffness"):
                    line[key] = float(getattr(found.penalty, key))
            if candidate in self._unknown:
                line["unknown_between"] = self._unknown[candidate]
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
