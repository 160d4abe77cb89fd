"""Branch and bound on a function whose largest value, and that on every box, is known."""

import numpy as np
import pytest

from skanfis.bounds.search import largest

TOP = np.array([0.3, -20.0, 4e-3])
WIDTH = np.array([1.0, 100.0, 1e-2])


def loose(seen, least):
    """Minus the squared distance from TOP, enclosed by twice its range on a box."""

    def evaluate(low, high):
        seen.append((low, high))
        middle = 0.5 * (low + high)
        at = (middle - TOP[:, None]) / WIDTH[:, None]
        half = 0.5 * (high - low) / WIDTH[:, None]
        near = np.maximum(np.abs(at) - 2.0 * half, 0.0)
        attained = -np.sum(at**2, axis=0)
        return -np.sum(near**2, axis=0) - least, middle, attained, half

    return evaluate


@pytest.mark.parametrize("cut", [0.1, np.nan])
def test_the_top_is_enclosed_and_few_boxes_are_never_looked_at_alone(cut):
    seen = []
    low, high = TOP - 0.7 * WIDTH, TOP + 0.5 * WIDTH
    cuts = np.full((3, 2), np.nan)
    cuts[0, 0] = cut
    found = largest(loose(seen, 0.0), low, high, 1e-4, 100_000, cuts)
    assert found.converged
    assert -1e-4 <= found.attained <= 0.0 <= found.bound <= found.attained + 1e-4
    assert np.sum(((found.point - TOP) / WIDTH) ** 2) <= 1e-4
    assert sum(one.shape[1] for one, _ in seen) == found.n_boxes
    assert seen[0][0].shape[1] == 1
    assert min(one.shape[1] for one, _ in seen[1:]) >= 64
    # The parts of the first box are that box.
    starts, stops = seen[1]
    assert np.prod(stops - starts, axis=0).sum() == pytest.approx(np.prod(high - low))
    inside = (starts < TOP[:, None]) & (TOP[:, None] < stops)
    assert inside.all(axis=0).sum() == 1
    assert ((starts[0] < cut) & (cut < stops[0])).sum() == 0


def test_it_ends_as_soon_as_it_is_known_whether_a_value_is_passed():
    seen = []
    low, high = TOP - WIDTH, TOP + 0.5 * WIDTH
    passed = largest(loose(seen, 0.0), low, high, 0.0, 100_000, np.full((3, 2), np.nan), until=-0.5)
    assert passed.attained > -0.5
    assert len(seen) == 1
