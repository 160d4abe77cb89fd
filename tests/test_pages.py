"""The code on the pages and in README runs, and prints what they say that it prints."""

import doctest
import re
import textwrap
from functools import wraps
from pathlib import Path

import joblib
import pytest

from skanfis import ANFISRegressor
from skanfis.export.fis.functions import function_of
from skanfis.gyro.metrics import ALLAN_FIGURES, figures_of_merit
from skanfis.inspection.readability import GREATEST_ALONE, GREATEST_ERROR
from skanfis.membership import FAMILIES, MEMBERSHIPS

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = ("quickstart", "from_matlab")
# How many lines of code there are at least: a page that lost them is no page that works.
WITH_PROMPTS = {
    "add_a_membership": 5,
    "choosing": 15,
    "files": 5,
    "how_sure": 15,
    "large_data": 5,
    "reading_rules": 20,
    "training": 20,
    "trees": 9,
}
if not (DOCS / f"{PAGES[0]}.rst").is_file():
    pytest.skip("the documentation is not here", allow_module_level=True)
README = (ROOT / "README.md").read_text(encoding="utf-8")
OF_README = re.findall(r"^```python\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)

pytestmark = pytest.mark.page

BLOCK = re.compile(r"^\.\. code-block:: (python|text)\n\n((?:   .*\n|\n)+)", re.MULTILINE)
LOOSELY = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


@pytest.fixture(scope="module")
def fitted_once():
    """What README and a page fit alike, the same settings to the same rows, is fitted once."""
    fit, known = ANFISRegressor.fit, {}

    @wraps(fit)
    def once(self, *rows, **others):
        key = joblib.hash((repr(self), rows, others))
        if key not in known:
            known[key] = vars(fit(self, *rows, **others)).copy()
        vars(self).update(known[key])
        return self

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ANFISRegressor, "fit", once)
        yield


@pytest.mark.parametrize("page", PAGES)
def test_page_as_pasted(page, tmp_path, monkeypatch, capsys, fitted_once):
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "__main__"}
    blocks = BLOCK.findall((DOCS / f"{page}.rst").read_text(encoding="utf-8"))
    assert [kind for kind, _ in blocks].count("text") > 5
    printed = ""
    for kind, block in blocks:
        text = textwrap.dedent(block).rstrip() + "\n"
        if kind == "python":
            assert not printed, f"{page}: nothing is said of the output {printed!r}"
            exec(compile(text, f"{page}.rst", "exec"), namespace)
            printed = capsys.readouterr().out
        else:
            assert doctest.OutputChecker().check_output(text, printed, LOOSELY), (
                f"{page}: expected\n{text}printed\n{printed}"
            )
            printed = ""
    assert not printed


@pytest.mark.parametrize("page", WITH_PROMPTS)
def test_page_with_prompts(page, tmp_path, monkeypatch):
    if page == "large_data":
        pytest.importorskip("dask")
    monkeypatch.chdir(tmp_path)
    path = str(DOCS / f"{page}.rst")
    failed, tried = doctest.testfile(path, module_relative=False, optionflags=LOOSELY)
    assert tried > WITH_PROMPTS[page]
    assert failed == 0


def test_every_page_with_prompts_is_run():
    assert set(WITH_PROMPTS) == {
        page.stem for page in DOCS.glob("*.rst") if ">>> " in page.read_text("utf-8")
    }


def test_limits_of_reading_rules_are_those_of_the_package():
    page = (DOCS / "reading_rules.rst").read_text(encoding="utf-8")
    table = page.partition("list-table")[2]
    for measure, limit in (
        ("text over model", f"{GREATEST_ERROR} times the error"),
        ("strongest rule alone", f"{GREATEST_ALONE} standard deviations"),
    ):
        assert re.search(rf"\* - {measure}\n     - {re.escape(limit)}\n", table)


def test_every_family_is_on_the_page():
    page = (DOCS / "memberships.rst").read_text(encoding="utf-8")
    for family in FAMILIES.values():
        in_files, _ = function_of(family, [1.0] * len(family.parameters))
        assert family.name in page
        assert f"``{in_files}``" in page
    for family in MEMBERSHIPS.values():
        assert f'``"{family.name}"``' in page
        assert all(parameter.name in page for parameter in family.parameters)


def test_every_figure_of_merit_is_on_the_page():
    """By its name, or by the ending alone, as in "residual_rms, _peak"."""
    page = (DOCS / "gyro_metrics.rst").read_text(encoding="utf-8")
    told = re.findall(r"\w+", "\n".join(line[:37] for line in page.splitlines()))
    endings = tuple(word for word in told if word.startswith("_"))
    for name in [*(figure.name for figure in figures_of_merit()), *ALLAN_FIGURES]:
        assert name in told or name.endswith(endings), name


def run(block, capsys):
    """In a namespace with nothing in it."""
    exec(compile(block, "README.md", "exec"), namespace := {"__name__": "__main__"})
    return namespace, capsys.readouterr().out


def test_ordinary_data_of_readme_as_pasted(capsys, fitted_once):
    namespace, out = run(OF_README[0], capsys)
    assert float(re.search(r"R² on new rows: (\S+)", out)[1]) > 0.3
    announced = re.search(r"# (\d+) rules, on (\w+) and (\w+)", OF_README[0])
    assert int(announced[1]) == namespace["model"].n_rules_
    assert f"IF {announced[2]} is low AND {announced[3]} is high\n" in out


def test_gyro_of_readme_as_pasted(capsys, fitted_once):
    namespace, out = run(OF_README[1], capsys)
    assert "rate" not in namespace["X"]
    numbers = r"(\d+) °/h RMS before, (\d+) after\n"
    measured, told = re.fullmatch(numbers, out), re.search(f"# {numbers}", OF_README[1])
    assert [*map(float, measured.groups())] == pytest.approx([*map(float, told.groups())], rel=0.1)
    # There is no other block.
    assert len(OF_README) == 2


def test_every_file_that_readme_links_to_is_there():
    links = re.findall(r"\]\(([^)#]+)", README)
    assert links
    missing = [link for link in links if "://" not in link and not (ROOT / link).is_file()]
    assert not missing
