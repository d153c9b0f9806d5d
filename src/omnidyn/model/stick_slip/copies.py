"""Copies of vectors, tables and states within kernels."""

from __future__ import annotations

from omnidyn.compiled.kernel import part


@part
def copy_row(to, source):
    """to[:] = source for vectors; numba would make an array on the way, and take seconds to compile a message."""
    for j in range(len(to)):
        to[j] = source[j]


@part
def copy_table(to, source):
    """to[:, :] = source for tables."""
    for i in range(to.shape[0]):
        for j in range(to.shape[1]):
            to[i, j] = source[i, j]


@part
def copy_state(to, source):
    """Take over all of a state."""
    copy_row(to.x, source.x)
    for e in range(len(to.each)):
        to.each[e] = source.each[e]


@part
def state_of_row(to, states, k):
    """Take over all of one of many states."""
    copy_row(to.x, states.x[k])
    for e in range(len(to.each)):
        to.each[e] = states.each[k, e]


@part
def row_of_state(states, k, source):
    """Make one of many states the one given."""
    copy_row(states.x[k], source.x)
    for e in range(len(source.each)):
        states.each[k, e] = source.each[e]
