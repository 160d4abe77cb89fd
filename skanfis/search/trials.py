r"""Short trainings of candidate structures on a sample of the rows, and what each is worth.

No row is held out: the weights of every candidate's penalty are found by the evidence (``tuning``),
and its error on rows left out one by one follows from the training on all of them
(``Tuned.expected_error``). Out of the running are candidates with a term that is hardly true on any
row, and those that the rows do not tell between them (``_undetermined_share``).

Rows that come in groups, runs of an instrument say, are more alike within a group than any
criterion on the same rows can know. Where the groups are given, the score is instead the error of
short trainings on the groups that are left out, a fifth of them at a time.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from sklearn.model_selection import GroupKFold

from ..antecedent import Antecedent
from ..blocks import BLOCK_ROWS
from ..consequent import basis, rule_outputs
from ..learning.data import StandardisedData
from ..learning.evidence import FREE
from ..learning.objective import SeparableProblem
from ..learning.premise import Premise
from ..membership import LEAST_TRUTH, Membership
from .candidates import Candidate, RuleBases
from .grid import Spacing
from .sample import effective_weight, search_sample, unit_scale
from .tuning import FIRST_PENALTY, FIRST_STEPS, Tuned, tune

# Candidates are compared on at most so many representative rows. Rows of one group are alike, and
# every candidate is trained once for each part that is left out.
_MOST_ROWS, _MOST_ROWS_IN_GROUPS = 2000, 1000
# Steps of the weights that tell what a candidate promises; training goes on from there.
_STEPS_TO_PROMISE = 2
# Turns of weights and premises of a candidate.
_TURNS = 2
# As cross-validation has by custom: more cost time, and tell little more.
_MOST_FOLDS = 5
# Places between rows; each half-way between a row and the nearest of so many others, for between
# rows far apart, as those of two clusters, lies what hardly any new row comes to.
_MOST_PLACES, _OTHERS, _SEED = 200, 20, 0
# Three rows far off among sixty come to a twentieth, structures told by three runs alone to a tenth
# and more.
_MOST_UNKNOWN = 0.075


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

    Attributes
    ----------
    scores : dict of Candidate to float
        Of all that were tried, in the order of trial.
    sample : StandardisedData
        The rows that candidates see.
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
    ):
        self.order, self.consequent_inputs = order, consequent_inputs
        self.free = [key for key in FREE if key not in fixed]
        self.first = replace(FIRST_PENALTY, **fixed)
        most = _MOST_ROWS if rows.groups is None else _MOST_ROWS_IN_GROUPS
        self.sample = search_sample(rows, most)
        self.spacing = Spacing(self.sample)
        self.rule_bases = RuleBases(families, inputs, self.spacing, seed)
        self.places = _midpoints(self.sample)
        self.n_sample, self.n_all = effective_weight(self.sample), effective_weight(rows)
        self.folds = _folds(self.sample.groups)
        self.scores: dict[Candidate, float] = {}
        self._begun: dict[Candidate, Tuned] = {}
        self._found: dict[Candidate, Tuned] = {}
        self._error_to_match: np.ndarray | float = 0.0

    def compare_with(self, best: Candidate):
        """Have candidates compared with the best so far at places between rows."""
        self._error_to_match = _error_at(self.tuned(best), self.places)[1]

    def promising(self, candidates):
        """Candidates by their expected error before the premises move, best first."""
        self._begun = {
            candidate: self._train(candidate, self.sample, 0, _STEPS_TO_PROMISE)
            for candidate in candidates
            if not _is_too_many(candidate, self.sample.n_rows)
        }
        return sorted(self._begun, key=lambda c: self.expected(self._begun[c]))

    def tuned(self, candidate: Candidate) -> Tuned:
        """The end of a candidate's training."""
        if candidate not in self._found:
            begun = self._begun.get(candidate)
            self._found[candidate] = self._train(candidate, self.sample, begun=begun)
        return self._found[candidate]

    def score(self, candidate: Candidate) -> float:
        """N log of the expected error, or the error on groups left out."""
        if candidate not in self.scores:
            self.scores[candidate] = self._scored(candidate)
        return self.scores[candidate]

    def _scored(self, candidate):
        if _is_too_many(candidate, self.sample.n_rows):
            return np.inf
        if self.folds:
            return self._held_out_error(candidate)
        tuned = self.tuned(candidate)
        if self._undetermined_share(tuned) > _MOST_UNKNOWN:
            return np.inf
        if _has_idle_term(self.sample, tuned.evaluation.antecedent):
            return np.inf
        # As the evidence, in units of twice the logarithm of a probability.
        with np.errstate(divide="ignore"):
            return self.n_sample * tuned.posterior.n_outputs * np.log(self.expected(tuned))

    def expected(self, tuned: Tuned) -> float:
        """Squared error expected on new rows, of a training on all rows and not the sample.

        What the parameters cost, k / n of the noise's variance, falls as the rows rise.
        """
        n_effective = tuned.posterior.n_effective
        on_sample, on_all = n_effective / self.n_sample, n_effective / self.n_all
        return tuned.expected_error * (1.0 + on_all) / (1.0 + on_sample)

    def error(self, candidate: Candidate) -> float:
        """RMS on the rows left out, or what is expected on new ones; of the standardised target."""
        if self.folds:
            return self.score(candidate)
        return np.sqrt(self.expected(self.tuned(candidate)))

    def _undetermined_share(self, tuned):
        """The part of the places between rows where a single row would tell more than all do.

        Unless the error to be expected there, (1 + leverage) sigma^2, is no more than that of the
        smaller model which would be taken instead.
        """
        if tuned.problem.antecedent.n_rules == 1:
            return 0.0
        leverage, error = _error_at(tuned, self.places)
        return float(np.mean((leverage > 1.0) & (error > self._error_to_match)))

    def _held_out_error(self, candidate):
        """Root of the mean squared error on groups left out, in the range of the others.

        What is beyond it is for the policy out of bounds, not for the structure.
        """
        total = weight = 0.0
        for training, held_out in self.folds:
            part, rest = self.sample.part(training), self.sample.part(held_out)
            low, high = part.X.min(axis=0), part.X.max(axis=0)
            rest = rest.part(((low <= rest.X) & (high >= rest.X)).all(axis=1))
            if _is_too_many(candidate, part.n_rows):
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
        """A short training on some rows."""
        if begun is None:
            problem = SeparableProblem(
                rows,
                self.rule_bases.of(candidate, rows),
                self.order,
                self.first,
                consequent_inputs=self.consequent_inputs,
            )
        else:
            problem, first_steps = begun.problem, first_steps - _STEPS_TO_PROMISE
        premise = Premise.of(problem.antecedent, rows.inputs.minimum, rows.inputs.maximum)
        weight = effective_weight(rows)
        return tune(problem, premise, self.free, weight, turns, first_steps, begun=begun)

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
            if self.folds:
                line["held_out_error"] = float(self.scores[candidate])
            lines.append(line)
        return lines


def held_out_loss(rows: StandardisedData, consequent_inputs, evaluation):
    """Mean squared error of rows that were not trained on, standardised, summed over outputs.

    Rows beyond the training rows' range count as predict holds them, at its edge.
    """
    low, high = (edge[:, None] for edge in rows.inputs.box)
    coefficients = evaluation.coefficients
    by_rule = coefficients.reshape(evaluation.antecedent.n_rules, -1, coefficients.shape[1])
    total = 0.0
    for chunk in rows.chunks(BLOCK_ROWS):
        for part in chunk:
            Z, target, weight = rows.read(part)
            np.clip(Z, low, high, out=Z)
            strengths = evaluation.antecedent.strengths(Z)
            basis_rows = basis(Z[consequent_inputs])
            for k, one in enumerate(by_rule.transpose(2, 0, 1)):
                squares = (target[k] - rule_outputs(one, strengths, basis_rows)[1]) ** 2
                total += squares.sum() if weight is None else weight @ squares
    return total / rows.total_weight


def _folds(groups):
    """Training and held-out rows of every fold; none where there are no two groups."""
    if groups is None or np.unique(groups).size < 2:
        return []
    n_folds = min(_MOST_FOLDS, np.unique(groups).size)
    return list(GroupKFold(n_folds).split(np.empty((groups.size, 0)), groups=groups))


def _is_too_many(candidate, n_rows):
    return candidate.clustering in ("k-means", "fcm") and candidate.size > n_rows


def _midpoints(rows: StandardisedData):
    """Places half-way between rows and the nearest of twenty others, (n_inputs, n_places)."""
    rng, X, n_places = np.random.default_rng(_SEED), rows.X, min(rows.n_rows, _MOST_PLACES)
    weight = np.ones(rows.n_rows) if rows.sample_weight is None else rows.sample_weight
    # Rows come as often as they count.
    upto = np.cumsum(weight / weight.max())
    quantiles = (np.arange(n_places) + 0.5) / n_places
    own = np.searchsorted(upto, upto[-1] * quantiles, side="right")
    others = np.searchsorted(upto, upto[-1] * rng.random((n_places, _OTHERS)), side="right")
    distance = np.sum((X[others] - X[own][:, None]) ** 2, axis=2)
    distance[others == own[:, None]] = np.inf
    nearest = others[np.arange(n_places), distance.argmin(axis=1)]
    return np.ascontiguousarray(0.5 * (X[own] + X[nearest]).T)


def _error_at(tuned: Tuned, places):
    """Leverage at some places, and the squared error to be expected there."""
    leverage = tuned.problem.leverage_at(tuned.solved, places, tuned.posterior.n_rows)
    return leverage, (1.0 + leverage) * tuned.posterior.noise_variance


def _has_idle_term(rows: StandardisedData, antecedent: Antecedent) -> bool:
    """Whether some term's membership is below one half on every row."""
    greatest = np.full(antecedent.n_terms, -np.inf)
    for chunk in rows.chunks(BLOCK_ROWS):
        for part in chunk:
            log_truth = antecedent.log_memberships(rows.read(part)[0])
            np.maximum(greatest, log_truth.max(axis=1), out=greatest)
    return bool((greatest < np.log(LEAST_TRUTH)).any())
