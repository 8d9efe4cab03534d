"""How the documentation is built: `sphinx-build -W docs build/docs`, without a network."""

import sys
from importlib import metadata
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE / "extensions")]

project = "bowdenfit"
author = copyright = "The bowdenfit developers"  # noqa: A001  (Sphinx calls it so)
try:
    release = metadata.version("bowdenfit")
except metadata.PackageNotFoundError:
    release = ""
extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "myst_nb",
    "description_keys",
    "docstrings",
    "library",
    "mathml",
    "repository_pages",
    "verb_help",
]
exclude_patterns = ["extensions"]
nitpicky = True
nitpick_ignore_regex = [  # of libraries, and of what has no page
    ("py:class", ".*"),
    ("py:exc", ".*"),
    ("py:obj", r"typing\.Literal\[.*"),
]
default_role = "code"  # single backquotes in docstrings

html_theme = "furo"
html_title = f"bowdenfit {release}".strip()
html_math_renderer = "mathml"
html_static_path = ["static"]
html_css_files = ["bowdenfit.css"]
html_copy_source = False
html_show_sphinx = False
html_baseurl = ""

myst_enable_extensions = ["amsmath", "deflist", "dollarmath"]
myst_heading_anchors = 3

# Notebooks are run anew whenever the pages are built.
nb_execution_mode = "force"
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_execution_show_tb = True
nb_merge_streams = True
nb_ipywidgets_js = {}  # these would come from a network

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = False  # verbs have more keywords than stand in their source
napoleon_google_docstring = True
napoleon_use_rtype = False
