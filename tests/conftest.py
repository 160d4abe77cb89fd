"""What all tests share."""

import sys

import numpy as np
import pytest

# It is read by mypy, and run by nobody.
collect_ignore = ["typed_user.py"]


@pytest.fixture
def rng():
    """A generator with the same seed for every test."""
    return np.random.default_rng(0)


@pytest.fixture(autouse=True)
def _no_open_figures():
    """Close what a test draws; matplotlib is not imported for the sake of it."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
