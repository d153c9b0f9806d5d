"""Order and sign of wheels and axes, by the motion over the floor and what the wheels must agree on."""

from __future__ import annotations

from itertools import product

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.findings.signal.reference import GEOMETRY, ground, pose_twist, wheels_twist
from omnidyn.findings.signal.robust import smooth
from omnidyn.findings.wiring.orders import (
    BEST_SHARE,
    WINDOWS,
    Wiring,
    WiringChoice,
    choose,
    code_of,
    means,
    wiring_finding,
    wirings,
)
from omnidyn.findings.wiring.pose_frame import commands_agree
from omnidyn.logs.channels import components
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.statement import ERROR

Moments = tuple[FloatArray, FloatArray, FloatArray]  # sums of v v', v w', w w'

# Of the motion of the wheels, that the floor must show to be a witness, by the number of its axes. All three show all
# motion there is: wheels in rpm or deg/s, read as rad/s, are 10 or 57 times too fast and may be exchanged as well.
SEEN_BY = (0.0, 0.3, 0.15, 0.01)


def by_floor(work: LogUnderCheck) -> tuple[str, WiringChoice] | None:
    """What is wrong between wheels and floor; wheels that turn as the firmware tells them are wired as it thinks."""
    answer = next(filter(None, (_within(work, seconds) for seconds in WINDOWS)), None)
    return None if answer is not None and answer[0] == "wheels" and commands_agree(work) else answer


def _within(work: LogUnderCheck, seconds: float) -> tuple[str, WiringChoice] | None:
    """("wheels" or "axes", what is wrong), from the motion over the floor and the wheels' own redundancy."""
    speed, robot = work.full("wheel_speed"), work.geometry
    if speed is None or robot is None:
        return None
    floor_motion = ground(work)
    floor, width = (work.get("twist_command"), 1) if floor_motion is None else (floor_motion.twist, floor_motion.width)
    n = robot.wheels.count
    axes = [] if floor is None else [k for k in range(3) if np.isfinite(floor[:, k]).any()]
    if not axes and n == 3:
        return None
    length = np.array([1.0, 1.0, float(np.mean(robot.wheels.robot_radius))])
    columns = np.column_stack([_twist_of(work, unit) for unit in np.eye(n)]) * length[:, None]
    null = _null_rows(robot)
    rows = np.vstack([columns[axes], null])
    w, *rest = means(
        work,
        smooth(speed, width),
        *([floor[:, axes] * length[axes]] if floor is not None and axes else []),
        seconds=seconds,
    )
    if len(w) < 8:
        return None
    v = rest[0] if rest else np.zeros((len(w), 0))
    rims, least_share = float(((w * robot.wheels.radii) ** 2).sum()), SEEN_BY[len(axes)]
    if axes and (v**2).sum() < least_share**2 * rims * len(axes) / n:
        return None  # a robot that does not turn says nothing through its heading
    target = np.column_stack([v, np.zeros((len(w), len(null)))])
    moments = target.T @ target, target.T @ w, w.T @ w
    candidates = list(wirings(n))
    costs = np.array([_cost(rows @ wiring.matrix, moments, bool(axes)) for wiring in candidates])
    total = (
        float(np.trace(moments[0]))
        if axes
        else float(np.trace(rows @ moments[2] @ rows.T) + (w**2).sum() * (rows**2).sum() / max(rows.shape[1], 1))
    )
    answer = choose(candidates, costs, total)
    turned = _by_axes(rows, moments, axes, total) if axes and floor_motion is not None else None
    return _simpler(work, answer, turned)


def _simpler(
    work: LogUnderCheck, answer: WiringChoice | None, turned: WiringChoice | None
) -> tuple[str, WiringChoice] | None:
    """Wheels or axes: what explains much more, else what needs fewer changes.

    One axis of the floor turned about is rarer than two motors exchanged, which may look the same.
    """
    if turned is None:
        return None if answer is None else ("wheels", answer)
    if answer is None or turned.best.changes + 1 < answer.best.changes or turned.left < BEST_SHARE * answer.left:
        return "axes", turned
    if turned.left < 2.0 * answer.left + 0.02:
        answer = answer._replace(rival=turned.best.statement(_axes_names(work)[1]))
    return "wheels", answer


def _twist_of(work: LogUnderCheck, unit: FloatArray) -> FloatArray:
    twist = wheels_twist(work, unit[None])
    assert twist is not None
    return twist[0]


def _null_rows(robot: Robot) -> FloatArray:
    """Combinations of wheel speeds that are 0 whatever the robot does, in m/s. Shape (wheels - 3, wheels)."""
    rims = wheel_speed(robot.wheels, np.eye(3))  # (3, wheels): wheel speed per unit of twist
    _, _, basis = np.linalg.svd(rims)
    return basis[3:] * float(np.mean(robot.wheels.radii))


def _cost(matrix: FloatArray, moments: Moments, scaled: bool) -> float:
    """Least sum of squares of target - a matrix w over a scale a > 0, or a = 1 where there is no target."""
    vv, vw, ww = moments
    along, size = float((matrix * vw).sum()), float(((matrix @ ww) * matrix).sum())
    if not scaled:
        return size
    if along <= 0.0 or size <= 0.0:
        return float(np.trace(vv))
    return float(np.trace(vv)) - along * (along / size)


def _by_axes(rows: FloatArray, moments: Moments, axes: list[int], total: float) -> WiringChoice | None:
    """The same question with the wheels trusted and the axes of the floor's twist exchanged or turned about."""
    vv, vw, ww = moments
    n, free = len(axes), len(vv) - len(axes)
    exchanges = [tuple(range(n))] + ([(1, 0, *range(2, n))] if axes[:2] == [0, 1] else [])
    candidates = [Wiring(order, tuple(sign)) for order in exchanges for sign in product((1.0, -1.0), repeat=n)]
    costs = []
    for wiring in candidates:
        turn = np.eye(n + free)
        turn[:n, :n] = wiring.matrix
        costs.append(_cost(rows, (turn @ vv @ turn.T, turn @ vw, ww), True))
    return choose(candidates, np.array(costs), total, 0.5)  # so few are tried that chance is no matter


def _axes_names(work: LogUnderCheck) -> tuple[str, tuple[str, ...]]:
    floor_motion = ground(work)
    assert floor_motion is not None
    names = components("twist", 0) if floor_motion.name == "twist" else ("x", "y", "heading")
    return floor_motion.name, tuple(names[k] for k in floor_motion.axes)


def axes_finding(work: LogUnderCheck, answer: WiringChoice) -> Finding:
    """Errors: axes of what was measured over the floor are exchanged, or have the opposite sign."""
    channel, names = _axes_names(work)
    turn = _turn_of_pose(work, answer.best)
    also = [] if turn is None else turned_names(turn)
    axes_names = answer.best.touched(names) + also
    return Finding(
        code_of(answer.best),
        ERROR,
        " ".join(axes_names),
        {
            "explained_as_logged": 1.0 - answer.logged,
            "explained_put_right": 1.0 - answer.left,
            "channel": channel,
            "wiring": answer.best.statement(names),
            "of_pose": also,
        },
        "axes",
        rests_on=GEOMETRY,
    )


def turned_names(turn: FloatArray) -> list[str]:
    """Which of x, y and heading such a matrix changes."""
    return [
        name
        for name, row, unit_row in zip(("x", "y", "heading"), turn, np.eye(3), strict=True)
        if (row != unit_row).any()
    ]


def _turn_of_pose(work: LogUnderCheck, wiring: Wiring) -> FloatArray | None:
    """The matrix that puts the pose right beside the twist; None where it does not go with it.

    A mirrored frame has y, heading, vy and omega mirrored. A pose that agrees with the twist as logged goes with it:
    axes A of the plane and the sign s of the turn are those of another frame where det A = s.
    """
    floor_motion, pose, twist = ground(work), work.full("pose"), work.full("twist")
    if floor_motion is None or floor_motion.name != "twist" or pose is None or twist is None or len(wiring.order) != 3:
        return None
    turn = wiring.matrix
    if np.linalg.det(turn[:2, :2]) != turn[2, 2]:
        return None
    body, width = pose_twist(work, pose)
    from_pose, from_twist = means(work, body, smooth(twist, width))
    size = np.sqrt((from_pose**2).sum() * (from_twist**2).sum())
    return turn if size > 0.0 and (from_pose * from_twist).sum() > 0.9 * size else None


def mended_axes(work: LogUnderCheck, wiring: Wiring) -> LogUnderCheck:
    """The log with these axes put right; NaN where a pose cannot be."""
    floor_motion = ground(work)
    assert floor_motion is not None
    values = work.channels[floor_motion.name].copy()
    if floor_motion.name == "pose":
        # A mirrored or turned picture: only the signs of the heading can be put right here.
        signs = np.ones(3)
        signs[floor_motion.axes] = wiring.sign
        values = values * signs if tuple(wiring.order) == tuple(range(len(wiring.order))) else values * np.nan
    else:
        values[:, floor_motion.axes] = wiring.applied(values[:, floor_motion.axes])
        if (turn := _turn_of_pose(work, wiring)) is not None:
            work = work.replace(pose=work.channels["pose"] @ turn.T)
    return work.replace(**{floor_motion.name: values})


def wheels_finding(work: LogUnderCheck, answer: WiringChoice, blamed: str) -> Finding:
    """Errors: wheel speeds in another order, or of the opposite sign, than floor or commands say."""
    floor_motion = ground(work)
    against = (
        floor_motion.name
        if floor_motion is not None
        else ("twist_command" if work.get("twist_command") is not None else "")
    )
    names = components("wheel_speed", work.wheels)
    numbers = {"channel": "wheel_speed", "against": against, "blamed": blamed}
    return wiring_finding(answer, names, numbers, "wheels", GEOMETRY)
