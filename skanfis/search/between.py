r"""What is known between the rows.

A model can be right on every row and say nothing between them. Rows that lie on a few curves do
that, as those of a gyro's runs, each at a temperature of its own: rules that divide time and
temperature both are told by one curve each, and what they say on the way to the next is anything
that their penalty lets them say. No criterion on the rows themselves sees it.

The leverage of a place z, h = phi(z)' (Phi' S Phi + n P)^-1 phi(z), is the variance of the
prediction there, in units of the noise's. On a row it is one at most, which is what is left when
that row alone decides. A place half-way between two rows where it is more is not known: a single
row there would tell more than all the others.

Unless the smaller model that would be taken instead knows no more there. With inputs that depend on
one another, as a product of two others does, or columns of zeros and ones, what lies half-way may
be nothing that ever comes, and where hardly any noise is left, that must not matter: a model whose
noise falls to a tenth may have a leverage of ninety-nine before it errs by as much. So a place is
known too where the error to be expected, (1 + h) sigma^2, is no more than the smaller model's.

What is asked is at how many places that is so, not by how much: beside one row far off it may be a
thousand at a single place, and the model is as good as ever at all others.
"""

import numpy as np

from ..learning.data import StandardisedData
from .tuning import Tuned

__all__ = ["expected_between", "is_told", "places_between", "unknown_between"]

_MOST_PLACES = 200
_SEED = 0
# Of so many others the nearest: between rows far apart, as those of two clusters, lies what hardly
# any new row comes to. With three, functions of clustered inputs have 10 and 21 % more error than
# where nothing is asked, with ten 1 %, with twenty none (benchmarks/between.py).
_OTHERS = 20
# Three rows far off among sixty come to a twentieth, structures told by three runs alone to a tenth
# and more; docs/mathematics.rst has what other parts and means give.
_MOST_UNKNOWN = 0.075


def places_between(rows: StandardisedData) -> np.ndarray:
    """Places half-way between rows and the nearest of twenty others, (n_inputs, n_places)."""
    rng, X, n_places = np.random.default_rng(_SEED), rows.X, min(rows.n_rows, _MOST_PLACES)
    weight = np.ones(rows.n_rows) if rows.sample_weight is None else rows.sample_weight
    # Rows come as often as they count.
    upto = np.cumsum(weight / weight.max())
    quantiles = (np.arange(n_places) + 0.5) / n_places
    own = np.searchsorted(upto, upto[-1] * quantiles, side="right")
    others = np.searchsorted(upto, upto[-1] * rng.random((n_places, _OTHERS)), side="right")
    distance = np.sum((X[others] - X[own][:, None]) ** 2, axis=2)
    # Nor is a place half-way from a row to itself.
    distance[others == own[:, None]] = np.inf
    nearest = others[np.arange(n_places), distance.argmin(axis=1)]
    return np.ascontiguousarray(0.5 * (X[own] + X[nearest]).T)


def expected_between(tuned: Tuned, places: np.ndarray) -> np.ndarray:
    """Squared error to be expected at some places, the premises being held; a mean over outputs."""
    return (1.0 + _leverage(tuned, places)) * tuned.posterior.noise_variance


def unknown_between(tuned: Tuned, places: np.ndarray, to_beat: np.ndarray | float = 0.0) -> float:
    """The part of some places that is not known, the premises being held; none of a single rule.

    ``to_beat`` is what is to be expected there of the model that would be taken instead, as
    ``expected_between`` has it; nothing where there is no such one.
    """
    if tuned.problem.antecedent.n_rules == 1:
        return 0.0
    leverage = _leverage(tuned, places)
    is_worse = (1.0 + leverage) * tuned.posterior.noise_variance > to_beat
    return float(np.mean((leverage > 1.0) & is_worse))


def _leverage(tuned, places):
    return tuned.problem.leverage_at(tuned.solved, places, tuned.posterior.n_rows)


def is_told(unknown: float) -> bool:
    """Whether the rows tell the model, of whose places such a part is not known."""
    return unknown <= _MOST_UNKNOWN
