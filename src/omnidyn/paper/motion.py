"""Claims on the motion of the body: eqs (4)-(6), (13), (14), and the inertia of Table 3."""

from __future__ import annotations

import numpy as np
from scipy.optimize import root

from omnidyn.arrays import FloatArray
from omnidyn.model.dynamics import acceleration, drive_wrench, frame_wrench, state_space
from omnidyn.model.mass import axis_masses
from omnidyn.model.robot import Robot
from omnidyn.paper.claim import ROUNDING, Claim, judge, listed, plain, same, tiny
from omnidyn.paper.steady import settled_twist
from omnidyn.paper.tables import EQ_13_POWER_OF_GEAR, EQ_13_SYMBOLS_OF_A33, INERTIA_SENTENCE

DIAGONAL_RUN = (1.5, 5.5, -2.5)  # [V] drives forward and turns
TURNING = (1.0, 0.0, 5.0)  # [m/s, m/s, rad/s]
SMALL_VOLTAGE, CREEP_SECONDS, CREEP_STEP = 0.5, 10.0, 1e-3
TWIST, VOLTAGE = np.array([0.4, 0.7, 2.0]), np.array([1.0, -3.0, 2.5])  # any: the balances are identities


def motion_claims(robot: Robot) -> tuple[Claim, ...]:
    """The claims of this file."""
    return (
        _balance(robot),
        _turning_frame(robot),
        _sign_at_rest(robot),
        _state_space(robot),
        _output(robot),
        _a33(robot),
        _inertia(robot),
    )


def _balance(robot: Robot) -> Claim:
    """Power: what the motors give is what the body gains and friction takes."""
    plain_frame = turning_frame(robot, False)
    gained = (axis_masses(robot) * TWIST) @ acceleration(plain_frame, TWIST, VOLTAGE)
    power = drive_wrench(robot, TWIST, VOLTAGE) @ TWIST
    loss = robot.friction.axes.sliding_wrench(TWIST) @ TWIST
    error = float(abs(gained - power - loss))
    return Claim(
        key="dynamics",
        place="eqs (4)-(6)",
        statement="Mass times acceleration is motor force minus viscous minus Coulomb friction, per axis.",
        printed="M dv/dt = F - B v - C sgn(v)",
        ours=f"power balances within {tiny(error, 'W')}",
        verdict=judge(error < ROUNDING),
        why=f"At v, v_n, w = {listed(TWIST)} the motors give {power:.3f} W, friction takes {-loss:.3f} W, the body "
        f"gains {gained:.3f} W.",
        numbers=plain(power_given=power, power_of_friction=loss, power_gained=gained),
    )


def turning_frame(robot: Robot, on: bool) -> Robot:
    """The robot with or without the terms M omega v of a turning frame."""
    return robot.replace(body=robot.body.replace(rotating_frame=on))


def settled_in_turning_frame(robot: Robot, voltage: FloatArray) -> FloatArray:
    """Twist at which the robot settles with the turning-frame terms kept: root of its acceleration, all axes "
    "sliding."""
    turning = turning_frame(robot, True)
    start = settled_twist(robot, voltage)
    start = np.where(start == 0.0, 0.1 * np.sign(frame_wrench(turning, start)), start)
    solution = root(lambda twist: acceleration(turning, twist, voltage), start, tol=1e-13)
    return solution.x


def _turning_frame(robot: Robot) -> Claim:
    frame_force = np.abs(frame_wrench(turning_frame(robot, True), TURNING)[:2]).max()
    coulomb = robot.friction.axes.coulomb[0]
    voltage = np.array(DIAGONAL_RUN)
    without, with_terms = settled_twist(robot, voltage), settled_in_turning_frame(robot, voltage)
    acceleration_left = np.abs(acceleration(turning_frame(robot, True), with_terms, voltage)).max()
    single = np.abs(frame_wrench(turning_frame(robot, True), np.diag([1.0, 1.0, 10.0]))).max()
    holds_at_single_axis = bool(single == 0.0)
    return Claim(
        key="turning-frame",
        place="eqs (4) (5)",
        statement="Newton's law holds in the body frame without further terms.",
        printed="no M w v_n, M w v",
        ours=f"{frame_force:.1f} N at {TURNING[0]:g} m/s and {TURNING[2]:g} rad/s",
        verdict=judge(bool(frame_force < ROUNDING), holds_at_single_axis and acceleration_left < 1e-9),
        why=f"Along one axis, as in all runs of the paper, the terms are {single:g}. At {TURNING[0]:g} m/s and "
        f"{TURNING[2]:g} rad/s they are {frame_force:.1f} N, against a Coulomb friction of {coulomb:g} N: u = "
        f"({listed(voltage)}) V settles at ({listed(without)}) without them and at ({listed(with_terms)}) with them.",
        numbers=plain(
            force=frame_force, coulomb=coulomb, settled_without=without, settled_with=with_terms, single_axis=single
        ),
    )


def creep(robot: Robot, voltage: FloatArray, duration: float, step: float) -> float:
    """Distance along x [m] of eq (13) read literally, sgn(0) = 0, in explicit steps [s] from rest."""
    system = state_space(robot)
    rate, drive, coulomb = float(system.A[0, 0]), float(system.B[0] @ voltage), float(system.K[0, 0])
    speed = travelled = 0.0
    for _ in range(round(duration / step)):
        travelled += step * speed
        speed += step * (rate * speed + drive + coulomb * ((speed > 0.0) - (speed < 0.0)))
    return travelled


def _sign_at_rest(robot: Robot) -> Claim:
    voltage = np.array([0.0, SMALL_VOLTAGE, -SMALL_VOLTAGE])
    literal = drive_wrench(robot, np.zeros(3), voltage)[0] / axis_masses(robot)[0]
    ours = acceleration(robot, np.zeros(3), voltage)[0]
    crept = creep(robot, voltage, CREEP_SECONDS, CREEP_STEP)
    finer = creep(robot, voltage, CREEP_SECONDS, CREEP_STEP / 10.0)
    return Claim(
        key="sign-at-rest",
        place="eqs (4)-(6)",
        statement="sgn(0) = 0: no friction acts on a robot at rest.",
        printed="sgn(0) = 0",
        ours="at rest friction balances the drive, up to C",
        verdict=judge(bool(abs(literal - ours) < ROUNDING), bool(ours == 0.0)),
        why=f"Then {SMALL_VOLTAGE:g} V, inside the dead zone of section 4, accelerates a robot at rest by "
        f"{literal:.2f} m/s^2, and steps of {1e3 * CREEP_STEP:g} ms creep {1e3 * crept:.1f} mm in {CREEP_SECONDS:g} s "
        f"({1e3 * finer:.2f} mm with steps ten times shorter: the answer depends on the step). With friction "
        f"set-valued at rest it stays: {ours:g} m/s^2.",
        numbers=plain(acceleration_as_printed=literal, acceleration=ours, creep=crept, creep_finer_step=finer),
    )


def _state_space(robot: Robot) -> Claim:
    system = state_space(robot)
    linear = system.A @ TWIST + system.B @ VOLTAGE + system.K @ np.sign(TWIST)
    error = np.abs(linear - acceleration(turning_frame(robot, False), TWIST, VOLTAGE)).max()
    off = np.abs(system.A - np.diag(np.diag(system.A))).max()
    return Claim(
        key="state-space",
        place="eq (13)",
        statement="Eqs (3)-(11) together are x' = A x + B u + K sgn(x), with A and K diagonal.",
        printed=f"l^{EQ_13_POWER_OF_GEAR['A']} in A, l^{EQ_13_POWER_OF_GEAR['B']} in B",
        ours=f"diag A = {listed(np.diag(system.A), '.4f')} 1/s",
        verdict=judge(error < ROUNDING and off < ROUNDING),
        why=f"A has nothing off its diagonal beyond {tiny(off)}; B rows: ({listed(system.B[0], '.4f')}), "
        f"({listed(system.B[1], '.4f')}), ({listed(system.B[2], '.4f')}); K = {listed(np.diag(system.K), '.4f')}. The "
        f"speeds settle with {listed(system.time_constants, '.4f')} s. All this needs the gear ratio in (11).",
        numbers=plain(A=system.A, B=system.B, K=system.K, error=error, time_constants=system.time_constants),
    )


def _output(robot: Robot) -> Claim:
    system = state_space(robot)
    error = np.abs(system.C @ TWIST - TWIST).max()
    return Claim(
        key="output",
        place="eq (14)",
        statement="The outputs are the three speeds.",
        printed="y = C x",
        ours="C = 1",
        verdict=judge(error < ROUNDING),
        why=f"C x differs from x by {error:g}.",
        numbers=plain(C=system.C),
    )


def _a33(robot: Robot) -> Claim:
    inertia = robot.body.inertia
    rate = state_space(robot).A[2, 2]
    doubled = robot.replace(body=robot.body.replace(inertia=2.0 * inertia))
    ratio = rate / state_space(doubled).A[2, 2]
    return Claim(
        key="inertia-symbol",
        place="eq (13), A_33",
        statement="A_33 holds two inertias, J and I_n.",
        printed=" and ".join(EQ_13_SYMBOLS_OF_A33),
        ours=f"one inertia, {inertia:g} kg m^2",
        verdict=judge(False, bool(abs(ratio - 2.0) < ROUNDING)),
        why=f"All of A_33 = {rate:.4f} 1/s is divided by one inertia: twice I_n divides it by {ratio:.3f}. Table 3 "
        "has no J.",
        numbers=plain(a33=rate, divided_by=ratio, inertia=inertia),
    )


def _inertia(robot: Robot) -> Claim:
    """I = M a^2/2 of a cylinder about its axis."""
    mass, inertia, radius = robot.body.mass, robot.body.inertia, float(np.mean(robot.wheels.robot_radius))
    cylinder = mass * radius**2 / 2.0
    needed_m = float(np.sqrt(2.0 * inertia / mass))
    small = robot.replace(body=robot.body.replace(inertia=cylinder))
    settling = [float(state_space(variant).time_constants[2]) for variant in (robot, small)]
    return Claim(
        key="inertia",
        place="Table 3",
        statement=f"I_n is that of {INERTIA_SENTENCE}.",
        printed=f"{inertia:g} kg m^2",
        ours=f"{cylinder:.4f} kg m^2",
        verdict=judge(bool(same(cylinder, inertia))),
        why=f"A cylinder of {mass:g} kg and radius b = {radius:g} m has {cylinder:.4f} kg m^2, "
        f"{inertia / cylinder:.1f} times less; {inertia:g} needs a radius of {needed_m:.2f} m. Steady speeds do not "
        f"tell which is right: I_n only sets how fast w settles, {settling[0]:.3f} s with the printed one and "
        f"{settling[1]:.3f} s with the cylinder's.",
        numbers=plain(
            settling=settling, cylinder=cylinder, printed=inertia, radius_needed=needed_m, ratio=inertia / cylinder
        ),
    )
