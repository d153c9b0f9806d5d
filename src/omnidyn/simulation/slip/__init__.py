"""Wheels that slip: an engine of its own, whose wheels have speeds of their own.

Read plant (the numbers, and what each wheel carries), body (its friction, and one wheel between motor and floor), leap
(where sweeps are slow), stage (body and wheels together, what holds and what slides), bounds (of a step), slip_march (a
run).
"""
