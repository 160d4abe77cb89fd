"""Pictures: their tables are right, and what they draw says so, with units."""

import numpy as np
import pandas as pd
import pytest
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
from skanfis.gyro.displays import three_digits
from skanfis.gyro.metrics import rms

from ..quick import quick

mpl = pytest.importorskip("matplotlib")
mpl.use("Agg")
Figure = pytest.importorskip("matplotlib.figure").Figure

N_ROWS = 2000


@pytest.fixture
def log(rng):
    """True rate, indicated and compensated rate, and what a display may want beside them."""
    phase, place = np.linspace(0.0, 2.0 * np.pi, N_ROWS), np.arange(N_ROWS)
    rate = rng.choice(np.linspace(-100.0, 100.0, 21), N_ROWS)
    columns = {"temperature": 20.0 + 30.0 * np.sin(phase), "temperature_rate": np.cos(phase)}
    columns["output"] = rate * (1 - 400e-6 * (columns["temperature"] - 20.0)) + 0.01
    columns["after"] = rate + 0.001 * rng.standard_normal(N_ROWS)
    return pd.DataFrame(columns | {"rate": rate, "position": place, "groups": place // 500})


WANTS = {
    ErrorDisplay: ["position"],
    HysteresisDisplay: ["temperature", "temperature_rate"],
    ScaleFactorErrorDisplay: ["temperature"],
    ResidualSurfaceDisplay: ["temperature"],
    GroupResidualDisplay: ["groups"],
}


def display_of(kind, log, **options):
    columns = {name: log[name] for name in WANTS[kind]}
    return kind.from_predictions(log["rate"], log["output"], log["after"], **columns, **options)


def drawn(display):
    """Points of all lines with both coordinates known, in the order of the axes."""
    return np.concatenate([line.get_xydata() for axes in display.axes_ for line in axes.lines])


@pytest.mark.parametrize("kind", WANTS)
def test_draws_with_units_on_the_axes_given(kind, log):
    figure = Figure(dpi=30)
    display = display_of(kind, log, ax=figure)
    assert display.figure_ is figure
    figure.canvas.draw()
    assert display.axes_[-1].get_xlabel().endswith("]")
    assert all("deg" not in axes.get_xlabel() + axes.get_ylabel() for axes in display.axes_)
    assert display.axes_[0].get_ylabel().endswith(("]", "group"))
    axes = np.atleast_1d(Figure().subplots(len(display.axes_)))
    assert list(display.plot(axes).axes_) == list(axes)
    with pytest.raises(ValueError, match=f"ax has 3 axes; this picture needs {len(axes)}"):
        display.plot(ax=Figure().subplots(3))


@pytest.mark.parametrize("unit", ["deg/s", "deg/h"])
def test_tables_hold_what_is_drawn_in_the_unit(unit, log):
    points = display_of(ErrorDisplay, log, unit=unit)
    table = points.tables()["points"]
    expected = [table[["time [s]", f"error {side} [{unit}]"]] for side in ("before", "after")]
    np.testing.assert_allclose(drawn(points), np.concatenate(expected), rtol=1e-12)
    factor = {"deg/s": 1.0, "deg/h": 3600.0}[unit]
    np.testing.assert_allclose(expected[1].iloc[:, 1], factor * (log["after"] - log["rate"]))
    bands = points.tables()["bands"]
    heights = points.axes_[1].collections[0].get_paths()[0].vertices[:, 1]
    assert bands[f"largest error after [{unit}]"].max() == pytest.approx(heights.max())
    assert points.axes_[1].get_ylabel() == f"error [°{unit[3:]}]"

    loop = display_of(HysteresisDisplay, log, unit=unit)
    table = loop.tables()["bias"]
    expected = [table.iloc[:, [0, k]] for k in (1, 2, 3, 4)]
    np.testing.assert_allclose(drawn(loop), np.concatenate(expected), rtol=1e-12)
    groups = display_of(GroupResidualDisplay, log, unit=unit)
    table = groups.tables()["groups"].iloc[:, 1:]
    np.testing.assert_allclose(drawn(groups)[:, 0], table.to_numpy().T.ravel(), rtol=1e-12)
    surface = display_of(ResidualSurfaceDisplay, log, unit=unit)
    cells = surface.tables()["cells"]
    mesh = np.ma.filled(surface.axes_[0].collections[0].get_array().astype(float), np.nan)
    np.testing.assert_allclose(cells[f"mean error after [{unit}]"], mesh.ravel(), rtol=1e-12)
    with pytest.raises(ValueError, match=r"unit='deg' must be one of deg/s, deg/h"):
        display_of(ErrorDisplay, log, unit="deg")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        *((9.996, "10.0"), (9.994, "9.99"), (-99.96, "-100"), (999.6, "1,000"), (1234.5, "1,234")),
        *((0.09996, "0.100"), (0.001, "0.00100"), (9.996e-7, "1.00e-06"), (9.94e-5, "0.0000994")),
        *((0.0, "0"), (np.nan, "–"), (-np.inf, "-inf")),
    ],
)
def test_numbers_have_three_digits(value, text):
    assert three_digits(value) == text


def test_bad_columns_are_named(log):
    with pytest.raises(ValueError, match="rate must be finite"):
        display_of(GroupResidualDisplay, log.assign(rate=np.nan))
    with pytest.raises(ValueError, match="after is NaN in all rows"):
        display_of(GroupResidualDisplay, log.assign(after=np.nan))
    with pytest.raises(TypeError, match="GroupResidualDisplay needs groups, with one value per"):
        GroupResidualDisplay.from_predictions(log["rate"], log["output"], log["after"])


def test_error_band_keeps_every_peak_and_leaves_gaps_open(log):
    peaks = log.assign(position=log["position"] + 2000.0 * (log["position"] >= 1000))
    peaks.loc[123, "after"] = peaks.loc[123, "rate"] + 5.0
    peaks.loc[1456, "after"] = peaks.loc[1456, "rate"] - 7.0
    display = display_of(ErrorDisplay, peaks)
    bands, whole = (display.tables()[name] for name in ("bands", "whole"))
    assert bands["largest error after [deg/s]"].max() == pytest.approx(5.0)
    assert bands["smallest error after [deg/s]"].min() == pytest.approx(-7.0)
    gap = bands[(bands["time [s], from"] > 1100) & (bands["time [s], to"] < 2900)]
    assert gap["largest error after [deg/s]"].isna().all()
    assert whole["RMS error [deg/s]"][0] == pytest.approx(rms(log["output"] - log["rate"]))
    assert "7.00 °/s" in display.axes_[1].get_title(loc="left")
    refused = display_of(ErrorDisplay, log.assign(after=log["after"].where(log.index >= 100)))
    assert refused.tables()["whole"]["RMS error [deg/s]"][1] == pytest.approx(0.001, rel=0.1)


def test_a_band_between_bands_without_rows_is_drawn_too():
    position, error = np.repeat(np.arange(10.0), 2), np.tile([-1.0, 2.0], 10)
    rates = np.zeros(20), error, 0.1 * error
    display = ErrorDisplay.from_predictions(*rates, position=position)
    bands = display.tables()["bands"].dropna()
    assert len(bands) == 10
    for panel, size in zip(display.axes_, (1.0, 0.1), strict=True):
        boxes = [path.get_extents() for path in panel.collections[0].get_paths()]
        np.testing.assert_allclose(bands.iloc[:, :2], [box.intervalx for box in boxes])
        np.testing.assert_allclose([box.intervaly for box in boxes], [[-size, 2.0 * size]] * 10)


def test_scale_factor_error_is_that_of_the_law(log):
    rate = log["rate"]
    bias = 0.5 + 0.02 * log["temperature"]  # is no scale factor, wherever it goes in a band
    before = rate * (1 + 1e-6 * (300.0 + 0.02 * rate**2)) + bias
    planted = log.assign(output=before, after=rate)
    display = display_of(ScaleFactorErrorDisplay, planted)
    table = display.tables()["scale-factor"]
    assert table["true rate [deg/s]"].abs().min() >= 5.0
    expected = 300.0 + 0.02 * table["true rate [deg/s]"] ** 2
    # A line through a cubic misses the bias by some 1e-4 deg/s: 20 ppm at the lowest rates.
    np.testing.assert_allclose(table["scale-factor error before [ppm]"], expected, atol=20.0)
    np.testing.assert_allclose(table["scale-factor error after [ppm]"], 0.0, atol=1e-6)
    # Rows of a band may all lie at one end of it: its middle would say where there are none.
    told = [text.get_text() for text in display.axes_[0].get_legend().get_texts()]
    bands = table.iloc[:, :2].drop_duplicates().to_numpy()
    assert told == [f"{low:z.0f} to {high:z.0f} °C" for low, high in bands]
    with pytest.raises(ValueError, match="rate is 5 in all rows"):
        display_of(ScaleFactorErrorDisplay, log.assign(rate=5.0))


def test_surface_counts_and_averages():
    rate, temperature = np.array([-10.0, -10.0, 10.0, 10.0, 10.0]), [0.0, 0.0, 0.0, 40.0, 40.0]
    after = np.add(rate, [0.1, 0.3, 0.5, np.nan, 0.7])
    display = ResidualSurfaceDisplay.from_predictions(rate, rate, after, temperature=temperature)
    cells = display.tables()["cells"]
    corners = cells[cells["rows"] > 0]
    assert corners.index.tolist() == [0, 24 * 23, 24 * 24 - 1]
    assert corners["rows"].tolist() == [2, 1, 1]
    np.testing.assert_allclose(corners["mean error after [deg/s]"], [0.2, 0.5, 0.7])
    assert "99 % of the cells empty" in display.axes_[1].get_title(loc="left")
    alone = ResidualSurfaceDisplay.from_predictions(*np.full((3, 1), 5.0), temperature=[20.0])
    assert "99.8 % of the cells empty" in alone.axes_[1].get_title(loc="left")


def test_groups_are_sorted_by_what_is_left_and_only_the_worst_are_drawn(log):
    groups = np.arange(N_ROWS) % 50
    sign = np.where(np.arange(N_ROWS) % 100 < 50, 1.0, -1.0)
    after = (log["rate"] + 0.001 * (groups + 1) * sign).where(groups != 7)
    display = display_of(GroupResidualDisplay, log.assign(groups=groups, after=after))
    # One without an answer stands at the top.
    order = [*range(7), *range(8, 50), 7]
    table = display.tables()["groups"]
    assert table["group"].tolist() == order
    np.testing.assert_allclose(table.iloc[:-1, 2], 0.001 * (np.array(order[:-1]) + 1))
    labels = [tick.get_text() for tick in display.ax_.get_yticklabels()]
    assert labels == [str(group) for group in order[-30:]]
    # Long names, as those of files, leave the errors their room, and the title is on the picture.
    long = display_of(GroupResidualDisplay, log.assign(groups=[f"{k:060}" for k in groups]))
    long.figure_.canvas.draw()
    (left, _), (right, _) = long.ax_.transAxes.transform([(0, 0), (1, 0)]) / long.figure_.dpi
    assert right - left > 3.0
    assert long.ax_._left_title.get_window_extent().x1 < long.figure_.bbox.x1
    # Rows without a label are a group too.
    some = display_of(GroupResidualDisplay, log.assign(groups=np.where(groups < 9, np.nan, 1.0)))
    assert some.tables()["groups"]["group"].isna().sum() == 1


def test_coverage_is_that_of_the_estimator(rng):
    names = ["temperature", "output", "time"]
    X = pd.DataFrame(rng.uniform(size=(500, 3)) * [50.0, 18.0, 1.0], columns=names)
    pipeline = make_pipeline(StandardScaler(), quick(2)).fit(X, X["output"] ** 2)
    # An L of data: the corner has no row, however well neighbours cover it.
    part = X[(X["temperature"] < 25.0) | (X["output"] < 9.0)]
    display = CoverageDisplay.from_estimator(pipeline, part)
    points, cells = (display.tables()[name] for name in ("points", "cells"))
    rows = points.iloc[[0, 4655], :2].set_axis(names[:2], axis=1).assign(time=part["time"].median())
    expected = pipeline[-1].coverage(pipeline[:-1].transform(rows))
    np.testing.assert_allclose(points["coverage"].iloc[[0, 4655]], expected)
    assert points["in range"].iloc[[0, 4655]].tolist() == [0, 1]
    assert cells["rows"].sum() == len(part)
    beyond = cells[(cells.iloc[:, 0] > 25.0) & (cells.iloc[:, 2] > 9.0)]
    assert not beyond["rows"].any()
    for x, y, *_, has_rows in points.iloc[::89].to_numpy():
        own = (cells.iloc[:, [0, 2]] < [x, y]) & (cells.iloc[:, [1, 3]].to_numpy() >= [x, y])
        assert has_rows == (cells["rows"][own.all(axis=1)] > 0).any()
    assert display.ax_.get_xlabel() == "temperature [°C]"
    far = CoverageDisplay.from_estimator(pipeline, X.assign(time=9.0))
    assert not far.tables()["points"]["in range"].any()
    level = CoverageDisplay.from_estimator(pipeline, X.assign(output=9.0)).tables()["points"]
    assert level.iloc[:, 1].nunique() == 96
    with pytest.raises(ValueError, match="'output' is no column of X, which has temperature, time"):
        CoverageDisplay.from_estimator(pipeline, X.drop(columns="output"))
    with pytest.raises(ValueError, match="StandardScaler has no method 'coverage'"):
        CoverageDisplay.from_estimator(pipeline[0], X)


def test_allan_curve_of_white_noise_and_drift(rng):
    pytest.importorskip("allantools")
    noise = 0.01 * rng.standard_normal(40_000)
    drift = 0.02 * np.linspace(-1.0, 1.0, 40_000)
    rates, options = (np.zeros(40_000), noise + drift, noise), {"time": 0.1 * np.arange(40_000)}
    display = AllanDisplay.from_predictions(*rates, **options)
    labels = [text.get_text() for text in display.ax_.get_legend().get_texts()]
    walks = [float(label.partition("N = ")[2].split()[0]) for label in labels]
    np.testing.assert_allclose(walks, 0.01 * np.sqrt(0.1) * 60.0, rtol=0.05)  # deg/sqrt(h)
    assert "Smoothing is not compensation" in display.ax_.get_title(loc="left")
    table = display.tables()["allan"]
    last = table.groupby("curve")["Allan deviation [deg/h]"].last()
    assert last["before"] > 2 * last["after"]
    slow = AllanDisplay.from_predictions(*rates, **options, unit="deg/s")
    assert slow.ax_.get_ylabel() == "Allan deviation [°/s]"
    found = slow.tables()["allan"]["Allan deviation [deg/s]"]
    np.testing.assert_allclose(found, table["Allan deviation [deg/h]"] / 3600.0, rtol=1e-12)
    # A row that was refused ends a stretch of both curves.
    noise[20_000] = np.nan
    parted = AllanDisplay.from_predictions(*rates, **options).tables()["allan"]
    longest = parted.groupby("curve")["averaging time [s]"].max()
    assert (longest == table["averaging time [s]"].max() / 2.0).all()
