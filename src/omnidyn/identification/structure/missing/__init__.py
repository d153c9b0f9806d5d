"""What would explain what a fit leaves: candidates.py (numbers that stand wrong, and what no law holds yet), laws.py
(laws to switch on), remedies.py (all of them, best first), switches.py (one switched on), refits.py (the best of them
fitted too).
"""
