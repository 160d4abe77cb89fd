r"""Rows out of the range: products of what is known at its edge and of what that changes by.

On a face of the range one input stands still, and far fewer columns do.

Most rows out of the range leave it along one input j alone. The shares of j and its basis function
are then the same numbers for all of them, at the edge and at a step inside. With chi the products
of the other inputs' shares and basis functions, the design and what it changes by over a step are

    phi = K_0 chi ,    change of phi = K_1 chi ,

with two matrices that are found once for every face: of 6 x 6 terms on three inputs chi has 18
entries and phi 144; of an input without terms K_1 has no columns but those of the constant. Of
F phi only inner products are needed, which a QR decomposition of [F K_0, F K_1] does not change: it
leaves a triangle for the one, and no more rows for the other than both have columns.
"""

from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import blas

from .antecedent import Antecedent
from .deviation import inner_products

__all__ = ["Face", "faces_of", "products_off_faces", "products_on_face"]

# Rows of a block on one face, from which on its tables are worth their while.
_ENOUGH = 64
# Columns of the design up to which there are any: they are kept, half a megabyte of each face.
_MOST_COLUMNS = 512


def faces_of(way, antecedent: Antecedent, n_columns):
    """Rows that leave the range along one input alone: (input, side, rows), if they are enough.

    ``way`` (n_inputs, n_rows) leads from the range to the rows; of a design of ``n_columns``.
    """
    if n_columns > _MOST_COLUMNS or None in antecedent.share_inputs:
        return
    outside = way != 0.0
    alone = outside.sum(axis=0) == 1
    for j in np.flatnonzero(outside.any(axis=1)):
        for side in (-1, 1):
            rows = np.flatnonzero(alone & (side * way[j] > 0.0))
            if rows.size >= _ENOUGH:
                yield int(j), side, rows


@dataclass(frozen=True, eq=False)
class Face:
    """What rows on one face are multiplied with.

    Attributes
    ----------
    shares : list of slice
        Of the inputs that vary.
    basis : ndarray of int
        The basis functions that vary, and the constant.
    changing : ndarray of int or slice
        The entries of chi that K_1 has columns for.
    half, change : ndarray of shape (n_varying, n_varying) and (n_halves, n_changing)
        F K_0, an upper triangle, and F K_1, both turned.
    joint_half, joint_change : ndarray of shape (n_outputs, n_displacements + n_pinned, ...)
        What ``DeviationTables.joint`` makes of K_0 chi and K_1 chi.
    """

    shares: list[slice]
    basis: np.ndarray
    changing: Any
    half: np.ndarray
    change: np.ndarray
    joint_half: np.ndarray
    joint_change: np.ndarray

    @classmethod
    def of(cls, antecedent, tables, inputs, j, once, twice):
        """The face of input j, of the range or a step inside: ``once`` and ``twice`` inside.

        These are rows (``DerivativeRows``, of which one point is enough) where only the values of
        input j count; ``inputs`` are those of the basis functions.
        """
        edges = np.cumsum([0, *antecedent.share_counts])
        parts = [slice(*ends) for ends in pairwise(edges)]
        place = [own == j for own in antecedent.share_inputs]
        varying = np.flatnonzero(np.append(True, inputs != j))
        both = []
        for row in (once, twice):
            factors = [
                row.shares[part, :1] if is_fixed else np.eye(part.stop - part.start)
                for part, is_fixed in zip(parts, place, strict=True)
            ]
            of_basis = np.eye(row.basis.shape[0])[:, varying]
            of_basis[np.append(False, inputs == j), 0] = row.basis[1:, 0][inputs == j]
            both.append(reduce(np.kron, [*factors, of_basis]))
        half, change = both[0], both[0] - both[1]
        n_varying, columns = half.shape[1], np.flatnonzero(change.any(axis=0))
        change = change[:, columns]
        turned = np.asarray(np.linalg.qr(tables.factor @ np.hstack([half, change]), mode="r"))
        joint = tables.joint[:, :, tables.n_premises :]
        return cls(
            [part for part, is_fixed in zip(parts, place, strict=True) if not is_fixed],
            varying,
            slice(None) if columns.size == n_varying else columns,
            turned[:n_varying, :n_varying],
            turned[:, n_varying:],
            joint @ half,
            joint @ change,
        )

    def astype(self, dtype):
        """The same in another precision."""
        names = ("half", "change", "joint_half", "joint_change")
        return replace(self, **{name: getattr(self, name).astype(dtype) for name in names})

    def halves(self, design):
        """Inner products of F phi with itself, with its change, of that, each (n_rows,)."""
        # Half the work of a full product.
        product = blas.get_blas_funcs("trmm", dtype=design.dtype)
        half = product(1.0, self.half.T, design.T, side=1, lower=1).T
        change = self.change @ design[self.changing]
        pairs = (half, half), (half, change[: len(half)]), (change, change)
        return np.stack([np.einsum("pn,pn->n", *pair) for pair in pairs])

    def joints(self, k, design):
        """What ``DeviationTables.joint`` makes of phi and of its change, for output k."""
        return self.joint_half[k] @ design, self.joint_change[k] @ design[self.changing]

    def design(self, row):
        """Chi of rows on the face, (n_varying, n_rows), in the precision of these tables."""
        dtype, n_rows = self.half.dtype, row.basis.shape[1]
        factors = [row.shares[part].astype(dtype, copy=False) for part in self.shares]
        factors.append(row.basis[self.basis].astype(dtype, copy=False))
        return reduce(lambda a, b: (a[:, None] * b).reshape(-1, n_rows), factors)


def products_off_faces(noise, tables, once, twice):
    """Products of h with itself, h with e, e with itself, (3, n_outputs, n_rows).

    Both are linear in the rows of the design and of d: they are subtracted first, and F, T and
    B_k applied to h and e alone.
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
            found[:, k] += inner_products(half, change, tables.signed)
    return found


def products_on_face(noise, tables, face, once, twice):
    """The same of rows on one face, by far fewer columns."""
    design, n_premises = face.design(once), tables.n_premises
    found = (noise[:, None] / tables.unit) ** 2 * face.halves(design)[:, None]
    if tables.joint.shape[1]:
        for k, joint in enumerate(tables.joint):
            half, change = face.joints(k, design)
            if n_premises:
                changes = _changes(tables, once, twice, k).astype(tables.dtype)
                half += joint[:, :n_premises] @ changes[0]
                change += joint[:, :n_premises] @ changes[1]
            found[:, k] += inner_products(half, change, tables.signed)
    return found


def _changes(tables, once, twice, k):
    """Derivatives by the premises, and what they change by, (2, n_parameters, n_rows)."""
    first, second = (one.changes(k, tables.unit) for one in (once, twice))
    return np.stack([first, first - second])
