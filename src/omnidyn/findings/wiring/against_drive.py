"""Signs of the axes of a twist against the voltages, where no speed of a wheel was recorded."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.reference import volts
from omnidyn.findings.wiring.orders import means
from omnidyn.logs.channels import components
from omnidyn.model.motor import no_load_speed
from omnidyn.model.wheels import twist_from_wheel_speed
from omnidyn.statement import ERROR

LEAST_LIKENESS = 0.5  # clean logs have 0.57 and more
LAGS = 4  # windows by which the motion may be late: a voltage that goes to and fro is half a turn late at one of them
ERRORS = 5.0  # standard errors of the likeness of two signals that have nothing to do with each other
DRIVEN_SHARE = 0.15  # of the axis that is driven most: another one says nothing
BY_AZIMUTH = ("wheels.azimuth_deg",)


def check_against_drive(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """The finding on axes of the twist that go the other way than the voltages drive them; the work with their signs.

    On a level floor motors give power to each axis: sum of (speed without load that the voltages ask for) * speed > 0.
    """
    voltage, twist, robot = volts(work), work.get("twist"), work.geometry
    if voltage is None or twist is None or robot is None or work.get("wheel_speed") is not None or len(work) < MIN_ROWS:
        return [], work
    driven = twist_from_wheel_speed(robot.wheels, no_load_speed(robot.motor, voltage))
    length = np.array([1.0, 1.0, float(np.mean(robot.wheels.robot_radius))])
    axes = [k for k in range(3) if np.isfinite(twist[:, k]).any()]
    asked, moved = means(work, driven * length, (twist * length)[:, axes])
    if not len(asked):
        return [], work
    size = np.sqrt((asked**2).sum(axis=0))
    likeness, late = np.ones(3), np.zeros(3)
    likeness[axes] = _likeness(asked[:, axes], moved)
    for lag in range(1, min(LAGS + 1, len(asked))):
        late[axes] = np.maximum(late[axes], _likeness(asked[:-lag, axes], moved[lag:]))
    least = max(LEAST_LIKENESS, ERRORS / np.sqrt(len(asked)))
    driven_axes = size > DRIVEN_SHARE * size.max()
    turned = (likeness < -least) & (late < LEAST_LIKENESS) & driven_axes
    if not turned.any():
        return [], work
    mixed = bool((np.abs(likeness) < LEAST_LIKENESS)[driven_axes].any())  # a sign leaves the other axes as they are
    names = [name for name, is_turned in zip(components("twist", 0), turned, strict=True) if is_turned]
    finding = Finding(
        "inverted",
        ERROR,
        " ".join(names),
        {"likeness": float(likeness[turned].max())},
        "mixed" if mixed else "drive",
        rests_on=BY_AZIMUTH,
    )
    return [finding], work if mixed else work.replace(twist=twist * np.where(turned, -1.0, 1.0))


def _likeness(asked: FloatArray, moved: FloatArray) -> FloatArray:
    """Cosine between each column of the one and that of the other."""
    sizes = np.sqrt((asked**2).sum(axis=0) * (moved**2).sum(axis=0))
    return (asked * moved).sum(axis=0) / np.maximum(sizes, 1e-300)
