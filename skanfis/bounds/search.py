"""Branch and bound over boxes, many at once."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

# Most boxes that are split in one round; fewest to evaluate at once: fewer are split again first.
_BATCH, _FEWEST = 1024, 64


class Found(NamedTuple):
    """The largest value over a box lies between ``attained``, found at ``point``, and ``bound``."""

    bound: float
    attained: float
    point: np.ndarray
    n_boxes: int
    converged: bool


class _Boxes(NamedTuple):
    """Boxes (n_inputs, n_boxes), their bounds, and how much the width along each input adds."""

    low: np.ndarray
    high: np.ndarray
    bound: np.ndarray
    gain: np.ndarray

    def of(self, chosen):
        return _Boxes(*(one[..., chosen] for one in self))

    @property
    def is_point(self):
        """Which boxes cannot be split any more."""
        least = 4.0 * np.spacing(np.maximum(np.abs(self.low), np.abs(self.high)))
        return (self.high - self.low <= least).all(axis=0)

    def parts(self, cuts):
        """Halves of every box, and halves of these until there are enough."""
        found = self._halves(cuts)
        while 0 < found.low.shape[1] < _FEWEST:
            found = found._halves(cuts)
        return found.low, found.high

    def _halves(self, cuts):
        """Both halves of every box, along the input with the largest gain."""
        k = np.arange(self.low.shape[1])
        width = self.high - self.low
        gain = np.where(np.isfinite(self.gain), self.gain, np.finfo(float).max) * (width > 0.0)
        gain = np.where((gain > 0.0).any(axis=0), gain, width)
        j = gain.argmax(axis=0)
        start, stop = self.low[j, k], self.high[j, k]
        at = start + 0.5 * (stop - start)
        for cut in cuts[j].T:
            at = np.where((start < cut) & (cut < stop), cut, at)
        left, right = self.high.copy(), self.low.copy()
        left[j, k] = right[j, k] = at
        low, high = np.concatenate([self.low, right], axis=1), np.concatenate([left, self.high], 1)
        gain[j, k] *= 0.5
        return _Boxes(low, high, np.tile(self.bound, 2), np.tile(gain, 2))


def largest(
    evaluate: Callable, low, high, tolerance, max_boxes, cuts, first=None, until=-np.inf
) -> Found:
    """Enclose the largest value that a function takes on a box.

    ``evaluate`` is as ``Enclosure.values``. The search ends when bound and value are ``tolerance``
    apart, or on one side of ``until``. It cuts at ``cuts`` first; ``first``: a point and its value.
    """
    where, best = (low, -np.inf) if first is None else first
    lows, highs = low[:, None].astype(float), high[:, None].astype(float)
    n_boxes, discarded, waiting = 0, -np.inf, None
    while True:
        bound, points, attained, gain = evaluate(lows, highs)
        n_boxes += bound.size
        top = int(np.argmax(attained))
        if attained[top] > best:
            best, where = float(attained[top]), points[:, top].copy()
        found = _Boxes(lows, highs, bound, gain)
        if waiting is not None:
            found = _Boxes(*(np.concatenate(both, -1) for both in zip(waiting, found, strict=True)))
        enough = max(best + tolerance, until)
        done = (found.bound <= enough) | found.is_point
        discarded = max(discarded, np.max(found.bound[done], initial=-np.inf))
        waiting = found.of(~done)
        if waiting.bound.size == 0 or n_boxes >= max_boxes or -np.inf < until < best:
            break
        order = np.argsort(-waiting.bound, kind="stable")
        lows, highs = waiting.of(order[:_BATCH]).parts(cuts)
        waiting = waiting.of(order[_BATCH:])
    bound = max(discarded, np.max(waiting.bound, initial=-np.inf), best)
    return Found(float(bound), best, where, n_boxes, bool(bound <= enough))
