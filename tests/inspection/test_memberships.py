"""The memberships drawn are those of the model."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skanfis.inspection import MembershipDisplay, memberships_table

from ..export.rule_bases import EVERY_PAIR, MODELS
from .drawing import drawn, plt

WITH_TERMS = pytest.mark.parametrize("kind", [k for k in EVERY_PAIR if "one rule" not in k])


@WITH_TERMS
def test_memberships_are_those_of_the_terms(kind):
    model = MODELS[kind]
    display = MembershipDisplay.from_estimator(model, n_points=11)
    table = memberships_table(model)
    for one in display.inputs:
        own = table[table["input"] == one.input_name]
        assert one.term_names == tuple(own["name"])
        for curve, (_, term) in zip(one.after, own.iterrows(), strict=True):
            if term["function"] == "gaussian":
                expected = np.exp(-(((one.grid - term["center"]) / term["width"]) ** 2) / 2)
                assert_allclose(curve, expected, rtol=1e-9)
        assert one.before.shape == one.after.shape
        assert not np.allclose(one.before, one.after)


def test_memberships_lie_over_the_histogram_of_the_data(fitted):
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


def test_memberships_before_training_are_dashed_or_left_out(fitted):
    pipe, _ = fitted
    with_before = MembershipDisplay.from_estimator(pipe, features=["kelvin"])
    lines = with_before.axes_[0].get_lines()
    assert [line.get_linestyle() for line in lines] == ["--", "-"] * 3
    without = MembershipDisplay.from_estimator(pipe, features=["kelvin"], show_before=False)
    assert len(without.axes_[0].get_lines()) == 3


def test_memberships_of_chosen_inputs_on_given_axes(fitted):
    pipe, _ = fitted
    _, axes = plt.subplots(1, 2)
    display = MembershipDisplay.from_estimator(pipe, features=[1, "kelvin"], ax=axes)
    assert_array_equal(display.axes_, axes)
    assert axes[0].get_xlabel() == "rate"
    figure, one = plt.subplots()
    display = drawn(MembershipDisplay.from_estimator(pipe, ax=one))
    assert all(axes.figure is figure for axes in display.axes_)
    alone = MembershipDisplay.from_estimator(pipe, features=[0], ax=plt.subplots()[1])
    assert len(alone.axes_) == 1
    with pytest.raises(ValueError, match="ax has 3 axes; 2 are needed, one per input"):
        MembershipDisplay.from_estimator(pipe, ax=plt.subplots(1, 3)[1])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"n_points": 1}, "n_points=1 must be a whole number of 2 or more"),
        ({"bins": 0}, "bins=0"),
        ({"features": ["pressure"]}, "'pressure' is no input: give a position from 0 to 2, or one"),
        ({"features": [3]}, "3 is no input"),
        ({"features": ["chip temperature"]}, "Input 'chip temperature' has no terms"),
    ],
)
def test_membership_parameters_are_checked(settings, message):
    with pytest.raises(ValueError, match=message):
        MembershipDisplay.from_estimator(
            MODELS["grid on two inputs, order 1, 1 outputs"], **settings
        )


def test_no_terms_no_picture():
    with pytest.raises(ValueError, match="no terms: nothing to draw"):
        MembershipDisplay.from_estimator(MODELS["one rule, order 1, 1 outputs"])
