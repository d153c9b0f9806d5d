"""Pages that stand alone: html and page, figures/, one file per page; style and plotting are shared.

Pages: identification_page, which is one of fit_page, line_page, motors_page, steady_page; drive_page, tracking_page.
Pictures alone: drift_picture, friction_picture; plots (`plot` of a result), notebook. misfit_section: what the model
leaves out. formulas: formulas on a page.
"""

from omnidyn.report import plotting as plotting  # before any other part of matplotlib is imported
