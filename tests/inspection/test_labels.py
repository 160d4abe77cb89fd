"""Names that are hostile to pictures and terminals."""

from dataclasses import replace

import numpy as np
import pytest

from skanfis.inspection import (
    LossCurveDisplay,
    MembershipDisplay,
    ResponseSurfaceDisplay,
    RuleActivationDisplay,
    RuleContributionDisplay,
)
from skanfis.inspection.labels import as_label, printable

from .drawing import A_GRID, drawn, plt

HOSTILE = ["$$", r"$\frac{0$", r"\$", "a$b", "$x_1$", "\x1b[2J", "\udcff", "a\nb"]


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


@pytest.mark.parametrize("name", HOSTILE)
def test_a_label_is_drawn_as_it_is(name):
    # matplotlib's own reading of a text: whether it is mathematics, and what it is without.
    figure = plt.figure()
    text = figure.text(0, 0, as_label(name))
    assert text._preprocess_math(as_label(name)) == (printable(name), False)
    plt.close(figure)


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
    drawn(LossCurveDisplay(loss=np.array([2.0, 1.0]), validation_loss=[1.5], name=name).plot())
    plt.close("all")
