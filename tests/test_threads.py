"""Workers give their results in order; BLAS has one thread while a fit runs, and then as before."""

import time

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from skanfis import ANFISRegressor
from skanfis._threads import map_in_threads, one_blas_thread


@pytest.mark.parametrize("n_jobs", [None, 1, 2, 3])
def test_results_come_in_order_whoever_is_done_first(n_jobs):
    def slow_at_first(k):
        time.sleep(0.01 * (k == 0))
        return k**2

    found = list(map_in_threads(n_jobs)(slow_at_first, list(range(20))))
    assert found == [k**2 for k in range(20)]


def blas_threads():
    return [pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"]


def test_as_many_as_before_where_a_fit_fails():
    with threadpool_limits(2, user_api="blas"):
        before = blas_threads()
        with pytest.raises(ValueError, match="n_mfs"):
            ANFISRegressor(n_mfs=100).fit(np.arange(15.0).reshape(5, 3), np.arange(5.0))
        assert blas_threads() == before


def test_as_many_as_before_after_the_last_of_fits_side_by_side():
    with threadpool_limits(2, user_api="blas"):
        before = blas_threads()
        first, second = one_blas_thread(), one_blas_thread()
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        assert set(blas_threads()) == {1}
        second.__exit__(None, None, None)
        assert blas_threads() == before
