"""From twist to pose, one step at a time: the two lines that every engine shares."""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part


@part
def rotated(angle, x, y):
    """(x, y) turned by `angle` [rad]: from the body frame to one against which the body has turned by it, eq (1)."""
    cos, sin = math.cos(angle), math.sin(angle)
    return cos * x - sin * y, sin * x + cos * y


@part
def put_next_pose(poses, k, x, y, turn, lost):
    """Write row k + 1 of `poses`: row k moved by (x, y) in its own body frame [m], then turned by `turn` [rad].

    Returns what rounding took from the heading; handed in again as `lost` it makes the headings a compensated sum.
    """
    east, north = rotated(poses[k, 2], x, y)
    poses[k + 1, 0] = poses[k, 0] + east
    poses[k + 1, 1] = poses[k, 1] + north
    kept = turn - lost
    poses[k + 1, 2] = poses[k, 2] + kept
    return (poses[k + 1, 2] - poses[k, 2]) - kept
