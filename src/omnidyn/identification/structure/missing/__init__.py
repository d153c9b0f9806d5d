"""What would explain what a fit leaves: candidates.py (numbers that stand wrong), rivals.py (what no law holds yet),
laws.py (laws to switch on), remedies.py (all of them, best first), computed_twist.py (what a twist from wheels hides),
switches.py (one switched on), refits.py (the best of them fitted too).
"""
