"""The code on the pages runs, and prints what they say that it prints."""

import doctest
import re
import textwrap
from pathlib import Path

import pytest

from skanfis.export.fis.functions import function_of
from skanfis.inspection.readability import GREATEST_ALONE, GREATEST_ERROR
from skanfis.membership import FAMILIES, MEMBERSHIPS

DOCS = Path(__file__).parents[1] / "docs"
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

pytestmark = pytest.mark.page

BLOCK = re.compile(r"^\.\. code-block:: (python|text)\n\n((?:   .*\n|\n)+)", re.MULTILINE)
LOOSELY = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


# The warnings that the pages speak of.
@pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")
@pytest.mark.parametrize("page", PAGES)
def test_page_as_pasted(page, tmp_path, monkeypatch, capsys):
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
