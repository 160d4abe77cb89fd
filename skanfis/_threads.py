"""Threads: work is shared out by ``n_jobs``; BLAS, whose sums depend on its threads, has one."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import lru_cache

from joblib import Parallel, delayed, effective_n_jobs
from threadpoolctl import ThreadpoolController


@lru_cache(maxsize=1)
def _thread_pools() -> ThreadpoolController:
    """The process's thread pools; looking for them takes as long as a small fit."""
    return ThreadpoolController()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """One thread of the numerical libraries, and as many as before at the end."""
    with _thread_pools().limit(limits=1):
        yield


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
