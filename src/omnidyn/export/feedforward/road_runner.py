"""road-runner: kS, kV, kA of driving forward, as the PARAMS of Road Runner's quickstart want them, or per inch.

Road Runner has one set of gains for all wheels, in volts per inch of the robot's way forward; on a mecanum or an
omnidirectional robot going sideways and turning take others, which stand beside it. Its wheels turn by

    (v_x -+ v_y inPerTick/lateralInPerTick -+ trackWidthTicks inPerTick omega)/inPerTick   [ticks/s]

(MecanumKinematics, version 1.0), so that with N ticks in a turn of a wheel, and the row g of G^T of any wheel,

    inPerTick = 2 pi r/(N |g_x|)   lateralInPerTick = 2 pi r/(N |g_y|)   trackWidthTicks = N |g_omega|/(2 pi r)
"""

from __future__ import annotations

import math

import numpy as np

from omnidyn.errors import UnsupportedError
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.feedforward.gains import AXES, NAMES, GainRow, rows
from omnidyn.export.feedforward.gains_csv import spread
from omnidyn.export.feedforward.guessed_gains import check_ticks, guessed_gains
from omnidyn.export.spelling import java_comment, number
from omnidyn.model.robot import Robot

INCH = 0.0254  # [m]
PER_INCH = "per inch of the robot's way: times inPerTick they are PARAMS.kV and PARAMS.kA of the quickstart"
PER_TICK = "kV and kA are per tick of a wheel, as PARAMS of the quickstart has them; of turning, per rad of the robot"
AXIS_NAMES = {"x": "forward", "y": "lateral", "yaw": "heading"}
ALIKE = 1e-9  # of what the wheels turn: Road Runner has one number for all of them


def road_runner(robot: Robot, ticks_per_turn: float | None = None, force_guess: bool = False) -> Export:
    """kS [V], kV, kA of driving forward and sideways, of turning per rad, as fields of Java.

    ticks_per_turn: of the encoder, in a turn of the wheel: gains are then per tick, with inPerTick, lateralInPerTick
    and trackWidthTicks beside them; else per inch. force_guess: also of a robot whose friction is a guess. Raises
    InputError for one without it, UnsupportedError for ticks of wheels that do not turn alike.
    """
    refuse("road-runner", robot)
    check_ticks(ticks_per_turn)
    omissions, guess = left_out("road-runner", robot), guessed_gains(robot, force_guess)
    lines, inches = [], {"x": INCH, "y": INCH, "yaw": 1.0}
    note = PER_INCH
    if ticks_per_turn is not None:
        note, distance_per_tick = PER_TICK, ways_per_tick(robot, ticks_per_turn)
        lines += [
            f"public double inPerTick = {number(distance_per_tick['x'] / INCH)};",
            f"public double lateralInPerTick = {number(distance_per_tick['y'] / INCH)};",
            f"public double trackWidthTicks = {number(1.0 / distance_per_tick['yaw'])};",
        ]
        inches = {"x": distance_per_tick["x"], "y": distance_per_tick["y"], "yaw": 1.0}
    unit = "tick" if ticks_per_turn is not None else "in"
    for row in rows(robot):
        if row.place in AXES:
            size = 1.0 if row.name == NAMES[0] else inches[row.place]
            scaled = row._replace(value=row.value * size, std=row.std * size, unit=row.unit.replace("/m", f"/{unit}"))
            lines.append(f"public double {_name(row)} = {number(scaled.value)}; // {spread(scaled)}")
    about = java_comment(
        [
            f"{robot.name}: feed-forward gains by omnidyn, volts and {'ticks' if unit == 'tick' else 'inches'}.",
            *guess,
            note,
            *[f"Not in it: {words}" for words in omissions],
        ]
    )
    files = {"gains.java": about + "\n".join(lines) + "\n"}
    return Export("road-runner", robot.name, files, omissions, (*guess, note))


def _name(row: GainRow) -> str:
    return row.name if row.place == "x" else f"{AXIS_NAMES[row.place]}{row.name.upper()}"


def ways_per_tick(robot: Robot, ticks_per_turn: float) -> dict[str, float]:
    """How far the robot goes in a tick of its wheels, by axis: [m], [m], [rad].

    Raises UnsupportedError where wheels do not all turn alike on an axis.
    """
    turns = np.abs(robot.wheels.wrench_matrix / robot.wheels.radii)  # [rad/m, rad/m, 1]
    if (np.ptp(turns, axis=1) > ALIKE * turns.max(axis=1)).any():
        raise UnsupportedError(
            "Road Runner has one number of ticks for all wheels, and these do not turn alike",
            got=f"{robot.wheels.count} wheels at {', '.join(f'{a:g}' for a in robot.wheels.azimuth_deg)} degrees",
            expected="four mecanum wheels, or omni wheels at 45 degrees",
            remedy="leave `ticks_per_turn` out, or export gains with it: gains of each wheel, per tick",
            where="ticks_per_turn",
        )
    return dict(zip(AXES, (2.0 * math.pi / ticks_per_turn / turns[:, 0]).tolist(), strict=True))
