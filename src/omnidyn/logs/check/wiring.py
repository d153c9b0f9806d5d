"""Which column is which wheel, and with which sign: every order and every sign of the wheels is tried.

Three redundancies are used, each a sum of squares that is 0 for the right wiring: the twist over the floor against
the twist of the wheels (and, beyond three wheels, what the wheels must agree on among themselves); u - R i - K l w of
each motor; and the likeness of voltage, command and speed where no number of the motor is known. An answer is given
only where it explains the log much better than the wiring as logged; wirings that the log cannot tell apart are said.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.logs.channels import components
from omnidyn.logs.check.reference import emf, ground, ohmic, pose_twist, volts, wheels_twist
from omnidyn.logs.check.robust import smooth, windowed
from omnidyn.logs.check.work import MIN_ROWS, Work
from omnidyn.logs.findings import FATAL, WARN, Finding
from omnidyn.model.wheels import wheel_speed

FloatArray = NDArray[np.float64]

BETTER = 0.35  # the right wiring leaves at most so much of what the logged one leaves
POOR = 0.02  # a wiring that leaves less than this share of the motion unexplained is not doubted
ALIKE = 0.15  # a wiring so close to the best one, of the way to the logged one, is as good
MAX_TRIED = 4  # wheels up to which every order is tried; beyond, exchanges of two
WINDOWS = (0.12, 0.5)  # [s]; the long one for speeds that drown in noise
SEEN = 0.15  # of the motion of the wheels, that the floor must show to be a witness

MOTOR = ("voltage", "duty", "current", "wheel_angle", "wheel_speed", "wheel_speed_command")


class Wiring(NamedTuple):
    """Slot i takes column order[i] times sign[i]; for axes, sign of vx, vy, omega, and whether x and y are exchanged."""

    order: tuple[int, ...]
    sign: tuple[float, ...]

    @property
    def changes(self) -> int:
        """How many things are wrong in the log if this is right."""
        return sum(k != j for k, j in enumerate(self.order)) + sum(s < 0.0 for s in self.sign)

    @property
    def matrix(self) -> FloatArray:
        """slots = matrix @ columns."""
        n = len(self.order)
        matrix = np.zeros((n, n))
        matrix[np.arange(n), self.order] = self.sign
        return matrix

    def applied(self, values: FloatArray) -> FloatArray:
        """The columns put right. Shape (rows, n)."""
        return values[:, self.order] * np.array(self.sign)

    def words(self, names: tuple[str, ...]) -> str:
        """What is wrong, by the names of the columns."""
        parts = []
        moved = [k for k, j in enumerate(self.order) if k != j]
        if len(moved) == 2:
            parts.append(f"{names[moved[0]]} and {names[moved[1]]} are exchanged")
        elif moved:
            parts.append("; ".join(f"{names[self.order[k]]} is in truth {names[k]}" for k in moved))
        turned = [names[j] for j, s in zip(self.order, self.sign, strict=True) if s < 0.0]
        if turned:
            parts.append(f"{' and '.join(turned)} {'has' if len(turned) == 1 else 'have'} the opposite sign")
        return ", and ".join(parts)

    def touched(self, names: tuple[str, ...]) -> list[str]:
        """The columns that are wrong."""
        return [names[j] for k, (j, s) in enumerate(zip(self.order, self.sign, strict=True)) if j != k or s < 0.0]


class Answer(NamedTuple):
    """best: the right wiring with fewest changes. others: as good ones. left, logged: share that best and log leave."""

    best: Wiring
    others: int
    second: Wiring | None
    left: float
    logged: float
    rival: str = ""  # the same seen from the floor


def wirings(n: int) -> Iterator[Wiring]:
    """Orders and signs of n columns to try."""
    signs = list(product((1.0, -1.0), repeat=n)) if n <= 8 else [tuple([1.0] * n)]
    if n <= MAX_TRIED:
        orders: list[tuple[int, ...]] = list(permutations(range(n)))
    else:
        orders = [tuple(range(n))]
        for a in range(n):
            for b in range(a):
                swapped = list(range(n))
                swapped[a], swapped[b] = b, a
                orders.append(tuple(swapped))
    return (Wiring(order, tuple(sign)) for order in orders for sign in signs)


def choose(tried: list[Wiring], costs: FloatArray, total: float, better: float = BETTER) -> Answer | None:
    """The wiring that the costs call for; None where that of the log, the first, is not clearly wrong."""
    logged, least = float(costs[0]), float(costs.min())
    if not np.isfinite(logged) or total <= 0.0 or logged < POOR * total or least > better * logged:
        return None
    alike = [k for k in np.flatnonzero(costs <= least + ALIKE * (logged - least))]
    alike.sort(key=lambda k: (tried[k].changes, costs[k]))
    # Of those with fewest changes the cheapest; a rival is one that does not need more changes.
    best = tried[alike[0]]
    rivals = [tried[k] for k in alike[1:] if tried[k].changes == best.changes]
    return Answer(best, len(rivals), rivals[0] if rivals else None, float(costs[alike[0]]) / total, logged / total)


def check_wiring(work: Work) -> tuple[list[Finding], Work]:
    """Findings on order and sign of the columns of motors and axes; the work with them put right."""
    if len(work) < MIN_ROWS or work.wheels < 1:
        return [], work
    floor = _floor_answer(work)
    found, turned = _check_frame(work, floor[1].left if floor is not None else 1.0)
    if found:
        work, floor = turned, _floor_answer(turned)
    motor = _by_motor(work)
    if floor is not None and floor[0] == "axes":
        found.append(_axes_finding(work, floor[1]))
        work = _mended_axes(work, floor[1].best)
    elif floor is not None:
        blamed = "wheel_speed" if motor is not None or not _motor_known(work) else "motors"
        found.append(_wheels_finding(work, floor[1], blamed))
        channels = MOTOR if blamed == "motors" else ("wheel_speed", "wheel_angle")
        work = _mended(work, channels, floor[1].best)
        motor = _by_motor(work)
    if motor is not None:
        channel, answer = motor
        found.append(_motor_finding(work, channel, answer))
        work = _mended(work, (channel,), answer.best)
    command = _by_likeness(work, "wheel_speed_command")
    if command is not None:
        found.append(_motor_finding(work, "wheel_speed_command", command))
        work = _mended(work, ("wheel_speed_command",), command.best)
    return found, work


def _floor_answer(work: Work) -> tuple[str, Answer] | None:
    """What is wrong between wheels and floor; wheels that turn as the firmware tells them are wired as it thinks."""
    answer = next(filter(None, (_by_floor(work, seconds) for seconds in WINDOWS)), None)
    return None if answer is not None and answer[0] == "wheels" and _commands_agree(work) else answer


def _mended(work: Work, channels: tuple[str, ...], wiring: Wiring) -> Work:
    for channel in channels:
        values = work.channels.get(channel)
        if values is not None:
            work = work.replace(**{channel: wiring.applied(values)})
    return work


def _windows(work: Work, *channels: FloatArray, seconds: float = WINDOWS[0]) -> list[FloatArray]:
    """Means over short windows, rows without all channels left out. Shapes (windows, columns)."""
    ids, count = work.windows(seconds)
    table = np.column_stack(channels)
    good = np.isfinite(table).all(axis=1)
    number = windowed(ids, count, good)
    sums = np.column_stack([windowed(ids, count, np.where(good, column, 0.0)) for column in table.T])
    keep = number >= 3
    means = sums[keep] / number[keep, None]
    return np.split(means, np.cumsum([values.shape[1] for values in channels])[:-1], axis=1)


# --- against the floor ---


def _check_frame(work: Work, left: float) -> tuple[list[Finding], Work]:
    """A pose whose x and y belong to another frame than its heading: turned, or mirrored as a picture from above is.

    left: what the best other wiring of the wheels leaves unexplained.
    """
    speed, pose, robot = work.full("wheel_speed"), work.full("pose"), work.geometry
    if speed is None or pose is None or robot is None or work.get("twist") is not None or len(work) < 3 * MIN_ROWS:
        return [], work
    best, plain = (0.0, 0.0 + 0.0j, 1.0), 0.0
    for mirror in (1.0, -1.0):
        turned = pose * [1.0, mirror, mirror]
        twist, width = pose_twist(work, turned)
        own = wheels_twist(work, speed, width)
        assert own is not None
        w, g = _windows(work, own[:, :2], twist[:, :2])
        if len(w) < 8:
            return [], work
        wheel, floor = w @ [1.0, 1.0j], g @ [1.0, 1.0j]
        size = np.sqrt((np.abs(wheel) ** 2).sum() * (np.abs(floor) ** 2).sum())
        slope = (np.conj(wheel) * floor).sum() / size if size > 0.0 else 0.0j
        if mirror > 0.0:
            plain = float(slope.real)
        if abs(slope) > best[0] + 0.05 * (mirror < 0.0):
            best = float(abs(slope)), complex(slope), mirror
    alike, slope, mirror = best
    angle = float(np.degrees(np.angle(slope)))
    trusted = _commands_agree(work)
    if trusted and plain < 0.5 and alike < 0.8:
        return [_unlike(plain)], work.replace(pose=None)
    if not trusted and left < 0.6 * (1.0 - alike**2) + 0.005:
        return [], work
    if alike < (0.8 if trusted else 0.9) or plain > 0.95 * alike or not (trusted or _turns_say(work, mirror)):
        return [], work
    words = f"turned by {angle:.0f} deg" + (" and mirrored" if mirror < 0.0 else "")
    mended = pose * [1.0, mirror, mirror]
    unit = np.exp(-1.0j * np.radians(angle))
    place = (mended[:, 0] + 1.0j * mended[:, 1]) * unit
    mended = np.column_stack([place.real, place.imag, mended[:, 2]])
    return [Finding(
        "pose_frame", WARN, "x y", f"x and y of the pose are {words} against its heading and the wheels (likeness "
        f"{plain:.2f} as logged, {alike:.2f} put right)",
        "turn the frame of the pose, or correct its heading by that angle, before world speeds are used", (), 0,
        {"angle_deg": angle, "mirrored": float(mirror < 0.0), "likeness": alike, "likeness_as_logged": plain},
    )], work.replace(pose=mended)  # fmt: skip


def _unlike(plain: float) -> Finding:
    return Finding(
        "pose_unlike", WARN, "x y heading", f"the pose does not follow the wheels (likeness {plain:.2f}), which turn as "
        "they are told; no turned or mirrored frame explains it", "look at the tracking of the pose; it was not used", (),
        0, {"likeness_as_logged": plain},
    )  # fmt: skip


def _commands_agree(work: Work) -> bool:
    """Whether the wheels turn as the commanded twist says: then they are wired as the firmware thinks."""
    orders, speed, robot = work.full("twist_command"), work.full("wheel_speed"), work.geometry
    if orders is None or speed is None or robot is None:
        return False
    wanted, turned = _windows(work, wheel_speed(robot.wheels, orders), speed)
    size = np.sqrt((wanted**2).sum() * (turned**2).sum())
    return bool(size > 0.0 and (wanted * turned).sum() > 0.9 * size)


def _turns_say(work: Work, mirror: float) -> bool:
    """Whether the robot turns enough to see that its wheels are right about yaw, whatever they are about x and y."""
    speed, pose = work.full("wheel_speed"), work.full("pose")
    if speed is None or pose is None:
        return False
    twist, width = pose_twist(work, pose * [1.0, mirror, mirror])
    own = wheels_twist(work, speed, width)
    assert own is not None
    w, g = _windows(work, own[:, 2:], twist[:, 2:])
    size = np.sqrt((w**2).sum() * (g**2).sum())
    moved = np.sqrt((w**2).sum()) * float(np.mean(work.geometry.wheels.robot_radius))  # type: ignore[union-attr]
    planar = np.sqrt((_windows(work, own[:, :2])[0] ** 2).sum())
    return bool(size > 0.0 and (w * g).sum() > 0.97 * size and moved > 0.3 * planar)


def _by_floor(work: Work, seconds: float) -> tuple[str, Answer] | None:
    """("wheels" or "axes", what is wrong), from the motion over the floor and the wheels' own redundancy."""
    speed, robot = work.full("wheel_speed"), work.geometry
    if speed is None or robot is None:
        return None
    seen = ground(work)
    name = "twist"
    if seen is None:
        orders = work.get("twist_command")
        floor, width, name = orders, 1, "twist_command"
    else:
        floor, width, name = seen.twist, seen.width, seen.name
    n = robot.wheels.count
    axes = [] if floor is None else [k for k in range(3) if np.isfinite(floor[:, k]).any()]
    if not axes and n == 3:
        return None
    length = np.array([1.0, 1.0, float(np.mean(robot.wheels.robot_radius))])
    to_twist = wheels_twist(work, np.zeros((1, n)))  # only to know that it works
    if to_twist is None:
        return None
    columns = np.column_stack([_twist_of(work, unit) for unit in np.eye(n)]) * length[:, None]
    null = _null_rows(robot)
    rows = np.vstack([columns[axes], null])
    parts = [smooth(speed, width)] + ([floor[:, axes] * length[axes]] if axes and floor is not None else [])
    means = _windows(work, *parts, seconds=seconds)
    w = means[0]
    if len(w) < 8:
        return None
    v = means[1] if axes else np.zeros((len(w), 0))
    if axes and (v**2).sum() < (SEEN if len(axes) > 1 else 2.0 * SEEN) ** 2 * ((w * robot.wheels.radii) ** 2).sum() * len(axes) / n:
        return None  # a robot that does not turn says nothing through its heading
    target = np.column_stack([v, np.zeros((len(w), len(null)))])
    moments = target.T @ target, target.T @ w, w.T @ w
    tried = list(wirings(n))
    costs = np.array([_cost(rows @ wiring.matrix, moments, bool(axes)) for wiring in tried])
    total = float(np.trace(moments[0])) if axes else float(np.trace(rows @ moments[2] @ rows.T) + _size(rows, w))
    answer = choose(tried, costs, total)
    if axes and name in ("twist", "pose"):
        turned = _by_axes(work, rows, moments, axes, total)
        if turned is not None and answer is None:
            return "axes", turned
    if axes and name in ("twist", "pose") and answer is not None:
        # One axis of the floor turned about is rarer than two motors exchanged, which may look the same.
        if turned is not None and (turned.best.changes + 1 < answer.best.changes or turned.left < BETTER * answer.left):
            return "axes", turned
        if turned is not None and turned.left < 2.0 * answer.left + 0.02:
            answer = answer._replace(rival=turned.best.words(_axes_names(work)[1]))
    return None if answer is None else ("wheels", answer)


def _twist_of(work: Work, unit: FloatArray) -> FloatArray:
    twist = wheels_twist(work, unit[None])
    assert twist is not None
    return twist[0]


def _null_rows(robot) -> FloatArray:
    """Combinations of wheel speeds that are 0 whatever the robot does, in m/s. Shape (wheels - 3, wheels)."""
    rims = wheel_speed(robot.wheels, np.eye(3))  # (3, wheels): wheel speed per unit of twist
    _, _, basis = np.linalg.svd(rims)
    return basis[3:] * float(np.mean(robot.wheels.radii))


def _size(rows: FloatArray, w: FloatArray) -> float:
    return float((w**2).sum()) * float((rows**2).sum()) / max(rows.shape[1], 1)


def _cost(matrix: FloatArray, moments: tuple[FloatArray, FloatArray, FloatArray], scaled: bool) -> float:
    """Least sum of squares of target - a matrix w over a scale a > 0, or a = 1 where there is no target."""
    vv, vw, ww = moments
    along, size = float((matrix * vw).sum()), float(((matrix @ ww) * matrix).sum())
    if not scaled:
        return size
    if along <= 0.0 or size <= 0.0:
        return float(np.trace(vv))
    return float(np.trace(vv)) - along**2 / size


def _by_axes(work: Work, rows: FloatArray, moments, axes: list[int], total: float) -> Answer | None:
    """The same question with the wheels trusted and the axes of the floor's twist exchanged or turned about."""
    vv, vw, ww = moments
    n, free = len(axes), len(vv) - len(axes)
    exchanges = [tuple(range(n))] + ([(1, 0, *range(2, n))] if axes[:2] == [0, 1] else [])
    tried = [Wiring(order, tuple(sign)) for order in exchanges for sign in product((1.0, -1.0), repeat=n)]
    costs = []
    for wiring in tried:
        turn = np.eye(n + free)
        turn[:n, :n] = wiring.matrix
        costs.append(_cost(rows, (turn @ vv @ turn.T, turn @ vw, ww), True))
    return choose(tried, np.array(costs), total, 0.5)  # so few are tried that chance is no matter


def _axes_names(work: Work) -> tuple[str, tuple[str, ...]]:
    seen = ground(work)
    assert seen is not None
    names = components("twist", 0) if seen.name == "twist" else ("x", "y", "heading")
    return seen.name, tuple(names[k] for k in seen.axes)


def _axes_finding(work: Work, answer: Answer) -> Finding:
    channel, names = _axes_names(work)
    wrong = answer.best.touched(names)
    heading = wrong == ["heading"] or wrong == ["omega"]
    also = " (a positive speed of all wheels must turn the robot counter-clockwise)" if heading else ""
    return Finding(
        "inverted" if all(k == j for k, j in enumerate(answer.best.order)) else "swapped", FATAL, " ".join(wrong),
        f"{channel} against the wheels: {answer.best.words(names)}{also}; as logged they share "
        f"{100 * (1 - answer.logged):.0f} % of their motion, put right {100 * (1 - answer.left):.0f} %"
        + (", or else all wheels have the opposite sign" if heading else ""),
        "set `invert` for that column in the mapping, or turn the wheels' signs in the same way",
        (), 0, {"explained_as_logged": 1.0 - answer.logged, "explained_put_right": 1.0 - answer.left},
    )  # fmt: skip


def _mended_axes(work: Work, wiring: Wiring) -> Work:
    seen = ground(work)
    assert seen is not None
    values = work.channels[seen.name].copy()
    if seen.name == "pose":
        # A mirrored or turned picture: only the signs of the heading can be put right here.
        signs = np.ones(3)
        signs[seen.axes] = wiring.sign
        values = values * signs if tuple(wiring.order) == tuple(range(len(wiring.order))) else values * np.nan
    else:
        values[:, seen.axes] = wiring.applied(values[:, seen.axes])
    return work.replace(**{seen.name: values})


def _wheels_finding(work: Work, answer: Answer, blamed: str) -> Finding:
    seen = ground(work)
    against = seen.name if seen is not None else ("twist_command" if work.get("twist_command") is not None else "")
    names = components("wheel_speed", work.wheels)
    wrong = answer.best.touched(names)
    what = f"the {against} of the robot" if against else "what the wheels must agree on"
    also = "; its voltage, current and speed agree, so the whole motor is meant" if blamed == "motors" else ""
    return Finding(
        _code(answer.best), FATAL, " ".join(wrong),
        f"wheel_speed against {what}: {answer.best.words(names)}{also}{_rivals(answer, names)}; as logged it "
        f"leaves {100 * answer.logged:.0f} % of the motion unexplained, put right {100 * answer.left:.1f} %",
        "put the columns right in the mapping (--column), or the order and signs of the wheels in the robot file",
        (), 0, {"unexplained_as_logged": answer.logged, "unexplained_put_right": answer.left,
                "as_good": float(answer.others)},
    )  # fmt: skip


def _code(wiring: Wiring) -> str:
    return "swapped" if any(k != j for k, j in enumerate(wiring.order)) else "inverted"


def _rivals(answer: Answer, names: tuple[str, ...]) -> str:
    if answer.second is None:
        return f" (or, which this log cannot tell apart, {answer.rival})" if answer.rival else ""
    more = f", or {answer.others - 1} more" if answer.others > 1 else ""
    return f" (or, which this log cannot tell apart, {answer.second.words(names)}{more})"


# --- of each motor ---


def _motor_known(work: Work) -> bool:
    """Whether voltage or current is there to say which motor a speed belongs to."""
    return work.full("wheel_speed") is not None and (
        work.full("voltage") is not None or work.full("duty") is not None or work.full("current") is not None
    )


def _by_motor(work: Work) -> tuple[str, Answer] | None:
    """(channel that is wired wrongly, how), from u = R i + K l w or, without it, from likeness."""
    exact = _by_circuit(work)
    if exact is not None:
        return exact[0]
    for channel in ("voltage", "duty"):
        if work.full(channel) is not None:
            answer = _by_likeness(work, channel)
            return None if answer is None else (channel, answer)
    return None


def _by_circuit(work: Work) -> tuple[tuple[str, Answer] | None] | None:
    """The same from u - R i - K l w, which is 0 for the right wiring; None where it cannot be had."""
    voltage, current, speed = volts(work), work.full("current"), work.full("wheel_speed")
    robot = work.geometry
    if voltage is None or current is None or speed is None or robot is None or work.log.current_unsigned:
        return None
    lost, counter = ohmic(work, current), emf(work, speed)
    assert lost is not None and counter is not None
    u, r, e = _windows(work, voltage, lost, counter)
    if len(u) < 8:
        return None
    # Scales of file and log may differ: each pair may have its own, from the data as logged or as tried.
    tried = list(wirings(u.shape[1]))
    total = float((u**2).sum())
    names = ("duty" if work.get("voltage") is None else "voltage", "current", "wheel_speed")
    best: tuple[str, Answer] | None = None
    for name, changed, rest in zip(names, (u, r, e), ((r, e, 1), (u, e, -1), (u, r, -1)), strict=True):
        fixed = rest[0] + rest[1] if rest[2] > 0 else rest[0] - rest[1]
        m = changed.T @ fixed
        size = float((changed**2).sum() + (fixed**2).sum())
        costs = np.array([size - 2.0 * float((wiring.matrix * m.T).sum()) for wiring in tried])
        answer = choose(tried, costs, total)
        if answer is not None and (best is None or answer.left < best[1].left):
            best = (name, answer)
    return (best,)


def _by_likeness(work: Work, channel: str) -> Answer | None:
    """Order and signs under which a drive channel and the speed of the same wheel look alike."""
    driven, speed = work.full(channel), work.full("wheel_speed")
    if driven is None or speed is None or driven.shape != speed.shape:
        return None
    u, w = _windows(work, driven, speed)
    if len(u) < 8:
        return None
    su, sw = np.sqrt((u**2).sum(axis=0)), np.sqrt((w**2).sum(axis=0))
    if (su < 0.05 * su.max()).any() or (sw < 0.05 * sw.max()).any() or su.max() == 0.0 or sw.max() == 0.0:
        return None  # a wheel that is not driven tells nothing of its place
    alike = (u.T @ w) / np.outer(su, sw)
    n = len(alike)
    tried = list(wirings(n))
    costs = np.array([sum(1.0 - (s * alike[j, k]) * abs(alike[j, k]) for k, (j, s) in
                          enumerate(zip(wiring.order, wiring.sign, strict=True))) for wiring in tried])  # fmt: skip
    answer = choose(tried, costs, float(n))
    return answer if answer is not None and (answer.logged - answer.left) * n > 1.0 else None


def _motor_finding(work: Work, channel: str, answer: Answer) -> Finding:
    names = components(channel, work.wheels)
    wrong = answer.best.touched(names)
    against = "wheel_speed" if channel != "wheel_speed" else "voltage and current"
    return Finding(
        _code(answer.best), FATAL, " ".join(wrong),
        f"{channel} against {against} of the same motor: {answer.best.words(names)}{_rivals(answer, names)}; as "
        f"logged it leaves {100 * answer.logged:.0f} % unexplained, put right {100 * answer.left:.1f} %",
        "put the columns right in the mapping (--column)", (), 0,
        {"unexplained_as_logged": answer.logged, "unexplained_put_right": answer.left, "as_good": float(answer.others)},
    )  # fmt: skip
