"""What a release publishes: links that work on an index, files that agree on version and floors."""

import re
import runpy
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

import skanfis

ROOT = Path(__file__).parents[1]
if not (ROOT / ".ci" / "release.py").is_file():
    pytest.skip("the files of a release are not here", allow_module_level=True)

URL = "https://example.org/someone/skanfis"
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def script(name):
    return runpy.run_path(str(ROOT / ".ci" / f"{name}.py"), run_name=name)


def test_links_of_readme_are_addresses_on_an_index(monkeypatch):
    # hatchling is there where a build runs, and not needed for this.
    base = ModuleType("hatchling.metadata.plugin.interface")
    base.MetadataHookInterface = object
    monkeypatch.setitem(sys.modules, base.__name__, base)
    absolute = script("metadata")["absolute"]
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    links = re.findall(r"!?\[[^\]]*\]\(([^)]+)\)", absolute(readme, URL, "1.2.3"))
    assert f"{URL}/raw/v1.2.3/docs/images/gyro.png" in links
    assert f"{URL}/blob/v1.2.3/docs/quickstart.rst" in links
    assert all(link.startswith("https://") for link in links)
    kept = '[there](https://a.b/c), [here](#here), `f(x)[0](1)` and [a](b.md "title")'
    assert absolute(kept, URL, "1").startswith("[there](https://a.b/c), [here](#here), ")


def test_one_release_writes_address_date_and_version(tmp_path, monkeypatch):
    release = script("release")
    names = {name for name, *_ in release["edits"](URL, "2030-01-02")}
    for name in [*names, "skanfis/__init__.py"]:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text((ROOT / name).read_text(encoding="utf-8"), encoding="utf-8")
    shared = release["prepare"].__globals__
    monkeypatch.setitem(shared, "ROOT", tmp_path)
    monkeypatch.setitem(shared, "git", lambda *arguments: "")
    before = {name: (tmp_path / name).read_text(encoding="utf-8") for name in names}
    release["prepare"](URL, True)
    assert before == {name: (tmp_path / name).read_text(encoding="utf-8") for name in names}
    for _ in range(2):  # a second attempt, after one that failed on the way, finds the same places
        release["prepare"](URL + "/", False)
        after = {name: (tmp_path / name).read_text(encoding="utf-8") for name in names}
        settings = tomllib.loads(after["pyproject.toml"])["tool"]["hatch"]["metadata"]["hooks"]
        assert settings["custom"]["url"] == URL
        assert f"## [{skanfis.__version__}] - " in after["CHANGELOG.md"]
        citation = after["docs/CITATION.cff"]
        assert f"\nversion: {skanfis.__version__}\n" in citation
        assert citation.count(f"\nrepository-code: {URL}\n") == 1
        assert citation.count("\ndate-released: ") == 1


@pytest.mark.parametrize(
    ("url", "answers", "reason"),
    [
        ("", {}, "must be the address"),
        (URL, {"status": " M README.md"}, "not committed"),
        (URL, {"tag": "v0"}, "tagged already"),
    ],
)
def test_no_release_of_what_is_not_ready(monkeypatch, url, answers, reason):
    release = script("release")
    shared = release["prepare"].__globals__
    monkeypatch.setitem(shared, "git", lambda *arguments: answers.get(arguments[0], ""))
    with pytest.raises(SystemExit, match=reason):
        release["prepare"](url, True)


def test_documentation_of_every_version_stays(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / ".ci"))
    publish = script("publish_docs")["publish"]
    sys.modules.pop("release", None)
    for folder in ("built", "pages/0.0.9", "pages/0.0.10"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "index.html").write_text(folder, encoding="utf-8")
    publish(tmp_path / "built", tmp_path / "pages", "https://pages")
    listed = (tmp_path / "pages" / "versions.json").read_text(encoding="utf-8")
    found = re.findall(r'"url": "https://pages/([^/]+)/"', listed)
    assert found == [skanfis.__version__, "0.0.10", "0.0.9"]
    assert found[0] in (tmp_path / "pages" / "index.html").read_text(encoding="utf-8")


def test_conda_recipe_has_the_floors_of_pyproject():
    jinja2 = pytest.importorskip("jinja2")
    yaml = pytest.importorskip("yaml")

    def load_file_regex(load_file, regex_pattern, from_recipe_dir):
        text = (ROOT / ".conda" / load_file).read_text(encoding="utf-8")
        return re.search(regex_pattern, text)

    recipe = jinja2.Template((ROOT / ".conda" / "meta.yaml").read_text(encoding="utf-8")).render(
        load_file_data=lambda path, from_recipe_dir: PYPROJECT,
        load_file_regex=load_file_regex,
        PYTHON="python",
    )
    found = yaml.safe_load(recipe)
    assert found["package"] == {"name": "skanfis", "version": skanfis.__version__}
    assert set(PYPROJECT["project"]["dependencies"]) < set(found["requirements"]["run"])
    assert found["build"]["entry_points"] == ["skanfis-gyro = skanfis.gyro.__main__:main"]
