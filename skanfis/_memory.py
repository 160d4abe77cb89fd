"""What a block of rows frees is kept for the next block, also where freed memory goes back at once.

A pass allocates and frees the same arrays block after block. glibc learns to keep them, unless the
environment has set ``MALLOC_TRIM_THRESHOLD_``, which ends the learning: then every array comes page
by page from the operating system again, and a fit takes almost three times as long, most of it in
the kernel. The workers of ``dask.distributed`` are started so (64 kB), to look small between tasks.
Within a pass the limits are raised here, and put back after it.
"""

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

__all__ = ["keeps_freed_memory"]

# Of glibc's malloc.h, and what it takes where nothing is set.
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD, _DEFAULT = -1, -3, 128 * 1024
# Arrays of a block are smaller than the one, and all of them together than the other.
_LARGEST_ARRAY, _KEPT = 8 * 2**20, 64 * 2**20
_SET = "MALLOC_TRIM_THRESHOLD_"

_lock = Lock()
_n_inside = 0


@contextmanager
def keeps_freed_memory() -> Iterator[None]:
    """Keep some 64 MB of what is freed, as long as this or another such context is open.

    Without ``MALLOC_TRIM_THRESHOLD_``, and where the C library is another one, it does nothing.
    """
    set_limit = _mallopt() if _SET in os.environ else None
    if set_limit is None:
        yield
        return
    global _n_inside
    with _lock:
        _n_inside += 1
        if _n_inside == 1:
            set_limit(_M_MMAP_THRESHOLD, _LARGEST_ARRAY)
            set_limit(_M_TRIM_THRESHOLD, _KEPT)
    try:
        yield
    finally:
        with _lock:
            _n_inside -= 1
            if _n_inside == 0:
                set_limit(_M_MMAP_THRESHOLD, _given("MALLOC_MMAP_THRESHOLD_"))
                set_limit(_M_TRIM_THRESHOLD, _given(_SET))


def _mallopt():
    """The function of glibc that sets a limit of malloc; None where there is none."""
    try:
        library = ctypes.CDLL(None)
        return library.mallopt if hasattr(library, "gnu_get_libc_version") else None
    except (OSError, TypeError):  # Windows has no library of this name
        return None


def _given(name):
    """The limit that the environment sets."""
    try:
        return int(os.environ.get(name, ""))
    except ValueError:
        return _DEFAULT
