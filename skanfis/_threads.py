"""Threads: work is shared out by ``n_jobs``; BLAS, whose sums depend on its threads, has one."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from threading import Lock

from joblib import Parallel, delayed, effective_n_jobs
from threadpoolctl import ThreadpoolController

# The process's thread pools; looking for them takes as long as a small fit.
_thread_pools = lru_cache(maxsize=1)(ThreadpoolController)
# BLAS has one number of threads for the whole process: fits in several threads give it back in
# reverse order, whichever ends first. Of OpenMP every thread has a number of its own.
_BLAS_LIMITS: list = []
_LOCK = Lock()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """One thread of the numerical libraries; at the end of the last fit as many as before."""
    blas, openmp = (_thread_pools().select(user_api=api) for api in ("blas", "openmp"))
    with _LOCK:
        _BLAS_LIMITS.append(blas.limit(limits=1))
    try:
        with openmp.limit(limits=1):
            yield
    finally:
        with _LOCK:
            _BLAS_LIMITS.pop().restore_original_limits()


def map_in_threads(n_jobs: int | None) -> Callable[[Callable, Iterable], Iterable]:
    """``map`` over worker threads, with the results in order."""
    if effective_n_jobs(n_jobs) == 1:
        return map

    def map_ordered(function, items):
        if len(items) == 1:
            return map(function, items)
        parallel = Parallel(n_jobs=n_jobs, backend="threading", return_as="generator")
        return parallel(delayed(function)(item) for item in items)

    return map_ordered
