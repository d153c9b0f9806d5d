"""From slope and dead band of motors to numbers of a robot file, by eqs (10) (11) with the wheels off the ground.

A wheel of radius r with friction b v + c sgn v at its rim, behind a gear l, at a constant speed w > 0 (v = r w):

    u = R i + V_d + K_v l w                        (11), V_d: the voltage drop, and the dead band of the driver
    l K_t i = r (b r w + c)                                              (10), f = T/r balances friction
    u = (K_v l + b r/g) w + (V_d + c/g),   g = l K_t/(R r) [N/V]         slope and dead band of a voltage
    i = (b r/g) w + c/g,                   g = l K_t/r [N/A]             and of a current

    voltage    K_v = (slope - b r/g)/l, b as the file has it;            c = g (dead_band - V_d)
    duty       the same, times the supply
    current    b = g slope/r                                             c = g dead_band

Where the file has K_t = K_v, which are one number of the magnet, K_t goes along. What spins has the inertia

    J l^2 + J_w = inertia g r                                            rotor J behind the gear, and wheel J_w

of which J is written: the wheel has what the file says, and where that is nothing, J holds the wheel too, as the mass
matrix takes only their sum. R, K_t, l, r and the supply are those of the file, as if they were exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from omnidyn.document import Part, Points, Table, apart, plain
from omnidyn.errors import InputError
from omnidyn.identification.estimate import identified
from omnidyn.identification.motors.estimate import BAND, INERTIA, LAG, OFFSET, SLOPE, MotorEstimate
from omnidyn.identification.motors.log import HEADING, LENGTH
from omnidyn.identification.motors.steady_curve import map_of
from omnidyn.identification.motors.study import MotorStudy
from omnidyn.model.drive import SPEED
from omnidyn.model.keys import EMF, TORQUE, Key, unit, with_priors
from omnidyn.model.known.told import with_correlation
from omnidyn.model.robot import Prior, Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.statement import NOTE, WARNING, Statement

COULOMB, VISCOUS = "friction.wheels.coulomb", "friction.wheels.viscous"
MAP = "drive.voltage_map_V"
BACKWARD = "friction.wheels.coulomb_backward"
LINKED_LEVELS = {  # levels that go along with another one
    COULOMB: ("coulomb_backward", "breakaway", "breakaway_backward"),
    BACKWARD: ("breakaway_backward",),
}
ROTOR = "motor.rotor_inertia_kg_m2"
STEP = 1e-6  # of a standard error: the differences by which errors propagate


@dataclass(frozen=True, eq=False)
class MotorNumbers:
    """robot: with the numbers that the motors determine, their std and source. value, std: by key.

    remarks: what was not written, and why; what a reader must know of what was.
    """

    robot: Robot
    value: dict[str, float]
    std: dict[str, float]
    remarks: tuple[Statement, ...]

    def parts(self) -> list[Part]:
        """A table of the numbers, and the remarks."""
        rows = [(key, f"{value:.5g}", f"{self.std[key]:.2g}", unit(key)) for key, value in self.value.items()]
        return apart([Table(("number", "value", "+-", "unit"), rows)] if rows else [], [Points(self.remarks)])

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        numbers = {key: {"value": v, "std": self.std[key], "unit": unit(key)} for key, v in self.value.items()}
        return plain({"numbers": numbers, "remarks": self.remarks})


def motors_into_robot(study: MotorStudy, robot: Robot) -> MotorNumbers:
    """What the motors determine as numbers of a robot file, an entry per wheel; the motor m is at wheel m.

    Raises InputError where the logs have more motors than the robot has wheels.
    """
    motors = [motor for motor in study.motors if motor.motor is not None]
    wheel_count = max((motor.motor or 0) + 1 for motor in motors)
    if wheel_count > robot.wheels.count:
        raise InputError(
            "the logs have more motors than the robot has wheels",
            got=wheel_count,
            expected=f"{robot.wheels.count} or fewer, as {robot.name} has",
        )
    if study.speed_from == HEADING:
        return MotorNumbers(robot, {}, {}, (Statement("motors_and_floor"),))
    if study.kind == "force" or motors[0].travel == LENGTH:
        return MotorNumbers(robot, {}, {}, (Statement("axis_not_wheel"),))
    supply, remarks = _supply(study, robot)
    bent_motors = [curve.motor for curve in study.curves]
    value: dict[str, float] = {}
    std: dict[str, float] = {}
    priors: dict[str, Prior] = {}
    for estimate in motors if supply else ():
        wheel = _Wheel(robot, estimate.motor or 0, study.kind)
        if estimate.motor in bent_motors:
            wheel_numbers, notes = wheel.behind_map(estimate, supply)
        else:
            wheel_numbers, notes = wheel.numbers(
                estimate, supply, 0.0 if study.windows is None else study.windows.smear
            )
        remarks += [remark.of(estimate.name) for remark in notes]
        for key, (number, spread) in wheel_numbers.items():
            robot = wheel.put(robot, key, number)
            value[key], std[key] = number, spread
            priors[key] = identified(spread, f"motors by {estimate.basis}, {estimate.source}")
    if value:
        robot, notes = _with_map(robot, study, supply)
        remarks += notes
    floor = [robot.friction.axes, robot.friction.direction]
    if any(key.startswith(COULOMB) for key in value) and any(np.any(f.coulomb) or np.any(f.viscous) for f in floor):
        remarks.append(Statement("floor_friction_kept", NOTE))
    # Motors that were measured anew, each by itself, are no longer off together with what an earlier fit found.
    full_robot = with_correlation(with_priors(robot, priors), [*priors], np.eye(len(priors)))
    return MotorNumbers(full_robot, value, std, tuple(remarks))


def _with_map(robot: Robot, study: MotorStudy, supply: float) -> tuple[Robot, list[Statement]]:
    """(the robot with the map of its driver where its motors show one, remarks).

    The steady speeds hold what friction takes of the motors and what the driver loses: neither is written beside it.
    """
    drive, wheels = robot.drive, robot.friction.wheels
    if not study.curves:
        removal_notes = [Statement("map_removed", NOTE, MAP)] if drive.voltage_map else []
        return robot.replace(drive=drive.replace(voltage_map=())), removal_notes
    reason = "loop" if drive.kind == SPEED else ""
    reason = reason or (
        "straight" if len(study.curves) < sum(motor.motor is not None for motor in study.motors) else ""
    )
    reason = reason or ("unsettled" if any(curve.unsettled for curve in study.curves) else "")
    if reason:
        return robot, [Statement("not_written", WARNING, MAP, {"why": reason})]
    points = map_of(study.curves, supply)
    has_inner_band = np.any(wheels.coulomb) or drive.dead_band > 0.0
    remarks = [Statement("map_written", NOTE, MAP, {"points": len(points)})]
    remarks += [Statement("map_holds_friction", NOTE, MAP)] if has_inner_band else []
    friction = robot.friction.replace(wheels=type(wheels)(viscous=wheels.viscous))
    return robot.replace(drive=drive.replace(voltage_map=points, dead_band=0.0), friction=friction), remarks


def _supply(study: MotorStudy, robot: Robot) -> tuple[float, list[Statement]]:
    """(volts, or ampere, in one unit of the input, remarks); 0 where that is not known."""
    if study.kind != "duty":
        return 1.0, []
    if math.isfinite(study.supply):
        return study.supply / 100.0, [Statement("supply_of_logs", NOTE, numbers={"supply": study.supply})]
    if robot.drive.supply is not None:
        return robot.drive.supply / 100.0, [Statement("supply_of_file", NOTE, numbers={"supply": robot.drive.supply})]
    return 0.0, [Statement("supply_unknown")]


class _Wheel:
    """The numbers of the file at one wheel, and what is to be said of them."""

    def __init__(self, robot: Robot, wheel: int, kind: str):
        motor, count = robot.motor, robot.wheels.count

        def at_wheel(value: Any) -> float:
            return float(per_wheel(value, count)[wheel])

        self.wheel, self.kind = wheel, kind
        self.gear, self.radius = at_wheel(motor.gear_ratio), at_wheel(robot.wheels.wheel_radius)
        self.resistance = at_wheel(motor.resistance)
        self.torque, self.efficiency = at_wheel(motor.torque_constant), at_wheel(motor.gear_efficiency)
        self.tied = self.torque == at_wheel(motor.emf_constant)
        self.wheel_inertia = at_wheel(robot.wheels.wheel_inertia)
        self.drop = at_wheel(motor.voltage_drop) + robot.drive.dead_band
        self.viscous = at_wheel(robot.friction.wheels.viscous)

    def key(self, name: str) -> str:
        return f"{name}[{self.wheel}]"

    def numbers(
        self, line: MotorEstimate, scale: float, smear: float
    ) -> tuple[dict[str, tuple[float, float]], list[Statement]]:
        """(key -> (value, std), remarks). scale: volts or ampere in one unit of the line. smear [s]: that of
        `MotorWindows`, 0 of free runs.
        """
        if BAND in line.unidentifiable or SLOPE in line.unidentifiable or not line.ci95[SLOPE][0] > 0.0:
            return {}, [Statement("line_not_determined")]
        values = np.array([line.value[SLOPE], line.value.get(BAND, 0.0)]) * scale
        offset = scale * line.value[OFFSET] if line.offset_seen else 0.0
        spread = np.array([line.std[SLOPE], line.std.get(BAND, 0.0)]) * scale
        covariance = np.outer(spread, spread) * np.array([[1.0, line.correlation], [line.correlation, 1.0]])
        key_values: dict[str, tuple[float, float]] = {}
        remarks: list[Statement] = []
        middle = values.copy()
        for name, number_of, reason in self._laws(line.dead_band_seen, line.offset_seen):
            if name in (COULOMB, BACKWARD) and not key_values:  # how hard a volt pushes is not known either
                continue
            values = middle + np.array([0.0, offset * {COULOMB: 1.0, BACKWARD: -1.0}.get(name, 0.0)])
            number = float(number_of(*values))
            if number > 0.0:
                slopes = np.array(
                    [
                        (number_of(*(values + step)) - number_of(*(values - step))) / (2.0 * step[k])
                        if step[k] > 0.0
                        else 0.0
                        for k, step in enumerate(np.diag(STEP * spread))
                    ]
                )
                key_values[self.key(name)] = number, float(np.sqrt(slopes @ covariance @ slopes))
            else:
                remarks.append(Statement("not_written", subject=name, numbers={"why": reason}))
        if not line.dead_band_seen:
            remarks.append(Statement("not_written", NOTE, COULOMB, {"why": "no_dead_band"}))
        inertia, inertia_notes = self._of_inertia(line, values[0], scale, smear) if key_values else ({}, [])
        return key_values | inertia, remarks + inertia_notes

    def behind_map(self, line: MotorEstimate, scale: float) -> tuple[dict[str, tuple[float, float]], list[Statement]]:
        """The same of a motor behind the map of its driver: its back-EMF, by the slope."""
        slope, spread = line.value[SLOPE] * scale, line.std[SLOPE] * scale
        number = self._emf(slope)
        if not number > 0.0:
            return {}, [Statement("not_written", subject=EMF, numbers={"why": "viscous_explains_slope"})]
        std = (self._emf(slope + STEP * spread) - self._emf(slope - STEP * spread)) / (2.0 * STEP)
        return {self.key(name): (number, std) for name in ((EMF, TORQUE) if self.tied else (EMF,))}, []

    def _laws(self, with_band: bool, offset_seen: bool) -> Iterator[tuple[str, Callable[[float, float], float], str]]:
        """(key, its number of slope and dead band, code of why there is none where that is not above 0).

        offset_seen: the dead band is then that of one direction, and the law of the other follows.
        """
        if self.kind == "current":
            yield VISCOUS, lambda slope, _: self._push(self.torque) * slope / self.radius, "negative"
        else:
            reason = "viscous_explains_slope"
            for name in (EMF, TORQUE) if self.tied else (EMF,):
                yield name, lambda slope, _: self._emf(slope), reason
        if with_band:
            drop = 0.0 if self.kind == "current" else self.drop
            reason = "drop_explains_dead_band"
            for name in (COULOMB, BACKWARD) if offset_seen else (COULOMB,):
                yield name, lambda slope, level: self._push(self._torque(slope)) * (level - drop), reason

    def _emf(self, slope: float) -> float:
        """K_v [V s/rad] from the slope [V s/rad]; 0 where the viscous friction of the file leaves none."""
        lost = self.viscous * self.resistance * self.radius**2 / (self.gear * self.efficiency)  # times 1/K_t
        if not self.tied:
            return (slope - lost / self.torque) / self.gear
        discriminant = slope**2 - 4.0 * self.gear * lost
        return 0.5 * (slope + math.sqrt(discriminant)) / self.gear if discriminant >= 0.0 else 0.0

    def _torque(self, slope: float) -> float:
        return self._emf(slope) if self.tied and self.kind != "current" else self.torque

    def _push(self, torque: float) -> float:
        """g: force at the rim [N] by one volt, or ampere, at rest."""
        per_ampere = self.efficiency * self.gear * torque / self.radius
        return per_ampere if self.kind == "current" else per_ampere / self.resistance

    def _of_inertia(
        self, line: MotorEstimate, slope: float, scale: float, smear: float
    ) -> tuple[dict[str, tuple[float, float]], list[Statement]]:
        """Of the rotor: (key -> (value, std), remarks)."""
        if not line.ci95[INERTIA][0] > 0.0:
            return {}, [Statement("not_written", NOTE, ROTOR, {"why": "no_inertia"})]
        if line.value[LAG] < smear:
            return {}, [Statement("lag_too_short", NOTE, ROTOR, {"lag": line.value[LAG], "smear": smear})]
        of_volt = self._push(self._torque(slope)) * self.radius * scale  # N m at the wheel by one unit of the input
        total = float(line.value[INERTIA] * of_volt)
        inertia = (total - self.wheel_inertia) / self.gear**2
        if not inertia > 0.0:
            return {}, [Statement("wheel_explains_inertia", subject=ROTOR, numbers={"inertia": total})]
        # K_t goes with the slope where it is the same number as K_v: both are off, as if independent
        share = line.std[SLOPE] / line.value[SLOPE] if self.tied and self.kind != "current" else 0.0
        spread = total * math.hypot(line.std[INERTIA] / line.value[INERTIA], share) / self.gear**2
        remarks = [] if self.wheel_inertia else [Statement("rotor_holds_wheel", NOTE, ROTOR)]
        return {self.key(ROTOR): (inertia, spread)}, remarks

    def put(self, robot: Robot, key: str, number: float) -> Robot:
        """The robot with a number; other levels of Coulomb friction at the wheel go along where they have to."""
        wheels = robot.friction.wheels
        if key == self.key(BACKWARD) and wheels.coulomb_backward is None:
            wheels = wheels.replace(coulomb_backward=wheels.coulomb)
            robot = robot.replace(friction=robot.friction.replace(wheels=wheels))
        robot = Key.parse(key).set(robot, number, checked=False)
        tied_names = LINKED_LEVELS.get(key.partition("[")[0], ())
        for name in (name for name in tied_names if getattr(wheels, name) is not None):
            tied_key = Key.parse(self.key(f"friction.wheels.{name}"))
            least_level = tied_key.get(robot) if name.startswith("breakaway") else 0.0
            robot = tied_key.set(robot, max(number, least_level), checked=False)
        return robot
