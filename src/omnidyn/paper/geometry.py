"""Claims on frames and wheels: eqs (1)-(3) and (7)-(9), and the sentence on noise."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.dynamics import state_space
from omnidyn.model.frames import AXES, body_to_world, world_to_body
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import rim_speed, twist_from_wheel_speed, wheel_speed, wrench_from_traction
from omnidyn.paper.claim import ROUNDING, Claim, judge, listed, plain, tiny
from omnidyn.paper.steady import printed_speed, printed_voltage
from omnidyn.paper.tables import EQ_3, NOISE_SENTENCE

TWIST = np.array([0.4, 0.7, 2.0])  # any twist and traction will do: the balance of power is an identity
TRACTION = np.array([1.0, -2.0, 3.0])


def geometry_claims(robot: Robot) -> tuple[Claim, ...]:
    """The claims of this file."""
    return (_frames(), _eq_3_rows(robot), _eq_3_sign(robot), _wrench(robot), _noise(robot))


def _frames() -> Claim:
    headings = np.linspace(-np.pi, np.pi, 25)
    turned = world_to_body(headings)
    orthonormal = np.abs(turned @ np.swapaxes(turned, -1, -2) - np.eye(3)).max()
    forward = body_to_world(np.pi / 2.0) @ [1.0, 0.0, 0.0]
    error = float(max(orthonormal, np.abs(forward - [0.0, 1.0, 0.0]).max()))
    return Claim(
        key="frames",
        place="eqs (1) (2)",
        statement="A rotation R(theta) turns velocities of the world into v, v_n, w of the body.",
        printed="[v v_n w] = R(theta) d(xi)/dt",
        ours=f"R R^T = 1 within {tiny(orthonormal)}",
        verdict=judge(error < ROUNDING),
        why=f"At a heading of 90 degrees, driving forward at 1 m/s moves the robot by {listed(forward[:2], '.1f')} "
        f"m/s in the world; over {len(headings)} headings the largest error is below {tiny(error)}.",
        numbers=plain(orthonormal_error=orthonormal, forward_at_90_deg=forward, headings=len(headings)),
    )


def model_eq_3(robot: Robot) -> FloatArray:
    """Eq (3) of the model in the form of the table: rows v and v_n times r, row w times r/b. Shape (3, 3)."""
    radius, distance = np.mean(robot.wheels.wheel_radius), np.mean(robot.wheels.robot_radius)
    scale = np.array([radius, radius, radius / distance])
    return twist_from_wheel_speed(robot.wheels, np.eye(robot.wheels.count)).T / scale[:, None]


def printed_eq_3(robot: Robot) -> FloatArray:
    """Eq (3) as printed, in SI: twist = this @ wheel speed. Shape (3, 3)."""
    radius, distance = np.mean(robot.wheels.wheel_radius), np.mean(robot.wheels.robot_radius)
    return np.array(EQ_3, dtype=float) * np.array([radius, radius, radius / distance], dtype=float)[:, None]


def _eq_3_rows(robot: Robot) -> Claim:
    difference = np.abs(model_eq_3(robot) - np.array(EQ_3))
    right = int((difference < ROUNDING).sum())
    rows = difference[[0, 2]].max()
    return Claim(
        key="wheel-kinematics",
        place="eq (3)",
        statement="The rows v and w follow from the speeds of the three wheels.",
        printed="v = r sqrt(3)/3 (w2 - w3), w = r/(3 b) (w1 + w2 + w3)",
        ours=f"the same within {tiny(rows)}",
        verdict=judge(rows < ROUNDING),
        why=f"{right} of the {difference.size} printed coefficients agree with the inverse of (7)-(9); the one that "
        "does not is in row v_n.",
        numbers=plain(printed=EQ_3, ours=model_eq_3(robot), agreeing=right),
    )


def _eq_3_sign(robot: Robot) -> Claim:
    ours, printed = model_eq_3(robot)[1, 0], EQ_3[1][0]
    back = printed_eq_3(robot) @ wheel_speed(robot.wheels, [0.0, 1.0, 0.0])
    printed_twist = printed_eq_3(robot) @ wheel_speed(robot.wheels, TWIST)
    at_wheels = TRACTION @ rim_speed(robot.wheels, TWIST)
    at_body = wrench_from_traction(robot.wheels, TRACTION) @ printed_twist
    drive = state_space(robot).B[1, 0]
    pattern = printed_eq_3(robot)[1] @ printed_voltage("y")[-1]
    inverse = np.abs(twist_from_wheel_speed(robot.wheels, wheel_speed(robot.wheels, TWIST)) - TWIST).max()
    return Claim(
        key="wheel-1-sign",
        place="eq (3), row v_n",
        statement="Wheel 1 adds +2 r1/3 of its speed to v_n.",
        printed=f"{printed:+.4f} r1",
        ours=f"{ours:+.4f} r1",
        verdict=judge(abs(ours - printed) < ROUNDING, inverse < ROUNDING),
        why=f"With the printed sign a robot that drives left at 1 m/s reads {back[1]:+.4f} m/s, and {at_wheels:.3f} W "
        f"at the wheels become {at_body:.3f} W at the body. Table 1 drives v_n forward with a negative voltage on "
        f"wheel 1, and B of (13) has {drive:+.4f} there: the sign must be minus.",
        numbers=plain(
            printed=printed,
            ours=ours,
            one_m_s_left_reads=back[1],
            round_trip_error=back[1] - 1.0,
            round_trip_error_corrected=inverse,
            power_at_wheels=at_wheels,
            power_at_body_as_printed=at_body,
            b_of_eq_13=drive,
            direction_of_table_1_as_printed=np.sign(pattern),
        ),
    )


def _wrench(robot: Robot) -> Claim:
    at_wheels = TRACTION @ rim_speed(robot.wheels, TWIST)
    at_body = wrench_from_traction(robot.wheels, TRACTION) @ TWIST
    matrix = wrench_from_traction(robot.wheels, np.eye(robot.wheels.count)).T
    error = float(abs(at_wheels - at_body))
    return Claim(
        key="wrench",
        place="eqs (7)-(9)",
        statement="Forces and torque on the body are sums of the forces of the wheels.",
        printed="delta = 30 degrees",
        ours=f"row F_v {listed(matrix[0], '.4f')}; row F_vn {listed(matrix[1], '.4f')}",
        verdict=judge(error < ROUNDING),
        why=f"The power is the same at the wheels and at the body, {at_wheels:.4f} W, within {tiny(error, 'W')}.",
        numbers=plain(matrix=matrix, power_at_wheels=at_wheels, power_at_body=at_body),
    )


def _noise(robot: Robot) -> Claim:
    """Independent noise of the wheel speeds through eq (3), per rad/s of standard deviation."""
    twist_std = np.linalg.norm(twist_from_wheel_speed(robot.wheels, np.eye(robot.wheels.count)), axis=0)
    driven = np.array([np.mean(printed_speed(axis)[1:]) for axis in AXES])
    relative = twist_std / driven
    at_rim = twist_std * [1.0, 1.0, np.mean(robot.wheels.robot_radius)]
    holds = bool(relative[:2].min() > relative[2])
    raw = bool(twist_std[:2].min() > twist_std[2])
    return Claim(
        key="noise",
        place="section 4",
        statement="The measured v and v_n are noisier than w, by the geometry.",
        printed=NOISE_SENTENCE,
        ours=f"per rad/s of encoder noise: {listed(twist_std[:2], '.4f')} m/s, {twist_std[2]:.4f} rad/s",
        verdict=judge(raw, holds),
        why=f"The numbers have two units: in SI w has {twist_std[2] / twist_std[0]:.1f} times the number of v. "
        f"Relative to the mean speeds of Table 1 the noise is {listed(100 * relative, '.1f')} % per rad/s, and at the "
        f"rim {listed(1e3 * at_rim, '.1f')} mm/s: so v and v_n are noisier in that sense. Geometry makes v and v_n "
        "alike.",
        numbers=plain(std_per_encoder_std=twist_std, mean_speed_driven=driven, relative=relative, at_rim=at_rim),
    )
