"""A cluster of real processes: one dies in the middle of a fit, and in the end it is closed."""

import os
import signal
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

pytest.importorskip("distributed")

import dask
import dask.array as da
from distributed import Client, LocalCluster
from distributed.scheduler import KilledWorker
from distributed.utils import get_mp_context

from skanfis import ANFISRegressor
from skanfis.dask import DaskANFISRegressor, rows
from skanfis.learning import sampling

N_ROWS = 4000


def noting(flag):
    """A function that returns its block, and writes down that it was called."""

    def note(block):  # inside, so that it is sent as it is: workers know no module of tests
        with open(flag, "a") as file:
            file.write(".")
        return block

    return note


@pytest.mark.slow
@pytest.mark.filterwarnings(
    "ignore::DeprecationWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
)
def test_a_worker_may_die_and_a_closed_cluster_is_said_to_be_so(tmp_path, monkeypatch, rng):
    monkeypatch.setattr(sampling, "MANY_ROWS", N_ROWS - 1)
    monkeypatch.setattr(sampling, "SAMPLE_ROWS", 1000)
    X = rng.uniform(-1.0, 1.0, (N_ROWS, 2))
    y = np.sin(3.0 * X[:, 0]) * X[:, 1] + 0.1 * rng.standard_normal(N_ROWS)
    expected = ANFISRegressor(n_mfs=2).fit(X, y).model_.coefficients
    flag = tmp_path / "calls"
    passes, whole = [], rows.reduce_partitions

    def fifth(partitions, of_rows, merge):
        passes.append(len(partitions.pieces))
        if len(passes) == 5:
            os.kill(client.run(os.getpid).popitem()[1], signal.SIGKILL)
        return whole(partitions, of_rows, merge)

    monkeypatch.setattr(rows, "reduce_partitions", fifth)
    options = {"n_workers": 1, "threads_per_worker": 1, "dashboard_address": ":0"}
    # Workers that are forked from a process which has imported everything, once for both.
    worker = dask.config.config["distributed"]["worker"]
    monkeypatch.setitem(worker, "multiprocessing-method", "forkserver")
    get_mp_context().set_forkserver_preload(["distributed", "skanfis.dask"])
    with LocalCluster(**options) as cluster, Client(cluster) as client:
        blocks = da.from_array(X, chunks=(1000, 2)).blocks
        noted = blocks[1].map_blocks(noting(str(flag)), dtype=float, meta=X[:0])
        lazy_X = da.concatenate([blocks[0], noted, blocks[2:]])
        lazy_y = da.from_array(y, chunks=1000)
        model = DaskANFISRegressor(n_mfs=2).fit(lazy_X, lazy_y)
        # Loaded once for every pass.
        assert flag.stat().st_size == len(passes) > 5
        # Sums over partitions and over blocks of rows are rounded differently.
        assert_allclose(model.model_.coefficients, expected, rtol=1e-10, atol=1e-10)
        predicted = model.predict(lazy_X)
        assert_allclose(predicted.compute(), model.predict(X), rtol=1e-12)
        lazy_X, lazy_y = da.from_array(X, chunks=(1000, 2)).persist(), lazy_y.persist()
    with pytest.raises(RuntimeError, match="was closed"):
        model.fit(lazy_X, lazy_y)


def test_a_partition_that_ends_its_workers_is_said_to_be_too_large():
    def ended():
        raise KilledWorker("sum-3", SimpleNamespace(address="tcp://w"), 3)

    with (
        dask.config.set(scheduler="synchronous"),
        pytest.raises(RuntimeError, match=r"same partition ended several workers.*KilledWorker"),
    ):
        rows.computed(dask.delayed(ended)())
