"""Many simulations: which, in which pieces, on which machines, and what they say together.

Read spec (what is varied, and the file that says so), design (the numbers of each sample), tasks (what is done with a
sample, what is measured), folder (shards, their manifest and lock: nothing is lost or done twice), sweep (the one door:
runs shards on any executor), results (what they say: shares within a limit, which numbers matter).
"""
