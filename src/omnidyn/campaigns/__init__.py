"""Many simulations and fits: which, in which pieces, on which machines, and what they say together.

Read spec (what is varied, and the file that says so), design (the numbers of each sample), tasks (what is done with a
sample, what is measured), fits (many logs: a row a fit), batches (samples moved together), manifest (what makes
a campaign this one), folder (shards and lock: nothing is lost or done twice), executors (where shards run), sweep (the
one door: runs shards on any executor), results (what they say: shares within a limit, which numbers matter),
total_shares (which matter together with others).
"""
