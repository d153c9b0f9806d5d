"""Claims on the motors: eqs (10)-(12)."""

from __future__ import annotations

import numpy as np

from omnidyn.model.dynamics import settled_currents, state_space
from omnidyn.model.frames import AXES
from omnidyn.model.motor import back_emf, no_load_speed, traction, wheel_torque
from omnidyn.model.robot import Robot
from omnidyn.paper.claim import ROUNDING, Claim, ClaimVerdict, judge, listed, plain, tiny
from omnidyn.paper.steady import settled_twist
from omnidyn.paper.tables import EQ_11_POWER_OF_GEAR, EQ_12, EQ_13_POWER_OF_GEAR, TABLE_4


def motor_claims(robot: Robot) -> tuple[Claim, ...]:
    """The claims of this file."""
    return (_force(robot), _back_emf(robot), _inductance(robot), _current_sign(robot), _current_limit(robot))


def without_gear_in_emf(robot: Robot) -> Robot:
    """The robot with the back-EMF of eq (11) as printed: K_v times the speed of the wheel, not of the motor."""
    motor = robot.motor
    per_wheel_turn = np.divide(motor.emf_constant, motor.gear_ratio)
    return robot.replace(motor=motor.replace(emf_constant=per_wheel_turn))


def power_of_gear(robot: Robot, printed_emf: bool) -> tuple[float, float]:
    """The power of the gear ratio in (the motor's part of A, B) of the state space, by doubling the ratio."""
    doubled = robot.replace(motor=robot.motor.replace(gear_ratio=np.multiply(2.0, robot.motor.gear_ratio)))
    before, after = (
        state_space(without_gear_in_emf(variant) if printed_emf else variant)
        for variant in (_frictionless(robot), _frictionless(doubled))
    )
    return float(np.log2(after.A[0, 0] / before.A[0, 0])), float(np.log2(after.B[0, 1] / before.B[0, 1]))


def _frictionless(robot: Robot) -> Robot:
    axes = robot.friction.axes.replace(viscous=(0.0,) * 3, coulomb=(0.0,) * 3, breakaway=None)
    return robot.replace(friction=robot.friction.replace(axes=axes))


def _force(robot: Robot) -> Claim:
    amperes = np.ones(robot.wheels.count)
    torque, force = wheel_torque(robot.motor, amperes), traction(robot.motor, robot.wheels, amperes)
    error = np.abs(force * robot.wheels.radii - torque).max()
    power = float((wheel_torque(robot.motor, amperes) - back_emf(robot.motor, amperes)) @ amperes)
    return Claim(
        key="traction",
        place="eq (10)",
        statement="A current makes the torque l K_t i at the wheel and the force T/r at its rim.",
        printed="f = T/r, T = l K_t i",
        ours=f"{torque[0]:.4f} N m and {force[0]:.4f} N per ampere",
        verdict=judge(error < ROUNDING),
        why="K_t = K_v in SI, as energy demands: what 1 A takes from the back-EMF at 1 rad/s is what it gives to the "
        f"wheel, within {tiny(abs(power), 'W')}.",
        numbers=plain(torque_per_ampere=torque, force_per_ampere=force, power_error=power),
    )


def _back_emf(robot: Robot) -> Claim:
    with_gear, without = power_of_gear(robot, False), power_of_gear(robot, True)
    powers = (EQ_13_POWER_OF_GEAR["A"], EQ_13_POWER_OF_GEAR["B"])
    ours, printed = np.diag(state_space(robot).A), np.diag(state_space(without_gear_in_emf(robot)).A)
    speed = np.full(robot.wheels.count, float(no_load_speed(robot.motor, np.array([1.0]))[0]))
    volts = back_emf(robot.motor, speed)[0], back_emf(without_gear_in_emf(robot).motor, speed)[0]
    return Claim(
        key="back-emf",
        place="eq (11)",
        statement="The back-EMF is K_v w_m, with w_m the speed of the wheel.",
        printed=f"K_v l^{EQ_11_POWER_OF_GEAR} w_m",
        ours=f"K_v l^{with_gear[0] - with_gear[1]:.0f} w_m",
        verdict=judge(np.allclose(without, powers), np.allclose(with_gear, powers)),
        why=f"(13) prints l^{powers[0]} in A. That follows with the gear ratio in the back-EMF; as printed it would "
        f"be l^{without[0]:.0f}, and the diagonal of A {listed(printed, '.3f')} instead of {listed(ours, '.3f')} 1/s. "
        f"At a wheel speed of {speed[0]:.2f} rad/s the motor makes {volts[0]:.3f} V, as printed {volts[1]:.3f} V.",
        numbers=plain(power_with_gear=with_gear, power_as_printed=without, a_with_gear=ours, a_as_printed=printed),
    )


def _inductance(robot: Robot) -> Claim:
    electrical = np.mean(np.divide(robot.motor.inductance or 0.0, robot.motor.resistance))
    ratios = state_space(robot).time_constants / electrical
    return Claim(
        key="inductance",
        place="eqs (11) (13)",
        statement="The inductance of the motors may be left out of the state space.",
        printed="L di/dt stands in (11), not in (13)",
        ours=f"L/R = {1e6 * electrical:.1f} us",
        verdict=judge(bool(ratios.min() > 100.0)),
        why=f"The currents settle {listed(ratios, '.0f')} times faster than the three speeds.",
        numbers=plain(electrical_time_constant=electrical, ratios=ratios),
    )


def _current_sign(robot: Robot) -> Claim:
    volts = np.array([row for axis in AXES for row in TABLE_4[axis]])
    currents = settled_currents(robot, settled_twist(robot, volts), volts)
    negative, zeros, count = int((currents < 0.0).sum()), int((currents == 0.0).sum()), currents.size
    return Claim(
        key="current-sign",
        place="eq (12)",
        statement="The motor current lies between 0 and i_max.",
        printed=EQ_12,
        ours="|i| <= i_max",
        verdict=judge(
            negative == 0, bool((np.abs(currents) < np.abs(volts).max() / np.min(robot.motor.resistance)).all())
        ),
        why=f"{negative} of the {count} steady currents of Table 4 are negative ({100 * negative / count:.0f} %), the "
        f"lowest {currents.min():.2f} A; {zeros} are 0. As printed, motors could neither turn backwards nor brake.",
        numbers=plain(negative=negative, zero=zeros, count=count, fraction=negative / count, currents=currents),
    )


def _current_limit(robot: Robot) -> Claim:
    rest, limit = np.zeros(3), robot.motor.voltage_limit
    stall = np.abs(settled_currents(robot, rest, np.full(robot.wheels.count, np.max(limit)))).max()
    volts = np.array([row for axis in AXES for row in TABLE_4[axis]])
    starting = np.abs(settled_currents(robot, rest, volts)).max()
    return Claim(
        key="current-limit",
        place="eq (12), Table 3",
        statement="The current is limited to i_max.",
        printed="i_max, no value",
        ours=f"stall current {stall:.2f} A",
        verdict=ClaimVerdict.NOT_IN_TEXT,
        why=f"i_max has no printed value. At {np.max(limit):g} V a blocked motor draws {stall:.2f} A, and the steps "
        f"of Table 4 start with up to {starting:.2f} A: a limit below that would be felt, one above {stall:.2f} A "
        "only when the voltage is reversed at speed. The preset has none.",
        numbers=plain(stall_current=stall, largest_starting_current=starting),
    )
