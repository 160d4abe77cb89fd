r"""How far from its centre each rule stands for rows, wherever that centre comes to lie.

The penalty weighs a rule's slope by its extent, max over rows of sqrt(w_r) |z_j - a_rj|, about a
centre a that moves as rows come. Of rows that are gone the maximum is still needed at the centre of
all. With u = sqrt(w_r) and v = u z it is the maximum of |v - u a|, a linear function of the point
(u, v), and so is found at a corner of these points' convex hull, for every a. Corners are few where
points are many; they are all that is kept, and the corners of two sets of rows are those of the
corners of both.

The points of rows on one curve (a single input) can all be corners. Beyond a limit every second
one may go, those first without which the hull is hardly smaller.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

__all__ = ["Farthest"]

# Of a circle, a polygon of so many corners is short by 1 - cos(pi / 256), 8e-5 of the radius. They
# take 4 kB for each rule and input.
_MOST_CORNERS = 256
# Parts of the range of u in the table that rows are held against first.
_PARTS = 64
# Directions in which the first corners are sought: whatever lies within these is none.
_DIRECTIONS = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)


def _chain(u, v):
    """Upper hull of points in ascending u; the highest of equal ones comes last."""
    kept: list[int] = []
    for i in range(len(u)):
        while kept:
            j = kept[-1]
            if u[i] == u[j]:
                kept.pop()
                continue
            if len(kept) == 1:
                break
            h = kept[-2]
            if (v[j] - v[h]) * (u[i] - u[h]) > (v[i] - v[h]) * (u[j] - u[h]):
                break
            kept.pop()
        kept.append(i)
    return kept


def _thinned(u, v):
    while u.size > _MOST_CORNERS:
        inner = np.arange(1, u.size - 1, 2)
        left, right = inner - 1, inner + 1
        area = (v[inner] - v[left]) * (u[right] - u[left])
        area -= (v[right] - v[left]) * (u[inner] - u[left])
        gone = inner[np.argsort(area, kind="stable")[: u.size - _MOST_CORNERS]]
        u, v = np.delete(u, gone), np.delete(v, gone)
    return u, v


@dataclass(frozen=True, eq=False)
class _Corners:
    """The upper corners of points (u, v), beginning with the origin."""

    u: np.ndarray = field(default_factory=lambda: np.zeros(1))
    v: np.ndarray = field(default_factory=lambda: np.zeros(1))

    @cached_property
    def _floor(self):
        """What the hull is not below, in equal parts of u from 0 to 1; it is concave."""
        edges = np.interp(np.arange(_PARTS + 2) / _PARTS, self.u, self.v, right=-np.inf)
        return np.minimum(edges[:-1], edges[1:])

    def __getstate__(self):
        """The corners alone: the rest follows."""
        return {"u": self.u, "v": self.v}

    def plus_many(self, u, v, parts):
        """With many points, of which a table tells most that are none; ``parts`` is that of u."""
        beyond = np.flatnonzero(v > self._floor[parts])
        return self.plus(u[beyond], v[beyond]) if beyond.size else self

    def plus(self, u, v):
        """With more points."""
        outside = v > np.interp(u, self.u, self.v, right=-np.inf)
        if not outside.any():
            return self
        u, v = np.concatenate([self.u, u[outside]]), np.concatenate([self.v, v[outside]])
        order = np.lexsort((v, u))
        u, v = u[order], v[order]
        # As lists: a loop over numbers of NumPy takes five times as long.
        kept = _chain(u.tolist(), v.tolist())
        return _Corners(*_thinned(u[kept], v[kept]))

    def highest(self, a):
        """Largest v - u a."""
        return np.max(self.v - a * self.u)


@dataclass(frozen=True, eq=False)
class Farthest:
    """Corners for every rule and every input of its consequent, above and below; immutable.

    Attributes
    ----------
    n_rules : int
    offset, scale : ndarray of shape (n_inputs,)
        Units of the points: z = (x - offset) / scale, for good.
    above, below : list of _Corners
        Rule by rule; those below with v turned round.
    """

    n_rules: int
    offset: np.ndarray
    scale: np.ndarray
    above: list[_Corners]
    below: list[_Corners]

    @classmethod
    def none(cls, n_rules, offset, scale):
        """Of no rows."""
        count = n_rules * offset.size
        return cls(n_rules, offset, scale, [_Corners()] * count, [_Corners()] * count)

    def plus_rows(self, strengths, X):
        """With rows: strengths (n_rules, n_rows), consequent inputs in their units."""
        root = np.sqrt(strengths)
        Z = (X - self.offset[:, None]) / self.scale[:, None]
        parts = (_PARTS * root).astype(np.intp)
        above, below = [], []
        for place, (r, j) in enumerate(np.ndindex(self.n_rules, self.offset.size)):
            u, v = root[r], root[r] * Z[j]
            one, other = self.above[place], self.below[place]
            if u.size > _DIRECTIONS.size and one.u.size == 1:
                first = [np.argmax(np.cos(angle) * u + np.sin(angle) * v) for angle in _DIRECTIONS]
                one, other = one.plus(u[first], v[first]), other.plus(u[first], -v[first])
            above.append(one.plus_many(u, v, parts[r]))
            below.append(other.plus_many(u, -v, parts[r]))
        return replace(self, above=above, below=below)

    def distance(self, center):
        """Largest sqrt(w_r) |x_j - center_rj|, in the units of X, (n_rules, n_inputs)."""
        places = ((center - self.offset) / self.scale).ravel()
        found = [
            max(one.highest(a), other.highest(-a))
            for one, other, a in zip(self.above, self.below, places, strict=True)
        ]
        return np.array(found).reshape(center.shape) * self.scale

    def plus(self, other):
        """The corners of both."""
        shift = np.tile((other.offset - self.offset) / self.scale, self.n_rules)
        factor = np.tile(other.scale / self.scale, self.n_rules)
        pairs = [(self.above, other.above, shift), (self.below, other.below, -shift)]
        above, below = (
            [
                mine.plus(more.u, g * more.v + t * more.u)
                for mine, more, t, g in zip(of_mine, of_other, shifts, factor, strict=True)
            ]
            for of_mine, of_other, shifts in pairs
        )
        return replace(self, above=above, below=below)
