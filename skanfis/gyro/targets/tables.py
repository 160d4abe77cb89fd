"""Tables and piecewise cubics in C, in floating or fixed point, in the place of an error."""

from types import SimpleNamespace

import numpy as np

from ...export.c.builder import header_of, input_lines
from ...export.c.dialect import STATUS, Dialect, kept_lines, remark
from ...export.c.self_test import ROWS, self_test
from ...export.c.templates import FINITE_INPUT, rejection
from .piecewise import Piecewise, spread

# Of every type what C calls it, what it computes in, and the bits of a number behind its sign.
TYPES = {
    "float": ("float", "float", 0),
    "double": ("double", "double", 0),
    "q31": ("int_least32_t", "int_least64_t", 31),
    "q15": ("int_least16_t", "int_least32_t", 15),
}
# What it says of a cell, and of which inputs.
KINDS = {
    "table": ("line", ("temperature",)),
    "cubic": ("cubic", ("temperature",)),
    "rate-table": ("plane", ("temperature", "output")),
}
_MARGIN = 1.001  # of a fixed-point scale, for what is rounded

_CODE = """
table |/* The value between two. */
table |static $wide $name_between($wide a, $wide b, $wide part)
table |{
table |    return a + (b - a) * part$per_one;
table |}
table |
      |int $name_predict(const $real x[$NAME_N_INPUTS], $real y[$NAME_N_OUTPUTS])
      |{
      |    $wide part[$NAME_N_INPUTS], value;
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
real  |        value *= $name_per_unit[i];
real  |        at[i] = (int)value;
fixed |        at[i] = (int)(value / $name_step[i]);
      |        if (at[i] > $name_last[i]) {
      |            at[i] = $name_last[i];
      |        }
real  |        part[i] = value - ($real)at[i];
fixed |        part[i] = (value - at[i] * $name_step[i]) * $one / $name_step[i];
      |    }
line  |    i = at[0];
line  |    value = $name_between($name_values[i], $name_values[i + 1], part[0]);
plane |    for (i = 0; i < 2; ++i) {
plane |        const $real *row = $name_values[at[0] + i];
plane |        const $wide next = $name_between(row[at[1]], row[at[1] + 1], part[1]);
plane |        value = (i == 0) ? next : $name_between(value, next, part[0]);
plane |    }
cubic |    value = $name_values[at[0]][3];
cubic |    for (i = 2; i >= 0; --i) {
cubic |        value = value * part[0]$per_one + $name_values[at[0]][i];
cubic |    }
      |    y[0] = ($real)value;
      |    return status;
      |}
"""


def name_of(kind):
    """What files and identifiers of a kind of table start with."""
    return f"gyro_{kind.replace('-', '_')}"


class Table:
    """A table or piecewise cubic of an error in a box, with the numbers as C holds them.

    ``piecewise`` is what it computes.
    """

    def __init__(self, error, ends, kind, type_name, n_cells):
        self.shape, self.names = KINDS[kind]
        real, self.wide, self.bits = TYPES[type_name]
        self.dialect = Dialect(name_of(kind), real, "c99")
        # Low, high and step as C holds them, the number of cells, and what 1 stands for.
        self.axes = [self._axis(low, high, n_cells) for low, high in ends]
        degree = 3 if self.shape == "cubic" else 1
        at = [
            np.minimum(low + np.arange(degree * n + 1) * step / degree, high) * unit
            for low, high, step, n, unit in self.axes
        ]
        points = np.stack(np.meshgrid(*at, indexing="ij"), axis=-1)
        values = error(points.reshape(-1, len(at))).reshape(points.shape[:-1])
        if degree == 3:
            places = 3 * np.arange(values.size // 3)[:, None] + np.arange(4)
            thirds = np.vander(np.arange(4) / 3.0, increasing=True)
            values = np.linalg.solve(thirds, values[places].T).T
        largest = np.abs(values).sum(axis=1).max() if degree == 3 else np.abs(values).max()
        self.unit = self._unit(_MARGIN * largest)
        numbers = np.rint(values / self.unit) if self.bits else values
        self.values = numbers.astype(self.dialect.dtype)
        self.piecewise = self._piecewise(self.values * self.unit)

    def _unit(self, largest):
        """Of a fixed-point number that may be so large: a power of two."""
        return 2.0 ** (np.ceil(np.log2(largest or 1.0)) - self.bits) if self.bits else 1.0

    def _axis(self, low, high, n_cells):
        if not self.bits:
            real = self.dialect.dtype.type
            low, high = float(real(low)), float(real(high))
            return low, high, 1.0 / float(real(n_cells / (high - low))), n_cells, 1.0
        unit, most = self._unit(max(abs(low), abs(high))), 2**self.bits - 1
        low, high = int(np.ceil(low / unit)), min(int(np.floor(high / unit)), most)
        step = -((low - high) // n_cells)
        return low, high, step, -((low - high) // step), unit

    def _piecewise(self, values):
        if self.shape == "cubic":
            powers, coefficients = np.arange(4)[:, None], values.T
        elif self.shape == "line":
            powers, coefficients = np.arange(2)[:, None], np.stack([values[:-1], np.diff(values)])
        else:
            powers = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
            down, along = np.diff(values, axis=0), np.diff(values)
            terms = values[:-1, :-1], down[:, :-1], along[:-1], np.diff(down)
            coefficients = np.stack(terms)
        origins = [(low + step * np.arange(n)) * unit for low, _, step, n, unit in self.axes]
        edges = [
            np.append(inner, high * unit)
            for inner, (_, high, *_, unit) in zip(origins, self.axes, strict=True)
        ]
        sizes = np.abs(coefficients)
        steepest, most = np.tensordot(powers.sum(axis=1), sizes, 1).max(), sizes.sum(axis=0).max()
        if self.bits:
            # The input is rounded; its place in a cell has a bit less; three products are cut off.
            place = 0.5 / min(step for _, _, step, *_ in self.axes) + 2.0 ** (1 - self.bits)
            slack = place * steepest + 3.0 * self.unit
        else:
            n_most = max(n for *_, n, _ in self.axes)
            slack = np.finfo(self.dialect.dtype).eps * (8.0 * n_most * steepest + 24.0 * most)
        widths = [step * unit for _, _, step, _, unit in self.axes]
        return Piecewise(edges, origins, widths, powers, coefficients, float(slack))

    def code(self, notes, units):
        """The C files; ``notes`` and ``units`` are as of :func:`skanfis.export.export_c`."""
        dialect, bits = self.dialect, self.bits
        lows, highs, steps, counts, scales = map(np.array, zip(*self.axes, strict=True))
        ends = {"low": lows, "high": highs} | ({} if bits else {"per_unit": 1.0 / steps})
        tables = [*ends.items(), ("values", self.values)]
        parts = [dialect.table(name, each.astype(dialect.dtype)) for name, each in tables]
        parts.append(dialect.table("last", counts - 1, "int"))
        if bits:
            parts.append(dialect.table("step", steps, self.wide))
        else:
            parts.append(dialect.write(rejection("raise", "c99")).lstrip())
        facts = {self.shape, "fixed" if bits else "real", self.shape != "cubic" and "table"}
        one = 2 ** (bits - 1)
        code = kept_lines(_CODE, facts).replace("$finite_input", FINITE_INPUT.strip("\n"))
        words = {"wide": self.wide, "one": one, "per_one": f" / {one}" if bits else ""}
        parts += [
            dialect.write(code, **words),
            self_test(self._answers(lows, highs, scales), dialect),
        ]
        head = f'#include "{dialect.name}.h"\n\n' + ("" if bits else "#include <float.h>\n\n")
        n_products, d = {"line": 1, "cubic": 3, "plane": 3}[self.shape], lows.size
        n_bytes = sum(each.size for _, each in tables) * dialect.dtype.itemsize
        lines = [
            *map(remark, notes),
            f"{' x '.join(map(str, counts))} cells; C99, {dialect.real}.",
            f"Whatever the inputs: at most {n_products + (2 * d if bits else d)} multiplications, "
            f"{n_products + 2 * d if bits else 0} divisions. Memory: {n_bytes} bytes of tables.",
            "",
            *input_lines(self.names, lows * scales, highs * scales, units),
            "Outputs y:",
            "  [0] error [deg/s]",
            "",
            "An input beyond its range is held at the end of it.",
        ]
        if bits:
            for k, (name, scale) in enumerate(zip(self.names, scales, strict=True)):
                lines.append(
                    f"Fixed point: x[{k}] is {name} / {_shown(scale)}, rounded by the caller, held "
                    f"between {-2 * one} and {2 * one - 1}."
                )
            lines.append(
                f"The error is y[0] * {_shown(self.unit)} deg/s. No sum or product overflows, and "
                f"y[0] stays below {2 * one} in size: nothing else is saturated."
            )
        else:
            lines.append("A row that is not finite gets no output.")
        include = "#include <stdint.h>" if bits else ""
        header = header_of("The error of a gyro", lines, dialect, d, 1, include)
        return SimpleNamespace(name=dialect.name, header=header, source=head + "\n".join(parts))

    def _answers(self, lows, highs, scales):
        """Rows, some of them beyond the range, with their values, status and tolerance."""
        dtype, beyond = self.dialect.dtype, 0.1 * (highs - lows)
        points = spread(np.stack([lows - beyond, highs + beyond], axis=1))
        X = points[:: len(points) // ROWS][:ROWS]
        X = np.rint(X).clip(-(2**self.bits), 2**self.bits - 1) if self.bits else X
        y, slack = self.piecewise(X * scales) / self.unit, self.piecewise.slack / self.unit
        if self.bits:
            y, slack = np.rint(y), np.ceil(slack) + 1.0
        status = STATUS["OUT_OF_RANGE"] * ((lows > X) | (highs < X)).any(axis=1)
        return X.astype(dtype), y[:, None].astype(dtype), status, np.array([slack]).astype(dtype)


def _shown(power):
    """A power of two."""
    return f"2^{int(np.log2(power))} ({power:.6g})"
