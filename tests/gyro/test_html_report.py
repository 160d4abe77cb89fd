"""The report: one file that needs nothing else, with all that was promised."""

import re
import subprocess
import sys
from html.parser import HTMLParser

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from skanfis.datasets import make_ofog
from skanfis.gyro._calibration import MAX_EXTRAPOLATION, Recipe, calibrate
from skanfis.gyro._html import Page
from skanfis.gyro._models import make_estimator
from skanfis.gyro._split import choose_split
from skanfis.gyro.displays._style import figures
from skanfis.gyro.html_report import report_page, rules_text
from skanfis.inspection import readability

VOID = {"meta", "img", "br"}


class Outline(HTMLParser):
    """Tags, attributes and text; every tag must be closed in its turn."""

    def __init__(self, text):
        super().__init__()
        self.open, self.attributes, self.tags, self.text = [], [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.attributes += [(tag, *pair) for pair in attributes]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def calibration_of(log, inputs=("time", "temperature", "temperature_rate", "output"), **options):
    split = choose_split(log, uses_output="output" in inputs)
    return calibrate(log, split, Recipe(inputs, **options), lambda text: None)


@pytest.fixture(scope="module")
def calibration():
    log = make_ofog(n_devices=1, n_runs=5, duration=900.0, profile="ramps", random_state=0)
    return calibration_of(log, terms=(1, 1, 1, 3))


@pytest.fixture(scope="module")
def page(calibration):
    return report_page(calibration, "<gyro> & co.csv")


def test_is_well_formed_and_escaped(page):
    outline = Outline(page)
    assert "Gyro compensation: <gyro> & co.csv" in "".join(outline.text)


def test_needs_nothing_from_elsewhere(page):
    outline = Outline(page)
    assert not {"script", "link", "iframe", "object"} & set(outline.tags)
    sources = [value for _, name, value in outline.attributes if name in ("src", "href")]
    assert sources
    kinds = ("data:image/png;base64,", "data:text/csv;charset=utf-8;base64,")
    assert all(value.startswith(kinds) for value in sources)
    # Style, too; and nothing of the machine that made it.
    assert not re.search(r"url\(|@import|https?://", page)


def test_every_picture_says_what_it_shows(page):
    outline = Outline(page)
    n_pictures = outline.tags.count("img")
    alternatives = [
        value for tag, name, value in outline.attributes if (tag, name) == ("img", "alt")
    ]
    assert len(set(alternatives)) == n_pictures
    for subject in ("time", "temperature", "scale-factor", "warming", "rows over", "held-out",
                    "Coverage", "Membership"):  # fmt: skip
        assert any(subject.lower() in text.lower() for text in alternatives), subject


def test_fits_a_phone(page):
    assert '<meta name="viewport" content="width=device-width, initial-scale=1">' in page
    # No table may push the page wider than the screen.
    assert page.count('<div class="scroll') == page.count("<table>")


def test_figures_are_those_of_held_out_rows_in_range(page, calibration):
    rows = calibration.inside
    after = np.sqrt(np.mean((calibration.after - calibration.rate)[rows] ** 2))
    before = np.sqrt(np.mean((calibration.before - calibration.rate)[rows] ** 2))
    text = " ".join(Outline(page).text)
    for value in (f"{before:#.3g} °/s", f"{after:#.3g} °/s", f"{before / after:#.3g} ×"):
        assert value in text.replace(",", "")
    assert "whole runs held out (5 runs" in text


def test_every_fold_was_new_to_its_model(calibration):
    # The last fold by hand.
    train, test = calibration.split.folds[-1]
    error = calibration.before - calibration.rate
    model = make_estimator(calibration.recipe, (1, (1, 1, 1, 3)))
    model.fit(calibration.X.iloc[train], error[train])
    expected = calibration.before[test] - model.predict(calibration.X.iloc[test])
    np.testing.assert_allclose(calibration.after[test], expected, rtol=1e-9)


def test_the_same_log_gives_the_same_report(page, calibration):
    assert report_page(calibration, "<gyro> & co.csv") == page


def test_rules_and_what_to_compute_on_board(page, calibration):
    text = " ".join(Outline(page).text)
    assert "error = " in rules_text(calibration)
    assert rules_text(calibration).splitlines()[0] in text
    assert "temperature_rate += (1 - exp(-h / 30))" in text
    assert "rate = output / 1 - error(time, temperature, temperature_rate, output);" in text


@pytest.mark.parametrize("physics", [False, True])
def test_says_whether_the_rules_can_be_read(physics):
    log = make_ofog(n_devices=1, n_runs=4, duration=600.0, random_state=0)
    calibration = calibration_of(log, ("temperature", "output"), terms=(2, 2), physics=physics)
    estimator = calibration.compensator.estimator
    # What the rules were taught, by hand.
    taught = calibration.before - calibration.rate
    if physics:
        taught = calibration.rate - estimator.base_.predict(calibration.X)
    found = readability(getattr(estimator, "residual_", estimator), calibration.X, taught)
    text = "".join(Outline(report_page(calibration, "log.csv")).text)
    section = text[text.index("Can the rules be read?") :]
    for sentence in found.findings or ["Nothing measured here speaks against"]:
        assert sentence in section
    assert f"[sd]{figures(found.summary['strongest_alone'])}0.5" in section.replace("\n", "")


def test_a_gyro_at_rest_has_no_scale_factor_pictures():
    log = make_ofog(n_devices=1, n_runs=4, duration=600.0, rates=[0.0], random_state=0)
    calibration = calibration_of(log, inputs=("temperature",), terms=(2,), outside="nan")
    text = " ".join(Outline(report_page(calibration, "rest.csv")).text)
    assert "°/h" in text
    assert "Scale-factor error against rate" not in text
    assert "no rate is given" in text


@pytest.mark.parametrize("has_time", [True, False])
def test_physics_shows_its_law(has_time):
    log = make_ofog(n_devices=1, n_runs=4, duration=600.0, random_state=0)
    inputs = ("temperature", "temperature_rate", "output")
    if not has_time:
        log, inputs = log.drop(columns="time"), ("temperature", "output")
    terms = (1,) * len(inputs)
    calibration = calibration_of(log, inputs, terms=terms, physics=True, outside="linear")
    text = " ".join(Outline(report_page(calibration, "law.csv")).text)
    law = calibration.compensator.estimator.base_
    assert f"{law.sagnac_factor_[0]:.8g}" in text
    assert rules_text(calibration).splitlines()[0] in text
    assert f"along its tangent, for each input up to {MAX_EXTRAPOLATION:g} of its standard" in text
    if has_time:
        assert f"lag of the thermometer: {law.thermometer_lag_:.6g} s" in text
        # The simulated thermometer's, of 180 s to 20 %, less that of the low-pass of its rate.
        assert 100.0 < law.thermometer_lag_ < 260.0
    else:
        assert "the log has no time" in text or "allantools is not installed" in text


def test_page_refuses_no_text():
    page = Page("a < b", "c & d")
    page.cards([("what", "1", "<i>")])
    page.section("s")
    page.heading("h")
    page.table(("x", "unit"), [(("1", "[0, 2]"), "°/s"), ("2", "")], "caption")
    page.preformatted("a\n<b>", "more")
    page.footer("end")
    outline = Outline(page.render())
    text = "".join(outline.text)
    for part in ("a < b", "c & d", "<i>", "[0, 2]", "a\n<b>", "caption"):
        assert part in text


def test_no_screen_is_asked_for():
    code = (
        "import sys; import skanfis.gyro.command; assert 'matplotlib' not in sys.modules; "
        "import skanfis.gyro._pictures as p; p._figure(1, 1); "
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_run_without_a_row_in_range_has_no_error():
    # Every run at a temperature of its own: the outermost lie beyond what the others have seen.
    log = make_ofog(
        n_devices=1, n_runs=6, duration=600.0, max_residual_heat=0.0, rates=[0.0], random_state=3
    )
    calibration = calibration_of(log, ("time", "temperature"), terms=(1, 2))
    in_range = [calibration.inside[log["run"] == run].any() for run in log["run"].unique()]
    assert not all(in_range)
    shown = "".join(Outline(report_page(calibration, "log.csv")).text)
    assert "–" in shown
    assert not re.search(r"\bnan\b", shown)
