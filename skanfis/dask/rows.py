"""Rows on a cluster: the passes go to them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial, reduce
from operator import methodcaller

import numpy as np

from .._memory import keeps_freed_memory
from ..bounds.constraints import Constraints
from ..learning.data import Scale, StandardisedData, check_scales
from .blocks import Blocks, Described, describe, joined
from .keeping import kept_blocks

__all__ = ["ClusterData", "ClusterRows", "add_each", "reduce_blocks"]

# Results that one task adds: a deep tree has many tasks, a flat one holds many results at once.
_FAN_IN = 8


def reduce_blocks(blocks: Blocks, of_loaded: Callable, merge: Callable):
    """What ``of_loaded`` makes of every block, merged two by two, in the blocks' order.

    One task per block, and a tree of merges; nothing but the result comes to the client.
    RuntimeError where the cluster is gone, or kills its workers.
    """
    from dask.delayed import delayed

    # One key for all tasks: what they have in common is sent to a worker once.
    common = delayed((blocks.without_pieces(), of_loaded, merge), traverse=False)
    apply, add = delayed(_apply, pure=False), delayed(reduce, pure=False)
    level = [apply(common, number, *parts) for number, parts in enumerate(blocks.pieces)]
    while len(level) > 1:
        groups = [level[start : start + _FAN_IN] for start in range(0, len(level), _FAN_IN)]
        level = [add(merge, group) for group in groups]
    return _computed(level[0])


def _apply(common, number, *parts):
    blocks, of_loaded, merge = common
    loaded = blocks.load(number, *parts)
    try:
        with keeps_freed_memory():
            return reduce(merge, map(of_loaded, loaded))
    except ValueError as error:
        raise ValueError(f"Partition {number}: {error}") from error


def _computed(lazy):
    from concurrent.futures import CancelledError

    try:
        return lazy.compute()
    except CancelledError as error:
        raise RuntimeError(_gone(error)) from error
    except ValueError as error:
        # Futures of a client that is closed are no part of the graph any more.
        if not str(error).startswith("Missing dependency"):
            raise
        raise RuntimeError(_gone(error)) from error
    except Exception as error:
        if type(error).__module__.partition(".")[0] != "distributed":
            raise
        raise RuntimeError(_gone(error)) from error


def _gone(error):
    what = f"{type(error).__name__}: {error}".strip()
    if type(error).__name__ == "KilledWorker":
        return (
            "The same partition ended several workers, most likely for want of memory: use smaller "
            f"partitions (repartition, rechunk), or workers with more memory. ({what})"
        )
    return (
        "The cluster that the data live on does not answer: it was closed, or the data are of "
        f"another client. Load or persist them again with the client that is now open. ({what})"
    )


@dataclass(frozen=True, eq=False)
class ClusterRows:
    """As ``StandardisedData``, wherever the blocks are; on a sample, rows are at hand."""

    blocks: Blocks
    n_rows: int
    total_weight: float
    inputs: Scale
    targets: Scale
    sample: StandardisedData | None = None

    def reduce(self, of_rows, merge):
        """What ``of_rows`` makes of the rows of every block, merged two by two."""
        of_loaded = partial(_of_rows, inputs=self.inputs, targets=self.targets, of_rows=of_rows)
        return reduce_blocks(self.blocks, of_loaded, merge)

    def sum(self, one_pass, block_rows, map_ordered=map):
        """Sums of a pass over all rows; the workers are the cluster's, not ``map_ordered``."""
        del map_ordered
        return self.reduce(methodcaller("sum", one_pass, block_rows), add_each)


def _of_rows(loaded, inputs, targets, of_rows):
    return of_rows(loaded.rows(inputs, targets))


def add_each(one, other):
    """Sums of two results, one by one."""
    return [a + b for a, b in zip(one, other, strict=True)]


@dataclass(frozen=True, eq=False)
class ClusterData:
    """Validated data on a cluster; see ``ValidatedData``."""

    blocks: Blocks
    described: Described
    wishes: Constraints | None = None

    @classmethod
    def of(cls, blocks):
        """Validate and measure the blocks, in one pass."""
        described = reduce_blocks(blocks, partial(describe, layout=blocks.layout), joined)
        if described.n_rows < 2:
            raise ValueError(
                f"Found {described.n_given} rows, of which {described.n_rows} have weight; at "
                "least 2 are needed."
            )
        return cls(blocks, described)

    @property
    def input_names(self):
        """Names of the inputs."""
        return self.blocks.layout.input_names

    @property
    def output_names(self):
        """Names of the outputs."""
        return self.blocks.layout.output_names

    def kept(self):
        """The same, loaded once and for all where the workers have memory enough."""
        return replace(self, blocks=kept_blocks(self.blocks, self.described.n_given))

    def rows(self):
        """The rows on their scales."""
        found = self.described
        assert found.inputs is not None
        assert found.targets is not None
        check_scales(found.inputs, found.targets, self.input_names, self.output_names)
        return ClusterRows(self.blocks, found.n_rows, found.weight, found.inputs, found.targets)

    def gathered(self):
        """All rows, here: X, y, weights or None, groups or None."""
        loaded = reduce_blocks(self.blocks, _as_it_is, _concatenated)
        return loaded.X, loaded.y, loaded.sample_weight, loaded.groups


def _as_it_is(loaded):
    return loaded


def _concatenated(one, other):
    names = ("X", "y", "sample_weight", "groups")
    pairs = {name: (getattr(one, name), getattr(other, name)) for name in names}
    arrays = {k: None if a is None else np.concatenate([a, b]) for k, (a, b) in pairs.items()}
    return replace(one, **arrays)
