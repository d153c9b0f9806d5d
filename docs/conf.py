"""How Sphinx builds the documentation: `python3 dev.py docs`. Every warning is an error there."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src"), str(ROOT / "docs")]

from api_page import as_rst, signature_of  # noqa: E402

import omnidyn  # noqa: E402

project = "omnidyn"
author = "The omnidyn authors"
project_copyright = "The omnidyn authors"
version = release = omnidyn.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc"]
exclude_patterns = ["_build"]
# README.md links to files of the repository, which are no pages here.
suppress_warnings = ["myst.xref_missing"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = f"omnidyn {version}"
html_show_sourcelink = False
html_static_path = ["_static"]
html_css_files = ["wide.css"]

autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_default_options = {"exclude-members": "model_config"}  # pydantic's, no promise of ours
python_maximum_signature_line_length = 90


def shown(app, what, name, obj, options, lines):
    """Docstrings are prose with formulas, made for help(): arguments become tables, the rest stays as it is."""
    text = "\n".join(lines)
    lines[:] = [] if what == "module" or not text.strip() else as_rst(obj, text)


def signature(app, what, name, obj, options, arguments, back):
    """Names and defaults alone: types stand in the table of arguments."""
    return signature_of(obj) if what in ("function", "method", "class") else None


def setup(app):
    app.connect("autodoc-process-docstring", shown, priority=100)
    app.connect("autodoc-process-signature", signature)
