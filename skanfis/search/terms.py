"""Terms per input of a grid, for those who cut the folds and bound the rules themselves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .._threads import one_blas_thread
from ..learning.data import StandardisedData
from ..membership import Gaussian
from .search import StructureSearch

__all__ = ["TermsFound", "search_terms"]


@dataclass(frozen=True)
class TermsFound:
    """What a search found.

    Parameters
    ----------
    terms : tuple of int
        Terms per input; 1 for an input that is in the consequents alone.
    tried : tuple of (tuple of int, float)
        Terms and error of all that were tried, in this order. The error is the RMS over the rows
        held out that were in the range of the others, in the units of the target; without folds,
        what is to be expected on new rows.
    """

    terms: tuple[int, ...]
    tried: tuple[tuple[tuple[int, ...], float], ...]

    @property
    def error(self) -> float:
        """That of the terms found."""
        return dict(self.tried)[self.terms]


def search_terms(
    X: np.ndarray,
    y: np.ndarray,
    folds: Sequence[tuple[np.ndarray, np.ndarray]],
    max_rules: int | None = None,
) -> TermsFound:
    """Find how many Gaussian terms each input needs, as ``ANFISRegressor`` does with ``groups``.

    The regressor cuts its folds by one kind of groups; where a fold holds out groups of two kinds,
    and some rows are neither trained on nor held out, such folds have to be given.

    Parameters
    ----------
    X : ndarray of shape (n_rows, n_inputs)
        Inputs, in any units.
    y : ndarray of shape (n_rows,)
        Target.
    folds : sequence of (ndarray of int, ndarray of int)
        Training and held-out rows. Without any, the error is estimated from the rows themselves.
    max_rules : int, optional
        Most rules, 1 or more; 36 and at most 256 consequent parameters if not given.

    Returns
    -------
    found : TermsFound
    """
    # As groups, the rows' own numbers: they tell which of them came into a sample.
    rows = StandardisedData.of(X, y[:, None], groups=np.arange(y.size))
    inputs = np.arange(X.shape[1])

    def split(kept):
        parts = [[np.flatnonzero(np.isin(kept, part)) for part in fold] for fold in folds]
        return [(train, test) for train, test in parts if train.size > 1 and test.size]

    with one_blas_thread():
        search = StructureSearch(
            rows,
            [Gaussian] * inputs.size,
            order=1,
            premise_inputs=inputs,
            consequent_inputs=inputs,
            seed=0,
            fixed={},
            max_rules=max_rules,
            split=split,
        )
        best = search.choose("grid")
    scale, trials = float(rows.targets.scale[0]), search.trials
    tried = tuple((one.counts, scale * float(trials.error(one))) for one in trials.scores)
    return TermsFound(best.counts, tried)
