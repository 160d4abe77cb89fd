"""Freed memory is kept within a pass where the environment says to give it back at once."""

import os
import subprocess
import sys

import pytest

COUNT_FAULTS = """
import resource
import numpy as np
from skanfis._memory import keeps_freed_memory

def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(200):
        np.ones(100_000) * 2.0  # the first one in its place: 195 pages
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

with keeps_freed_memory():
    with keeps_freed_memory():
        pass
    inside = faults()
print(inside, faults())
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="glibc's limits")
def test_pages_are_taken_once_within_and_given_back_after():
    environment = {**os.environ, "MALLOC_TRIM_THRESHOLD_": "65536"}
    command = [sys.executable, "-c", COUNT_FAULTS]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    inside, after = map(int, done.stdout.split())
    if after < 30_000:
        pytest.skip("this C library keeps what is freed")
    assert inside < 0.05 * after
