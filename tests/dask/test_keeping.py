"""Rows that workers keep for the time of a fit: one share for each of their threads."""

import sys

import numpy as np
import pytest
from numpy.testing import assert_array_equal

pytest.importorskip("dask")

import dask
import dask.array as da

from skanfis.dask import keeping, rows
from skanfis.dask.blocks import Blocks

of_the_cluster = keeping._workers
# Two workers, of three threads together.
WORKERS = [{"nthreads": 2, "memory_limit": 10**6}, {"nthreads": 1, "memory_limit": 10**6}]


@pytest.fixture(autouse=True)
def workers(monkeypatch):
    monkeypatch.setattr(keeping, "_workers", lambda: WORKERS)
    with dask.config.set(scheduler="synchronous"):
        yield


def blocks_of(X, y, chunks):
    return Blocks.of(da.from_array(X, chunks=(chunks, 2)), da.from_array(y, chunks=chunks))


def loaded(piece):
    return piece[0].compute()


def test_every_thread_keeps_one_share_of_the_partitions():
    X = np.arange(1400.0).reshape(700, 2)
    blocks = blocks_of(X, X[:, 1], 100)
    kept = keeping.kept_blocks(blocks, 700)
    shares = [loaded(piece) for piece in kept.pieces]
    # Of seven partitions the first share has the first, fourth and seventh.
    assert [len(share) for share in shares] == [3, 2, 2]
    assert_array_equal(shares[0][2].X, X[600:])
    assert_array_equal(shares[2][1].y[:, 0], X[500:600, 1])
    # What a pass makes of them is what it makes of the partitions.
    for one in (blocks, kept):
        assert rows.reduce_blocks(one, lambda part: part.X.sum(), np.add) == X.sum()
    # Fewer partitions than threads are a share each.
    few = keeping.kept_blocks(blocks_of(X, X[:, 1], 350), 700)
    assert [len(loaded(piece)) for piece in few.pieces] == [1, 1]


def test_a_scheduler_is_told_how_much_moving_a_share_would_take():
    X = np.zeros((1000, 2))
    (part,) = loaded(keeping.kept_blocks(blocks_of(X, X[:, 0], 1000), 1000).pieces[0])
    assert 24_000 < sys.getsizeof(part) < 25_000


def test_nothing_is_kept_beyond_a_quarter_of_the_memory_or_without_a_limit(monkeypatch):
    X = np.zeros((10, 2))
    blocks = blocks_of(X, X[:, 0], 5)
    # Two inputs, a target, weight and group: 40 bytes a row, of a quarter of two million.
    assert keeping.kept_blocks(blocks, 12_500) is not blocks
    assert keeping.kept_blocks(blocks, 12_501) is blocks
    for limits in ([], [{"nthreads": 1, "memory_limit": 0}]):
        monkeypatch.setattr(keeping, "_workers", lambda limits=limits: limits)
        assert keeping.kept_blocks(blocks, 10) is blocks


def test_data_that_workers_hold_stay_where_they_are():
    X = np.arange(1400.0).reshape(700, 2)
    blocks = blocks_of(X, X[:, 1], 100)
    # Pieces of tasks that are not to be read, but are there.
    held = [tuple(dask.delayed(part) for part in piece[0].read()) for piece in blocks.pieces]
    kept = keeping.kept_blocks(Blocks(held, blocks.layout), 700)
    assert len(kept.pieces) == 7
    assert_array_equal(loaded(kept.pieces[3])[0].X, X[300:400])


class Client:
    """What a cluster's client says of its workers."""

    def get(self, dsk, keys, **options):
        raise NotImplementedError

    def scheduler_info(self, n_workers):
        assert n_workers == -1  # all of them
        return {"workers": dict(enumerate(WORKERS))}


def test_the_cluster_is_that_of_the_scheduler_in_use():
    assert of_the_cluster() == []
    with dask.config.set(scheduler=Client().get):
        assert of_the_cluster() == WORKERS
