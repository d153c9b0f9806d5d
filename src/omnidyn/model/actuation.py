"""What reaches the motors, from what was asked for.

    u = clip(duty supply, +-u_max)                                  asked of the driver [V]
    u' = map(|u|) sgn u                                             of a driver that is no line
    u_motor = left gain (|u'| - dead)+ sgn u,  left = 1 - fade p    what it passes on, p the share of the run gone by

A driver that is ideal has no map, gain 1, no dead band and no fade. A fit may find the last three; their derivatives
stand here too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import kernel, part
from omnidyn.model.motor import Motor
from omnidyn.model.robot import Robot


class Driver(NamedTuple):
    """gain [-]; dead_band [V]; fade: share of the voltage lost from the start of a run to its end, evenly."""

    gain: float = 1.0
    dead_band: float = 0.0
    fade: float = 0.0


GAIN, DEAD_BAND, FADE = Driver._fields


def voltage_of_duty(duty: FloatArray, supply: FloatArray | float) -> FloatArray:
    """duty x supply [V]. `duty`, shape (rows, wheels); `supply` [V], one number or shape (rows,)."""
    return duty * np.asarray(supply, dtype=float)[..., None]


def asked_voltage(
    voltage: FloatArray | None, duty: FloatArray | None, supply: FloatArray | None, nominal: float | None
) -> FloatArray | None:
    """The voltage of a log: as logged, else its duty times the supply, logged or else nominal; None without these."""
    battery = nominal if supply is None else supply
    if voltage is not None or duty is None or battery is None:
        return voltage
    return voltage_of_duty(duty, battery)


def clip_voltage(motor: Motor, voltage: FloatArray) -> FloatArray:
    """Voltage [V] kept within the limit of the driver, symmetric about zero. Shape (*batch, wheels)."""
    limit = np.asarray(motor.voltage_limit)  # one number for all is clipped to many times as fast as one for each
    return np.clip(voltage, -limit, limit)


def mapped(robot: Robot, voltage: FloatArray, *, backward: bool = False) -> FloatArray:
    """What the map of the driver makes of a voltage [V], or which voltage it makes this of. Shape (*batch, wheels).

    Beyond its last point it goes on as between the last two.
    """
    if not robot.drive.voltage_map:
        return voltage
    asked, passed = np.array([(0.0, 0.0), *(point[:2] for point in robot.drive.voltage_map)]).T
    x, y = (passed, asked) if backward else (asked, passed)
    size, slope = np.abs(voltage), (y[-1] - y[-2]) / (x[-1] - x[-2])
    return np.sign(voltage) * (np.interp(size, x, y) + slope * np.maximum(size - x[-1], 0.0))


def without_map(robot: Robot) -> Robot:
    """The robot behind the map of its driver: of voltages that are `mapped`."""
    return robot.model_copy(update={"drive": robot.drive.model_copy(update={"voltage_map": ()})})


def reaching(robot: Robot, voltage: FloatArray) -> FloatArray:
    """What the driver of a robot passes on to the motors [V]: its map, less its dead band. Shape (*batch, wheels)."""
    band, voltage = robot.drive.dead_band, mapped(robot, voltage)
    if band == 0.0:
        return voltage
    return np.sign(voltage) * np.maximum(np.abs(voltage) - band, 0.0)


def asked_for(robot: Robot, voltage: FloatArray) -> FloatArray:
    """What to ask of the driver for a voltage at the motors [V]: `reaching` backward. Shape (*batch, wheels)."""
    return mapped(robot, voltage + robot.drive.dead_band * np.sign(voltage), backward=True)


@part
def at_motor(u, share, driver):
    """(u_motor, its derivatives by gain, dead band and fade) of a voltage u, `share` of the run gone by."""
    size, side = abs(u) - driver.dead_band, 1.0 if u > 0.0 else -1.0
    if size <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    left, whole = 1.0 - driver.fade * share, driver.gain * size * side
    return left * whole, left * (size * side), left * (-driver.gain * side), -share * whole


def at_motors(voltage: FloatArray, share: FloatArray, driver: Driver) -> tuple[FloatArray, FloatArray]:
    """(u_motor, its derivatives by the numbers of the driver). Shapes (rows, wheels) and (3, rows, wheels).

    voltage u [V], shape (rows, wheels); share of the run that has gone by, 0 to 1, shape (rows,).
    """
    out, by = np.empty(voltage.shape), np.empty((len(driver), *voltage.shape))
    # Whatever arrays a caller has, writable or not, one kernel serves them.
    _put_at_motors(*(np.require(each, requirements=["C", "W"]) for each in (voltage, share)), driver, out, by)
    return out, by


@kernel
def _put_at_motors(voltage, share, driver, out, by):
    for k in range(len(voltage)):
        for w in range(voltage.shape[1]):
            out[k, w], by[0, k, w], by[1, k, w], by[2, k, w] = at_motor(voltage[k, w], share[k], driver)
