"""Pictures show the model, whatever it knows and whatever its names are."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.compose import TransformedTargetRegressor
from sklearn.preprocessing import MinMaxScaler

from skanfis import ANFISRegressor
from skanfis.inspection import (
    MembershipDisplay,
    ResponseSurfaceDisplay,
    RuleActivationDisplay,
    RuleContributionDisplay,
    memberships_table,
    rules_table,
)
from skanfis.inspection.labels import as_label, printable

from ..export.rule_bases import EVERY_PAIR, MODELS, NAMES, rows_of

plt = pytest.importorskip("matplotlib.pyplot")
A_GRID = MODELS["grid, order 1, 1 outputs"]
TWO_OUTPUTS = MODELS["scattered, order 1, 2 outputs"]
# One of every kind, of both orders and both numbers of outputs.
EACH = pytest.mark.parametrize(
    "model", [one for i, one in enumerate(EVERY_PAIR.values()) if i % 2 == i // 4 % 2]
)


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    plt.close("all")


def drawn(display):
    """Draw the figure: what is wrong in it raises or warns now."""
    display.figure_.canvas.draw()
    return display


class TestMemberships:
    @EACH
    def test_they_are_those_of_the_terms(self, model):
        if not model.antecedent.n_terms:
            with pytest.raises(ValueError, match="no terms: nothing to draw"):
                MembershipDisplay.from_estimator(model)
            return
        table = memberships_table(model)
        for one in MembershipDisplay.from_estimator(model, n_points=11).inputs:
            own = table[table["input"] == one.input_name]
            assert one.term_names == tuple(own["name"])
            for curve, (_, term) in zip(one.after, own.iterrows(), strict=True):
                if term["function"] == "gaussian":
                    expected = np.exp(-(((one.grid - term["center"]) / term["width"]) ** 2) / 2)
                    assert_allclose(curve, expected, rtol=1e-9)
            assert not np.allclose(one.before, one.after)

    def test_they_lie_over_the_histogram_of_the_data(self, fitted):
        pipe, X = fitted
        display = drawn(MembershipDisplay.from_estimator(pipe, X, bins=12))
        for one in display.inputs:
            counts, edges = np.histogram(X[one.input_name], 12)
            assert_array_equal(one.counts, counts)
            assert_allclose(one.edges, edges)
            assert_allclose(one.grid[[0, -1]], [X[one.input_name].min(), X[one.input_name].max()])
        assert [axes.get_xlabel() for axes in display.axes_] == ["kelvin", "rate"]
        legend = display.axes_[0].get_legend()
        assert [text.get_text() for text in legend.get_texts()] == ["low", "medium", "high"]
        lines = display.axes_[0].get_lines()
        assert [line.get_linestyle() for line in lines] == ["--", "-"] * 3

    def test_of_chosen_inputs_on_given_axes(self, fitted):
        pipe, _ = fitted
        _, axes = plt.subplots(1, 2)
        display = MembershipDisplay.from_estimator(
            pipe, features=[1, "kelvin"], ax=axes, show_before=False
        )
        assert_array_equal(display.axes_, axes)
        assert axes[0].get_xlabel() == "rate"
        assert len(axes[1].get_lines()) == 3
        with pytest.raises(ValueError, match="ax has 3 axes; 2 are needed"):
            MembershipDisplay.from_estimator(pipe, ax=plt.subplots(1, 3)[1])

    @pytest.mark.parametrize(
        ("settings", "message"),
        [
            ({"n_points": 1}, "n_points=1 must be a whole number of 2 or more"),
            ({"bins": 0}, "bins=0"),
            ({"features": ["pressure"]}, "'pressure' is no input: give a position from 0 to 2"),
            ({"features": ["chip temperature"]}, "Input 'chip temperature' has no terms"),
        ],
    )
    def test_parameters_are_checked(self, settings, message):
        model = MODELS["grid on two inputs, order 1, 1 outputs"]
        with pytest.raises(ValueError, match=message):
            MembershipDisplay.from_estimator(model, **settings)


class TestActivation:
    @EACH
    def test_every_rule_has_one_cell(self, model):
        display = RuleActivationDisplay.from_estimator(model)
        assert sorted(display.rules[display.rules >= 0]) == list(range(model.n_rules))
        for cell, r in np.ndenumerate(display.rules):
            expected = [model.rule_weights[r], model.rule_rows[r]] if r >= 0 else [np.nan] * 2
            assert_array_equal([display.weights[cell], display.rows[cell]], expected)

    def test_cells_of_a_grid_stand_where_their_terms_do(self):
        display = RuleActivationDisplay.from_estimator(A_GRID)
        assert (display.inputs_down, display.inputs_across) == (NAMES[:1], NAMES[1:])
        table = rules_table(A_GRID)["if"]
        for (i, j), r in np.ndenumerate(display.rules):
            terms = [*display.labels_down[i].split(", "), *display.labels_across[j].split(", ")]
            assert list(table.loc[r]) == terms

    def test_rules_that_are_no_grid(self):
        display = RuleActivationDisplay.from_estimator(MODELS["rule table, order 1, 2 outputs"])
        assert any(label.startswith("any") for label in display.labels_down)
        model = MODELS["scattered, order 1, 1 outputs"]
        display = RuleActivationDisplay.from_estimator(model)
        assert_array_equal(display.rules[:, 0], np.argsort(-model.rule_weights))
        assert display.inputs_across == ()

    def test_empty_cells_are_hatched(self):
        display = drawn(RuleActivationDisplay.from_estimator(A_GRID))
        hatched = [patch for patch in display.ax_.patches if patch.get_hatch()]
        assert len(hatched) == np.sum(A_GRID.rule_rows < 0.5)
        assert "hatched" in display.ax_.get_title(loc="left")
        texts = [text.get_text() for text in display.ax_.texts]
        assert len(texts) == A_GRID.n_rules
        assert f"{100 * A_GRID.rule_weights[1]:.1f} %" in texts


class TestContribution:
    @EACH
    @pytest.mark.parametrize("baseline", ["mean", 2.5])
    def test_contributions_and_baseline_are_the_prediction(self, model, baseline):
        display = RuleContributionDisplay.from_estimator(
            model, "rate", held={0: 1e6 + 100.0}, baseline=baseline, n_points=15
        )
        rows = np.tile([1e6 + 100.0, model.reference[1], 0.0], (15, 1))
        rows[:, 2] = display.grid
        expected = model.predict(rows)[:, 0]
        total = display.baseline + display.contributions.sum(axis=0)
        assert_allclose(total, expected, rtol=1e-9, atol=1e-12)
        wanted = expected.mean() if baseline == "mean" else baseline
        assert display.baseline == pytest.approx(wanted)
        assert_allclose(display.ax_.get_lines()[-1].get_ydata(), total)
        assert set(display.held) == set(NAMES[:2])

    def test_rules_without_a_line_are_drawn_as_their_sum(self):
        display = RuleContributionDisplay.from_estimator(A_GRID, max_rules=4)
        names = [text.get_text() for text in display.ax_.get_legend().get_texts()]
        assert names[-2:] == ["8 other rules", "prediction"]
        assert names[0].split(": ")[1] == display.rule_terms[int(names[0].split(": ")[0])]
        lines = [line.get_ydata() - display.baseline for line in display.ax_.get_lines()[1:]]
        assert_allclose(sum(lines[:-1]), lines[-1], atol=1e-9)

    def test_where_data_are_missing_is_grey(self):
        # Nothing between: the rules that speak at low and high x have the data.
        X = np.concatenate([np.linspace(0, 1, 40), np.linspace(9, 10, 40)])[:, None]
        model = ANFISRegressor(n_mfs=5, solver="lse").fit(X, np.sin(X[:, 0]))
        display = drawn(RuleContributionDisplay.from_estimator(model))
        assert (display.coverage < 0.5).any()
        assert "grey" in display.ax_.get_title(loc="left")

    def test_band_is_so_many_deviations_wide(self):
        rng = np.random.default_rng(0)
        X = rng.uniform(size=(60, 2))
        model = ANFISRegressor(n_mfs=2, solver="lse").fit(X, X[:, 0] + 0.1 * rng.normal(size=60))
        display = RuleContributionDisplay.from_estimator(model, 1, n_deviations=2, n_points=9)
        rows = np.column_stack([np.full(9, display.held["x0"]), display.grid])
        assert_allclose(display.band, 2.0 * model.model_.standard_deviation(rows)[:, 0])
        (band,) = drawn(display).ax_.collections
        assert_allclose(band.get_paths()[0].vertices[1:10, 1], model.predict(rows) - display.band)
        with pytest.raises(ValueError, match="knows of no posterior"):
            RuleContributionDisplay.from_estimator(A_GRID, n_deviations=1)

    @pytest.mark.parametrize(
        ("settings", "message"),
        [
            ({"baseline": "median"}, "baseline='median' must be 'mean' or a finite number"),
            ({"baseline": np.nan}, "baseline=nan must be"),
            ({"n_deviations": -1}, "n_deviations=-1 must be a number, zero or positive"),
        ],
    )
    def test_parameters_are_checked(self, settings, message):
        with pytest.raises(ValueError, match=message):
            RuleContributionDisplay.from_estimator(A_GRID, **settings)


class TestSurface:
    @EACH
    def test_it_is_the_prediction_with_the_rest_held(self, model):
        display = ResponseSurfaceDisplay.from_estimator(
            model, features=("rate", 0), held={1: 30.0}, output=-1, grid_resolution=7
        )
        rows = np.column_stack([display.xx1.ravel(), np.full(49, 30.0), display.xx0.ravel()])
        assert_allclose(display.response.ravel(), model.predict(rows)[:, -1], rtol=1e-12)
        assert_allclose(display.coverage.ravel(), model.coverage(rows), rtol=1e-12)
        assert display.held == {"chip temperature": 30.0}
        assert (display.ax_.get_xlabel(), display.ax_.get_ylabel()) == ("rate", "time")
        assert display.xx0.min() == model.minimum[2]
        assert display.xx1.max() == model.maximum[0]

    @pytest.mark.parametrize("plot_method", ["contourf", "pcolormesh"])
    def test_of_a_pipeline_over_its_data(self, fitted, plot_method):
        pipe, X = fitted
        target = TransformedTargetRegressor(pipe, transformer=MinMaxScaler())
        target.fit(X, pipe.predict(X))
        display = drawn(ResponseSurfaceDisplay.from_estimator(target, X, plot_method=plot_method))
        assert_array_equal(display.points, X)
        corner = pd.DataFrame([X.max()])
        assert display.response[-1, -1] == pytest.approx(target.predict(corner)[0], rel=1e-9)

    def test_colours_are_set_by_where_the_data_are(self):
        display = ResponseSurfaceDisplay.from_estimator(A_GRID, grid_resolution=41)
        seen = display.response[display.coverage >= 0.5]
        assert 0 < seen.size < display.response.size
        drawn(display.plot(plot_method="pcolormesh"))
        assert_array_equal(display.surface_.get_clim(), [seen.min(), seen.max()])

    def test_a_flat_surface_can_be_drawn(self):
        X = np.random.default_rng(0).uniform(size=(20, 2))
        flat = ANFISRegressor(n_mfs=2, solver="lse").fit(X, np.full(20, 3.0))
        drawn(ResponseSurfaceDisplay.from_estimator(flat, X, grid_resolution=4))

    @pytest.mark.parametrize(
        ("settings", "error", "message"),
        [
            ({"features": (0, 0)}, ValueError, "the same input twice"),
            ({"features": (0,)}, ValueError, "must be two inputs"),
            ({"features": "rate"}, ValueError, "must be two inputs"),
            ({"output": 1}, ValueError, "1 is no output: give a position from 0 to 0, or one of"),
            ({"held": [1.0]}, TypeError, "held must be a dict"),
            ({"held": {"rate": np.nan}}, ValueError, "must be a number in the range of training"),
            ({"held": {"rate": 5.0}}, ValueError, r"held\['rate'\]=5.0"),
            ({"held": {"rate": "high"}}, ValueError, r"held\['rate'\]='high'"),
            ({"grid_resolution": 1}, ValueError, "grid_resolution=1"),
            ({"plot_method": "bars"}, ValueError, "plot_method='bars'"),
        ],
    )
    def test_parameters_are_checked(self, settings, error, message):
        with pytest.raises(error, match=message):
            ResponseSurfaceDisplay.from_estimator(A_GRID, **settings)

    def test_a_model_of_one_input_has_none(self):
        x = np.linspace(0.0, 1.0, 20).reshape(-1, 1)
        with pytest.raises(ValueError, match="one input, and a surface takes two: RuleContrib"):
            ResponseSurfaceDisplay.from_estimator(ANFISRegressor(n_mfs=2).fit(x, x[:, 0]))


SINGLE = [RuleActivationDisplay, ResponseSurfaceDisplay, RuleContributionDisplay]


@pytest.mark.parametrize("display", SINGLE)
def test_single_panels_are_drawn_where_asked(display):
    _, ax = plt.subplots()
    assert display.from_estimator(A_GRID, ax=ax).ax_ is ax


def test_displays_say_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.pyplot", None)
    with pytest.raises(ImportError, match=r"pip install matplotlib .*'\.\[plot\]'"):
        MembershipDisplay.from_estimator(A_GRID)


def test_a_model_without_data_is_not_said_to_lack_them():
    # As read from a .fis file: nothing is known of the data, which is not the same as no data.
    model = replace(
        A_GRID,
        rule_weights=np.full(12, 1 / 12),
        rule_rows=np.zeros(12),
        support=None,
        reference=np.zeros(3),
    )
    surface = ResponseSurfaceDisplay.from_estimator(model, grid_resolution=5)
    assert_array_equal(surface.coverage, 1.0)
    assert surface.held == {"rate": pytest.approx((model.minimum[2] + model.maximum[2]) / 2)}
    assert_array_equal(RuleContributionDisplay.from_estimator(model).coverage, 1.0)
    with pytest.raises(ValueError, match="read from a file and knows of no data: give X"):
        RuleActivationDisplay.from_estimator(model)
    assert RuleActivationDisplay.from_estimator(model, rows_of(model, 1.0)).rows.sum() == 40


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain °C, 温度", "plain °C, 温度"),
        ("\x1b[31m", r"\x1b[31m"),
        ("a\r\n\tb\x7f", r"a\r\n\tb\x7f"),
        ("\u202e\u2028\udcff", r"\u202e\u2028\udcff"),
        ("می\u200cخواهم", "می\u200cخواهم"),
    ],
)
def test_what_no_reader_sees_is_escaped(text, shown):
    assert printable(text) == shown


@pytest.mark.parametrize("name", ["$$", r"$\frac{0$", r"\$", "a$b", "\x1b[2J", "\udcff", "a\nb"])
def test_a_label_is_drawn_as_it_is(name):
    # matplotlib's own reading of a text: whether it is mathematics, and what it is without.
    text = plt.figure().text(0, 0, as_label(name))
    assert text._preprocess_math(as_label(name)) == (printable(name), False)


# Those that cannot be drawn as they are: no picture has forgotten to ask for a label.
@pytest.mark.filterwarnings("ignore:Glyph .* missing")
def test_every_picture_takes_every_name():
    name, other = r"$\frac{0$", "\udcff"
    model = replace(
        A_GRID,
        input_names=(name, f"{other}2", f"3{name}"),
        output_names=(other,),
        term_names=tuple(f"{(name, other)[t % 2]}{t}" for t in range(A_GRID.antecedent.n_terms)),
    )
    drawn(MembershipDisplay.from_estimator(model))
    drawn(RuleActivationDisplay.from_estimator(model))
    drawn(RuleContributionDisplay.from_estimator(model, feature=name))
    drawn(ResponseSurfaceDisplay.from_estimator(model, features=[name, f"{other}2"]))
