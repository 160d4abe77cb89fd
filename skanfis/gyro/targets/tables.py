"""Lookup tables in C, in floating or fixed point, that replace the compensator's error model."""

from itertools import product
from types import SimpleNamespace

import numpy as np

from ...export.c.dialect import STATUS, Dialect, kept_lines
from ...export.c.header import header_of, input_lines
from ...export.c.self_test import ROWS, self_test
from ...export.c.templates import FINITE_INPUT, rejection
from .error_model import Piecewise, spread

# For every type: its name in C, the type of intermediate results, and the bits behind the sign.
TYPES = {
    "float": ("float", "float", 0),
    "double": ("double", "double", 0),
    "q31": ("int_least32_t", "int_least64_t", 31),
    "q15": ("int_least16_t", "int_least32_t", 15),
}
# By the number of inputs: name of the table, and cells of each input.
NAMES, _N_CELLS = {1: "gyro_table", 2: "gyro_rate_table"}, {1: 64, 2: 24}
_MARGIN = 1.001  # of a fixed-point scale, for rounding

_CODE = """
      |/* The value between two neighbours. */
      |static $wide $name_between($wide a, $wide b, $wide part)
      |{
      |    return a + (b - a) * part$per_one;
      |}
      |
      |int $name_predict(const $real x[$NAME_N_INPUTS], $real y[$NAME_N_OUTPUTS])
      |{
      |    $wide part[$NAME_N_INPUTS], value, cells;
      |    int i, at[$NAME_N_INPUTS], status = $NAME_IN_RANGE;
      |
real  |$finite_input
fixed |    for (i = 0; i < $NAME_N_INPUTS; ++i) {
      |        value = x[i];
      |        if (value < $name_low[i]) {
      |            value = $name_low[i];
      |            status = $NAME_OUT_OF_RANGE;
      |        }
      |        if (value > $name_high[i]) {
      |            value = $name_high[i];
      |            status = $NAME_OUT_OF_RANGE;
      |        }
      |        value -= $name_low[i];
      |        cells = value / $name_step[i];
      |        at[i] = (int)cells;
      |        if (at[i] > $name_last[i]) {
      |            at[i] = $name_last[i];
      |        }
      |        part[i] = (value - ($wide)at[i] * $name_step[i])$times_one / $name_step[i];
      |    }
line  |    i = at[0];
line  |    value = $name_between($name_values[i], $name_values[i + 1], part[0]);
plane |    for (i = 0; i < 2; ++i) {
plane |        const $real *row = $name_values[at[0] + i];
plane |        const $wide next = $name_between(row[at[1]], row[at[1] + 1], part[1]);
plane |        value = (i == 0) ? next : $name_between(value, next, part[0]);
plane |    }
      |    y[0] = ($real)value;
      |    return status;
      |}
"""


class Table:
    """A table of an ErrorModel, with the numbers as C holds them.

    ``piecewise`` is what it computes. For each axis, ``low``, ``high`` and ``step`` are numbers in
    C, in units of ``scale``, and ``counts`` is the number of cells; values are in multiples of
    ``unit``.
    """

    def __init__(self, error, type_name, n_cells=None):
        self.names = error.names
        n_cells = n_cells or _N_CELLS[len(self.names)]
        real, self.wide, self.bits = TYPES[type_name]
        self.dialect = Dialect(NAMES[len(self.names)], real, "c99")
        self._place(error.ends[:, 0], error.ends[:, 1], n_cells)
        axes = zip(self.low, self.high, self.step, self.counts, self.scale, strict=True)
        at = [
            np.minimum(low + np.arange(n + 1) * step, high) * scale
            for low, high, step, n, scale in axes
        ]
        points = np.stack(np.meshgrid(*at, indexing="ij"), axis=-1)
        values = error(points.reshape(-1, len(at))).reshape(points.shape[:-1])
        inside = self.high - self.low - (self.counts - 1) * self.step
        for axis, part in enumerate(self.step / inside):
            # The last cell may end beyond the range: its line goes on from the edge.
            last = np.moveaxis(values, axis, 0)
            last[-1] = last[-2] + part * (last[-1] - last[-2])
        self.unit = float(self._scale_of(_MARGIN * np.abs(values).max()))
        values = np.rint(values / self.unit) if self.bits else values
        self.values = values.astype(self.dialect.dtype)
        self.piecewise = self._piecewise(self.values * self.unit, [each[:-1] for each in at])

    def _scale_of(self, largest):
        """The unit for numbers up to ``largest``: in fixed point a power of two, else 1."""
        if not self.bits:
            return np.ones_like(largest)
        return 2.0 ** (np.ceil(np.log2(np.where(largest > 0.0, largest, 1.0))) - self.bits)

    def _place(self, low, high, n_cells):
        self.scale = self._scale_of(np.maximum(np.abs(low), np.abs(high)))
        if self.bits:
            self.low = np.ceil(low / self.scale).astype(np.int64)
            self.high = np.floor(high / self.scale).astype(np.int64).clip(max=2**self.bits - 1)
            self.step = -((self.low - self.high) // n_cells)
            self.counts = -((self.low - self.high) // self.step)
            return
        ends = np.array([low, high, (high - low) / n_cells]).astype(self.dialect.dtype)
        self.low, self.high, self.step = ends.astype(float)
        self.counts = np.full(low.size, n_cells)

    def _piecewise(self, values, origins):
        powers = np.array(list(product((0, 1), repeat=values.ndim)))
        parts = [values] * len(powers)
        for axis in range(values.ndim):
            for k, part in enumerate(parts):
                is_slope = powers[k, axis]
                parts[k] = np.diff(part, axis=axis) if is_slope else np.delete(part, -1, axis)
        edges = [np.append(*ends) for ends in zip(origins, self.high * self.scale, strict=True)]
        coefficients = np.array(parts)
        sizes = np.abs(coefficients)
        steepest, most = np.tensordot(powers.sum(axis=1), sizes, 1).max(), sizes.sum(axis=0).max()
        if self.bits:
            # Errors: of the rounded input, of its place in a cell, and of three truncated products.
            slack = (0.5 / self.step.min() + 2.0 ** (1 - self.bits)) * steepest + 3.0 * self.unit
        else:
            eps = np.finfo(self.dialect.dtype).eps
            slack = eps * (8.0 * self.counts.max() * steepest + 24.0 * most)
        width = self.step * self.scale
        return Piecewise(edges, origins, width, powers, coefficients, float(slack))

    def code(self, notes, units):
        """The C files; ``notes`` and ``units`` are as of :func:`skanfis.export.export_c`."""
        dialect, bits, one = self.dialect, self.bits, 2 ** (self.bits - 1)
        tables = {"low": self.low, "high": self.high, "step": self.step, "values": self.values}
        head, kinds = f'#include "{dialect.name}.h"\n', {"last": "int"}
        if not bits:
            head += f"\n#include <float.h>\n\n{dialect.write(rejection('raise', 'c99')).lstrip()}"
        n_bytes = sum(each.size for each in tables.values()) * dialect.dtype.itemsize
        tables = {name: each.astype(dialect.dtype) for name, each in tables.items()}
        tables["last"] = self.counts - 1
        d = self.low.size
        facts = {"plane" if d > 1 else "line", "fixed" if bits else "real"}
        code = kept_lines(_CODE, facts).replace("$finite_input", FINITE_INPUT.strip("\n"))
        words = {"wide": self.wide, "per_one": f" / {one}" if bits else ""}
        words["times_one"] = f" * {one}" if bits else ""
        source = [
            head,
            *(dialect.table(name, each, kinds.get(name)) for name, each in tables.items()),
            dialect.write(code, **words),
            self_test(self._answers(), dialect),
        ]
        n_products = 2**d - 1
        lines = [
            f"{' x '.join(map(str, self.counts))} cells; C99, {dialect.real}.",
            f"Cost of any evaluation: {n_products + (2 * d if bits else d)} multiplications, "
            f"{(n_products if bits else 0) + 2 * d} divisions. Memory: {n_bytes} bytes of tables.",
            "",
            *input_lines(self.names, self.low * self.scale, self.high * self.scale, units),
            "Outputs y:",
            "  [0] error [deg/s]",
            "",
            "An input beyond its range is held at its end, and the row is flagged.",
        ]
        if bits:
            pairs = enumerate(zip(self.names, self.scale, strict=True))
            inputs = ", ".join(f"x[{k}] is {name} / {_shown(scale)}" for k, (name, scale) in pairs)
            lines.append(
                f"Fixed point: {inputs}, rounded by the caller and held within {-2 * one} and "
                f"{2 * one - 1}. The error is y[0] * {_shown(self.unit)} deg/s. No sum or product "
                "overflows: nothing else is saturated."
            )
        else:
            lines.append("A row with an input that is not finite gets no output.")
        include = "#include <stdint.h>" if bits else ""
        header = header_of("A table of the error of a gyro", notes, lines, dialect, d, 1, include)
        return SimpleNamespace(name=dialect.name, header=header, source="\n".join(source))

    def _answers(self):
        """Rows, some of them beyond the range, with their values, status and tolerance."""
        beyond = 0.1 * (self.high - self.low)
        points = spread(np.stack([self.low - beyond, self.high + beyond], axis=1))
        X = points[:: len(points) // ROWS][:ROWS]
        X = np.rint(X).clip(-(2**self.bits), 2**self.bits - 1) if self.bits else X
        y, slack = self.piecewise(X * self.scale) / self.unit, self.piecewise.slack / self.unit
        if self.bits:
            y, slack = np.rint(y), np.ceil(slack) + 1.0
        status = STATUS["OUT_OF_RANGE"] * ((self.low > X) | (self.high < X)).any(axis=1)
        answers = X, y[:, None], np.array([slack])
        X, y, tolerance = (each.astype(self.dialect.dtype) for each in answers)
        return X, y, status, tolerance


def _shown(power):
    """A power of two as text."""
    return f"2^{int(np.log2(power))} ({power:.6g})"
