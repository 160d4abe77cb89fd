"""Workers give their results in order; what a fit sets for the process is then as before."""

import time
import warnings
from threading import Event, Thread

import numpy as np
import pytest
from sklearn.linear_model import LinearRegression
from threadpoolctl import threadpool_info, threadpool_limits

from skanfis import ANFISRegressor
from skanfis._threads import map_in_threads, one_blas_thread, without
from skanfis.intervals import ConformalRegressor


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


def test_warnings_are_heard_again_after_the_last_of_those_who_ignored_them():
    """Threads leave in any order; contexts of Python's own would leave them ignored for good."""
    before = list(warnings.filters)
    first, second = without(FutureWarning), without(FutureWarning)
    first.__enter__()
    second.__enter__()
    warnings.warn("ignored", FutureWarning, stacklevel=1)
    first.__exit__(None, None, None)
    warnings.warn("still ignored", FutureWarning, stacklevel=1)
    second.__exit__(None, None, None)
    assert warnings.filters == before
    with pytest.warns(FutureWarning, match="heard"):
        warnings.warn("heard", FutureWarning, stacklevel=1)


def test_fits_that_overlap_leave_the_filters_of_warnings_as_they_were():
    """The first measures its held-out rows until the second does, which outlasts it."""
    first_is_in, second_is_in, first_is_done = Event(), Event(), Event()

    class First(LinearRegression):
        def predict(self, X):
            first_is_in.set()
            assert second_is_in.wait(30)
            return super().predict(X)

    class Second(LinearRegression):
        def predict(self, X):
            second_is_in.set()
            assert first_is_done.wait(30)
            return super().predict(X)

    def fit(regressor):
        X = np.arange(40.0).reshape(-1, 1)
        ConformalRegressor(regressor, method="split", scaled=False).fit(X, X[:, 0])

    before = list(warnings.filters)
    first, second = Thread(target=fit, args=[First()]), Thread(target=fit, args=[Second()])
    first.start()
    assert first_is_in.wait(30)
    second.start()
    first.join()
    first_is_done.set()
    second.join()
    assert warnings.filters == before
