"""The report: one file that needs nothing else, with all that was promised."""

import base64
import re
import sys

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("jinja2")

from skanfis.datasets import make_ofog
from skanfis.gyro._calibration import Recipe, calibrate
from skanfis.gyro._headline import proven_bounds, rules_text
from skanfis.gyro._options import parse_limit
from skanfis.gyro._results import Picture, Results
from skanfis.gyro._split import choose_split
from skanfis.gyro.displays import three_digits
from skanfis.gyro.html_report import check_installed, report_page
from skanfis.gyro.metrics import rms
from skanfis.inspection import readability

from ..outline import Outline
from .planted import with_few_rivals

pytestmark = pytest.mark.usefixtures("given_weights", "coarse_report")


def calibration_of(log, inputs=("temperature", "temperature_rate", "output"), **options):
    split = choose_split(log, uses_output="output" in inputs)
    recipe = Recipe(inputs, **{"write": "rules"} | options)
    return calibrate(log, split, recipe, lambda text: None)


@pytest.fixture(scope="module")
def calibration(given_weights):
    log = make_ofog(n_devices=1, n_runs=4, duration=900.0, profile="ramps", random_state=0)
    return calibration_of(log, terms=(1, 1, 3))


SCRIPT = "<script>alert('1')</script>\x00\u202e"
TITLE = "<gyro> & co.csv"


@pytest.fixture(scope="module")
def options(calibration):
    """All in it is text from outside; the limits lie on both sides of what was found."""
    merit = Results(calibration).merit.set_index("figure")
    value = merit.loc["residual_rms", "after"]
    typed = [f"residual_rms={factor * value:.9f}deg/s" for factor in (1.001, 0.999)]
    return {
        "serial": SCRIPT,
        "operator": SCRIPT,
        "files": ((SCRIPT, 12, "0" * 64),),
        "typed": SCRIPT,
        "limits": tuple(map(parse_limit, [*typed, "bias_instability=1deg/h"])),
    }


@pytest.fixture(scope="module")
def page(calibration, options, coarse_report):
    return report_page(Results(calibration, **options), TITLE)


def text_of(calibration):
    return Outline(report_page(Results(calibration), TITLE)).text


def test_is_well_formed_and_escaped(page):
    text = Outline(page).text
    assert "Gyro compensation: <gyro> & co.csv" in text
    # What was typed is data; control signs are shown as such.
    assert text.count(r"<script>alert('1')</script>\x00\u202e") == 4
    assert not {"\x00", "\u202e"} & set(text)
    # On a phone no table may push the page wider than the screen.
    assert page.count('<div class="scroll') == page.count("<table>")


def test_needs_nothing_from_elsewhere(page):
    outline = Outline(page)
    assert not {"script", "link", "iframe", "object"} & set(outline.names)
    sources = [own[name] for _, own in outline.tags for name in ("src", "href") if name in own]
    assert sources
    kinds = ("data:image/png;base64,", "data:text/csv;charset=utf-8;base64,")
    assert all(value.startswith(kinds) for value in sources)
    # Style, too; and nothing of the machine that made it.
    assert not re.search(r"url\(|@import|https?://", page)


def test_physics_shows_its_law(few_rivals, no_pictures):
    log = make_ofog(n_devices=1, n_runs=3, duration=600.0, random_state=0)
    calibration = calibration_of(log, terms=(1, 1, 1), physics=True, outside="linear")
    text = text_of(calibration)
    law, found = calibration.compensator.estimator.base_, calibration.rules[-1].model_
    assert rules_text(calibration).splitlines()[0] in text
    assert f"along its tangent, for each input up to {found.max_extrapolation:g} of its" in text
    assert f"{law.thermometer_lag_:.8g} s * temperature_rate" in rules_text(calibration)
    # The simulated thermometer's, of 180 s to 20 %, less that of the low-pass of its rate.
    assert 100.0 < law.thermometer_lag_ < 260.0
    taught = calibration.rate - law.predict(calibration.X)
    section = text[text.index("Can the rules be read?") :]
    findings = readability(calibration.rules, calibration.X, taught).findings
    findings = [sentence for sentence in findings if "digits" not in sentence]
    for sentence in findings or ["Nothing measured here speaks against"]:
        assert sentence in section


def test_a_cubic_is_held_beyond_its_range_and_has_bounds_of_its_own(
    calibration, no_pictures, monkeypatch
):
    cubic = text_of(calibration_of(calibration.log, ("output",), terms=(1,), write="cubic"))
    with_few_rivals(monkeypatch)
    none = text_of(calibration_of(calibration.log, ("output",), terms=(1,), write="none"))
    assert "is flagged (status 1): the value at the edge is held" in cubic
    assert "addition to the arcsine law" not in cubic
    assert "Nothing is subtracted, so there is nothing to bound." in none
    bounded = ["largest compensation, proven" in text for text in (cubic, none)]
    assert bounded == [True, False]


def test_a_gyro_at_rest_has_a_hysteresis_and_no_scale_factor_pictures(few_rivals, no_drawing):
    settings = {"rates": [0.0], "duration": 1800.0, "profile": "ramps", "random_state": 0}
    log = make_ofog(n_devices=1, n_runs=3, **settings)
    results = Results(calibration_of(log, ("temperature",), terms=(2,), outside="nan"))
    # Of what temperature alone leaves, too.
    assert "hysteresis" in results.pictures
    assert np.isfinite(results.merit.set_index("figure").loc["hysteresis", "after"])
    text = Outline(report_page(results, TITLE)).text
    assert "°/h" in text
    assert "Scale-factor error against rate" not in text
    assert "there is no value" in text


def test_the_verdict_comes_first(page, calibration, no_pictures):
    text = Outline(page).text
    verdict = calibration.verdict
    # Three rules, where the law of the sensor knows more.
    assert verdict.recommended != verdict.model
    title = "Use the arcsine law instead of the fuzzy rules"
    assert title in text[: text.index("Summary")]
    assert "are of the fuzzy rules, as --write asks" in text
    assert f"leaves {three_digits(verdict.rms['arcsine law'])} °/s RMS" in text
    inputs = ("temperature", "output")
    simple = calibration_of(calibration.log, inputs, terms=(1, 1), write="recommended")
    text = text_of(simple)
    model = next(each for each in simple.simpler if each.name == "arcsine law").estimator.base_
    assert f"{model.sagnac_factor_[0]:.8g}" in text[text.index("What is written") :]
    assert "are of the arcsine law, as recommended" in text
    assert "Can the rules be read?" not in text
    assert "Nothing is added to the arcsine law" in text


def test_one_unit_throughout(page, calibration, no_pictures, monkeypatch):
    """Of errors; rates, and the formula of what to use instead, are in deg/s."""
    monkeypatch.setattr("skanfis.gyro._results._SMALL", np.inf)
    size = rms((calibration.after - calibration.rate)[calibration.inside])
    hourly = text_of(calibration)
    for text, unit, factor in ((Outline(page).text, "°/s", 1.0), (hourly, "°/h", 3600.0)):
        told = text[text.index("How it was checked") : text.index("Figures of merit")]
        assert [other for other in ("°/s", "°/h") if other in told] == [unit]
        assert f"{three_digits(factor * size)} {unit}" in text


def test_terms_are_drawn_over_inputs_with_their_units(calibration, monkeypatch):
    monkeypatch.setattr(Picture, "of", lambda subject, figure, *_: figure)
    (figure,) = Results(calibration).memberships()
    assert [axes.get_xlabel() for axes in figure.axes] == ["output [°/s]"]


def test_a_file_runs_nothing_in_a_spreadsheet():
    from matplotlib.figure import Figure

    tables = {"groups": pd.DataFrame({"group": ["=HYPERLINK(1)", "-5"], "error": [1.0, 2.0]})}
    picture = Picture.of("subject", Figure(), tables, "Caption.")
    lines = base64.b64decode(picture.files["subject.csv"]).decode().splitlines()
    assert lines == ["group,error", "'=HYPERLINK(1),1", "-5,2"]


def test_the_way_to_get_what_is_missing_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    with pytest.raises(ImportError, match="the report needs weasyprint: pip install weasyprint"):
        check_installed(pdf=True)
    monkeypatch.setitem(sys.modules, "jinja2", None)
    with pytest.raises(ImportError, match="pip install jinja2"):
        check_installed()


def test_limits_on_both_sides_of_the_figure_and_what_is_proven(page, calibration):
    text = Outline(page).text
    section = text[text.index("Limits of the specification") : text.index("Pictures")]
    assert re.findall(r"pass|fail|not measured", section) == ["pass", "fail", "not measured"]
    assert re.search(r"bias instability 1 \S+ °/h not measured", section)
    assert "1 of 3 limits kept; not kept: residual rms; could not be measured" in text
    told = text[text.rindex("What is proven") : text.rindex("Can the rules be read?")]
    assert f"{Results(calibration).shown(proven_bounds(calibration)[0])} °/s" in told
    assert "as the indicated one does proven" in told


def test_no_screen_is_asked_for(fresh_process):
    assert fresh_process["matplotlib_of_the_command"] == []
    assert fresh_process["pyplot_of_pictures"] == []


def test_a_pdf_of_one_run_has_five_pages_at_most():
    weasyprint = pytest.importorskip("weasyprint")
    log = make_ofog(n_devices=1, n_runs=1, profile="ramps", duration=7200.0, random_state=0,
                    rates=np.arange(-90.0, 91.0, 15.0))  # fmt: skip
    calibration = calibration_of(log, terms=(1, 1, 2))
    document = weasyprint.HTML(string=report_page(Results(calibration), TITLE)).render()
    assert 2 <= len(document.pages) <= 5
    assert document.write_pdf().startswith(b"%PDF")
