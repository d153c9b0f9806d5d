"""Copies of vectors, tables and states within kernels, and whether two states stick alike."""

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
def copy_each(to, source):
    """Take over the named states of every element."""
    for e in range(len(to)):
        to[e] = source[e]


@part
def copy_state(to, source):
    """Take over all of a state."""
    copy_row(to.x, source.x)
    copy_each(to.each, source.each)


@part
def state_of_row(to, states, k):
    """Take over all of one of many states."""
    copy_row(to.x, states.x[k])
    copy_each(to.each, states.each[k])


@part
def row_of_state(states, k, source):
    """Make one of many states the one given."""
    copy_row(states.x[k], source.x)
    copy_each(states.each[k], source.each)


@part
def signs_differ(a, b):
    """Whether two states differ in what sticks or in a direction of sliding, element by element."""
    apart = False
    for e in range(len(a.each)):
        apart |= a.each[e].sign != b.each[e].sign
    return apart
