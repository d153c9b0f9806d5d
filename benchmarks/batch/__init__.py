"""Batches of robots beside others, and the limits of the machine: `python -m benchmarks batch`.

rows: what is measured. peers: others on the same work. loop.cpp: the plain loop, and what the machine can.
"""

from benchmarks.batch.rows import measure

__all__ = ["measure"]
