"""How an input of a model comes from a raw column, and back.

The box needs care. Its edges are rows of the training data, and the edge computed back from z may
differ from the row's x in the last bit: the row would then be out of bounds. The edge taken is
therefore the outermost x that the scaler's own arithmetic maps into the box of z.
"""

import operator
from dataclasses import dataclass, replace

import numpy as np

from ._one_hot import Indicator

__all__ = ["Column"]

_INVERSE = {
    operator.sub: operator.add,
    operator.add: operator.sub,
    operator.truediv: operator.mul,
    operator.mul: operator.truediv,
}


@dataclass(frozen=True)
class Column:
    """How a column comes from a raw one: arithmetic with numbers, in the scaler's own order.

    With an indicator, from that of one category of the raw column.
    """

    source: int
    operations: tuple = ()
    indicator: Indicator | None = None

    @property
    def key(self):
        """What orders the inputs, and no two of them share."""
        return self.source, -1 if self.indicator is None else self.indicator.place

    def then(self, operations):
        return replace(self, operations=(*self.operations, *operations))

    def forward(self, x):
        for operation, number in self.operations:
            x = operation(x, number)
        return x

    def backward(self, z):
        for operation, number in reversed(self.operations):
            z = _INVERSE[operation](z, number)
        return z

    def offset_and_scale(self):
        """Of x = offset + scale z."""
        offset, scale = 0.0, 1.0
        for operation, number in self.operations:
            if operation is operator.sub:
                offset += number * scale
            elif operation is operator.add:
                offset -= number * scale
            elif operation is operator.truediv:
                scale *= number
            else:
                scale /= number
        return offset, scale

    def outermost(self, edge, side):
        """The outermost x, to the ``side`` (-1 or 1), that is mapped to no more than ``edge``."""
        guess = self.backward(edge)
        if not self.operations or not np.isfinite(guess):
            return guess

        def is_inside(x):
            return side * self.forward(x) <= side * edge

        offset, _ = self.offset_and_scale()
        step = side * np.spacing(max(abs(guess), abs(offset)))
        inner, outer = guess, guess
        while not is_inside(inner):
            inner, step = inner - step, 2.0 * step
        while is_inside(outer):
            outer, step = outer + step, 2.0 * step
        while (middle := inner + 0.5 * (outer - inner)) not in (inner, outer):
            inner, outer = (middle, outer) if is_inside(middle) else (inner, middle)
        return inner
