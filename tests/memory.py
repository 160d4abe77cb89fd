"""How much memory a block of code takes."""

import tracemalloc
from contextlib import contextmanager


@contextmanager
def traced():
    """A list that holds, after the block, the most bytes that were in use in it."""
    peak = []
    tracemalloc.start()
    try:
        yield peak
    finally:
        peak.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
