"""Variance of the tangent out of the range: by which products, on a line, on faces or elsewhere.

Rows of a block are sorted by the inputs that they leave the range along (see ``faces``). What a
face multiplies rows with is found when the first rows lie on it, and kept; in single precision
where that is right to ``SINGLE_DIGITS`` at points all over the face, however far out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .deviation import DerivativeRows, DeviationTables
from .faces import STEP, Face, nodes, products_off_faces, products_on_line
from .leaving import on_faces
from .shortest import SINGLE_DIGITS, points_of_range

__all__ = ["Outside"]

# Points of a face, and standard deviations beyond it, at which precisions are compared.
_N_COMPARED, _LENGTHS = 512, (0.0, 0.3, 3.0, 100.0)
# Faces whose tables are kept: of five inputs with terms there are 242, of some 50 kB.
_MOST_FACES = 256


@dataclass(frozen=True, eq=False)
class Outside:
    """Rows out of a model's range.

    Attributes
    ----------
    posterior : Posterior
        Whose noise and inputs these are.
    model : TSKModel
    tables : DeviationTables
        In the precision that is asked for.
    double : DeviationTables
        In double precision.
    row_of : callable
        The derivative rows (``DerivativeRows``) at points (n_inputs, n_points) of the range.
    faces : dict
        Those that are found already.
    """

    posterior: Any
    model: Any
    tables: DeviationTables
    double: DeviationTables
    row_of: Callable[[np.ndarray], DerivativeRows]
    faces: dict

    def squares(self, row, Z, way):
        """Variance with the noise, (n_outputs, n_rows), in squares of the tables' unit.

        Z is the nearest point of the range, ``row`` the derivative rows there, ``way`` the way from
        there, (n_inputs, n_rows).
        """
        model, tables, noise = self.model, self.tables, self.posterior.noise
        below, above = tables.rulers[:, :, None]
        length = np.sqrt(np.sum((way / np.where(way < 0.0, below, above)) ** 2, axis=0))
        found = np.empty((3, noise.size, Z.shape[1]))
        left = np.full(Z.shape[1], True)
        n_columns = self.posterior.consequents.shape[0]
        for away, rows, leaves_others in on_faces(way, model.antecedent, n_columns):
            if away and leaves_others and tables is self.double:
                # To all digits these are found as those elsewhere are.
                continue
            part = slice(None) if rows.size == left.size else rows
            some, some_way = row.part(part), way[:, part] / length[part]
            if away is None:
                ways = some_way / model.spread[:, None]
                found[:, :, part] = products_on_line(self.posterior, model, tables, some, ways)
            else:
                found[:, :, part] = self._on_face(away, some, some_way, leaves_others)
            left[rows] = False
        if left.any():
            part = slice(None) if left.all() else left
            step = way[:, part] * (STEP / np.maximum(length[part], np.finfo(float).tiny))
            once, twice = (self.row_of(Z[:, part] - k * step) for k in (1, 2))
            found[:, :, part] = products_off_faces(noise, tables, once, twice)
        return self._square(found, length)

    def _on_face(self, away, row, way, leaves_others):
        """Products of rows on a face, ``way`` of length one by the rulers."""
        inputs, own = [j for j, _ in away], self.posterior.inputs
        by = np.array([self.tables.rulers[int(side > 0), j] for j, side in away])
        directions, ways = np.abs(way[inputs]) / by[:, None], None
        if leaves_others:
            ways = np.zeros(row.basis.shape)
            if self.model.order == 1:
                np.divide(way[own], self.model.spread[own, None], out=ways[1:])
        return self._face(away).products(self.posterior.noise, row, directions, ways)

    def _face(self, away):
        """What rows beyond the ends of some inputs, (input, side) each, are multiplied with."""
        model, double, at = self.model, self.double, self.model.minimum.copy()
        for j, side in away:
            at[j] = (model.maximum if side > 0 else model.minimum)[j]
        key = away, at.tobytes(), self.tables.dtype
        if key not in self.faces:
            inputs, inside = [j for j, _ in away], nodes(len(away))[0]
            steps = np.array([STEP * side * double.rulers[int(side > 0), j] for j, side in away])
            points = np.tile(at[:, None], len(inside))
            points[inputs] -= steps[:, None] * inside.T
            rows = [self.row_of(np.ascontiguousarray(one[:, None])) for one in points.T]
            face = Face.of(model, double, self.posterior.inputs, inputs, rows)
            if self.tables is not double:
                face = self._quickest(face, inputs, at)
            if len(self.faces) >= _MOST_FACES:
                self.faces.clear()
            self.faces[key] = face
        return self.faces[key]

    def _quickest(self, face, inputs, at):
        """The same in single precision where deviations are right to ``SINGLE_DIGITS`` by it."""
        rng = np.random.default_rng(0)
        Z = points_of_range(self.model, _N_COMPARED, rng)
        Z[inputs] = at[inputs, None]
        row, single = self.row_of(Z), face.astype(np.float32)
        directions = np.abs(rng.normal(size=(len(inputs), _N_COMPARED)))
        ways = rng.normal(size=row.basis.shape)
        ways[0] = 0.0
        # Half of them leave the range along inputs without terms too.
        ways[:, ::2] = 0.0
        length = np.sqrt(np.sum(directions**2, axis=0) + np.sum(ways[face.basis] ** 2, axis=0))
        right, found = (
            one.products(self.posterior.noise, row, directions / length, ways / length)
            for one in (face, single)
        )
        for length in _LENGTHS:
            squares = [self._square(one, length) for one in (right, found)]
            # A part of a square is twice that of its root.
            if not (np.abs(squares[1] - squares[0]) <= 2.0 * SINGLE_DIGITS * squares[0]).all():
                return face
        return single

    def _square(self, products, length):
        """The tangent's variance, with the noise, so many standard deviations on the way."""
        near, both, change = products
        noise = (self.posterior.noise[:, None] / self.tables.unit) ** 2
        square = noise + near + 2.0 * np.maximum(both * length, 0.0)
        square += np.maximum(change, 0.0) * length**2
        return np.maximum(square, noise, out=square)
