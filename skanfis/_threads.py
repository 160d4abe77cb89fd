"""Threads: who works on several rows or starts at once, and who must not.

Work is shared out here, by ``n_jobs``, and nowhere else: BLAS with threads of its own on top would
have more threads than cores, and sums whose last bits depend on how many.
"""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from functools import lru_cache
from threading import Lock

from joblib import Parallel, delayed, effective_n_jobs
from threadpoolctl import ThreadpoolController

__all__ = ["map_in_threads", "one_blas_thread"]


class _OneBlasThread:
    """BLAS at one thread from the first fit's beginning to the last one's end.

    The number is the whole process's. Fits in several Python threads overlap, and each by itself
    would take the others' limit for the number to restore, or end it for all. A thread of its own
    sets the number and restores it: threadpoolctl, from 3.8 on, lets no other undo what one did.
    """

    def __init__(self) -> None:
        self._lock, self._n_fits = Lock(), 0
        self._owner: ThreadPoolExecutor | None = None
        self._limit = ExitStack()

    def begin(self) -> None:
        """One more fit."""
        with self._lock:
            self._n_fits += 1
            if self._n_fits == 1:
                self._owner = ThreadPoolExecutor(1, thread_name_prefix="skanfis-blas")
                self._owner.submit(self._set).result()

    def end(self) -> None:
        """One less."""
        with self._lock:
            self._n_fits -= 1
            if self._n_fits == 0 and self._owner is not None:
                self._owner.submit(self._limit.close).result()
                self._owner.shutdown()
                self._owner = None

    def _set(self) -> None:
        blas = _thread_pools().select(user_api="blas")
        for library in blas.lib_controllers:
            # A limit that the user has set in another thread would else stand.
            if hasattr(library, "clear_controlling_thread"):
                library.clear_controlling_thread(force=True)
        self._limit.enter_context(blas.limit(limits=1))


_one_blas_thread = _OneBlasThread()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """One thread of the numerical libraries, as long as this or another such context is open."""
    try:
        _one_blas_thread.begin()
        # Of MKL and OpenMP the number belongs to the thread that sets it. What is the process's is
        # one already, so that this changes nothing of it, nor its end.
        with _thread_pools().limit(limits=1):
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
