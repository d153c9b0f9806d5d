"""The inverse model as a few numbers: what a microcontroller needs to know of a robot, kS, kV and kA of every wheel.

    u = V (v_x, v_y, omega) + A (v_x', v_y', omega') + sum_e S_e sgn(d_e . twist)            volts at the motors
        + P (Cx^2 v_x, Cy^2 v_y, 0)/sqrt(Cx^2 v_x^2 + Cy^2 v_y^2) + P M omega (-v_y - omega c_x, v_x - omega c_y, c . v)
    asked = u + drop sgn i + dead_band sgn u

P: volts per wrench; e: the body axes and wheels that rub; c: the centre of mass, from that of the wheels; the terms of
the second line where the robot has them. It is `voltage_for` of a robot in motion, to the last bits; at rest the sign
is that of the way it is to start.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.document import Document, Part, Table, plain
from omnidyn.errors import UnsupportedError
from omnidyn.model.frames import AXES
from omnidyn.model.inverse import inverse
from omnidyn.model.motor import back_emf
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel, wheel_speed
from omnidyn.shown import Displayable

ROUNDING = 1e-13  # of the largest number of a table


@dataclass(frozen=True, eq=False)
class FeedforwardTable(Displayable):
    """Numbers of the formula above.

    speed: V, kV, shape (wheels, 3). change: A, kA, shape (wheels, 3). directions: d_e of what rubs, shape (k, 3).
    sign: S_e, kS, forward and backward, shape (2, wheels, k). push: P [V/N, V/N, V/(N m)], shape (wheels, 3).
    ellipse: (Cx, Cy) [N]; plain: its force is (Cx vx, Cy vy)/|v|. turning: M where the body frame turns, else 0 [kg].
    centre: c [m], shape (2,). drop [V], shape (wheels,); dead_band [V]. back_emf: of a twist [V], shape (wheels, 3).
    """

    robot: str
    speed: FloatArray
    change: FloatArray
    directions: FloatArray
    sign: FloatArray
    push: FloatArray
    ellipse: FloatArray
    plain: bool
    turning: float
    centre: FloatArray
    drop: FloatArray
    dead_band: float
    back_emf: FloatArray

    def volts(self, twist: ArrayLike, acceleration: ArrayLike) -> FloatArray:
        """The formula: volts of each wheel. twist [m/s, m/s, rad/s] and its derivative, shape (3,) each. (wheels,)."""
        nu, change = np.asarray(twist, dtype=float), np.asarray(acceleration, dtype=float)
        along = self.directions @ nu
        u = self.speed @ nu + self.change @ change
        u = u + self.sign[0] @ np.maximum(np.sign(along), 0.0) - self.sign[1] @ np.maximum(np.sign(-along), 0.0)
        (x, y, w), (c, d) = nu, self.centre
        wrench = self.turning * w * np.array([-y - w * c, x - w * d, c * x + d * y])
        rubs = float(np.hypot(*((1.0 if self.plain else self.ellipse) * nu[:2])))
        if rubs > 0.0:
            wrench[:2] += (self.ellipse if self.plain else self.ellipse**2) * nu[:2] / rubs
        u = u + self.push @ wrench
        current = np.sign(u - self.back_emf @ nu)
        u = u + self.drop * current
        return u + self.dead_band * np.sign(u)

    def document(self) -> Document:
        """The numbers as tables, and the formula as a microcontroller has it."""
        head = ("wheel", *(f"kV {axis}" for axis in AXES), *(f"kA {axis}" for axis in AXES))
        rows = [
            (str(k + 1), *(f"{value:.5g}" for value in (*self.speed[k], *self.change[k])))
            for k in range(len(self.speed))
        ]
        parts: list[Part] = [
            f"{self.robot}: volts of each wheel, of speeds [V s/m, V s/m, V s/rad] and of their changes",
            "",
            Table(head, rows, ">", name="speed and change"),
            "",
        ]
        if len(self.directions):
            sign_rows = [("along", *(f"kS {k + 1}" for k in range(len(self.speed))))]
            sign_rows += [
                (_way(direction), *(f"{value:.5g}" for value in self.sign[0, :, e]))
                for e, direction in enumerate(self.directions)
            ]
            parts += [
                "volts against dry friction, times the sign of the speed along",
                "",
                Table(sign_rows[0], sign_rows[1:], "<>", name="sign"),
                "",
            ]
        parts += [*self.code(), ""]
        return Document(parts, plain({key: value for key, value in vars(self).items()}))

    def code(self) -> list[str]:
        """The formula in C, a line for each wheel; vx, vy, w are the twist, ax, ay, aw its derivative, sgn(0) = 0."""
        off = bool(self.turning) and bool(self.centre.any())
        lines = ["/* volts of each wheel: twist (vx, vy, w) and its derivative (ax, ay, aw) */"]
        if self.ellipse.any():
            x, y = (self.ellipse if self.plain else self.ellipse**2).tolist()
            size = "vx*vx + vy*vy" if self.plain else f"{_c(x)}*vx*vx + {_c(y)}*vy*vy"
            lines += [
                f"d = sqrtf({size}); if (d < 1e-9f) d = 1e-9f;",
                f"fx = {_c(x)}*vx/d; fy = {_c(y)}*vy/d;",
            ]
        elif self.turning:
            lines += ["fx = 0; fy = 0;"]
        if self.turning:
            lines += [f"fx -= {_c(self.turning)}*w*vy; fy += {_c(self.turning)}*w*vx;"]
        if off:
            c, d = (self.turning * self.centre).tolist()
            lines += [f"fx -= {_c(c)}*w*w; fy -= {_c(d)}*w*w; ft = w*({_sum(np.array([c, d]), ('vx', 'vy'))});"]
        for e, direction in enumerate(self.directions):
            lines.append(f"s{e} = sgn({_sum(direction, ('vx', 'vy', 'w'))});")
        for k in range(len(self.speed)):
            terms = [_sum(self.speed[k], ("vx", "vy", "w")), _sum(self.change[k], ("ax", "ay", "aw"))]
            terms += [self._sign_term(k, e) for e in range(len(self.directions))]
            if self.ellipse.any() or self.turning:
                terms.append(_sum(self.push[k] if off else self.push[k, :2], ("fx", "fy", "ft")[: 3 if off else 2]))
            expression = " + ".join(term for term in terms if term != "0").replace("+ -", "- ")
            lines.append(f"u{k + 1} = {expression or '0'};")
            if self.drop[k]:
                emf = _sum(self.back_emf[k], ("vx", "vy", "w"))
                lines.append(f"u{k + 1} += {_c(self.drop[k])}*sgn(u{k + 1} - ({emf}));")
            if self.dead_band:
                lines.append(f"u{k + 1} += {_c(self.dead_band)}*sgn(u{k + 1});")
        return lines

    def _sign_term(self, k: int, e: int) -> str:
        forward, backward = self.sign[:, k, e].tolist()
        if forward == backward:
            return f"{_c(forward)}*s{e}" if forward else "0"
        return f"(s{e} > 0 ? {_c(forward)} : {_c(backward)})*s{e}"


def feedforward_table(robot: Robot) -> FeedforwardTable:
    """The inverse model of a robot as numbers and as a formula in C, for a controller that has no omnidyn.

    Raises UnsupportedError for gears that lose: which of them drive depends on the motion.
    """
    check_order("feedforward_table(robot)", (robot, Robot))
    if np.any(np.asarray(robot.motor.gear_efficiency) != 1.0):
        raise UnsupportedError(
            "no formula of signs and sums for gears that lose",
            got="[motor] gear_efficiency below 1",
            expected="1",
            remedy="take voltage_for, which finds out which motors drive",
        )
    if robot.drive.voltage_map:
        raise UnsupportedError(
            "no formula of signs and sums for a driver that is no line",
            got="[drive] voltage_map_V",
            expected="none",
            remedy="take voltage_for, or leave voltage_map_V out",
        )
    model, count = inverse(robot), robot.wheels.count
    levels = model.levels
    if levels.falls.any():
        raise UnsupportedError(
            "no formula of signs and sums for friction that falls with the speed",
            got="stribeck_speed",
            expected="none",
            remedy="take voltage_for, or leave stribeck_speed out: then it pushes with coulomb",
        )
    push = per_wheel(robot.motor.resistance, count)[:, None] * model.share
    viscous = (levels.directions.T * levels.viscous) @ levels.directions
    emf = back_emf(robot.motor, wheel_speed(robot.wheels, np.eye(3))).T
    rubs = levels.slide.any(axis=0)
    sign = np.einsum("wi,ei,se->swe", push, levels.directions[rubs], levels.slide[:, rubs])
    return FeedforwardTable(
        robot.name,
        _clean(emf + push @ viscous),
        _clean(push @ model.mass),
        _clean(levels.directions[rubs]),
        _clean(sign),
        _clean(push),
        levels.ellipse_slide,
        levels.plain,
        robot.body.mass if robot.body.rotating_frame else 0.0,
        np.array(robot.body.centre),
        per_wheel(robot.motor.voltage_drop, count),
        robot.drive.dead_band,
        _clean(emf),
    )


def _sum(values: FloatArray, names: tuple[str, ...]) -> str:
    """A sum of products; what is 0 is left out."""
    terms = [f"{_c(value)}*{name}" for value, name in zip(values.tolist(), names, strict=True) if value]
    return " + ".join(terms).replace("+ -", "- ") or "0"


def _c(value: float) -> str:
    """A float of C."""
    text = f"{value:.7g}"
    return f"{text}f" if "." in text or "e" in text else f"{text}.0f"


def _clean(matrix: FloatArray) -> FloatArray:
    """The matrix with 0 for what is rounding."""
    return np.where(np.abs(matrix) <= ROUNDING * np.abs(matrix).max(initial=0.0), 0.0, matrix)


def _way(direction: FloatArray) -> str:
    """A direction as an axis, or as its numbers."""
    if np.count_nonzero(direction) == 1 and direction.max() == 1.0:
        return AXES[int(np.argmax(direction))]
    return "(" + ", ".join(f"{value:.4g}" for value in direction) + ")"
