r"""The sums over rows that the consequents are solved from, at premises that stay.

    G = sum s phi phi' ,    c = sum s phi y ,    q = sum s y^2 ,    W = sum s ,

with phi = w(x) (x) [1, z], inputs and targets standardised by all rows that are in the sums. They
add over rows: rows that come later, and rows that another machine has seen, are a sum away.
Disagreement and centres of rules are row sums of G (see ``penalty`` and ``consequent``).
"""

from dataclasses import dataclass, replace

import numpy as np

from ..antecedent import Antecedent
from ..blocks import fitting_rows, row_blocks
from ..consequent import basis
from ..learning.data import Scale, StandardisedData
from ..learning.gram import DesignMoments
from .scales import Change, merged_scale

__all__ = ["Moments", "blocks"]


def blocks(rows: StandardisedData, antecedent: Antecedent, n_more=0):
    """Slices of rows whose intermediate results take a bounded number of bytes."""
    n_values = 4 * (antecedent.n_rules + antecedent.n_terms + rows.X.shape[1]) + n_more
    return row_blocks(rows.n_rows, fitting_rows(n_values))


@dataclass(frozen=True, eq=False)
class Moments:
    """The sums, and the scales that they are on.

    Attributes
    ----------
    inputs, targets : Scale
    weight, squared_weight : float
        W and the sum of squares of the weights.
    gram : ndarray of shape (n_columns, n_columns)
    slope : ndarray of shape (n_columns, n_outputs)
    square : ndarray of shape (n_outputs,)
    consequent_inputs : ndarray of int
    """

    inputs: Scale
    targets: Scale
    weight: float
    squared_weight: float
    gram: np.ndarray
    slope: np.ndarray
    square: np.ndarray
    consequent_inputs: np.ndarray

    @classmethod
    def of(cls, rows: StandardisedData, antecedent: Antecedent, consequent_inputs):
        """The sums over rows, on the rows' own scales; the antecedent is in the units of X."""
        n_basis, n_outputs = 1 + consequent_inputs.size, rows.y.shape[1]
        design = DesignMoments(antecedent.share_counts, n_basis)
        sums = np.zeros(design.shape, order="F")
        slope, square = np.zeros((antecedent.n_rules * n_basis, n_outputs)), np.zeros(n_outputs)
        for part in blocks(rows, antecedent, sum(design.shape)):
            Z, target, weight = rows.read(part)
            basis_rows = basis(Z[consequent_inputs])
            weighted = basis_rows if weight is None else basis_rows * weight
            raw = np.array(rows.X[part].T, dtype=float, order="C")
            strengths, shares = antecedent.strengths_and_shares(raw)
            design.accumulate(sums, shares, basis_rows, weighted)
            for k, values in enumerate(target):
                slope[:, k] += (strengths @ (weighted * values).T).ravel()
                square[k] += weighted[0] @ values**2
        weight = rows.sample_weight
        squared = float(rows.n_rows) if weight is None else float(np.sum(weight**2))
        return cls(
            rows.inputs,
            rows.targets,
            rows.total_weight,
            squared,
            design.gram(sums),
            slope,
            square,
            consequent_inputs,
        )

    @property
    def n_basis(self):
        """Columns of the design per rule."""
        return 1 + self.consequent_inputs.size

    @property
    def n_rules(self):
        """Rules."""
        return self.slope.shape[0] // self.n_basis

    @property
    def effective_weight(self):
        """Rows by weight, as ``structure.sample`` counts them."""
        return max(self.weight, self.weight**2 / self.squared_weight)

    def on(self, inputs: Scale, targets: Scale):
        """The same sums on other scales."""
        of_inputs = Change.of(self.inputs, inputs).only(self.consequent_inputs)
        of_targets = Change.of(self.targets, targets)
        # sum s phi, since strengths sum to one; and sum s y likewise.
        every = self.gram[:, :: self.n_basis].sum(axis=1)
        total = self.slope[:: self.n_basis].sum(axis=0)
        t, g = of_targets.shift, of_targets.factor
        return replace(
            self,
            inputs=inputs,
            targets=targets,
            gram=of_inputs.of_square(self.gram),
            slope=of_inputs.of_rows(g * self.slope + t * every[:, None]),
            square=g**2 * self.square + 2.0 * t * g * total + t**2 * self.weight,
        )

    def faded(self, factor):
        """The sums with all weights times a factor."""
        return replace(
            self,
            weight=factor * self.weight,
            squared_weight=factor**2 * self.squared_weight,
            gram=factor * self.gram,
            slope=factor * self.slope,
            square=factor * self.square,
        )

    def plus(self, other):
        """The sums over the rows of both, on the scales of all of them."""
        weights = self.weight, other.weight
        inputs = merged_scale(self.inputs, weights[0], other.inputs, weights[1])
        targets = merged_scale(self.targets, weights[0], other.targets, weights[1])
        one, two = self.on(inputs, targets), other.on(inputs, targets)
        return replace(
            one,
            weight=one.weight + two.weight,
            squared_weight=one.squared_weight + two.squared_weight,
            gram=one.gram + two.gram,
            slope=one.slope + two.slope,
            square=one.square + two.square,
        )

    def __getstate__(self):
        """Half of the symmetric matrix is enough in a file."""
        half = self.gram[np.triu_indices(self.gram.shape[0])]
        return {**self.__dict__, "gram": half}

    def __setstate__(self, state):
        n = state["slope"].shape[0]
        gram = np.zeros((n, n))
        gram[np.triu_indices(n)] = state["gram"]
        gram += np.triu(gram, 1).T
        self.__dict__.update(state, gram=gram)
