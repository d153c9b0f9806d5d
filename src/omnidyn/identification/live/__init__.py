"""Enough? What a log tells while it grows.

rows (what came, however it came), quadratic (what rows tell, as sums that add up), model (the
numbers between two whole fits), status (the numbers now, and whether
that is enough), change (what is no longer as in a fit before), live (the door).
"""
