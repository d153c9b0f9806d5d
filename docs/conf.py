"""How Sphinx builds the documentation: `python3 dev.py docs`. Every warning is an error there."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "src"))

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

autodoc_member_order = "bysource"
autodoc_default_options = {"exclude-members": "model_config"}  # pydantic's, no promise of ours
python_maximum_signature_line_length = 90


def plain_text(app, what, name, obj, options, lines):
    """Docstrings are plain text with formulas, made for help(). Shown as they are, not read as markup."""
    if what == "module":
        lines[:] = []  # the page has its own introduction
    text = [line.rstrip() for line in lines]
    if any(text):
        lines[:] = ["::", "", *("    " + line for line in text), ""]


def setup(app):
    app.connect("autodoc-process-docstring", plain_text, priority=100)
