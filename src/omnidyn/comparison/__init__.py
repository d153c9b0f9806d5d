"""A model beside a log: compare is the door, result the answer.

replay (a free run, begun by start), traces, metrics, aligned and lag, whiteness, difference (of two models),
threshold, bands (how far the model may be off). text shows it. drift stands beside: fits of one
robot, compared with each other.
"""
