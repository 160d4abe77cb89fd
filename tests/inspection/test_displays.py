"""Pictures show the model, whatever it knows and whatever its names are."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.compose import TransformedTargetRegressor
from sklearn.preprocessing import MinMaxScaler

from skanfis.export import fold
from skanfis.inspection import EffectsDisplay, MembershipDisplay, ResponseSurfaceDisplay
from skanfis.inspection.labels import as_label, on_axis, printable, title_of

from ..export.rule_bases import EVERY_PAIR, MODELS, rows_of
from ..quick import quick
from .encoded import encoded

plt = pytest.importorskip("matplotlib.pyplot")
A_GRID = MODELS["grid, order 1, 1 outputs"]
# One of every kind, of both orders and both numbers of outputs.
EACH = pytest.mark.parametrize(
    "model", [one for i, one in enumerate(EVERY_PAIR.values()) if i % 2 == i // 4 % 2]
)


def drawn(display):
    """Draw the figure: what is wrong in it raises or warns now."""
    display.figure_.canvas.draw()
    return display


class TestMemberships:
    @EACH
    def test_they_are_those_of_the_terms(self, model):
        if not model.antecedent.n_terms:
            with pytest.raises(ValueError, match="no fuzzy terms, so there is nothing to draw"):
                MembershipDisplay.from_estimator(model)
            return
        table, X = pd.DataFrame(model.memberships()), rows_of(model, 1.0, 9)
        display = MembershipDisplay.from_estimator(model, X)
        for one, axes in zip(display.inputs, display.axes_, strict=True):
            j = model.input_names.index(one.input_name)
            assert_array_equal(axes.get_xlim(), [model.minimum[j], model.maximum[j]])
            assert_array_equal(one.counts, np.histogram(X[:, j], one.edges)[0])
            own = table[table["input"] == one.input_name]
            # Of a cut the side above says all.
            own = own[own["function"] != "sigmoid_falling"]
            assert one.term_names == tuple(own["name"])
            for curve, (_, term) in zip(one.after, own.iterrows(), strict=True):
                if term["function"] == "gaussian":
                    expected = np.exp(-(((one.grid - term["center"]) / term["width"]) ** 2) / 2)
                    assert_allclose(curve, expected, rtol=1e-9)
                if term["function"] == "sigmoid_rising":
                    expected = 1 / (1 + np.exp((term["center"] - one.grid) / term["width"]))
                    assert_allclose(curve, expected, rtol=1e-9)
            assert not np.allclose(one.before, one.after)

    def test_equal_terms_are_drawn_once(self):
        tree = MODELS["tree, order 1, 1 outputs"]
        alike = replace(tree, term_names=("1",) * tree.antecedent.n_terms)
        drawn_of = [MembershipDisplay.from_estimator(model).inputs for model in (tree, alike)]
        assert max(len(one.term_names) for one in drawn_of[0]) > 1
        assert [one.term_names for one in drawn_of[1]] == [("1",)] * len(drawn_of[0])


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

    @staticmethod
    def surface_of(response):
        """What is drawn of a response at seven by seven places."""
        xx0, xx1 = np.meshgrid(np.linspace(0.0, 1.0, 7), np.linspace(0.0, 1.0, 7))
        shown = {"xx0": xx0, "xx1": xx1, "response": response, "coverage": np.ones((7, 7))}
        names = {"input_names": ("a", "b"), "output_name": "y", "held": {}}
        return drawn(ResponseSurfaceDisplay(**shown, **names).plot())

    @pytest.mark.parametrize("value", [-7.0, 0.0, 2249.7])
    def test_what_is_flat_but_for_rounding_is_drawn_flat(self, value, rng):
        display = self.surface_of(value * (1.0 + 3e-14 * rng.normal(size=(7, 7))))
        *_, bar = display.figure_.axes
        assert bar.yaxis.get_major_formatter().get_offset() == ""
        assert np.ptp(display.surface_.levels) >= 0.1 * abs(value)

    def test_a_small_change_of_a_large_target_is_drawn(self):
        rise = np.linspace(0.0, 2.0, 49).reshape(7, 7)
        assert np.ptp(self.surface_of(1e12 + rise).surface_.levels) < 3.0

    def test_lines_show_where_another_rule_becomes_the_strongest(self):
        plain, display = (
            drawn(ResponseSurfaceDisplay.from_estimator(A_GRID, show_rules=one))
            for one in (False, True)
        )
        others = np.full(display.xx0.size, display.held["rate"])
        rows = np.column_stack([display.xx0.ravel(), display.xx1.ravel(), others])
        assert plain.strongest is None
        assert_array_equal(display.strongest.ravel(), A_GRID.strengths(rows).argmax(axis=1))
        n_more = np.unique(display.strongest).size - 1
        assert len(display.ax_.collections) == n_more + len(plain.ax_.collections)
        assert "lines: another rule" in " ".join(display.ax_.get_title(loc="left").split())
        assert "lines" not in plain.ax_.get_title(loc="left")
        # A single rule has no borders.
        model = MODELS["one rule, order 1, 1 outputs"]
        one = drawn(ResponseSurfaceDisplay.from_estimator(model, show_rules=True))
        assert not one.strongest.any()

    def test_an_input_of_two_values_is_held_at_the_commoner(self, rng):
        X = rng.uniform(size=(60, 3))
        X[:, 2] = rng.random(60) < 0.3
        display = ResponseSurfaceDisplay.from_estimator(quick([2, 2, 1]).fit(X, X.sum(axis=1)))
        assert display.held == {"x2": 0.0}

    def test_of_a_pipeline_over_its_data(self, fitted):
        pipe, X = fitted
        target = TransformedTargetRegressor(pipe, transformer=MinMaxScaler())
        target.fit(X, pipe.predict(X))
        display = drawn(ResponseSurfaceDisplay.from_estimator(target, X))
        assert_array_equal(display.points, X)
        corner = pd.DataFrame([X.max()])
        assert display.response[-1, -1] == pytest.approx(target.predict(corner)[0], rel=1e-9)

    @pytest.mark.parametrize(
        ("settings", "error", "message"),
        [
            ({"features": (0, 0)}, ValueError, "names the same input twice"),
            ({"features": (0, "pressure")}, ValueError, "'pressure' is no input: give a position"),
            ({"features": "rate"}, ValueError, "must name two inputs"),
            ({"features": 1}, ValueError, "features=1 must name two inputs"),
            ({"output": 1}, ValueError, "1 is no output: give a position from 0 to 0, or one of"),
            ({"held": [1.0]}, TypeError, "held must be a dict"),
            ({"held": {"rate": np.nan}}, ValueError, "must be a number within the range"),
            ({"held": {"rate": 5.0}}, ValueError, r"held\['rate'\]=5.0"),
            ({"held": {"rate": "high"}}, ValueError, r"held\['rate'\]='high'"),
            ({"held": {1: 30.0}}, ValueError, r"held\[1\] fixes an input that is drawn"),
            ({"grid_resolution": 1}, ValueError, "grid_resolution=1"),
        ],
    )
    def test_parameters_are_checked(self, settings, error, message):
        with pytest.raises(error, match=message):
            ResponseSurfaceDisplay.from_estimator(A_GRID, **settings)

    @pytest.mark.filterwarnings("ignore::skanfis.exceptions.ConstantInputWarning")
    def test_a_model_of_one_input_that_changes_has_none(self):
        x = np.linspace(0.0, 1.0, 20)
        model = quick([2, 1]).fit(np.column_stack([x, 0.0 * x + 3.0]), x)
        with pytest.raises(ValueError, match=r"'x1' is constant .*always 3\)\. Name two"):
            ResponseSurfaceDisplay.from_estimator(model)
        with pytest.raises(ValueError, match="one input, but a surface needs two: plot its"):
            ResponseSurfaceDisplay.from_estimator(quick(2).fit(x[:, None], x))


@pytest.mark.parametrize(("display", "count"), [(MembershipDisplay, 3), (EffectsDisplay, 5)])
def test_panels_are_drawn_on_given_axes(display, count):
    X = rows_of(A_GRID, 1.0, 9)
    axes = plt.subplots(count)[1]
    assert_array_equal(display.from_estimator(A_GRID, X, ax=axes).axes_, axes)
    with pytest.raises(ValueError, match=f"ax holds 2 Axes, not {count}"):
        display.from_estimator(A_GRID, X, ax=axes[:2])


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
    assert "pale" not in surface.ax_.get_title(loc="left")
    assert surface.held == {"rate": pytest.approx((model.minimum[2] + model.maximum[2]) / 2)}


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


def test_a_title_has_no_negative_zero():
    assert title_of({"rate": -0.0, "load": -2.5}) == "rate = 0; load = -2.5"


def test_a_long_name_leaves_room_for_the_picture():
    first, second = (f"{'a' * 50}{k}{'b' * 50}{end}" for k, end in ((0, "x"), (1, "y")))
    assert as_label("a" * 60) == "a" * 60
    assert as_label(first).endswith("bbbx")
    assert as_label(first) != as_label(second)
    assert len(as_label(f"{'a' * 50}$")) <= 60
    assert len(as_label(first)) == 60
    assert on_axis(first).count("\n") == 2
    assert on_axis("sensor_000_temperature") == "sensor_000_\ntemperature"
    assert on_axis("mean air temperature") == "mean air temperature"
    assert on_axis("air temperature at noon") == "air temperature at\nnoon"


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
    labels = [as_label(name) for name in model.input_names]
    memberships = drawn(MembershipDisplay.from_estimator(model))
    assert [axes.get_xlabel() for axes in memberships.axes_] == labels
    surface = drawn(ResponseSurfaceDisplay.from_estimator(model, None, model.input_names[:2]))
    assert [surface.ax_.get_xlabel(), surface.ax_.get_ylabel()] == labels[:2]


@pytest.mark.parametrize(
    ("drop", "held", "told", "ones"),
    [
        (None, {}, {"day": "Sat", "wet": "no"}, {"day_Sat"}),
        ("first", {}, {"day": "Sat", "wet": "no"}, {"day_Sat"}),
        (None, {"day_Sun": 1}, {"day": "Sun", "wet": "no"}, {"day_Sun"}),
        (["Sat", "no"], {}, {"day": "Sat", "wet": "no"}, set()),
        (["Sat", "no"], {"day_Sun": 1}, {"day": "Sun", "wet": "no"}, {"day_Sun"}),
        (["Sat", "no"], {"wet_yes": 1}, {"day": "Sat", "wet": "yes"}, {"wet_yes"}),
    ],
)
def test_a_category_is_held_at_one_level(drop, held, told, ones, rng):
    X = pd.DataFrame(rng.normal(size=(200, 2)), columns=["heat", "hour"])
    X["day"] = rng.choice(["Fri", "Sat", "Sun"], 200, p=[0.2, 0.6, 0.2])
    X["wet"] = rng.choice(["no", "yes"], 200, p=[0.8, 0.2])
    y = X["heat"] * (X["day"] == "Sat") + X["hour"] + (X["wet"] == "yes")
    pipe = encoded(["day", "wet"], quick(n_mfs=1), drop=drop).fit(X, y)
    ones = ones | ({"wet_no"} if drop is None else set())
    display = ResponseSurfaceDisplay.from_estimator(pipe, features=["heat", "hour"], held=held)
    assert display.held == told
    model = fold(pipe)
    values = {"heat": display.xx0.ravel(), "hour": display.xx1.ravel()}
    rows = [values.get(name, np.full(3600, float(name in ones))) for name in model.input_names]
    assert_allclose(display.response.ravel(), model.predict(np.transpose(rows))[:, 0], rtol=1e-12)
