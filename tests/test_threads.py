"""Workers give their results in order; BLAS has one thread while a fit runs, and then as before."""

import threading
import time

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from skanfis import ANFISRegressor
from skanfis._threads import map_in_threads
from skanfis.learning import LeastSquares


@pytest.mark.parametrize("n_jobs", [None, 1, 2, 3])
def test_results_come_in_order_whoever_is_done_first(n_jobs):
    def slow_at_first(k):
        time.sleep(0.01 * (k == 0))
        return k**2

    found = list(map_in_threads(n_jobs)(slow_at_first, list(range(20))))
    assert found == [k**2 for k in range(20)]


def test_error_of_a_worker_reaches_the_caller():
    def fails_at_five(k):
        if k == 5:
            raise FloatingPointError("five")
        return k

    with pytest.raises(FloatingPointError, match="five"):
        list(map_in_threads(2)(fails_at_five, list(range(10))))


def blas_threads():
    return [pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"]


@pytest.fixture
def two_blas_threads():
    """As on any machine."""
    limits = threadpool_limits(2, user_api="blas")
    yield blas_threads()
    limits.restore_original_limits()


class Waiting(LeastSquares):
    """Least squares, once its turn has come; notes how many threads BLAS has before and after."""

    def __init__(self, begun, go, seen):
        self.begun, self.go, self.seen = begun, go, seen

    def solve(self, problem, premise, **settings):
        self.begun.set()
        assert self.go.wait(60.0)
        self.seen.extend(blas_threads())
        return super().solve(problem, premise, **settings)


def fit(solver):
    X = np.linspace(-1.0, 1.0, 30).reshape(-1, 1)
    ANFISRegressor(n_mfs=2, agreement=0.1, solver=solver).fit(X, np.sin(3.0 * X[:, 0]))


@pytest.mark.parametrize("first_to_end", [0, 1])
def test_one_thread_as_long_as_any_of_overlapping_fits_runs(two_blas_threads, first_to_end):
    seen = []
    solvers = [Waiting(threading.Event(), threading.Event(), seen) for _ in range(2)]
    fits = [threading.Thread(target=fit, args=(solver,)) for solver in solvers]
    for solver, thread in zip(solvers, fits, strict=True):
        thread.start()
        assert solver.begun.wait(60.0)
    for k in (first_to_end, 1 - first_to_end):
        solvers[k].go.set()
        fits[k].join(60.0)
        assert set(blas_threads()) == ({1} if k == first_to_end else set(two_blas_threads))
    # Each has found one, the second after the first had ended.
    assert len(seen) == 2 * len(two_blas_threads)
    assert set(seen) == {1}


def test_as_many_as_before_where_a_fit_fails(two_blas_threads):
    with pytest.raises(ValueError, match="n_mfs"):
        ANFISRegressor(n_mfs=100).fit(np.arange(15.0).reshape(5, 3), np.arange(5.0))
    assert blas_threads() == two_blas_threads
