"""The automatic search: kinds of candidates, one expected error, one choice.

Every kind is a sequence from small to large (``candidates``). It is grown on all rows and, step by
step beside it, for every fold without the rows that judge there (``judging``). It ends when two
steps no longer lower the error expected on new rows. If rows are few for the number of inputs,
every kind is grown twice: with slopes by the inputs of the lasso (``lasso``), and by all.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..learning.data import StandardisedData
from ..learning.sparse_slopes import SLOPE_WORTHS
from .choice import Judged, Judges, best_of, chosen, tolerated, within
from .judging import dealt_rows, judging_folds
from .start import Start, described, started
from .trials import Plan, Trials
from .tuning import ROWS_PER_CONSEQUENT, cost_of

# A sequence ends this many steps beyond its best candidate. One would be too few: a product of two
# inputs needs terms on both before either helps.
_FURTHER = 2
# Standard errors by which several rules must beat one if half of the rows judge. In folds one is
# enough: noise that the rows of training have by chance is missing on those left out, so what has
# learnt it loses there. The half that judges once has noise of its own.
_OF_HALF = 2.0
# If rows do not suffice for this many rules, slopes by the inputs of the lasso are tried too.
_FEW_RULES = 3


class StructureSearch:
    """A search over structures for the rows that the final model will be trained on."""

    def __init__(self, rows: StandardisedData, plan: Plan, simplicity: float):
        self.plan, self.simplicity = plan, simplicity
        self.rows = sample = dealt_rows(rows)
        found, is_half = judging_folds(sample)
        n_basis = 1 + plan.consequent_inputs.size
        is_wide = sample.n_rows < ROWS_PER_CONSEQUENT * _FEW_RULES * n_basis
        self.folds = [Trials(sample.part(grow), plan, is_wide) for grow, _ in found]
        self.left_out = [sample.part(judge) for _, judge in found]
        self.trials = self.folds[0] if is_half else Trials(sample, plan, is_wide)
        self.judges = Judges.of(self.left_out, _OF_HALF if is_half else 1.0)
        self.judged: list[Judged] = []

    def run(self, kinds: Sequence[str]) -> Start:
        """A start from the chosen structure."""
        first, n_slopes = self.trials.one_rule, self.trials.slope_inputs.size
        is_part = n_slopes < self.plan.consequent_inputs.size
        for has_all in (False, True) if is_part else (False,):
            candidate = replace(first, has_all_slopes=has_all)
            one_rule = self._judge(candidate, [candidate] * len(self.folds))
            # If the lasso keeps no input, its one rule is the mean: that is judged, but not grown.
            if n_slopes or has_all or not is_part:
                for kind in kinds:
                    self._grow(kind, one_rule)
        best = best_of(self.judged, self.judges)
        variance = self._variance()
        most = tolerated(best.squared_error, variance, self.simplicity)
        # Only within the tolerance: a second look at every size would give chance a second try.
        for one in within(self.judged, best, most):
            self._judge_sparse_slopes(one, variance)
        found = chosen(within(self.judged, best, most), variance)
        error = found.squared_error
        most = tolerated(min(error, best.squared_error), variance, self.simplicity)
        room = most / error if error > 0.0 else 1.0
        tuned = self.trials.tuned(found.candidate)
        return started(tuned, self.rows, self.plan, room, self._report(found, variance))

    def _grow(self, kind, one_rule):
        """Judge a kind from small to large, some steps further than the best.

        With monotonic constraints, a kind also goes on while its unconstrained rules gain: the
        constrained ones may gain only a step later.
        """
        now, best, best_free, n_further = one_rule, one_rule, one_rule, 0
        while n_further < _FURTHER:
            larger = self.trials.larger(kind, now.candidate)
            in_folds = [
                larger if fold is self.trials else fold.larger(kind, one)
                for fold, one in zip(self.folds, now.in_folds, strict=True)
            ]
            if larger is None or None in in_folds:
                return
            now = self._judge(larger, in_folds)
            n_further += 1
            if self.judges.are_less(now.squares, best.squares):
                best, n_further = now, 0
            if self.judges.are_less(now.free_squares, best_free.free_squares):
                best_free, n_further = now, 0

    def _judge_sparse_slopes(self, one, variance):
        """Judge a candidate with fewer slopes; keep it if cheaper and its rules hold alone."""
        most = max((1.0 + self.simplicity) ** 2 * one.squared_error_of_rules, variance)
        soonest = one
        for worth in SLOPE_WORTHS:
            in_folds = [replace(like, slope_worth=worth) for like in one.in_folds]
            simpler = self._judge(replace(one.candidate, slope_worth=worth), in_folds)
            holds = simpler.cost < one.cost and simpler.squared_error_of_rules <= most
            if holds and simpler is chosen([simpler, soonest], variance):
                soonest = simpler
            else:
                self.judged.remove(simpler)

    def _judge(self, candidate, in_folds):
        """Judge a candidate: in every fold, its like predicts the rows that were left out."""
        free_squares = squares = self._squares(in_folds, None)
        if self.plan.held is not None:
            squares = self._squares(in_folds, self.plan.held)
        error, tuned = self.judges.mean(squares), self.trials.tuned(candidate)
        cost, of_rules = cost_of(tuned), error + tuned.disagreement
        judged = Judged(candidate, in_folds, squares, free_squares, error, cost, of_rules)
        self.judged.append(judged)
        if self.plan.tell is not None:
            words = f"{candidate.describe()}: expected error {np.sqrt(error):.3g} sd"
            self.plan.tell(f"{words} of the target, {cost} numerals")
        return judged

    def _squares(self, in_folds, held):
        """Squared errors on the rows that judge, scaled to those of a training on all rows."""
        squares = [
            fold.squared_errors(fold.tuned(one), rows, held)
            for fold, one, rows in zip(self.folds, in_folds, self.left_out, strict=True)
        ]
        factor = self.folds[0].with_more_rows(self.folds[0].tuned(in_folds[0]))
        return factor * np.concatenate(squares)

    def _variance(self):
        """Squared error of the mean of the training rows on the rows that judge."""
        squares = []
        for fold, rows in zip(self.folds, self.left_out, strict=True):
            mean = np.average(fold.rows.y, axis=0, weights=fold.rows.sample_weight)
            squares.append(np.sum((rows.y - mean) ** 2, axis=1))
        return self.judges.mean(np.concatenate(squares))

    def _report(self, found, variance):
        """Every candidate in words and numbers, best first; ``variance`` is as in ``described``."""
        return [
            described(
                self.trials.tuned(one.candidate),
                one.candidate.describe(),
                one.squared_error,
                variance,
                is_chosen=one is found,
            )
            for one in sorted(self.judged, key=lambda one: one.squared_error)
        ]
