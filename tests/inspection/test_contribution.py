"""The contributions and the baseline are the prediction."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skanfis import ANFISRegressor
from skanfis.inspection import RuleContributionDisplay, explain

from .drawing import A_GRID, ALL, NAMES, drawn


@ALL
@pytest.mark.parametrize("baseline", ["mean", 2.5])
def test_contributions_and_baseline_are_the_prediction(model, baseline):
    display = RuleContributionDisplay.from_estimator(
        model, "rate", held={0: 1e6 + 100.0}, output=0, baseline=baseline, n_points=15
    )
    rows = np.tile([1e6 + 100.0, model.reference[1], 0.0], (15, 1))
    rows[:, 2] = display.grid
    expected = model.predict(rows)[:, 0]
    total = display.baseline + display.contributions.sum(axis=0)
    assert_allclose(total, expected, rtol=1e-9, atol=1e-12)
    assert display.baseline == pytest.approx(expected.mean() if baseline == "mean" else baseline)
    assert_allclose(display.ax_.get_lines()[-1].get_ydata(), total)
    assert set(display.held) == set(NAMES[:2])


def test_contributions_without_baseline_are_those_of_the_explanation():
    display = RuleContributionDisplay.from_estimator(A_GRID, 0, baseline=0, n_points=5)
    rows = np.tile(A_GRID.reference, (5, 1))
    rows[:, 0] = display.grid
    for line in explain(A_GRID, rows).itertuples():
        found = display.contributions[line.rule, line.row]
        assert found == pytest.approx(line.contribution, rel=1e-9)


def test_rules_without_a_line_are_drawn_as_their_sum():
    display = RuleContributionDisplay.from_estimator(A_GRID, max_rules=4)
    names = [text.get_text() for text in display.ax_.get_legend().get_texts()]
    assert names[-2:] == ["8 other rules", "prediction"]
    assert names[0].split(": ")[1] == display.rule_terms[int(names[0].split(": ")[0])]
    lines = [line.get_ydata() - display.baseline for line in display.ax_.get_lines()[1:]]
    assert_allclose(sum(lines[:-1]), lines[-1], atol=1e-9)
    assert len(display.plot(max_rules=12).ax_.get_lines()) == 1 + 12 + 1


def test_where_data_are_missing_is_grey_and_out_of_the_limits():
    # Nothing between: the rules that speak at low and high x have the data.
    X = np.concatenate([np.linspace(0, 1, 40), np.linspace(9, 10, 40)])[:, None]
    model = ANFISRegressor(n_mfs=5, solver="lse").fit(X, np.sin(X[:, 0]))
    display = drawn(RuleContributionDisplay.from_estimator(model))
    assert (display.coverage < 0.5).any()
    assert "grey" in display.ax_.get_title(loc="left")


@pytest.mark.parametrize("baseline", ["median", np.nan, None])
def test_baseline_is_checked(baseline):
    with pytest.raises(ValueError, match=r"baseline=.* must be 'mean' or a finite number"):
        RuleContributionDisplay.from_estimator(A_GRID, baseline=baseline)


def test_band_is_so_many_deviations_wide():
    rng = np.random.default_rng(0)
    X = rng.uniform(size=(60, 2))
    model = ANFISRegressor(n_mfs=2, solver="lse").fit(X, X[:, 0] + 0.1 * rng.normal(size=60))
    display = drawn(RuleContributionDisplay.from_estimator(model, 1, n_deviations=2, n_points=9))
    rows = np.column_stack([np.full(9, display.held["x0"]), display.grid])
    mean, std = model.predict(rows), model.model_.standard_deviation(rows)[:, 0]
    (band,) = display.ax_.collections
    ends = band.get_paths()[0].vertices
    assert_allclose(ends[1:10, 1], mean - 2.0 * std)
    assert_allclose(display.band, 2.0 * std)
    with pytest.raises(ValueError, match="knows of no posterior"):
        RuleContributionDisplay.from_estimator(A_GRID, n_deviations=1)
    with pytest.raises(ValueError, match="n_deviations=-1 must be a number, zero or positive"):
        RuleContributionDisplay.from_estimator(model, n_deviations=-1)
