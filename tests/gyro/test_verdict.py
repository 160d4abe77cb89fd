"""Which compensation is recommended, by planted errors."""

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from skanfis.gyro._calibration import judge

N_GROUPS, N_ROWS = 8, 50
GROUPS = np.repeat(np.arange(N_GROUPS), N_ROWS)
UNEVEN = np.geomspace(0.01, 0.5, N_GROUPS)


def errors_of(rng, **sizes):
    """Errors of given sizes by group, by name, "no compensation" first."""
    found = {"no compensation": np.full(GROUPS.size, 1.0)}
    for name, size in sizes.items():
        signs = rng.permuted(np.tile([-1.0, 1.0], (N_GROUPS, N_ROWS // 2)), axis=1)
        found[name] = np.broadcast_to(size, N_GROUPS)[GROUPS] * signs.ravel()
    return found


def test_gain_is_the_geometric_mean_with_students_interval(rng):
    simple, model = rng.uniform(0.5, 2.0, (2, N_GROUPS))
    verdict = judge(errors_of(rng, line=simple, model=model), GROUPS)
    ratios = np.log(simple / model)
    gain = verdict.gains["line"]
    assert gain.factor == pytest.approx(np.exp(ratios.mean()))
    low, high = np.exp(ttest_1samp(ratios, 0.0).confidence_interval(0.95))
    assert (gain.low, gain.high) == pytest.approx((low, high))
    assert gain.of_all_rows == pytest.approx(np.sqrt(np.mean(simple**2) / np.mean(model**2)))


@pytest.mark.parametrize(
    ("constant", "line", "model", "recommended"),
    [
        # Better in every group; of very different sizes, a mean of squares sees the largest alone.
        (UNEVEN, 1.0, 0.8 * UNEVEN, "model"),
        # Smaller, but by less than groups scatter.
        (0.1, 0.1, 0.1 * np.array([0.5, 0.5, 1.4, 0.6, 0.5, 1.5, 0.6, 1.3]), "constant"),
        # Smaller in every group, but not worth it.
        (0.1, 0.1, 0.099, "constant"),
        (0.1, 0.05, 0.0495, "line"),
        # Larger.
        (0.1, 0.02, 0.05, "line"),
        # One bad group that a mean of logarithms hardly sees.
        (0.1, 0.1, np.array([0.01] * 7 + [0.5]), "constant"),
        # One bad group of what is between, by which its errors scatter.
        (0.2, np.array([0.01] * 7 + [9.0]), 0.005, "model"),
        # Nothing helps.
        (1.0, 1.0, 1.0, "no compensation"),
        # Equal up to rounding.
        (0.0, 1e-17, 1e-18, "constant"),
    ],
)
def test_the_simplest_that_nothing_beats_is_recommended(rng, constant, line, model, recommended):
    verdict = judge(errors_of(rng, constant=constant, line=line, model=model), GROUPS)
    assert (verdict.recommended, verdict.model) == (recommended, "model")


def test_one_group_shows_nothing(rng):
    errors = {name: error[:N_ROWS] for name, error in errors_of(rng, model=0.01).items()}
    verdict = judge(errors, GROUPS[:N_ROWS])
    assert np.isnan(verdict.gains["no compensation"].low)
    assert verdict.recommended == "no compensation"


@pytest.mark.parametrize(
    ("most", "constant", "recommended"),
    [
        ("constant", 0.5, "constant"),
        ("constant", 1.2, "no compensation"),
        ("line", 0.5, "straight line"),
        # No law was fitted.
        ("law-line", 0.5, "straight line"),
    ],
)
def test_no_more_is_recommended_than_the_split_can_tell(rng, most, constant, recommended):
    """However much better it looks: it was judged on the cycle, or rates, that it learnt."""
    errors = errors_of(rng, constant=constant, **{"straight line": 0.01}, model=0.001)
    assert judge(errors, GROUPS, most).recommended == recommended
    assert judge(errors, GROUPS).recommended == "model"
