r"""Rows out of the range: products of what is known at its edge and of what that changes by.

With h the half of a row at the nearest point of the range (see ``posterior``), and e what h changes
by over a standard deviation of the way from there (beside an outlier a shorter ruler, see
``deviation``), what is asked for is h' h, h' e and e' e. Where few inputs leave the range, far
fewer products do than in general.

*On a line.* Rows that leave it along inputs without terms, any number of them: their shares stay as
they are, and the basis changes by the way's own direction. The quadratic form of the range serves
for all three products.

*On a face.* Rows that leave it along up to five inputs with terms: at the edge the shares of these
and their basis functions are the same numbers for all of them. With chi the products of the other
inputs' shares and basis functions, and a how many steps inside a row is along each input with terms
that it leaves the range by, the design there is

    phi = K(a) chi ,    K(a) = sum_m c_m(a) K_m ,

by Newton's interpolation of the second order: a step is so short that the third counts for nothing.
Along one input the two points asked for are those that are interpolated. The matrices K_m are found
once for every face: of 6 x 6 terms on three inputs chi has 18 entries and phi 144. So are outputs
and the derivatives by the edge's own terms; those by others' terms take their shares too. Quadratic
forms of F K_m are by pairs of chi's factors (see ``quadratic``). Of rows that leave the range along
inputs without terms as well, chi changes by their basis functions: by K_0 chi(way), K_0 at a step
inside along every one of the inputs with terms. What K differs from that is second order.

*Elsewhere* the design is formed at one step inside and at two.
"""

from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise

import numpy as np
from scipy.linalg import blas

from .deviation import inner_products, narrowed
from .learning.gram import pair_index
from .quadratic import QuadraticForm, row_products

__all__ = ["STEP", "Face", "nodes", "products_off_faces", "products_on_line"]

# Derivatives along a way out of the box, by differences over this part of what measures it.
# They are taken inside: terms may have a corner on the edge.
STEP = 2.0**-14


def nodes(n_away):
    """Points of a face, in steps inside, (n_nodes, n_away), and its parts as their differences."""
    if n_away == 1:
        return np.array([[1], [2]]), np.array([[1.0, 0.0], [1.0, -1.0]])
    unit = np.eye(n_away, dtype=int)
    seconds = [unit[i] + unit[j] for i in range(n_away) for j in range(i, n_away)]
    points = np.vstack([np.zeros((1, n_away), dtype=int), unit, *seconds])
    # What of a part is at each point: the inverse of the parts' values there.
    return 1 + points, np.linalg.inv(_newton(points.T.astype(float)).T)


def _newton(at):
    """Newton's polynomials up to the second order at points (n_away, n_points), a row each."""
    n_away = len(at)
    seconds = [
        0.5 * at[i] * (at[i] - 1.0) if i == j else at[i] * at[j]
        for i in range(n_away)
        for j in range(i, n_away)
    ]
    return np.stack([np.ones(at.shape[1]), *at, *seconds])


def _weights_of_parts(directions, dtype):
    """Of a face's parts a step along directions (n_away, n_rows), and what it changes by.

    None along one input and no other, where these are the parts themselves.
    """
    if len(directions) == 1:
        (way,) = directions
        if (way == 1.0).all():
            return None
        once, change = np.stack([np.ones_like(way), 1.0 - way]), np.stack([0.0 * way, way])
    else:
        once, twice = (_newton(k * directions - 1.0) for k in (1.0, 2.0))
        change = once - twice
        change[0] = 0.0
    return once.astype(dtype), change.astype(dtype)


@dataclass(frozen=True, eq=False)
class Face:
    """What rows on one face are multiplied with, for n_outputs outputs and n_parts parts K_m.

    Attributes
    ----------
    shares : list of slice
        Of the inputs that vary.
    basis : ndarray of int
        The basis functions that vary, and the constant.
    terms : list of (ndarray, ndarray)
        Of every group the terms of inputs that vary, among the group's and among all.
    forms : QuadraticForm
        Those of K_m' F' F K_n, m <= n.
    between : QuadraticForm
        Those of K_m' F' F K_0, m > 0, between chi and that of another basis.
    by_term : ndarray of shape (n_outputs, n_parts, n_terms + 1, n_varying)
        Of chi: what the rules of each term that varies add up to, and the output.
    joint : ndarray of shape (n_outputs, n_parts, n_halves, n_varying)
        What ``DeviationTables.joint`` makes of chi.
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
    between: QuadraticForm
    by_term: np.ndarray
    joint: np.ndarray
    own: np.ndarray
    unit: np.ndarray
    n_added: int

    @classmethod
    def of(cls, model, tables, inputs, away, points):
        """The face of the inputs ``away``, in the precision of ``tables``.

        ``points`` are rows (``DerivativeRows``, one point each) at its ``nodes``, of which only the
        values of these inputs count; ``inputs`` are those of the basis functions.
        """
        antecedent = model.antecedent
        edges = np.cumsum([0, *antecedent.share_counts])
        parts = [slice(*ends) for ends in pairwise(edges)]
        place = [own in away for own in antecedent.share_inputs]
        varying = np.flatnonzero(np.append(True, ~np.isin(inputs, away)))
        at_points = [_from_varying(row, parts, place, inputs, away) for row in points]
        differences = nodes(len(away))[1]
        matrices = np.tensordot(differences, np.stack(at_points), axes=1)
        shares = [part for part, is_fixed in zip(parts, place, strict=True) if not is_fixed]
        counts, halves = [part.stop - part.start for part in shares], tables.factor @ matrices
        across = halves.swapaxes(1, 2)[:, None] @ halves
        symmetric = 0.5 * (across + across.swapaxes(2, 3))[np.triu_indices(len(halves))]
        terms, start = [], 0
        for group in antecedent.groups:
            own = np.flatnonzero(~np.isin(group.inputs, away))
            terms.append((own, start + own))
            start += group.n_terms
        maps = _DerivativeMaps(model, tables, inputs, away, points, at_points, differences)
        found = [maps.of_output(k) for k in range(len(tables.unit))]
        by_term, joint, own = (np.stack(one) for one in zip(*found, strict=True))
        return cls(
            shares,
            varying,
            terms,
            QuadraticForm.of(symmetric, counts, varying.size),
            QuadraticForm.between(across[1:, 0], counts, varying.size),
            by_term,
            joint,
            own,
            tables.unit,
            tables.n_added,
        )

    def astype(self, dtype):
        """The same in another precision."""
        arrays = {name: getattr(self, name).astype(dtype) for name in ("by_term", "joint", "own")}
        forms = {name: getattr(self, name).astype(dtype) for name in ("forms", "between")}
        return replace(self, **arrays, **forms)

    def products(self, noise, row, directions, ways=None):
        """Products of h with itself, of h with e, of e with itself, (3, n_outputs, n_rows).

        ``row`` is at the edge, where what varies is what it is at a step inside; ``directions``
        (n_away, n_rows) of the way out are by its rulers. ``ways`` (n_basis, n_rows) are those of
        the basis functions, of inputs that have no terms, or None where there are none. Together
        they are of length one.
        """
        dtype, n_rows = self.joint.dtype, row.basis.shape[1]
        kept = [row.shares[part] for part in self.shares]
        shares = narrowed(np.concatenate(kept or [np.empty((0, n_rows))]), dtype)
        shifts = None if ways is None else STEP * ways[self.basis]
        basis = row.basis[self.basis] if shifts is None else row.basis[self.basis] - shifts
        basis = basis.astype(dtype)
        weights = _weights_of_parts(directions, dtype)
        squares = _squares(weights, self.forms.values(shares, basis))
        if shifts is not None:
            shifts = shifts.astype(dtype)
            self._add_shifts(squares, weights, shares, basis, shifts)
        found = (noise[:, None] / self.unit) ** 2 * squares[:, None]
        if self.joint.shape[2]:
            chi = self._chi(shares, basis)
            turned = None if shifts is None else self._chi(shares, shifts)
            for k in range(len(self.joint)):
                half, change = _sides(self.joint[k], chi, turned, weights)
                if self.own.shape[2]:
                    self._add_own(k, row, chi, turned, weights, (half, change))
                found[:, k] += signed_products(half, change, self.n_added)
        near, both, change = found
        return np.stack([near + 2.0 * both + change, (both + change) / STEP, change / STEP**2])

    def _chi(self, shares, basis):
        counts = np.cumsum([part.stop - part.start for part in self.shares])[:-1]
        factors = [*np.split(shares, counts), basis] if self.shares else [basis]
        n_rows = basis.shape[1]
        return reduce(lambda a, b: (a[:, None] * b).reshape(-1, n_rows), factors)

    def _add_shifts(self, squares, weights, shares, basis, shifts):
        """Add what the change of the basis functions adds to ``_squares``, in place."""
        edge = replace(self.forms, table=self.forms.table[0])
        _, both, change = edge.products(shares, basis, shifts)
        of_parts = np.ones((1, basis.shape[1]), basis.dtype) if weights is None else weights[1][1:]
        between = self.between.summed_between(of_parts, shares, basis, shifts)
        squares[1] += both
        squares[2] += 2.0 * between + change

    def _add_own(self, k, row, chi, turned, weights, both):
        """What derivatives by the terms that vary add, at one step inside and to the change."""
        of_terms = np.concatenate([own for _, own in self.terms])
        shares = narrowed(row.shares[of_terms], chi.dtype)
        sums = _sides(self.by_term[k], chi, turned, weights)
        for own_sums, part in zip(sums, both, strict=True):
            by_term = own_sums[:-1] - shares * own_sums[-1]
            start, changes = 0, []
            for (own, _), gradient in zip(self.terms, row.gradients, strict=True):
                of_group = by_term[start : start + own.size]
                change = gradient[:, own].astype(chi.dtype) * of_group
                changes.append(change.reshape(-1, chi.shape[1]))
                start += own.size
            part += self.own[k] @ np.concatenate(changes)


def _squares(weights, values):
    """Products of h with itself, of h with e, of e with itself, (3, n_rows), by those of parts."""
    if weights is None:
        return values
    once, change = weights
    # Of all pairs; those of m > n are those of n < m.
    by_pair = values[pair_index(len(once))]
    near, far = (np.einsum("mpn,pn->mn", by_pair, one) for one in weights)
    return np.stack(
        [np.einsum("mn,mn->n", *pair) for pair in ((once, near), (change, near), (change, far))]
    )


def _sides(matrices, chi, turned, weights):
    """What matrices (n_parts, n, n_varying) make of chi at one step inside, and its change.

    ``turned`` is what chi itself changes by, or None.
    """
    n_parts, n, n_varying = matrices.shape
    if weights is None:
        half, change = np.tensordot(matrices, chi, axes=1)
    elif n > n_varying:
        flat = matrices.transpose(1, 0, 2).reshape(n, n_parts * n_varying)
        half, change = (flat @ row_products([one, chi], chi) for one in weights)
    else:
        parts = np.tensordot(matrices, chi, axes=1)
        half, change = (np.einsum("mn,mqn->qn", one, parts) for one in weights)
    if turned is not None:
        change += matrices[0] @ turned
    return half, change


def _from_varying(row, parts, place, inputs, away):
    """K: the design of rows with the shares and the basis functions of inputs of one row."""
    factors = [
        row.shares[part, :1] if is_fixed else np.eye(part.stop - part.start)
        for part, is_fixed in zip(parts, place, strict=True)
    ]
    is_away = np.append(False, np.isin(inputs, away))
    of_basis = np.eye(row.basis.shape[0])[:, ~is_away]
    of_basis[is_away, 0] = row.basis[is_away, 0]
    return reduce(np.kron, [*factors, of_basis])


class _DerivativeMaps:
    """What makes derivatives by the premises of chi."""

    def __init__(self, model, tables, inputs, away, points, at_points, differences):
        antecedent, self.tables, self.points = model.antecedent, tables, points
        self.at_points, self.differences = np.stack(at_points), differences
        columns = np.concatenate([[0], 1 + inputs]) if model.order == 1 else [0]
        widths = np.concatenate([[1.0], model.spread[inputs]])
        self.coefficients = model.coefficients[:, columns] * widths[:, None]
        self.contains = antecedent.sum_over_rules(np.eye(antecedent.n_rules))
        inputs_of_terms = np.concatenate([g.inputs for g in antecedent.groups])
        self.is_fixed = np.isin(inputs_of_terms, away)
        self.of_parameters = np.concatenate(
            [np.tile(np.isin(g.inputs, away), len(g.theta)) for g in antecedent.groups]
        )

    def of_output(self, k):
        """``by_term``, ``joint`` and ``own`` of one output."""
        unit, n_premises = self.tables.unit[k], self.tables.n_premises
        coefficients = self.coefficients[:, :, k] / unit
        sums = (self.contains[:, :, None] * coefficients).reshape(len(self.contains), -1)
        # Of every term the rules that have it, then of all rules: the output.
        sums = np.vstack([sums, coefficients.ravel()])
        # Differences come first, of which no digits are lost thereafter.
        matrices = np.tensordot(self.differences, self.at_points, axes=1)
        by_term = sums[np.append(~self.is_fixed, True)] @ matrices
        joint = self.tables.joint[k]
        premises, consequents = joint[:, :n_premises], joint[:, n_premises:]
        sides = consequents @ matrices
        if not n_premises:
            return by_term, sides, premises
        at_points = [
            self._of_fixed(row, sums @ one)
            for row, one in zip(self.points, self.at_points, strict=True)
        ]
        fixed = np.tensordot(self.differences, np.stack(at_points), axes=1)
        sides = sides + premises[:, self.of_parameters] @ fixed
        return by_term, sides, premises[:, ~self.of_parameters]

    def _of_fixed(self, row, sums):
        """Derivatives by the parameters of the edge's own terms, of chi, (n, n_varying)."""
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
