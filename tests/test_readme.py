"""What a reader pastes runs: README's blocks of Python, each in a namespace with nothing in it."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
if not README.is_file():
    pytest.skip("README.md is not here", allow_module_level=True)

pytestmark = pytest.mark.page

TEXT = README.read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```python\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)


def run(block, capsys):
    exec(compile(block, "README.md", "exec"), namespace := {"__name__": "__main__"})
    return namespace, capsys.readouterr().out


# The warnings that its own comments announce.
@pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")
def test_ordinary_data_as_pasted(capsys):
    namespace, out = run(BLOCKS[0], capsys)
    assert float(re.search(r"R² on new rows: (\S+)", out)[1]) > 0.3
    announced = re.search(r"# (\d+) rules, on (\w+) and (\w+)", BLOCKS[0])
    assert int(announced[1]) == namespace["model"].n_rules_
    assert f"IF {announced[2]} is low AND {announced[3]} is high\n" in out


@pytest.mark.filterwarnings("ignore::skanfis.exceptions.OutOfBoundsWarning")
def test_gyro_as_pasted(capsys):
    namespace, out = run(BLOCKS[1], capsys)
    assert "rate" not in namespace["X"]
    numbers = r"(\d+) °/h RMS before, (\d+) after\n"
    measured, told = re.fullmatch(numbers, out), re.search(f"# {numbers}", BLOCKS[1])
    assert [*map(float, measured.groups())] == pytest.approx([*map(float, told.groups())], rel=0.1)


def test_there_is_no_other_block():
    assert len(BLOCKS) == 2


def test_every_file_that_it_links_to_is_there():
    links = re.findall(r"\]\(([^)#]+)", TEXT)
    assert links
    missing = [link for link in links if "://" not in link and not (ROOT / link).is_file()]
    assert not missing
