"""A gyroscope in another unit than the wheels: deg/s read as rad/s, where the wheels say how fast the robot turns."""

from __future__ import annotations

import numpy as np

from omnidyn.findings.finding import Finding
from omnidyn.findings.scale.mistakes import (
    NO_MISTAKE,
    TURN_UNITS,
    possible,
    unit_finding,
    unit_of,
)
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.reference import (
    GEOMETRY,
    electric_speed,
    wheels_twist,
)
from omnidyn.findings.signal.robust import slope

SAME_UNIT_LOG = 0.5  # of the logarithm: what is off by less is in the right unit


def check_turn_rate(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """The finding on the unit of omega; the work with it put right.

    The wheels are blamed (elsewhere) where they are off against the path or the motors too, or where only their unit
    can have been mistaken.
    """
    speed, twist = work.full("wheel_speed"), work.get("twist")
    wheel_motion = None if speed is None or len(work) < MIN_ROWS else wheels_twist(work, speed)
    if wheel_motion is None or twist is None or not np.isfinite(twist[:, 2]).any():
        return [], work
    sizes = [float(np.sqrt(np.nanmean(values[:, 2] ** 2))) for values in (twist, wheel_motion)]
    if not sizes[1] > 0.0 or abs(np.log(max(sizes[0], 1e-300) / sizes[1])) < SAME_UNIT_LOG:
        return [], work
    ids, count = work.windows()
    yaw = slope(twist[:, 2], wheel_motion[:, 2], ids, count)
    mistake = unit_of(yaw.value, possible(TURN_UNITS, work, "omega")) if yaw.windows >= 4 else NO_MISTAKE
    if not any(mistake) or not yaw.differs(1.0, SAME_UNIT_LOG):
        return [], work
    for axes in ([0], [1]):
        if np.isfinite(twist[:, axes]).any():
            path = slope(twist[:, axes], wheel_motion[:, axes], ids, count)
            if path.windows >= 4 and path.value > 0.0 and abs(np.log(path.value)) > SAME_UNIT_LOG:
                return [], work
    implied = electric_speed(work)
    if implied is not None:
        turned = slope(implied, speed, ids, count)  # type: ignore[arg-type]
        if turned.windows >= 4 and turned.value > 0.0 and abs(np.log(turned.value)) > SAME_UNIT_LOG:
            return [], work
    values = twist.copy()
    values[:, 2] /= yaw.value
    return [unit_finding("omega", yaw.value, mistake, GEOMETRY, shown_by="ratio", source="wheels")], work.replace(
        twist=values
    )
