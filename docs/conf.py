"""Configuration of Sphinx; every option that is not set has its default."""

import os
import re
import sys
from importlib import import_module
from pathlib import Path

import skanfis

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_ext"))

project = "skanfis"
author = "The skanfis developers"
copyright = author
version = release = skanfis.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "mathml",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build"]
templates_path = ["_templates"]
default_role = "literal"
# Every reference to a name has to lead somewhere, but for those to other packages' pages.
nitpicky = True
nitpick_ignore_regex = [
    ("py:.*", r"(sklearn|numpy|scipy|pandas)\..*"),
    # Properties, which stand in the tables of attributes; and what signatures name but no page has.
    ("py:obj", r"\w+"),
    ("py:class", r"skanfis\.(model\.TSKModel|inspection\.measures\.Measures)"),
]

autosummary_generate = True
# Types stand in the tables of parameters, in words; twenty of them would bury a signature.
autodoc_typehints = "none"
# A class and a function whose names differ by a capital only would be one file on some systems.
autosummary_filename_map = {
    "skanfis.inspection.readability": "skanfis.inspection.readability_function"
}
# The tables of methods come from the template of autosummary.
numpydoc_show_class_members = False
_LISTED = set(
    re.findall(r"^   (\w+)$", (HERE / "api.rst").read_text(encoding="utf-8"), re.MULTILINE)
)


def stands_here(module, name, method):
    """Whether a method is told of on a class's page: it is ours, and of no class with a page.

    The docstrings of what comes from scikit-learn refer to pages that are not here.
    """
    if method == "__init__" or method.endswith("_request"):
        return False
    public = getattr(import_module(module), name)
    owner = next((one for one in public.__mro__ if method in vars(one)), object)
    is_ours = owner.__module__.partition(".")[0] == "skanfis"
    return is_ours and (owner is public or owner.__name__ not in _LISTED)


autosummary_context = {"stands_here": stands_here}
# A function cannot be kept from one build to the next; every page is made anew.
suppress_warnings = ["config.cache"]

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "auto_examples",
    "image_scrapers": ("matplotlib",),
    "abort_on_example_error": True,
    "min_reported_time": 1,
    # What a plot gives back is no result.
    "ignore_repr_types": "matplotlib|Display|ndarray",
    "show_memory": False,
    # A page that would need a network.
    "write_computation_times": False,
}

html_static_path = ["_static"]
html_css_files = ["skanfis.css"]
html_theme = "pydata_sphinx_theme"
html_title = f"skanfis {version}"
html_theme_options = {"show_prev_next": False, "show_toc_level": 2}
# Released versions stay side by side, one folder each, with a menu to go from one to another: `make
# release` says where (DOCS_URL), and writes the list of versions there.
if docs_url := os.environ.get("DOCS_URL"):
    html_baseurl = f"{docs_url}/{version}/"
    html_theme_options |= {
        "switcher": {"json_url": f"{docs_url}/versions.json", "version_match": version},
        "navbar_end": ["version-switcher", "theme-switcher"],
    }
