"""Turn and travel of a run since its start: how many numbers of it are wanted.

The heading th, the path s that the wheels have rolled along the body's own axes, and the place p, both from where the
robot stood and along where it faced then:

    th' = omega    s' = v    p' = R(th) v        dp'/dq = R(th) (dv/dq + dth/dq z x v)
"""

from __future__ import annotations

TURN, PATH, PLACE = 1, 3, 5  # numbers of it: heading; path along x, y of the body; place along x, y at the start
SAME_TIME = 1e-9  # [s] times that differ by less are one
