r"""The data as the kernel sees it: standardised, transposed, one cache-sized block at a time.

Inputs and target are standardised here and nowhere else, by weighted mean and standard deviation,
so that a fit does not depend on their units. A block is read as Z (n_inputs, n_rows) and the target
(n_outputs, n_rows). Only one block per worker exists at any time: ``X`` may be memory-mapped and
larger than memory.
"""

from dataclasses import dataclass
from functools import cached_property, reduce

import numpy as np

from ..blocks import BLOCK_ROWS, add_each, row_blocks
from ..policies import ROUNDING

# Blocks per unit of parallel work. It is fixed, so that sums are taken in the same order whatever
# the number of workers.
_BLOCKS_PER_CHUNK = 16

# The largest number of a column, and the inverse of the least deviation. Within these limits,
# squares and slopes of one column by another neither overflow nor vanish.
LARGEST_NUMBER = 1e100

# Any fixed number does.
_FINGERPRINT_SEED = 20090101


def fingerprint(columns):
    """One number per row out of columns (n_columns, n_rows): a fixed random projection.

    Equal rows have equal numbers to the last bit, because the columns are added one by one. Unequal
    rows almost surely have unequal numbers.
    """
    factors = np.random.default_rng(_FINGERPRINT_SEED).standard_normal(len(columns))
    numbers = np.zeros(columns.shape[1])
    for factor, column in zip(factors, columns, strict=True):
        numbers += factor * column
    return numbers


def place_in_sample(Z, target):
    """One number per row [z, y] to draw it by; the order of columns makes no difference."""
    return fingerprint(np.concatenate([np.sort(Z, axis=0), np.sort(target, axis=0)]))


@dataclass(frozen=True, eq=False)
class Scale:
    """z = (x - offset) / scale, per column, and the range of the column."""

    offset: np.ndarray
    scale: np.ndarray
    minimum: np.ndarray
    maximum: np.ndarray

    @classmethod
    def of(cls, mean, deviation, minimum, maximum):
        """From these numbers of columns; a constant column has its own value, and scale one."""
        constant = never_changes(minimum, maximum)
        offset = np.where(constant, minimum, mean)
        scale = np.where(constant | (deviation == 0.0), 1.0, deviation)
        return cls(offset, scale, minimum, maximum)

    @cached_property
    def is_constant(self):
        """Which columns never change, but for rounding errors."""
        return never_changes(self.minimum, self.maximum)

    def varying(self, columns):
        """The ``columns`` as a list, with None in place of constant ones."""
        return [None if self.is_constant[j] else int(j) for j in columns]

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest values, standardised."""
        return (self.minimum - self.offset) / self.scale, (self.maximum - self.offset) / self.scale

    def apply(self, columns):
        """Columns (n_columns, n_rows), standardised, in C order."""
        out = np.subtract(columns, self.offset[:, None], order="C")
        out /= self.scale[:, None]
        return out


@np.errstate(over="ignore", invalid="ignore")  # ``check_scales`` refuses what overflows
def column_statistics(values, sample_weight=None):
    """The :class:`Scale` of every column of ``values`` (n_rows, n_columns), in two passes.

    The first sums differences from the first row, the second those from the mean, so that columns
    far from the origin lose no digits.
    """
    weight = np.broadcast_to(1.0, len(values)) if sample_weight is None else sample_weight
    minimum, maximum = np.full((2, values.shape[1]), [[np.inf], [-np.inf]])
    origin = _columns(values, slice(1))
    total, first, second = 0.0, np.zeros(values.shape[1]), np.zeros(values.shape[1])
    for part in row_blocks(values.shape[0], BLOCK_ROWS):
        block = _columns(values, part)
        np.minimum(minimum, block.min(axis=1), out=minimum)
        np.maximum(maximum, block.max(axis=1), out=maximum)
        total += float(weight[part].sum())
        first += (block - origin) @ np.array(weight[part])
    mean = origin + (first / total)[:, None]
    # Relative to the range: else squares of tiny deviations would vanish unseen.
    span = np.where(never_changes(minimum, maximum), 1.0, maximum - minimum)
    for part in row_blocks(values.shape[0], BLOCK_ROWS):
        deviations = (_columns(values, part) - mean) / span[:, None]
        second += deviations**2 @ np.array(weight[part])
    return Scale.of(mean[:, 0], span * np.sqrt(second / total), minimum, maximum)


def never_changes(minimum, maximum):
    """Whether columns with these extremes are constant, but for rounding errors."""
    return maximum <= minimum + ROUNDING * np.maximum(np.abs(minimum), np.abs(maximum))


def _columns(values, part):
    """Some rows, transposed and contiguous, so that sums run along memory."""
    return np.array(values[part].T, dtype=float, order="C")


def check_scales(inputs, targets, input_names, output_names):
    """Raise ValueError, naming the column, where numbers are too large or vary too little."""
    for what, scale, names in (("X", inputs, input_names), ("y", targets, output_names)):
        sizes = np.maximum(np.abs(scale.minimum), np.abs(scale.maximum))
        for size, spread, constant, name in zip(
            sizes, scale.scale, scale.is_constant, names, strict=True
        ):
            if size > LARGEST_NUMBER:
                raise ValueError(
                    f"Column {name!r} of {what} holds numbers up to {size:.3g}, but sums overflow "
                    f"beyond {LARGEST_NUMBER:.0e}. Express this column in a larger unit."
                )
            if not constant and spread < 1.0 / LARGEST_NUMBER:
                raise ValueError(
                    f"Column {name!r} of {what} has a standard deviation of only {spread:.3g}; "
                    f"below {1.0 / LARGEST_NUMBER:.0e}, floating-point numbers lose their digits. "
                    "Express this column in a smaller unit."
                )


@dataclass(frozen=True, eq=False)
class StandardisedData:
    """X (n_rows, n_inputs), y (n_rows, n_outputs), weights or None, the scales of both, groups.

    If there are many rows, a fit begins on a ``sample`` of them, see ``sampling``.
    """

    X: np.ndarray
    y: np.ndarray
    sample_weight: np.ndarray | None
    inputs: Scale
    targets: Scale
    groups: np.ndarray | None = None  # the run, device, ... that each row belongs to
    sample: "StandardisedData | None" = None

    @classmethod
    def of(cls, X, y, sample_weight=None, groups=None):
        """Rows with the scales found from the data; every weight must be positive."""
        inputs, targets = (column_statistics(part, sample_weight) for part in (X, y))
        return cls(X, y, sample_weight, inputs, targets, groups)

    def part(self, indices):
        """Some of the rows, on the same scales."""
        weight = None if self.sample_weight is None else self.sample_weight[indices]
        groups = None if self.groups is None else self.groups[indices]
        return StandardisedData(
            self.X[indices], self.y[indices], weight, self.inputs, self.targets, groups
        )

    @property
    def n_rows(self):
        return self.X.shape[0]

    @property
    def weights(self):
        """The weights; all ones if there are none."""
        return np.ones(self.n_rows) if self.sample_weight is None else self.sample_weight

    @property
    def total_weight(self):
        """Sum of the weights."""
        return float(self.n_rows if self.sample_weight is None else np.sum(self.sample_weight))

    @property
    def effective_weight(self):
        """Number of rows by weight: the sum of weights s, or Kish's effective size, if larger.

        A row of weight 3 counts as three copies, so the sum counts the rows. Weights below one
        cannot be copies. Then the size of an unweighted sample of the same precision,
        (sum s)^2 / sum s^2 (Kish 1965), is usually larger, and is taken.
        """
        if self.sample_weight is None:
            return float(self.n_rows)
        # Relative to the largest: squares of tiny weights would vanish.
        largest = float(np.max(self.sample_weight))
        share = self.sample_weight / largest
        return max(largest * float(np.sum(share)), float(np.sum(share) ** 2 / np.sum(share**2)))

    def chunks(self, block_rows):
        """Units of parallel work: lists of slices of at most ``block_rows`` rows."""
        blocks = row_blocks(self.n_rows, block_rows)
        step = _BLOCKS_PER_CHUNK
        return [blocks[start : start + step] for start in range(0, len(blocks), step)]

    def sum(self, one_pass, block_rows, map_ordered=map):
        """Sums of a pass (see ``passes``) over all rows, in blocks of at most ``block_rows``.

        ``map_ordered`` is ``map``, or a function that spreads chunks over workers. Sums are added
        in the order of chunks, so that they do not depend on it.
        """

        def of_chunk(chunk):
            return reduce(add_each, (one_pass(*self.read(part)) for part in chunk))

        return reduce(add_each, map_ordered(of_chunk, self.chunks(block_rows)), [])

    def reduce(self, of_rows, merge):
        """The result of ``of_rows``; rows that are in parts merge the results two by two."""
        del merge
        return of_rows(self)

    def table(self, part):
        """Standardised [z, y] of some rows, (n_rows, n_inputs + n_outputs), without weights."""
        inputs = (self.X[part] - self.inputs.offset) / self.inputs.scale
        return np.hstack([inputs, (self.y[part] - self.targets.offset) / self.targets.scale])

    def numbers(self, of_block):
        """One number for every row; ``of_block`` computes them from Z and the target of a block."""
        numbers = np.empty(self.n_rows)
        for part, Z, target, _ in self.blocks():
            numbers[part] = of_block(Z, target)
        return numbers

    def blocks(self, block_rows=BLOCK_ROWS):
        """Blocks of at most ``block_rows`` rows, in order: slice, Z, target and weights."""
        for part in row_blocks(self.n_rows, block_rows):
            yield part, *self.read(part)

    def read(self, part):
        """Z, standardised target and weights of one block."""
        Z, target = self.inputs.apply(self.X[part].T), self.targets.apply(self.y[part].T)
        weight = np.ones(Z.shape[1]) if self.sample_weight is None else self.sample_weight[part]
        return Z, target, weight
