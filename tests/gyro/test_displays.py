"""Pictures: what they store is right, and what they draw says so, with units."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skanfis.gyro import (
    AllanDisplay,
    CoverageDisplay,
    ErrorDisplay,
    GroupResidualDisplay,
    HysteresisDisplay,
    ResidualSurfaceDisplay,
    ScaleFactorErrorDisplay,
)

from ..quick import quick

mpl = pytest.importorskip("matplotlib")
mpl.use("Agg")
Figure = pytest.importorskip("matplotlib.figure").Figure

N_ROWS = 4000


@pytest.fixture
def rates(rng):
    """True rate, indicated and compensated rate, temperature and its rate of change."""
    time = np.linspace(0.0, 1.0, N_ROWS)
    temperature = 20.0 + 30.0 * np.sin(2 * np.pi * time)
    rate = rng.choice(np.linspace(-100.0, 100.0, 21), N_ROWS)
    before = rate * (1 - 400e-6 * (temperature - 20.0)) + 0.01
    after = rate + 0.001 * rng.standard_normal(N_ROWS)
    return {
        "rate": rate,
        "before": before,
        "after": after,
        "temperature": temperature,
        "temperature_rate": np.cos(2 * np.pi * time),
    }


def three(rates):
    return rates["rate"], rates["before"], rates["after"]


OPTIONS = {
    ErrorDisplay: lambda rates: {"position": np.arange(N_ROWS)},
    HysteresisDisplay: lambda rates: {
        "temperature": rates["temperature"],
        "temperature_rate": rates["temperature_rate"],
    },
    ScaleFactorErrorDisplay: lambda rates: {"temperature": rates["temperature"]},
    ResidualSurfaceDisplay: lambda rates: {"temperature": rates["temperature"]},
    GroupResidualDisplay: lambda rates: {"groups": np.arange(N_ROWS) // 1000},
}
DISPLAYS = list(OPTIONS)


def axes_of(display):
    return getattr(display, "axes_", None) if hasattr(display, "axes_") else [display.ax_]


@pytest.mark.parametrize("display_class", DISPLAYS)
def test_every_axis_has_its_unit(display_class, rates):
    display = display_class.from_predictions(*three(rates), **OPTIONS[display_class](rates))
    display.figure_.canvas.draw()
    axes = axes_of(display)
    assert axes[-1].get_xlabel().endswith("]")
    for panel in axes:
        shared = panel.get_shared_y_axes().get_siblings(panel)
        assert any(each.get_ylabel().endswith(("]", "group")) for each in shared)


@pytest.mark.parametrize("display_class", DISPLAYS)
def test_draws_on_the_axes_given(display_class, rates):
    n_axes = 1 if display_class is GroupResidualDisplay else 2
    axes = np.atleast_1d(Figure().subplots(n_axes))
    options = OPTIONS[display_class](rates)
    display = display_class.from_predictions(*three(rates), ax=axes, **options)
    assert list(axes_of(display)) == list(axes)
    with pytest.raises(ValueError, match=f"ax has 3 axes; this picture needs {n_axes}"):
        display.plot(ax=Figure().subplots(3))


def drawn_lines(display):
    """Points of all lines, in the order of the axes."""
    points = [line.get_xydata() for axes in axes_of(display) for line in axes.lines]
    return np.concatenate(points).astype(float)


DRAWN = {
    ErrorDisplay: ("points", "time [s]", ["error before", "error after"]),
    HysteresisDisplay: (
        "bias",
        "temperature [degC]",
        [f"bias {when}, {how}" for when in ("before", "after") for how in ("warming", "cooling")],
    ),
    GroupResidualDisplay: ("groups", "RMS error", ["RMS error before", "RMS error after"]),
}


@pytest.mark.parametrize("unit", ["deg/s", "deg/h"])
@pytest.mark.parametrize("display_class", DRAWN)
def test_tables_hold_what_is_drawn(display_class, unit, rates):
    options = OPTIONS[display_class](rates)
    display = display_class.from_predictions(*three(rates), unit=unit, **options)
    name, position, columns = DRAWN[display_class]
    table = display.tables()[name]
    values = [table[f"{column} [{unit}]"] for column in columns]
    if display_class is GroupResidualDisplay:
        lines = np.arange(len(table))
        expected = np.concatenate([np.column_stack([value, lines]) for value in values])
    else:
        expected = np.concatenate([np.column_stack([table[position], v]) for v in values])
    np.testing.assert_allclose(drawn_lines(display), expected, rtol=1e-12)


@pytest.mark.parametrize("display_class", DISPLAYS)
def test_tables_need_no_drawing(display_class, rates):
    display = display_class.from_predictions(*three(rates), **OPTIONS[display_class](rates))
    drawn, undrawn = display.tables(), replace(display).tables()
    assert drawn.keys() == undrawn.keys()
    for name, table in drawn.items():
        pd.testing.assert_frame_equal(undrawn[name], table)


def test_tables_of_bands_cells_and_scale_factors_hold_what_is_drawn(rates):
    display = ErrorDisplay.from_predictions(*three(rates), position=np.arange(N_ROWS), unit="deg/h")
    bands = display.tables()["bands"]
    heights = display.axes_[1].collections[0].get_paths()[0].vertices[:, 1]
    assert bands["largest error after [deg/h]"].max() == pytest.approx(heights.max())
    assert bands["smallest error after [deg/h]"].min() == pytest.approx(heights.min())
    display = ScaleFactorErrorDisplay.from_predictions(
        *three(rates), temperature=rates["temperature"]
    )
    table = display.tables()["scale-factor"]
    found = np.concatenate([table.iloc[:, [2, 3]], table.iloc[:, [2, 4]]])
    np.testing.assert_allclose(drawn_lines(display), found, rtol=1e-12)
    display = ResidualSurfaceDisplay.from_predictions(
        *three(rates), temperature=rates["temperature"], unit="deg/h"
    )
    cells = display.tables()["cells"]
    mesh = display.axes_[0].collections[0].get_array()
    found = np.ma.filled(mesh.astype(float), np.nan).ravel()
    np.testing.assert_allclose(cells["mean error after [deg/h]"], found, rtol=1e-12)
    # A cell's rows by its ends, by hand.
    x, y = "temperature [degC]", "true rate [deg/s]"
    cell = cells.loc[cells["rows"].idxmax()]
    within = (rates["temperature"] >= cell[f"{x}, from"]) & (
        rates["temperature"] < cell[f"{x}, to"]
    )
    within &= (rates["rate"] >= cell[f"{y}, from"]) & (rates["rate"] <= cell[f"{y}, to"])
    assert within.sum() == cell["rows"]


@pytest.mark.parametrize(
    ("low", "factor"),
    # Within a decade, over one or two, and over many; from each side of a label.
    [
        *((2e-6, 1.0), (0.004, 1.0), (0.9, 3.0), (3.0, 3.0)),
        *((3.0, 40.0), (2000.0, 40.0), (2e-6, 1e5), (0.9, 1e5)),
    ],
)
def test_numbers_on_a_logarithmic_axis_can_be_read(low, factor):
    rate = np.zeros(40)
    after = np.repeat([low, 0.5 * low * (1 + factor), low * factor, low], 10)
    display = GroupResidualDisplay.from_predictions(
        rate, after * factor, after, groups=np.repeat([0, 1, 2, 3], 10)
    )
    renderer = display.figure_.canvas.get_renderer()
    display.figure_.canvas.draw()
    left, right = display.ax_.get_xlim()
    labels = [
        label
        for label, place in zip(
            display.ax_.get_xticklabels(), display.ax_.get_xticks(), strict=True
        )
        if left <= place <= right
    ]
    assert len(labels) >= 2
    assert not any("$" in label.get_text() for label in labels)
    boxes = [label.get_window_extent(renderer) for label in labels]
    assert all(one.x1 < two.x0 for one, two in pairwise(boxes))
    values = [float(label.get_text().replace(",", "")) for label in labels]
    assert all(0.9 * left <= value <= 1.1 * right for value in values)


@pytest.mark.parametrize("display_class", DISPLAYS)
def test_estimator_and_predictions_give_the_same(display_class, rates):
    X = pd.DataFrame(rates).assign(output=rates["before"], number=np.arange(N_ROWS))
    X["position"], X["groups"] = X["number"], X["number"] // 1000
    inputs = X[["temperature", "output"]]
    error = X["output"] - X["rate"]
    options = OPTIONS[display_class](rates)
    for predicts, target in (("error", error), ("rate", X["rate"])):
        model = LinearRegression().fit(inputs, target)
        predicted = model.predict(inputs)
        after = X["output"] - predicted if predicts == "error" else predicted
        one = display_class.from_predictions(X["rate"], X["output"], after, **options)
        names = {name: name for name in options}
        two = display_class.from_estimator(model, X, X["rate"], predicts=predicts, **names)
        for name in vars(one):
            if not name.endswith("_") and isinstance(getattr(one, name), np.ndarray):
                np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


def test_predicts_is_checked(rates):
    X = pd.DataFrame(rates)
    model = LinearRegression().fit(X, X["rate"])
    with pytest.raises(ValueError, match="predicts='phase' must be one of error, rate"):
        ErrorDisplay.from_estimator(
            model, X, X["rate"], output="before", predicts="phase", position="temperature"
        )


@pytest.mark.parametrize("display_class", DISPLAYS)
def test_columns_of_unequal_length_are_refused(display_class, rates):
    rate, before, after = three(rates)
    with pytest.raises(ValueError, match=r"after has shape \(3999,\).*as many as rate"):
        display_class.from_predictions(rate, before, after[1:], **OPTIONS[display_class](rates))


def test_error_band_keeps_every_peak_and_leaves_gaps_open(rates):
    rate, before, after = three(rates)
    position = np.arange(N_ROWS, dtype=float)
    position[2000:] += 4000.0
    after = after.copy()
    after[123], after[3456] = rate[123] + 5.0, rate[3456] - 7.0
    display = ErrorDisplay.from_predictions(rate, before, after, position=position)
    assert np.nanmax(display.range_after) == pytest.approx(5.0)
    assert np.nanmin(display.range_after) == pytest.approx(-7.0)
    middle = (display.edges[:-1] > 2100) & (display.edges[1:] < 5900)
    assert np.isnan(display.range_after[middle]).all()
    assert display.rms[0] == pytest.approx(np.sqrt(np.mean((before - rate) ** 2)))
    assert "7.00 °/s" in display.axes_[1].get_title(loc="left")


def test_error_in_degrees_per_hour(rates):
    display = ErrorDisplay.from_predictions(
        *three(rates), position=rates["temperature"], position_label="temperature [°C]"
    )
    per_second = display.axes_[1].get_ylim()[1]
    display.plot(unit="deg/h")
    assert display.axes_[1].get_ylabel() == "error [°/h]"
    assert display.axes_[1].get_ylim()[1] == pytest.approx(3600 * per_second)
    with pytest.raises(ValueError, match=r"unit='deg' must be one of deg/s, deg/h"):
        display.plot(unit="deg")


def test_refused_rows_are_left_out(rates):
    rate, before, after = three(rates)
    after = np.where(np.arange(N_ROWS) < 100, np.nan, after)
    display = ErrorDisplay.from_predictions(rate, before, after, position=np.arange(N_ROWS))
    assert display.rms[1] == pytest.approx(0.001, rel=0.1)


def test_hysteresis_is_that_of_the_law(rates):
    bias = (0.5 * rates["temperature"] + 10.0 * rates["temperature_rate"]) / 3600.0
    # A scale factor that changes with temperature, and its cube, are no bias.
    rate = rates["rate"]
    by_rate = 1e-4 * rates["temperature"] * rate - 1e-6 * rate**3
    display = HysteresisDisplay.from_predictions(
        rate,
        rate + by_rate + bias,
        rate,
        temperature=rates["temperature"],
        temperature_rate=rates["temperature_rate"],
    )
    # The branches are 2 x 10 deg/h x |rate of change| apart, most where it is 1 degC/min.
    expected = 20.0 * np.sqrt(1 - ((display.temperature - 20.0) / 30.0) ** 2)
    inner = np.abs(display.temperature - 20.0) < 20.0
    gap = (display.before[0] - display.before[1])[inner]
    np.testing.assert_allclose(gap, expected[inner], rtol=0.05)
    assert display.gap_before_ == pytest.approx(20.0, rel=0.05)
    assert display.gap_after_ == pytest.approx(0.0, abs=1e-6)


def test_a_temperature_that_only_rises_has_no_gap(rates):
    display = HysteresisDisplay.from_predictions(
        *three(rates), temperature=rates["temperature"], temperature_rate=np.ones(N_ROWS)
    )
    assert np.isnan(display.gap_before_)
    assert "never meet" in display.axes_[0].get_title(loc="left")


def test_scale_factor_error_is_that_of_the_law(rates):
    rate, temperature = rates["rate"], rates["temperature"]
    before = rate * (1 + 1e-6 * (300.0 + 0.02 * rate**2)) + 0.5  # a bias is no scale factor
    display = ScaleFactorErrorDisplay.from_predictions(
        rate, before, rate, temperature=temperature, n_temperatures=2
    )
    known = np.isfinite(display.before)
    assert np.abs(display.rate[known]).min() >= 5.0
    expected = 300.0 + 0.02 * display.rate**2
    # The bias is taken from a line through a cubic: a fraction of a ppm over the larger rates.
    np.testing.assert_allclose(display.before[known], expected[known], atol=6.0)
    np.testing.assert_allclose(display.after[known], 0.0, atol=1e-6)


def test_scale_factor_needs_rates(rates):
    with pytest.raises(ValueError, match="rate is 5 in all rows"):
        ScaleFactorErrorDisplay.from_predictions(
            np.full(N_ROWS, 5.0), rates["before"], rates["after"], temperature=rates["temperature"]
        )


def test_surface_counts_and_averages():
    rate = np.array([-10.0, -10.0, 10.0, 10.0, 10.0])
    temperature = np.array([0.0, 0.0, 0.0, 40.0, 40.0])
    left = np.array([0.1, 0.3, 0.5, np.nan, 0.7])
    display = ResidualSurfaceDisplay.from_predictions(
        rate, rate, rate + left, temperature=temperature, n_bins=(2, 2)
    )
    np.testing.assert_array_equal(display.counts, [[2, 0], [1, 1]])
    np.testing.assert_allclose(display.residual, [[0.2, np.nan], [0.5, 0.7]])
    assert "25% of the cells empty" in display.axes_[1].get_title(loc="left")


def test_groups_are_sorted_by_what_is_left_and_only_the_worst_are_drawn(rates):
    rate, before, _ = three(rates)
    groups = np.arange(N_ROWS) % 50
    after = rate + 0.001 * (groups + 1) * np.where(np.arange(N_ROWS) % 100 < 50, 1.0, -1.0)
    display = GroupResidualDisplay.from_predictions(rate, before, after, groups=groups)
    assert display.groups.tolist() == list(range(50))
    np.testing.assert_allclose(display.after, 0.001 * np.arange(1, 51))
    labels = [tick.get_text() for tick in display.ax_.get_yticklabels()]
    assert labels == [str(group) for group in range(20, 50)]
    assert display.ax_.get_xscale() == "log"


def test_a_group_without_an_answer_stands_at_the_top():
    rate, groups = np.zeros(4), np.array(["a", "a", "b", "b"])
    display = GroupResidualDisplay.from_predictions(
        rate, rate + 1.0, [np.nan, np.nan, 0.1, 0.1], groups=groups
    )
    assert display.groups.tolist() == ["b", "a"]


@pytest.fixture
def compensator(rng):
    X = pd.DataFrame({"temperature": rng.uniform(0, 50, 500), "output": rng.uniform(-9, 9, 500)})
    y = X["output"] ** 2
    return make_pipeline(StandardScaler(), quick(2)).fit(X, y), X


def test_coverage_mask_is_that_of_the_estimator(compensator):
    pipeline, X = compensator
    display = CoverageDisplay.from_estimator(pipeline, X, n_points=21, margin=0.5)
    model = pipeline[-1]
    # The middle of the picture, and its lowest corner.
    rows = np.array([[display.x[10], display.y[10]], [display.x[0], display.y[0]]])
    rows = pipeline[:-1].transform(pd.DataFrame(rows, columns=X.columns))
    np.testing.assert_allclose(display.coverage[[10, 0], [10, 0]], model.coverage(rows))
    assert display.inside[10, 10]
    assert not display.inside[0, 0]
    inside_x = display.x[display.inside.any(axis=0)]
    step = display.x[1] - display.x[0]
    assert abs(inside_x.min() - X["temperature"].min()) < step
    assert abs(inside_x.max() - X["temperature"].max()) < step
    assert display.ax_.get_xlabel() == "temperature [°C]"


def test_cells_without_rows_are_empty_on_the_map(rng):
    """An L of data: the corner has no row, however well neighbours cover it."""
    x, y = rng.uniform(0.0, 10.0, (2, 4000))
    x[:3], y[:3] = [0.0, 10.0, 0.0], [0.0, 0.0, 10.0]
    X = pd.DataFrame({"temperature": x, "output": y})[(x < 5.0) | (y < 5.0)]
    model = quick(1).fit(X, X["output"])
    display = CoverageDisplay.from_estimator(model, X, n_cells=10, n_points=41, margin=0.2)
    corner = (display.x[None, :] > 5.0) & (display.y[:, None] > 5.0)
    beyond = (display.x[None, :] > 10.0) | (display.y[:, None] > 10.0)
    beyond = beyond | (display.x[None, :] < 0.0) | (display.y[:, None] < 0.0)
    mesh = display.ax_.collections[0].get_array()
    shown = ~np.ma.getmaskarray(mesh).reshape(41, 41)
    on_edge = np.isclose(display.x, 5.0)[None, :] | np.isclose(display.y, 5.0)[:, None]
    np.testing.assert_array_equal(shown[~on_edge], ~(corner | beyond)[~on_edge])
    assert display.counts.sum() == len(X)
    assert "25% of the cells in range are empty" in display.ax_.get_title(loc="left")
    cells = display.tables()["cells"]
    assert (cells["rows"] == 0).sum() == 25
    points = display.tables()["points"]
    np.testing.assert_array_equal(points["in a cell with data"], shown.ravel())


def test_coverage_holds_other_inputs(rng):
    X = pd.DataFrame(rng.uniform(size=(200, 3)), columns=["time", "temperature", "output"])
    model = quick(1).fit(X, X["time"])
    within = CoverageDisplay.from_estimator(model, X)
    beyond = CoverageDisplay.from_estimator(model, X, others={"time": 9.0})
    assert within.inside.any()
    assert not beyond.inside.any()


def test_coverage_refuses_unknown_columns_and_estimators_without(compensator):
    pipeline, X = compensator
    with pytest.raises(ValueError, match="'speed' is no column of X"):
        CoverageDisplay.from_estimator(pipeline, X, x="speed")
    with pytest.raises(ValueError, match="LinearRegression has no method 'coverage'"):
        CoverageDisplay.from_estimator(LinearRegression().fit(X, X["output"]), X)


def test_allan_curve_of_white_noise_and_drift(rng):
    pytest.importorskip("allantools")
    noise = 0.01 * rng.standard_normal(40_000)
    drift = 0.02 * np.linspace(-1.0, 1.0, 40_000)
    display = AllanDisplay.from_predictions(
        np.zeros(40_000), noise + drift, noise, sampling_interval=0.1
    )
    walk = 0.01 * np.sqrt(0.1) * 60.0  # deg/sqrt(h)
    texts = [text.get_text().split() for text in display.ax_.texts]
    marks = [float(text[2]) for text in texts if text[0] == "N"]
    assert marks
    np.testing.assert_allclose(marks, walk, rtol=0.05)
    assert "Smoothing is not compensation" in display.ax_.get_title(loc="left")
    assert display.before["deviation"].iloc[-1] > 2 * display.after["deviation"].iloc[-1]


def test_allan_in_degrees_per_second(rng):
    pytest.importorskip("allantools")
    noise = 0.01 * rng.standard_normal((2, 4000)).cumsum(axis=1)
    display = AllanDisplay.from_predictions(np.zeros(4000), *noise, sampling_interval=1.0)
    hourly = drawn_lines(display)[:, 1]
    display.plot(unit="deg/s")
    curves = [line for line in display.ax_.lines if line.get_marker() == "o"]
    drawn = np.concatenate([line.get_xydata() for line in curves])
    table = display.tables()["allan"]
    np.testing.assert_allclose(drawn, table.iloc[:, [1, 2]].to_numpy(), rtol=1e-12)
    np.testing.assert_allclose(drawn[0, 1], hourly[0] / 3600.0, rtol=1e-12)
    assert display.ax_.get_ylabel() == "Allan deviation [°/s]"


def test_allan_marks_no_random_walk_where_short_times_show_none(rng):
    pytest.importorskip("allantools")
    # Smoothed noise: the slope of -1/2 begins beyond the filter.
    noise = np.convolve(rng.standard_normal(40_000), np.ones(100) / 100, mode="same")
    display = AllanDisplay.from_predictions(np.zeros(40_000), noise, noise, sampling_interval=1.0)
    assert not any(text.get_text().startswith("N =") for text in display.ax_.texts)
