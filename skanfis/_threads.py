"""Worker threads for ``n_jobs``; what a thread sets for the whole process, and sets back."""

import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import lru_cache, partial
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
# BLAS has one thread limit for the whole process, and Python one list of filters of warnings.
# Several threads restore them in reverse order, whichever ends first: the last restores the
# original. OpenMP has a limit per thread.
_BLAS_LIMITS: list = []
_FILTERS: list = []
_LOCK = Lock()


@contextmanager
def _restored_by_the_last(entered: list, change: Callable) -> Iterator[None]:
    """Change what is the whole process's, by a context that ``change`` makes."""
    with _LOCK:
        entered.append(change())
        entered[-1].__enter__()
    try:
        yield
    finally:
        with _LOCK:
            entered.pop().__exit__(None, None, None)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Hold numerical libraries to one thread, as sums of BLAS depend on their number."""
    blas, openmp = (_thread_pools().select(user_api=api) for api in ("blas", "openmp"))
    one = partial(blas.limit, limits=1)
    with _restored_by_the_last(_BLAS_LIMITS, one), openmp.limit(limits=1):
        yield


def without(category: type[Warning]) -> AbstractContextManager[None]:
    """Ignore warnings of a category, as ``warnings.catch_warnings``, but fit for threads."""
    ignored = partial(warnings.catch_warnings, action="ignore", category=category)
    return _restored_by_the_last(_FILTERS, ignored)


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
