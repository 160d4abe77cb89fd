r"""The data as the kernel sees it: standardised, transposed, one cache-sized block at a time.

Inputs and target are standardised here and nowhere else, by weighted mean and standard deviation,
so that a fit does not depend on their units. A block is read as Z (n_inputs, n_rows) and the target
(n_outputs, n_rows), and only one block per worker exists at any time: ``X`` may be memory-mapped
and larger than memory.
"""

from dataclasses import dataclass

import numpy as np

from ..blocks import BLOCK_ROWS, row_blocks

# Blocks per unit of parallel work. It depends on nothing, so that sums are taken in the same order
# whatever the number of workers.
_BLOCKS_PER_CHUNK = 16

# Exponents of two beyond which a column is shifted: sums of squares stay finite up to there.
_FAR = 400
# What a column may hold, and its slopes (by their logarithm): room is left for sums and products.
_LARGEST = 1e300
_LARGEST_SLOPE = 950

# Any fixed number would do.
_FINGERPRINT_SEED = 20090101


def fingerprint(columns):
    """One number per row out of columns (n_columns, n_rows): a fixed random projection.

    Equal rows have equal numbers to the last bit, because the columns are added one by one; unequal
    rows have unequal numbers, all but surely.
    """
    factors = np.random.default_rng(_FINGERPRINT_SEED).standard_normal(len(columns))
    numbers = np.zeros(columns.shape[1])
    for factor, column in zip(factors, columns, strict=True):
        numbers += factor * column
    return numbers


@dataclass(frozen=True, eq=False)
class Scale:
    """z = (x - offset) / scale, per column; the range is that of the rows with weight."""

    offset: np.ndarray
    scale: np.ndarray
    minimum: np.ndarray
    maximum: np.ndarray

    @property
    def is_constant(self):
        """Which columns never change."""
        return self.minimum == self.maximum

    def varying(self, columns):
        """Some columns as a list, with None in place of those that never change."""
        is_constant = self.is_constant
        return [None if is_constant[j] else int(j) for j in columns]

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest values, standardised."""
        return (self.minimum - self.offset) / self.scale, (self.maximum - self.offset) / self.scale

    def apply(self, columns, out):
        """Standardise columns (n_columns, n_rows) into ``out``."""
        np.subtract(columns, self.offset[:, None], out=out)
        out /= self.scale[:, None]
        return out


def column_statistics(values, sample_weight=None):
    """The :class:`Scale` of every column of ``values`` (n_rows, n_columns), in two passes.

    The variance is taken about the mean, in a second pass: columns far from the origin lose no
    digits. A constant column has scale one. Columns near the ends of the range of floats are taken
    by a power of two nearer to one, so that neither sums nor differences overflow.
    """
    minimum, maximum = np.full((2, values.shape[1]), [[np.inf], [-np.inf]])
    with np.errstate(over="ignore", invalid="ignore"):
        origin, total, first = _first_pass(
            values, sample_weight, np.zeros(1, dtype=int), minimum, maximum
        )
        exponents = np.frexp(np.maximum(np.abs(minimum), np.abs(maximum)))[1]
    shift = np.where(np.abs(exponents) > _FAR, -exponents, 0)
    if shift.any():
        origin, total, first = _first_pass(values, sample_weight, shift, minimum, maximum)
    low, high = np.ldexp(minimum, shift), np.ldexp(maximum, shift)
    mean = (origin + first / total)[:, None]
    constant = minimum == maximum
    # Deviations count in parts of the range: their squares neither overflow nor vanish.
    span = np.where(constant, 1.0, high - low)
    second = np.zeros(values.shape[1])
    for part in row_blocks(values.shape[0], BLOCK_ROWS):
        block = _shifted(_columns(values, part), shift)
        block -= mean
        block /= span[:, None]
        np.square(block, out=block)
        second += _sum(block, sample_weight, part)
    scale = np.ldexp(span * np.sqrt(second / total), -shift)
    return Scale(
        np.where(constant, minimum, np.ldexp(mean[:, 0], -shift)),
        np.where(scale == 0.0, 1.0, scale),
        minimum,
        maximum,
    )


def _first_pass(values, sample_weight, shift, minimum, maximum):
    """The first row, the total weight, and the weighted sum of differences from that row.

    All but the range, which is written to ``minimum`` and ``maximum``, is in shifted units.
    """
    # Differences, so that columns far from the origin lose no digits.
    origin = _shifted(_columns(values, slice(1)), shift)
    total, first = 0.0, np.zeros(values.shape[1])
    for part in row_blocks(values.shape[0], BLOCK_ROWS):
        block = _columns(values, part)
        np.minimum(minimum, block.min(axis=1), out=minimum)
        np.maximum(maximum, block.max(axis=1), out=maximum)
        total += float(block.shape[1] if sample_weight is None else sample_weight[part].sum())
        block = _shifted(block, shift)
        block -= origin
        first += _sum(block, sample_weight, part)
    return origin[:, 0], total, first


def _columns(values, part):
    """Some rows as columns of their own, which sums run along."""
    return np.array(values[part].T, dtype=float, order="C")


def _shifted(block, shift):
    return np.ldexp(block, shift[:, None]) if np.any(shift) else block


def _sum(block, sample_weight, part):
    return block.sum(axis=1) if sample_weight is None else block @ sample_weight[part]


def check_scales(inputs, targets, input_names, output_names):
    """Raise ValueError where a model of such columns, in their units, is beyond what floats hold.

    Its slopes are changes of a target by changes of an input.
    """
    for what, scale, names in (("X", inputs, input_names), ("y", targets, output_names)):
        sizes = np.maximum(np.abs(scale.minimum), np.abs(scale.maximum))
        for size, spread, constant, name in zip(
            sizes, scale.scale, scale.is_constant, names, strict=True
        ):
            if size > _LARGEST:
                raise ValueError(
                    f"Column {name!r} of {what} holds numbers up to {size:.3g}; beyond "
                    f"{_LARGEST:.0e} sums overflow. Give it in a larger unit."
                )
            if not constant and spread < 1.0 / _LARGEST:
                raise ValueError(
                    f"Column {name!r} of {what} varies by {spread:.3g} only; below "
                    f"{1.0 / _LARGEST:.0e} floats lose their digits. Give it in a smaller unit."
                )
    # A target far from zero is divided by the inputs too, be it constant.
    largest = np.maximum(np.abs(targets.minimum), np.abs(targets.maximum))
    with np.errstate(divide="ignore"):
        largest_slopes = np.log2(largest) - np.log2(inputs.scale[:, None])
    smallest_slopes = np.log2(targets.scale) - np.log2(inputs.scale[:, None])
    is_beyond = largest_slopes > _LARGEST_SLOPE
    is_beyond |= (smallest_slopes < -_LARGEST_SLOPE) & ~targets.is_constant
    for j, k in np.argwhere(is_beyond & ~inputs.is_constant[:, None]):
        raise ValueError(
            f"Column {output_names[k]!r} of y reaches {largest[k]:.3g}, varies by "
            f"{targets.scale[k]:.3g}, and column {input_names[j]!r} of X varies by "
            f"{inputs.scale[j]:.3g}: floats hold no slope of one by the other. Give one of them in "
            "another unit."
        )


@dataclass(frozen=True, eq=False)
class StandardisedData:
    """X (n_rows, n_inputs), y (n_rows, n_outputs), weights or None, the scales of both, groups.

    Of many rows there may be a ``sample`` on which to begin, see ``sampling``.
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
        return cls(
            X,
            y,
            sample_weight,
            column_statistics(X, sample_weight),
            column_statistics(y, sample_weight),
            groups,
        )

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
    def total_weight(self):
        """Sum of the weights; the number of rows where there are none."""
        if self.sample_weight is None:
            return float(self.n_rows)
        return float(np.sum(self.sample_weight))

    def chunks(self, block_rows):
        """Units of parallel work: lists of slices of at most ``block_rows`` rows."""
        blocks = row_blocks(self.n_rows, block_rows)
        step = _BLOCKS_PER_CHUNK
        return [blocks[start : start + step] for start in range(0, len(blocks), step)]

    def sum(self, one_pass, block_rows, map_ordered=map):
        """Sums of a pass (see ``passes``) over all rows, in blocks of at most so many of them.

        ``map_ordered`` is ``map``, or what spreads chunks over workers; sums are added in the
        chunks' order, so that they do not depend on it.
        """

        def of_chunk(chunk):
            sums = [np.zeros(shape, order="F") for shape in one_pass.shapes]
            for part in chunk:
                one_pass(*self.read(part), sums)
            return sums

        totals = [np.zeros(shape, order="F") for shape in one_pass.shapes]
        for sums in map_ordered(of_chunk, self.chunks(block_rows)):
            for total, one in zip(totals, sums, strict=True):
                total += one
        return totals

    def reduce(self, of_rows, merge):
        """What ``of_rows`` makes of the rows; where they are in parts, merged two by two."""
        del merge
        return of_rows(self)

    def table(self, part):
        """Standardised [z, y] of some rows, (n_rows, n_inputs + n_outputs), weights left out."""
        inputs = (self.X[part] - self.inputs.offset) / self.inputs.scale
        return np.hstack([inputs, (self.y[part] - self.targets.offset) / self.targets.scale])

    def fingerprints(self, of_inputs=False):
        """One number for every row, the same where rows, or their inputs alone, are equal."""
        numbers = np.empty(self.n_rows)
        for part in row_blocks(self.n_rows, BLOCK_ROWS):
            Z, target, _ = self.read(part)
            numbers[part] = fingerprint(Z if of_inputs else np.concatenate([Z, target]))
        return numbers

    def read(self, part):
        """Z, standardised target, and weights or None, of one block."""
        X, y = self.X[part], self.y[part]
        Z = self.inputs.apply(X.T, np.empty((X.shape[1], X.shape[0])))
        target = self.targets.apply(y.T, np.empty((y.shape[1], y.shape[0])))
        return Z, target, None if self.sample_weight is None else self.sample_weight[part]
