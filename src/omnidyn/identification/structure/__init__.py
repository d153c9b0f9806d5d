"""Is the model right? What a fit leaves out, what would mend it, what cannot be told apart, what each number rests on,
and which are not the same throughout the logs.

Rests on output_error/linear/. Read in this order: disturbances.py (forces that no model of ours has), misfit.py
(whether residuals hold them), tails.py (outliers), noise_level.py and windows.py (noise that the log shows without the
model), residual_bins.py (pictures), missing/ (what would explain a misfit), block_fits.py and shifts.py (which numbers
differ between parts of the logs), sensitivity_to_fixed.py (what each number rests on), diagnosis.py (all of it),
ladder/ (one remedy at a time).
"""
