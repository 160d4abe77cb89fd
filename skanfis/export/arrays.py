"""Predictions by the operations of another array library, where its arrays are.

The formula is the one of :mod:`skanfis.export.onnx`, which takes a few operations of a graph; here
they are carried out at once, in the functions of the array API standard. NumPy arrays go another
way, in place and in fewer calls: see ``model``.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..blocks import LARGE_BLOCK_ROWS, row_blocks
from ._graph import Value
from ._numbers import Numbers
from .onnx import Formula

__all__ = ["predict_in"]


def predict_in(xp, model, X):
    """Outputs (n_rows, n_outputs) of a model, as the array library has them.

    Parameters
    ----------
    xp : module
        Namespace of the array API standard.
    model : TSKModel
        With another policy out of bounds than "raise".
    X : array of the library, of shape (n_rows, n_inputs)
        Finite, of type float32 or float64, in which all is computed.

    Raises
    ------
    ValueError
        If a membership is of a family of one's own, which has no such formula, or a number is
        beyond what the type holds.
    """
    dtype = np.float32 if X.dtype == xp.float32 else np.float64
    formula = Formula(Numbers.of(model, dtype), model.out_of_bounds, _AtOnce(xp, X, dtype))
    found = []
    for part in row_blocks(X.shape[0], LARGE_BLOCK_ROWS):
        found.append(formula.outputs(Value(formula.graph, X[part, :])).name)
    return found[0] if len(found) == 1 else xp.concat(found, axis=0)


class _AtOnce:
    """As :class:`~skanfis.export._graph.Graph`: a node is its result, and a value's name too."""

    def __init__(self, xp, like, dtype):
        self.xp, self.dtype = xp, np.dtype(dtype)
        self._type, self._device = like.dtype, like.device

    def node(self, operation, *inputs, **attributes):
        """The result of an operation of ONNX; inputs that are no values become arrays."""
        operate = _OPERATIONS[operation]
        if operation in _WITH_NUMBERS:
            first, numbers = inputs
            arrays = self._array(first), self._numbers(operation, numbers)
        else:
            arrays = tuple(map(self._array, inputs))
        return Value(self, operate(self.xp, *arrays, **attributes))

    def _array(self, value):
        if isinstance(value, Value):
            return value.name
        numbers = np.asarray(value)
        flat = self.xp.asarray(numbers.ravel().tolist(), dtype=self._type, device=self._device)
        return self.xp.reshape(flat, numbers.shape)

    def _numbers(self, operation, numbers):
        numbers = numbers.tolist()
        if operation != "Gather":
            return tuple(numbers)
        return self.xp.asarray(numbers, dtype=self.xp.int64, device=self._device)


def _sigmoid(xp, x):
    small = xp.exp(-xp.abs(x))  # overflows nowhere
    return xp.where(x < 0, small, xp.ones_like(x)) / (1.0 + small)


def _softmax(xp, x, axis):
    powers = xp.exp(x - xp.max(x, axis=axis, keepdims=True))
    return powers / xp.sum(powers, axis=axis, keepdims=True)


# Their second input are whole numbers.
_WITH_NUMBERS = ("Gather", "Reshape", "ReduceSum")
_OPERATIONS: dict[str, Callable[..., Any]] = {
    "Add": lambda xp, x, y: x + y,
    "Sub": lambda xp, x, y: x - y,
    "Mul": lambda xp, x, y: x * y,
    "Div": lambda xp, x, y: x / y,
    "MatMul": lambda xp, x, y: x @ y,
    "Neg": lambda xp, x: -x,
    "Less": lambda xp, x, y: x < y,
    "Greater": lambda xp, x, y: x > y,
    "Min": lambda xp, x, y: xp.minimum(x, y),
    "Max": lambda xp, x, y: xp.maximum(x, y),
    "Exp": lambda xp, x: xp.exp(x),
    "Log": lambda xp, x: xp.log(x),
    "Abs": lambda xp, x: xp.abs(x),
    "Sigmoid": _sigmoid,
    "Softmax": _softmax,
    "Where": lambda xp, x, y, z: xp.where(x, y, z),
    "Identity": lambda xp, x: x,
    "Concat": lambda xp, *x, axis: xp.concat(x, axis=axis),
    "Gather": lambda xp, x, places, axis: xp.take(x, places, axis=axis),
    # Zero stands for the length that is there.
    "Reshape": lambda xp, x, shape: xp.reshape(x, (x.shape[0], *shape[1:])),
    "ReduceSum": lambda xp, x, axes, keepdims: xp.sum(x, axis=axes, keepdims=bool(keepdims)),
}
