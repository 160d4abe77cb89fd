"""Threads: who works on several rows or starts at once, and who must not.

Work is shared out here, by ``n_jobs``, and nowhere else: BLAS with threads of its own on top would
have more threads than cores, and sums whose last bits depend on how many.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from threading import Lock

from joblib import Parallel, delayed, effective_n_jobs
from threadpoolctl import ThreadpoolController

__all__ = ["map_in_threads", "one_blas_thread"]


class _OneBlasThread:
    """BLAS at one thread from the first fit's beginning to the last one's end.

    The number is the whole process's. Fits in several Python threads overlap, and each by itself
    would take the others' limit for the number to restore.
    """

    def __init__(self) -> None:
        self._lock, self._n_fits, self._limits = Lock(), 0, None

    def begin(self, blas: ThreadpoolController) -> None:
        """One more fit."""
        with self._lock:
            if self._n_fits == 0:
                self._limits = blas.limit(limits=1)
            self._n_fits += 1

    def end(self) -> None:
        """One less."""
        with self._lock:
            self._n_fits -= 1
            if self._n_fits == 0 and self._limits is not None:
                self._limits.restore_original_limits()
                self._limits = None


_one_blas_thread = _OneBlasThread()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """One thread of the numerical libraries, as long as this or another such context is open.

    OpenMP's number belongs to the thread that sets it, and is set and restored in each: the small
    clusterings of a search, which use it, would only be slower with more.
    """
    pools = _thread_pools()
    with pools.select(user_api="openmp").limit(limits=1):
        _one_blas_thread.begin(pools.select(user_api="blas"))
        try:
            yield
        finally:
            _one_blas_thread.end()


@lru_cache(maxsize=1)
def _thread_pools() -> ThreadpoolController:
    """The process's thread pools; looking for them takes as long as a small fit."""
    return ThreadpoolController()


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
