r"""Rows out of the range: products of what is known at its edge and of what that changes by.

With h the half of a row at the nearest point of the range (see ``posterior``), and e what h changes
by over a standard deviation of the way from there, what is asked for is h' h, h' e and e' e. Where
few inputs leave the range, far fewer products do than in general.

*On a line.* Rows that leave it along inputs without terms, any number of them: their shares stay as
they are, and the basis changes by the way's own direction. The quadratic form of the range serves
for all three products.

*On a face.* Rows that leave it along one input j with terms, and no other: the shares of j and its
basis function are the same numbers for all of them. With chi the products of the other inputs'
shares and basis functions, the design and what it changes by over a step are

    phi = K_0 chi ,    change of phi = K_1 chi ,

with two matrices that are found once for every face: of 6 x 6 terms on three inputs chi has 18
entries and phi 144. So are outputs and the derivatives by j's own terms; those by others' terms
take their shares too. Quadratic forms of F K_0 and F K_1 are by pairs of chi's factors (see
``quadratic``).

*Elsewhere* the design is formed at one step inside and at two.
"""

from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise

import numpy as np
from scipy.linalg import blas

from .antecedent import Antecedent
from .deviation import inner_products
from .quadratic import QuadraticForm

__all__ = ["STEP", "Face", "on_faces", "products_off_faces", "products_on_line"]

# Derivatives along a way out of the box, by differences over this part of a standard deviation.
# They are taken inside: terms may have a corner on the edge.
STEP = 2.0**-14
# Rows of a block on one face, from which on its tables are worth their while.
_ENOUGH = 64
# Columns of the design up to which there are any: they are kept, half a megabyte of each face.
_MOST_COLUMNS = 512


def on_faces(way, antecedent: Antecedent, n_columns):
    """Rows on a line (None, 0, rows), and on each face (input, side, rows) if they are enough.

    ``way`` (n_inputs, n_rows) leads from the range to the rows; of a design of ``n_columns``.
    """
    outside = way != 0.0
    with_terms = np.unique(np.concatenate([[], *(g.inputs for g in antecedent.groups)])).astype(int)
    n_with_terms = outside[with_terms].sum(axis=0)
    rows = np.flatnonzero(n_with_terms == 0)
    if rows.size:
        yield None, 0, rows
    if n_columns > _MOST_COLUMNS or None in antecedent.share_inputs:
        return
    alone = (n_with_terms == 1) & (outside.sum(axis=0) == 1)
    for j in with_terms[outside[with_terms].any(axis=1)]:
        for side in (-1, 1):
            rows = np.flatnonzero(alone & (side * way[j] > 0.0))
            if rows.size >= _ENOUGH:
                yield int(j), side, rows


@dataclass(frozen=True, eq=False)
class Face:
    """What rows on one face are multiplied with, for n_outputs outputs.

    Attributes
    ----------
    shares : list of slice
        Of the inputs that vary.
    basis : ndarray of int
        The basis functions that vary, and the constant.
    terms : list of (ndarray, ndarray)
        Of every group the terms of inputs that vary, among the group's and among all.
    forms : QuadraticForm
        The three of K_0' F' F K_0, of K_0' F' F K_1 and of K_1' F' F K_1.
    by_term : ndarray of shape (n_outputs, 2 (n_terms + 1), n_varying)
        Of chi: what the rules of each term that varies add up to, and the output; their changes.
    joint : ndarray of shape (n_outputs, 2 n_halves, n_varying)
        What ``DeviationTables.joint`` makes of chi: at one step inside, and the change.
    own : ndarray of shape (n_outputs, n_halves, n_parameters)
        The same of the derivatives by the parameters of terms that vary.
    unit : ndarray of shape (n_outputs, 1)
    n_added : int
        As those of ``DeviationTables``.
    """

    shares: list[slice]
    basis: np.ndarray
    terms: list[tuple[np.ndarray, np.ndarray]]
    forms: QuadraticForm
    by_term: np.ndarray
    joint: np.ndarray
    own: np.ndarray
    unit: np.ndarray
    n_added: int

    @classmethod
    def of(cls, model, tables, inputs, j, once, twice):
        """The face of input j, in the precision of ``tables``: ``once`` and ``twice`` inside.

        These are rows (``DerivativeRows``, of which one point is enough) where only the values of
        input j count; ``inputs`` are those of the basis functions.
        """
        antecedent = model.antecedent
        edges = np.cumsum([0, *antecedent.share_counts])
        parts = [slice(*ends) for ends in pairwise(edges)]
        place = [own == j for own in antecedent.share_inputs]
        varying = np.flatnonzero(np.append(True, inputs != j))
        both = [_from_varying(row, parts, place, inputs, j) for row in (once, twice)]
        half, change = both[0], both[0] - both[1]
        shares = [part for part, is_fixed in zip(parts, place, strict=True) if not is_fixed]
        halves, changes = tables.factor @ half, tables.factor @ change
        counts = [part.stop - part.start for part in shares]
        across = halves.T @ changes
        squares = halves.T @ halves, 0.5 * (across + across.T), changes.T @ changes
        terms, start = [], 0
        for group in antecedent.groups:
            own = np.flatnonzero(group.inputs != j)
            terms.append((own, start + own))
            start += group.n_terms
        maps = _DerivativeMaps(model, tables, inputs, j, once, twice, half, change)
        found = [maps.of_output(k) for k in range(len(tables.unit))]
        by_term, joint, own = (np.stack(one) for one in zip(*found, strict=True))
        return cls(
            shares,
            varying,
            terms,
            QuadraticForm.stack([QuadraticForm.of(one, counts, varying.size) for one in squares]),
            by_term,
            joint,
            own,
            tables.unit,
            tables.n_added,
        )

    def astype(self, dtype):
        """The same in another precision."""
        arrays = {name: getattr(self, name).astype(dtype) for name in ("by_term", "joint", "own")}
        return replace(self, **arrays, forms=self.forms.astype(dtype))

    def products(self, noise, row):
        """Products of h with itself, of h with e, of e with itself, (3, n_outputs, n_rows).

        ``row`` is at the edge, where what varies is what it is at a step inside.
        """
        dtype, n_rows = self.joint.dtype, row.basis.shape[1]
        kept = [row.shares[part] for part in self.shares]
        shares = np.concatenate(kept or [np.empty((0, n_rows))]).astype(dtype, copy=False)
        basis = row.basis[self.basis].astype(dtype)
        squares = self.forms.values(shares, basis)
        found = (noise[:, None] / self.unit) ** 2 * squares[:, None]
        if self.joint.shape[1]:
            chi = self._chi(shares, basis)
            for k in range(len(self.joint)):
                sides = self.joint[k] @ chi
                if self.own.shape[2]:
                    self._add_own(k, row, chi, sides)
                half, change = np.split(sides, 2)
                found[:, k] += signed_products(half, change, self.n_added)
        near, both, change = found
        return np.stack([near + 2.0 * both + change, (both + change) / STEP, change / STEP**2])

    def _chi(self, shares, basis):
        counts = np.cumsum([part.stop - part.start for part in self.shares])[:-1]
        factors = [*np.split(shares, counts), basis] if self.shares else [basis]
        n_rows = basis.shape[1]
        return reduce(lambda a, b: (a[:, None] * b).reshape(-1, n_rows), factors)

    def _add_own(self, k, row, chi, sides):
        """What derivatives by the terms that vary add, at one step inside and to the change."""
        of_terms = np.concatenate([own for _, own in self.terms])
        shares = row.shares[of_terms].astype(chi.dtype)
        sums = self.by_term[k] @ chi
        for part, own_sums in zip(np.split(sides, 2), np.split(sums, 2), strict=True):
            by_term = own_sums[:-1] - shares * own_sums[-1]
            start, changes = 0, []
            for (own, _), gradient in zip(self.terms, row.gradients, strict=True):
                of_group = by_term[start : start + own.size]
                change = gradient[:, own].astype(chi.dtype) * of_group
                changes.append(change.reshape(-1, chi.shape[1]))
                start += own.size
            part += self.own[k] @ np.concatenate(changes)


def _from_varying(row, parts, place, inputs, j):
    """K: the design of rows with the shares and the basis function of input j of one row."""
    factors = [
        row.shares[part, :1] if is_fixed else np.eye(part.stop - part.start)
        for part, is_fixed in zip(parts, place, strict=True)
    ]
    varying = np.flatnonzero(np.append(True, inputs != j))
    of_basis = np.eye(row.basis.shape[0])[:, varying]
    of_basis[np.append(False, inputs == j), 0] = row.basis[1:, 0][inputs == j]
    return reduce(np.kron, [*factors, of_basis])


class _DerivativeMaps:
    """What makes derivatives by the premises of chi."""

    def __init__(self, model, tables, inputs, j, once, twice, half, change):
        antecedent, self.tables, self.half, self.change = model.antecedent, tables, half, change
        self.once, self.twice = once, twice
        columns = np.concatenate([[0], 1 + inputs]) if model.order == 1 else [0]
        widths = np.concatenate([[1.0], model.spread[inputs]])
        self.coefficients = model.coefficients[:, columns] * widths[:, None]
        self.contains = antecedent.sum_over_rules(np.eye(antecedent.n_rules))
        inputs_of_terms = np.concatenate([g.inputs for g in antecedent.groups])
        self.is_fixed = inputs_of_terms == j
        self.of_parameters = np.concatenate(
            [np.tile(g.inputs == j, len(g.theta)) for g in antecedent.groups]
        )

    def of_output(self, k):
        """``by_term``, ``joint`` and ``own`` of one output."""
        unit, n_premises = self.tables.unit[k], self.tables.n_premises
        coefficients = self.coefficients[:, :, k] / unit
        sums = (self.contains[:, :, None] * coefficients).reshape(len(self.contains), -1)
        # Of every term the rules that have it, then of all rules: the output.
        sums = np.vstack([sums, coefficients.ravel()])
        inside, change = sums @ self.half, sums @ self.change
        kept = np.append(~self.is_fixed, True)
        by_term = np.vstack([inside[kept], change[kept]])
        joint = self.tables.joint[k]
        premises, consequents = joint[:, :n_premises], joint[:, n_premises:]
        sides = [consequents @ self.half, consequents @ self.change]
        if not n_premises:
            return by_term, np.vstack(sides), premises
        first = self._of_fixed(self.once, inside)
        second = self._of_fixed(self.twice, inside - change)
        fixed = premises[:, self.of_parameters]
        sides[0] += fixed @ first
        sides[1] += fixed @ (first - second)
        return by_term, np.vstack(sides), premises[:, ~self.of_parameters]

    def _of_fixed(self, row, sums):
        """Derivatives by the parameters of j's own terms, of chi, (n_parameters, n_varying)."""
        by_term = sums[:-1] - row.shares[:, :1] * sums[-1]
        start, found = 0, []
        for gradient in row.gradients:
            own = slice(start, start + gradient.shape[1])
            mine = self.is_fixed[own]
            own_terms = by_term[own][mine]
            found.append((gradient[:, mine, :1] * own_terms).reshape(-1, sums.shape[1]))
            start = own.stop
        return np.vstack(found)


def products_on_line(posterior, model, tables, row, ways):
    """The same of rows that leave the range along inputs without terms.

    ``ways`` (n_inputs, n_rows) are directions in standard deviations, of length one.
    """
    inputs, unit, dtype = posterior.inputs, tables.unit, tables.dtype
    narrow, direction = row.astype(dtype), np.zeros(row.basis.shape)
    direction[1:] = ways[inputs] if model.order == 1 else 0.0
    out = np.flatnonzero(direction.any(axis=1))
    turned = direction.astype(dtype)
    squares = tables.form.products(narrow.shares, narrow.basis, turned)
    found = (posterior.noise[:, None] / unit) ** 2 * squares[:, None]
    if not tables.joint.shape[1]:
        return found
    for k in range(len(unit)):
        by_basis = tables.by_basis(k, narrow)
        half = np.einsum("bqn,bn->qn", by_basis, narrow.basis)
        change = np.einsum("bqn,bn->qn", by_basis[out], turned[out])
        if tables.n_premises:
            tables.add_premises(k, row.changes(k, unit), half)
        if tables.n_premises and out.size:
            slopes = model.coefficients[:, 1 + inputs[out - 1], k] * model.spread[inputs[out - 1]]
            by_rule = row.strengths * (slopes @ direction[out])
            by_term = model.antecedent.term_sensitivity(by_rule, by_rule.sum(axis=0), row.shares)
            of_way = replace(row, by_term=[*[None] * k, by_term])
            tables.add_premises(k, of_way.changes(k, unit), change)
        found[:, k] += signed_products(half, change, tables.n_added)
    return found


def products_off_faces(noise, tables, once, twice):
    """Products of h with itself, of h with e, of e with itself, (3, n_outputs, n_rows).

    With h at one step inside and e what it changes by from two steps to one, both are linear in the
    rows of the design and of d: they are subtracted first, and F, T and B_k applied to these alone.
    """
    n_premises = tables.n_premises
    sides = np.empty((2, tables.joint.shape[2], once.outputs.shape[1]), tables.dtype)
    designs = sides[:, n_premises:]
    once.astype(tables.dtype).design(designs[0])
    once.write_change_from(twice, designs[1])
    # Half the work of a full product.
    product = blas.get_blas_funcs("trmm", dtype=tables.dtype)
    u = [product(1.0, tables.factor.T, one.T, side=1, lower=0).T for one in designs]
    found = (noise[:, None] / tables.unit) ** 2 * np.stack(inner_products(*u))[:, None]
    if tables.joint.shape[1]:
        for k, joint in enumerate(tables.joint):
            if n_premises:
                sides[:, :n_premises] = _changes(tables, once, twice, k)
            half, change = (joint @ one for one in sides)
            found[:, k] += signed_products(half, change, tables.n_added)
    near, both, change = found
    return np.stack([near + 2.0 * both + change, (both + change) / STEP, change / STEP**2])


def signed_products(half, change, n_added):
    """Inner products of two sides, (3, n_rows): of rows that are added less of those taken off."""
    added = np.stack(inner_products(half[:n_added], change[:n_added]))
    if len(half) == n_added:
        return added
    return added - np.stack(inner_products(half[n_added:], change[n_added:]))


def _changes(tables, once, twice, k):
    """Derivatives by the premises, and what they change by, (2, n_parameters, n_rows)."""
    first, second = (one.changes(k, tables.unit) for one in (once, twice))
    return np.stack([first, first - second])
