"""Arithmetic that writes an ONNX graph: every operation on a :class:`Value` becomes a node."""

from functools import partialmethod

import numpy as np

__all__ = ["Graph", "Value"]


class Graph:
    """Where nodes and constants go: skl2onnx's scope and container, for one type of number."""

    def __init__(self, scope, container, dtype):
        self.scope, self.container, self.dtype = scope, container, np.dtype(dtype)

    def value(self, name):
        """What goes by this name already."""
        return Value(self, name)

    def node(self, operation, *inputs, output=None, **attributes):
        """The output of a new node; inputs that are no values become constants."""
        output = output or self.scope.get_unique_variable_name(operation.lower())
        self.container.add_node(
            operation,
            [self._name_of(one) for one in inputs],
            output,
            name=self.scope.get_unique_operator_name(operation),
            op_version=self.container.target_opset,
            **attributes,
        )
        return Value(self, output)

    def _name_of(self, value):
        if isinstance(value, Value):
            return value.name
        array = np.asarray(value)
        if array.dtype.kind == "f" or not array.ndim:
            array = array.astype(self.dtype)
        from onnx import helper

        name = self.scope.get_unique_variable_name("constant")
        kind = helper.np_dtype_to_tensor_dtype(array.dtype)
        self.container.add_initializer(name, kind, list(array.shape), array.ravel().tolist())
        return name


class Value:
    """A tensor of the graph, its first axis the rows."""

    def __init__(self, graph, name):
        self.graph, self.name = graph, name

    def _node(self, operation, *others, **attributes):
        return self.graph.node(operation, self, *others, **attributes)

    __add__ = partialmethod(_node, "Add")
    __sub__ = partialmethod(_node, "Sub")
    __mul__ = partialmethod(_node, "Mul")
    __truediv__ = partialmethod(_node, "Div")
    __matmul__ = partialmethod(_node, "MatMul")
    __neg__ = partialmethod(_node, "Neg")
    __lt__ = partialmethod(_node, "Less")
    __gt__ = partialmethod(_node, "Greater")
    exp = partialmethod(_node, "Exp")
    log = partialmethod(_node, "Log")
    abs = partialmethod(_node, "Abs")
    # 1 / (1 + exp(-self)).
    sigmoid = partialmethod(_node, "Sigmoid")
    # The smaller of the two, and the larger.
    at_most = partialmethod(_node, "Min")
    at_least = partialmethod(_node, "Max")
    # Of a comparison: one value where it holds, another where not.
    where = partialmethod(_node, "Where")

    def softmax(self):
        """Normalised exponentials along the columns."""
        return self._node("Softmax", axis=1)

    def columns(self, positions):
        """Columns at these positions, in their order."""
        return self._node("Gather", np.asarray(positions, dtype=np.int64), axis=1)

    def reshape(self, *shape):
        """Another shape after the axis of the rows."""
        return self._node("Reshape", np.array([0, *shape], dtype=np.int64))

    def sum(self, keep):
        """Over axis 1, which stays with length one if ``keep``."""
        return self._node("ReduceSum", np.array([1], dtype=np.int64), keepdims=int(keep))
