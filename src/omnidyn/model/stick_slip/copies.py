"""Copies of vectors and tables within kernels."""

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
