"""The predictive controller beside CasADi with IPOPT, on the plants of `control_real`: the same loop, the same sensors.

IPOPT solves the whole program in each step: 20 steps ahead, Runge-Kutta of fourth order, friction as a smooth function,
the weights of the paper's robot, a latency by prediction. It knows what the robot file says. Skipped where CasADi is
not installed: docs/tested.md.
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import numpy as np

from benchmarks.control_real import DT, errors, robot_of, told
from benchmarks.control_real.paths import FunctionPath, paths
from benchmarks.control_real.plant import Plant
from benchmarks.control_real.rivals import to_body
from benchmarks.control_real.robots import NUMBERS
from benchmarks.table import Table, machine
from omnidyn.arrays import FloatArray
from omnidyn.control.mpc.controller import Mpc

AHEAD, SUBSTEPS, SECONDS = 20, 4, 8.0  # steps, per step, [s] of the clover
SOFT = np.array([0.02, 0.02, 0.2])  # [m/s, m/s, rad/s] width of smooth friction
WEIGHTS, VOLTS_WEIGHT, LAST = [200.0, 200.0, 20.0, 1.0, 1.0, 0.1], 2e-3, 5.0
ALLOWED_ERROR, ALLOWED_TIME = 1.2, 1.0 / 500.0
SENSORS = {"axebot": "instantaneous", "xdrive": "encoder", "mecanum": "encoder"}
OPTIONS = {
    "print_time": 0,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 60,
    "ipopt.warm_start_init_point": "yes",
    "ipopt.mu_init": 1e-3,
}


class Ipopt:
    """A nonlinear program in each step, warm-started."""

    def __init__(self, plant: Plant) -> None:
        self.plant, self.wheels = plant, plant.wheels
        self.constant = plant.motors[0].mean() * np.ones(plant.wheels)
        self.per_volt = plant.directions @ np.diag(self.constant / plant.motors[1])
        self.braking = plant.directions @ np.diag(self.constant**2 / plant.motors[1]) @ plant.directions.T
        self.limit = plant.volts
        self.late = round(plant.latency / DT)
        self._build()
        self.sent: list[FloatArray] = []
        self.guess: FloatArray | None = None

    def _rate(self, ca: Any, x: Any, u: Any) -> Any:
        """Rate of pose and twist."""
        plant, cos, sin, v = self.plant, ca.cos(x[2]), ca.sin(x[2]), x[3:6]
        force = ca.mtimes(ca.DM(self.per_volt), u) - ca.mtimes(ca.DM(self.braking), v) - ca.DM(plant.viscous) * v
        force -= ca.DM(plant.axes[1]) * ca.tanh(v / ca.DM(SOFT))
        if plant.disc[0] > 0.0:
            cx, cy = float(plant.disc[0]), float(plant.disc[1])
            size = ca.sqrt((cx * v[0]) ** 2 + (cy * v[1]) ** 2 + (SOFT[0] * max(cx, cy)) ** 2)
            force -= ca.vertcat(cx**2 * v[0] / size, cy**2 * v[1] / size, 0.0)
        change = ca.mtimes(ca.DM(np.linalg.inv(plant.mass)), force)
        if plant.flags[0] > 0.0:
            change += ca.vertcat(x[5] * x[4], -x[5] * x[3], 0.0)
        return ca.vertcat(cos * v[0] - sin * v[1], sin * v[0] + cos * v[1], v[2], change)

    def _build(self) -> None:
        import casadi as ca  # pyright: ignore[reportMissingImports]

        x, u, h = ca.SX.sym("x", 6), ca.SX.sym("u", self.wheels), DT / SUBSTEPS
        y = x
        for _ in range(SUBSTEPS):
            k1 = self._rate(ca, y, u)
            k2 = self._rate(ca, y + h / 2 * k1, u)
            k3 = self._rate(ca, y + h / 2 * k2, u)
            k4 = self._rate(ca, y + h * k3, u)
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        self.move = ca.Function("move", [x, u], [y])
        states, inputs = ca.MX.sym("X", 6, AHEAD + 1), ca.MX.sym("U", self.wheels, AHEAD)
        given, wanted = ca.MX.sym("P", 6, AHEAD + 2), ca.MX.sym("W", self.wheels, AHEAD)
        cost, gaps = 0, [states[:, 0] - given[:, 0]]
        for k in range(AHEAD):
            gaps.append(states[:, k + 1] - self.move(states[:, k], inputs[:, k]))
            error = states[:, k + 1] - given[:, k + 2]
            cost += (LAST if k == AHEAD - 1 else 1.0) * ca.dot(ca.DM(WEIGHTS) * error, error)
            cost += VOLTS_WEIGHT * ca.sumsqr(inputs[:, k] - wanted[:, k])
        program = {
            "x": ca.vertcat(ca.vec(states), ca.vec(inputs)),
            "p": ca.vertcat(ca.vec(given), ca.vec(wanted)),
            "f": cost,
            "g": ca.vertcat(*gaps),
        }
        self.solve = ca.nlpsol("solve", "ipopt", program, OPTIONS)

    def step(self, t: float, pose: FloatArray, twist: FloatArray, path: FunctionPath) -> FloatArray:
        """Volts or duties. Shape (wheels,)."""
        x = np.concatenate([pose, twist])
        for u in self.sent[len(self.sent) - self.late :]:
            x = np.array(self.move(x, u)).ravel()
        motion = path.at(t + DT * (self.late + np.arange(AHEAD + 1)))
        turns = 2.0 * np.pi * np.round((x[2] - motion.pose[0, 2]) / (2.0 * np.pi))
        ahead = np.array(
            [[*p[:2], p[2] + turns, *to_body(p[2]) @ v] for p, v in zip(motion.pose, motion.velocity, strict=True)]
        )
        twists = ahead[:, 3:]
        wrench = (twists[1:] - twists[:-1]) / DT @ self.plant.mass + twists[:-1] @ self.braking
        wrench += self.plant.viscous * twists[:-1] + self.plant.friction * np.tanh(twists[:-1] / SOFT)
        wanted = np.clip(wrench @ np.linalg.pinv(self.per_volt).T, -self.limit, self.limit)
        count = 6 * (AHEAD + 1)
        if self.guess is None:
            start = np.concatenate([x, ahead[1:].ravel(), wanted.ravel()])
        else:
            states, inputs = self.guess[:count].reshape(-1, 6), self.guess[count:].reshape(-1, self.wheels)
            start = np.concatenate([x, states[2:].ravel(), states[-1], inputs[1:].ravel(), inputs[-1]])
        bound = np.concatenate([np.full(count, np.inf), np.full(AHEAD * self.wheels, self.limit)])
        given = np.concatenate([x, ahead.ravel(), wanted.ravel()])
        answer = self.solve(x0=start, p=given, lbx=-bound, ubx=bound, lbg=0.0, ubg=0.0)
        self.guess = np.array(answer["x"]).ravel()
        volts = self.guess[count : count + self.wheels]
        self.sent = [*self.sent, volts][-max(self.late, 1) :]
        return volts / self.plant.volts if self.plant.duty else volts


def measure() -> Table:
    """The three robots on the first seconds of the clover."""
    columns = ["robot", "sensors", "controller", "mm", "mrad", "us a step"]
    table = Table("control_casadi: the clover, rms of errors and time of a step", columns, notes=[machine()])
    if find_spec("casadi") is None:
        table.notes.append("CasADi is not installed: skipped")
        return table
    whole = paths()["clover"]
    for robot, numbers in NUMBERS.items():
        kind, plant = SENSORS[robot], Plant(numbers)
        path = FunctionPath("clover", SECONDS, lambda t: whole.at(t).pose)
        theirs = errors(plant, Ipopt(plant), path, kind)
        ours = errors(plant, Mpc(told(robot_of(robot, numbers), kind)), path, kind)
        table.add(robot=robot, sensors=kind, controller="IPOPT", **_cells(theirs))
        goal = ours[0] <= ALLOWED_ERROR * theirs[0] and ours[2] <= ALLOWED_TIME * theirs[2]
        table.add("1.2 of mm, 1/500 of us", goal, robot=robot, sensors=kind, controller="mpc", **_cells(ours))
    return table


def _cells(off: tuple[float, float, float]) -> dict[str, Any]:
    return {"mm": round(off[0], 3), "mrad": round(off[1], 3), "us a step": round(off[2])}
