"""Error of fixed steps: robots whose blocks are not exact beside `simulate` at a tolerance of 1e-8.

`python -m benchmarks.batch.fixed_steps` prints the table of docs/how-to/batches.md: the largest differences over 16
robots of other masses and motors, each under commands of its own that are held for 0.1 to 0.5 s, over 5 s.
"""

from __future__ import annotations

import numpy as np

from benchmarks.batch.rows import DRAWN, SPREAD, along
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.robot import Robot
from omnidyn.simulation.batch.batch import simulate_batch
from omnidyn.simulation.batch.sample import sample
from omnidyn.simulation.simulate import simulate
from tests.support.robots import TABLE_3, robot_of

ROBOTS, SECONDS, SEED = 16, 5.0, 3
MOTORS = tuple(key for key in DRAWN if key != "friction")  # levels drawn apart would hold more than they slide with
STEPS = (5e-4, 1e-3, 5e-3, 2e-2)  # [s]


def kinds() -> dict[str, Robot]:
    """Name -> a robot that its engine moves by fixed steps."""
    robot = robot_of(TABLE_3)
    turning = robot.replace(body=robot.body.replace(rotating_frame=True))
    disc = DirectionFriction(coulomb=(1.8, 1.8), viscous=0.9, yaw_coulomb=0.09, yaw_viscous=0.01)
    axes = robot.friction.axes
    held = AxesFriction(
        viscous=axes.viscous, coulomb=axes.coulomb, breakaway=tuple(1.2 * level for level in axes.coulomb)
    )
    ellipse = along(robot)
    return {
        "turning frame, friction of the axes": turning,
        "the same, a disc": turning.replace(friction=Friction(direction=disc)),
        "the same, an ellipse": ellipse,
        "the same with a current limit": ellipse.replace(motor=ellipse.motor.replace(current_limit=2.0)),
        "turning frame, breakaway 1.2 times Coulomb": turning.replace(friction=Friction(axes=held)),
    }


def commands(dt: float) -> np.ndarray:
    """Volts of each robot, some of them 0. Shape (robots, rows, 3)."""
    random, rows = np.random.default_rng(SEED), round(SECONDS / dt)
    volts = np.zeros((ROBOTS, rows, 3))
    for robot in range(ROBOTS):
        t = 0.0
        while t < SECONDS:
            last = t + 0.02 * random.integers(5, 26)
            volts[robot, round(t / dt) : round(last / dt)] = random.uniform(-6.0, 6.0, 3) * (random.random() < 0.8)
            t = last
    return volts


def errors(robot: Robot) -> dict[float, tuple[float, float, float]]:
    """Step [s] -> largest errors of vx and vy [m/s], omega [rad/s], and of the position at the end [m]."""
    chosen = list(sample(robot, ROBOTS, SEED, factors=dict.fromkeys(MOTORS, SPREAD)))
    coarse = commands(2e-2)
    true = [simulate(one, rows, 2e-2, tol=1e-8) for one, rows in zip(chosen, coarse, strict=True)]
    twist, pose = np.array([run.twist for run in true]), np.array([run.pose for run in true])
    found = {}
    for dt in STEPS:
        run = simulate_batch(chosen, coarse, 2e-2, substeps=round(2e-2 / dt), every=1, threads=1)
        assert run.twists is not None
        assert run.poses is not None
        off, place = np.abs(run.twists - twist), np.abs(run.poses - pose)
        found[dt] = float(off[..., :2].max()), float(off[..., 2].max()), float(place[..., :2].max())
    return found


def main() -> None:
    """Print the table."""
    print("| robot | " + " | ".join(f"{dt * 1e3:g} ms" for dt in STEPS) + " |")
    print("|---|" + "---:|" * len(STEPS))
    for name, robot in kinds().items():
        cells = [f"{v:.0e} m/s, {w:.0e} rad/s, {x:.0e} m" for v, w, x in errors(robot).values()]
        print(f"| {name} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
