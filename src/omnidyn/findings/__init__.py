"""Is a log fit for use? check runs one family of faults after the other, finding is what they say.

signal/ is what all families stand on (log_under_check is their contract). Families: time_base, values/, limits,
wiring/ (and frames), slip, scale/ (and derivatives), filters, averaged (means over rows), energy, motion, oddities
(small things), excitation. What rests on a guessed number is no fault (guessed). What the log can be used for: needs
are the rules, which `identify` goes by too, fitness asks them. What can be mended by reading otherwise: remedies.
"""
