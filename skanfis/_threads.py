"""Worker threads for ``n_jobs``; BLAS gets one thread, as its sums depend on their number."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from numbers import Integral
from threading import Lock

from joblib import Parallel, delayed, effective_n_jobs
from threadpoolctl import ThreadpoolController

from ._sklearn import Interval

# What ``n_jobs`` may be, for ``_parameter_constraints``: joblib has no meaning for zero.
N_JOBS = [
    Interval(Integral, None, -1, closed="right"),
    Interval(Integral, 1, None, closed="left"),
    None,
]

# The process's thread pools, kept because finding them takes as long as a small fit.
_thread_pools = lru_cache(maxsize=1)(ThreadpoolController)
# BLAS has one thread limit for the whole process. Fits in several threads restore it in reverse
# order, whichever ends first: the last restores the original. OpenMP has a limit per thread.
_BLAS_LIMITS: list = []
_LOCK = Lock()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Hold numerical libraries to one thread; the last fit to end restores the number before."""
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
