"""Convert models to ONNX: a converter that skl2onnx uses for estimators, alone or in pipelines.

The graph computes what the model computes, in the same order: inputs clipped to the box, log
memberships, strengths by a softmax over the rules, consequents weighted by the strengths. For
"linear", the derivative along the way out of the box goes through the same operations.
"""

from functools import partialmethod
from typing import Any

import numpy as np

from ._families import FORMULAS
from ._numbers import Numbers
from .folding import fold

# The first version with Softmax along one axis, and ReduceSum with axes as an input.
_OLDEST_OPSET = 13
# onnxruntime drops the addition of a scalar that is zero in single precision.
_TAKEN_FOR_ZERO = 1e-45


def register_onnx_converter() -> None:
    """Teach skl2onnx to convert :class:`skanfis.ANFISRegressor`, alone or in a pipeline.

    Inputs give a graph in double precision if one of them is double, else in single precision.
    ``out_of_bounds`` becomes part of the graph, save "raise", which is refused with a ValueError; a
    row that is not finite gives NaN. ImportError if skl2onnx is not installed.

    Examples
    --------
    >>> import pytest
    >>> skl2onnx = pytest.importorskip("skl2onnx")
    >>> from skanfis import ANFISRegressor
    >>> from skanfis.datasets import make_jang_sinc
    >>> from skanfis.export import register_onnx_converter
    >>> register_onnx_converter()
    >>> X, y = make_jang_sinc()
    >>> skl2onnx.to_onnx(ANFISRegressor(n_mfs=4).fit(X, y), X[:1]).graph.output[0].name
    'variable'
    """
    try:
        from skl2onnx import update_registered_converter
    except ImportError as error:
        raise ImportError(
            "register_onnx_converter needs skl2onnx: pip install skl2onnx onnxruntime (the extra "
            "'onnx'; in a clone pip install '.[onnx]')."
        ) from error
    from .. import ANFISRegressor

    update_registered_converter(
        ANFISRegressor, "SkanfisANFISRegressor", _set_shapes, _convert, overwrite=True
    )


def _set_shapes(node):
    """Type and shape of the output."""
    from skl2onnx.common.data_types import DoubleTensorType, FloatTensorType

    is_double = any(isinstance(given.type, DoubleTensorType) for given in node.inputs)
    kind = DoubleTensorType if is_double else FloatTensorType
    n_outputs = node.raw_operator._fitted_model().n_outputs
    node.outputs[0].type = kind([node.inputs[0].get_first_dimension(), n_outputs])


def _convert(scope, node, container):
    """Write the model of ``node.raw_operator`` as nodes."""
    from onnx import TensorProto
    from skl2onnx.common.data_types import DoubleTensorType

    if container.target_opset < _OLDEST_OPSET:
        raise ValueError(
            f"target_opset={container.target_opset} is too old for an ANFIS: it takes "
            f"{_OLDEST_OPSET} or newer."
        )
    model = fold(node.raw_operator)
    if model.out_of_bounds == "raise":
        raise ValueError(
            "out_of_bounds='raise' has no counterpart in ONNX, where no value makes a graph fail: "
            "set_params(out_of_bounds='nan') before the conversion marks such rows."
        )
    is_double = isinstance(node.outputs[0].type, DoubleTensorType)
    dtype, kind = (np.float64, TensorProto.DOUBLE) if is_double else (np.float32, TensorProto.FLOAT)
    graph = _Graph(scope, container, np.dtype(dtype))
    # One input with all columns, or, from a frame, one per column, in any order.
    named, given = {one.raw_name: one for one in node.inputs}, node.inputs
    if named.keys() == set(model.input_names):
        given = [named[name] for name in model.input_names]
    parts = [graph.node("Cast", _Value(graph, one.full_name), to=kind) for one in given]
    y = _Formula(Numbers(model, dtype), graph).outputs(graph.node("Concat", *parts, axis=1))
    graph.node("Identity", y, output=node.outputs[0].full_name)


class _Graph:
    """Where nodes and constants go: skl2onnx's scope and container, for one type of number."""

    def __init__(self, scope, container, dtype):
        self.scope, self.container, self.dtype = scope, container, dtype

    def node(self, operation, *inputs, output=None, **attributes):
        """Add a node and return its output; inputs that are not of the graph become constants."""
        output = output or self.scope.get_unique_variable_name(operation.lower())
        self.container.add_node(
            operation,
            [one.name if isinstance(one, _Value) else self._constant(one) for one in inputs],
            output,
            name=self.scope.get_unique_operator_name(operation),
            op_version=self.container.target_opset,
            **attributes,
        )
        return _Value(self, output)

    def _constant(self, value):
        from onnx import helper

        array = np.asarray(value)
        if array.dtype.kind == "f" or not array.ndim:
            array = array.astype(self.dtype)
        if array.size == 1 and 0.0 < abs(array.item()) < _TAKEN_FOR_ZERO:
            raise ValueError(
                f"onnxruntime takes {array.item():g}, of the model, for zero: scale the data."
            )
        name = self.scope.get_unique_variable_name("constant")
        kind = helper.np_dtype_to_tensor_dtype(array.dtype)
        self.container.add_initializer(name, kind, list(array.shape), array.ravel().tolist())
        return name


class _Value:
    """A tensor of the graph, its first axis the rows; every operation on it becomes a node."""

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
    at_most = partialmethod(_node, "Min")
    at_least = partialmethod(_node, "Max")
    # Method of a comparison: one value where it holds, another where it does not.
    where = partialmethod(_node, "Where")
    softmax = partialmethod(_node, "Softmax", axis=1)

    def columns(self, positions):
        return self._node("Gather", np.asarray(positions, dtype=np.int64), axis=1)

    def reshape(self, *shape):
        """Another shape after the axis of the rows."""
        return self._node("Reshape", np.array([0, *shape], dtype=np.int64))

    def sum(self, keep=True):
        """Sum over axis 1, which is kept with length one if ``keep``."""
        return self._node("ReduceSum", np.array([1], dtype=np.int64), keepdims=int(keep))


class _Formula:
    """The model's formula, written with values of a graph."""

    def __init__(self, numbers, graph):
        self.numbers, self.graph, self.policy = numbers, graph, numbers.model.out_of_bounds

    def outputs(self, x):
        """The outputs (n_rows, n_outputs) at inputs (n_rows, n_inputs)."""
        numbers, way_out = self.numbers, None
        group: Any = None
        inside = x.at_least(numbers.low).at_most(numbers.high)
        # Zero, unless an input is infinite or not a number: then NaN, also for a held input.
        not_finite = (x - x).sum()
        z = inside - numbers.reference
        if self.policy == "linear":
            followed = (x - inside).at_least(-numbers.reach).at_most(numbers.reach)
            # Derivatives are taken along a part of the way only, since products could overflow.
            far = (followed.abs() * numbers.inverse_spread).sum() + 1.0
            way_out, group = followed / far, numbers.tangent_group
        y, change = self._rules(z, way_out if group is None else None)
        for g in () if group is None else np.unique(group):
            is_here = np.isin(group, (0, g))
            there = z * is_here.astype(float) + np.where(is_here, 0.0, numbers.tangent_at)
            part = self._rules(there, way_out * (group == g).astype(float))[1]
            change = part if change is None else change + part
        y = y + numbers.offset
        if change is not None:
            # Scaled back after the sum: infinities of opposite sign have no sum.
            y = y + far * change
        if numbers.output_limits is not None:
            low, high = numbers.output_limits
            y = y.at_least(low).at_most(high)
        y = y + not_finite
        if self.policy == "nan":
            is_out = (x - inside).abs().sum() > 0.0
            y = is_out.where(np.full((1, 1), np.nan), y)
        return y

    def _rules(self, z, way_out):
        """The rules' output minus the offset, and its change along the way out, or None."""
        zero = z.columns([0]) * 0.0
        strengths, changes = self._strengths(z, way_out, zero)
        by_rule = self._by_rule(zero + 1.0, z)
        change = None
        if way_out is not None:
            of_strengths = changes.reshape(self.numbers.model.n_rules, 1) * by_rule
            change = self._weigh(strengths, of_strengths + self._by_rule(zero, way_out))
        return self._weigh(strengths, by_rule), change

    def _strengths(self, z, way_out, zero):
        """Strengths (n_rows, n_rules), and the change of their logarithms along the way out."""
        numbers, logs, slopes = self.numbers, [], []
        for terms in numbers.terms:
            positions = numbers.term_input[terms.start : terms.start + len(terms.constants)]
            formula = FORMULAS[terms.family].of
            value, slope = formula(z.columns(positions), terms.constants.T)
            logs.append(value())
            if way_out is not None:
                slopes.append(slope() * way_out.columns(positions))
        # 1 where rule r has term t; the last row stands for no term.
        has_term = np.zeros((numbers.model.antecedent.n_terms + 1, numbers.model.n_rules))
        has_term[numbers.rule_terms.T, np.arange(numbers.model.n_rules)] = 1.0
        shares = (self._joined(*logs, zero) @ has_term).softmax()
        if way_out is None:
            return shares, None
        change = self._joined(*slopes, zero) @ has_term
        return shares, change - (shares * change).sum()

    def _by_rule(self, one, z):
        """Constants times ``one`` plus slopes times z, (n_rows, n_rules, n_outputs)."""
        n_rules, n_outputs, n_basis = self.numbers.consequents.shape
        sloped = [z.columns(self.numbers.slope_input)] * (n_basis > 1)
        by_output = self.numbers.consequents.reshape(-1, n_basis).T
        return (self._joined(one, *sloped) @ by_output).reshape(n_rules, n_outputs)

    def _joined(self, *columns):
        return self.graph.node("Concat", *columns, axis=1)

    def _weigh(self, strengths, by_rule):
        """Sum over rules (n_rows, n_outputs)."""
        return (strengths.reshape(self.numbers.model.n_rules, 1) * by_rule).sum(keep=False)
