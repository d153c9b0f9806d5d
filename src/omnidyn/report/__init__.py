"""Pages that stand alone: html and page, figures/, one file per page; style is shared."""

from omnidyn.report import plotting as plotting  # before any other part of matplotlib is imported
