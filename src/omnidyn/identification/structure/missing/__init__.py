"""What would explain what a fit leaves: candidates.py (numbers that stand wrong), laws.py (laws to switch on),
unoffered.py (what no law holds yet), remedies.py (all of them, best first), switches.py (one switched on), refits.py
(the best of them fitted too), odometry.py (a radius that looks like another number).
"""
