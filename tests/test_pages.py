"""Pages to be pasted run as they stand, from the top, and print what they say that they print."""

import doctest
import re
import textwrap
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
PAGES = ("quickstart", "from_matlab")
if not (DOCS / f"{PAGES[0]}.rst").is_file():
    pytest.skip("the documentation is not here", allow_module_level=True)

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
