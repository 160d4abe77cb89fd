"""Configuration of Sphinx; every option that is not set has its default."""

import os
import sys
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

autosummary_generate = True
# A class and a function whose names differ by a capital only would be one file on some systems.
autosummary_filename_map = {
    "skanfis.inspection.readability": "skanfis.inspection.readability_function"
}
# The tables of methods come from the template of autosummary.
numpydoc_show_class_members = False

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "auto_examples",
    "image_scrapers": ("matplotlib",),
    "abort_on_example_error": True,
    "min_reported_time": 1,
    "show_memory": False,
}

html_theme = "pydata_sphinx_theme"
html_title = f"skanfis {version}"
html_theme_options = {"show_prev_next": False}
