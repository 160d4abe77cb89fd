"""Searches that go all of their ways, in less time."""

import pytest

from ..quick import with_few_candidates


@pytest.fixture
def few_candidates(monkeypatch):
    """Where which structure is found is not the question."""
    with_few_candidates(monkeypatch)
