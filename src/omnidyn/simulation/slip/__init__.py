"""Wheels that slip: an engine of its own, whose wheels have speeds of their own.

Read loads (what each wheel carries), plant (the numbers), wheel (one wheel between motor and floor), body (its
friction), levels (what holds and what slides), stage (body and wheels together), bounds (of a step), march (a run).
"""
