"""Do automatic nuisances earn their place on real logs? Fitted to some, run freely on others, with them and without."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import trim_mean

from benchmarks.real import real_loop, udea
from benchmarks.table import Table
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import STUDENT, OutputError
from omnidyn.identification.validation import HELD_OUT, validate
from omnidyn.model.first_guess import BODY_AXES, first_guess
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.model.wheels import Wheels
from omnidyn.run import Run
from tests.support import real_logs as logs

WORSE = 1.01  # times the error without, that they may cost
ROWS = 50  # of a window, 0.5 s: encoders have noise and spikes far above what the model misses
FEWEST = 20  # of these rows that must be there


def nuisances(table: Table) -> None:
    """Of the udea drives and turns, each part by the other, and of the Robotino's floor."""
    robot = udea_robot()
    drives = [Run(t=r.t, duty=r.duty, wheel_speed=r.wheel_speed, source=r.source) for r in udea.drive_runs()]
    turn = logs.udea_turning(logs.folder())[1]
    half = len(turn) // 2
    cut = [udea.part(turn, rows) for rows in (slice(0, half), slice(half, None))]
    turns = [Run(t=r.t, duty=r.duty, pose=r.pose, source=f"half {k + 1}") for k, r in enumerate(cut)]
    for what, fitted, held, more in (
        ("exp4, exp5 by exp1..3", drives[:3], drives[3:], {"loss": STUDENT}),
        ("exp1..3 by exp4, exp5", drives[3:], drives[:3], {"loss": STUDENT}),
        ("turning, the second half by the first", turns[:1], turns[1:], {}),
        ("turning, the first half by the second", turns[1:], turns[:1], {}),
    ):
        _beside(table, "udea", what, robot, (fitted, held), more)
    floor = [real_loop.prepared(run, 0.0) for run in logs.robotino_groups(logs.folder())["gray 0.2"]]
    asked = {"free": real_loop.LEVELS, "outputs": real_loop.OUTPUTS, "start": "rest", "loss": STUDENT}
    _beside(table, "robotino", "6 runs by 6 others", load_robot("robotino"), (floor[::12], floor[6::12]), asked)


def udea_robot() -> Robot:
    """What its owner knows; all else a guess."""
    wheels = Wheels(azimuth_deg=(150.0, 270.0, 30.0), robot_radius=0.099, wheel_radius=0.0325)
    robot = first_guess("udea", wheels, 3.178, 22.2, BODY_AXES)
    body, drive = robot.body.replace(rotating_frame=False), robot.drive.replace(kind="duty", supply=22.2)
    return robot.replace(body=body, drive=drive)


def _beside(
    table: Table, data: str, what: str, robot: Robot, runs: tuple[Sequence[Run], Sequence[Run]], asked: dict[str, Any]
) -> None:
    without, alone = _errors(robot, runs, {**asked, "nuisances": ()})
    automatic, names = _errors(robot, runs, asked)
    ratio = float(np.sqrt(np.mean([(automatic[name] / without[name]) ** 2 for name in without])))
    assert not alone
    table.add(
        f"<= {WORSE}",
        ratio <= WORSE,
        data=data,
        value=ratio,
        unit="",
        what=f"held-out error with {', '.join(names) or 'no'} nuisances over that without: {what}",
    )


def _errors(
    robot: Robot, runs: tuple[Sequence[Run], Sequence[Run]], asked: dict[str, Any]
) -> tuple[dict[str, float], list[str]]:
    """(component -> error of the means of windows in free runs of logs that were not fitted, names of nuisances)."""
    fitted, held = runs
    fit = identify(fitted, robot, OutputError(**asked)).estimate
    seen = validate(fit, fitted, held)
    compared, found = seen.held_out, {}
    assert compared is not None
    for name in seen.scores[HELD_OUT]:
        errors = [compared.trace(compared.robots[0], name, segment).error for segment in compared.segments]
        parts = [part[np.isfinite(part)] for each in errors for part in np.split(each, range(ROWS, len(each), ROWS))]
        means = [trim_mean(part, udea.TRIM) for part in parts if len(part) >= FEWEST]
        found[name] = float(np.sqrt(np.mean(np.square(means))))
    return found, [*fit.nuisances]
