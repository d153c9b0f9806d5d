"""What is fitted to what.

parameters and primitives (from them to numbers of the step), record (a log), outputs with redundant (channels computed
from others), starts (where friction begins), motion (what moved), nuisances (what the log does), problem (all of it).
"""
