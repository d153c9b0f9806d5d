"""Claims on the steady runs of Table 1, against the parameters of Table 3 and against themselves."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.deadzone import breakaway_voltage, moving_axes
from omnidyn.model.dynamics import drive_wrench
from omnidyn.model.frames import AXES
from omnidyn.model.keys import Key
from omnidyn.model.motor import no_load_speed
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.paper.claim import TOLERANCE, Claim, judge, listed, plain, same
from omnidyn.paper.steady import (
    model_speed,
    pattern_of,
    printed_force,
    printed_speed,
    printed_twist,
    printed_voltage,
    rms,
)
from omnidyn.paper.tables import (
    FORCE_UNIT,
    PAPER_AXES,
    SPEED_UNIT,
    TABLE_3,
)


def speed_claims(robot: Robot) -> tuple[Claim, ...]:
    """The claims of this file."""
    per_axis = [claim(robot, axis) for claim in (_steady_speed, _rest_row, _force) for axis in AXES]
    return (_preset(robot), *per_axis, _no_load(robot))


def _preset(robot: Robot) -> Claim:
    ours = {key: Key.parse(key).get(robot) for key in TABLE_3}
    different = [key for key, value in TABLE_3.items() if ours[key] != value]
    return Claim(
        key="table-3",
        place="Table 3",
        statement="The parameters of the robot.",
        printed=f"{len(TABLE_3)} numbers",
        ours=f"{len(TABLE_3) - len(different)} the same in the preset {robot.name}",
        verdict=judge(not different),
        why=f"{len(different)} differ{': ' + ', '.join(different) if different else ''}. i_max of (12) has no value "
        "there.",
        numbers=plain(**{key.replace(".", "_"): value for key, value in ours.items()}),
    )


def _steady_speed(robot: Robot, axis: str) -> Claim:
    ours, printed = model_speed(robot, axis)[1:], printed_speed(axis)[1:]
    off = ours / printed - 1.0
    levels = np.abs(printed_voltage(axis)).max(axis=1)[1:]
    return Claim(
        key=f"steady-speed-{axis}",
        place="Table 1, Table 3",
        statement=f"The model of Table 3 reaches the steady speeds {PAPER_AXES[axis]} of Table 1.",
        printed=f"{listed(printed)} {SPEED_UNIT[axis]} at {listed(levels)} V",
        ours=f"{listed(ours)} {SPEED_UNIT[axis]}",
        verdict=judge(bool(same(ours, printed).all())),
        why=f"The model is off by {listed(100 * off, '+.1f')} %; rmse {rms(ours - printed):.3f} {SPEED_UNIT[axis]} "
        "over the moving rows.",
        numbers=plain(voltage=levels, measured=printed, model=ours, relative_error=off, rmse=rms(ours - printed)),
    )


def _rest_row(robot: Robot, axis: str) -> Claim:
    voltage = printed_voltage(axis)[0]
    moving = bool(moving_axes(robot, voltage)[AXES.index(axis)])
    speed, breakaway = model_speed(robot, axis)[0], float(breakaway_voltage(robot, pattern_of(axis)))
    level = float(np.abs(voltage).max())
    return Claim(
        key=f"at-rest-{axis}",
        place="Table 1, Table 3",
        statement=f"The robot does not move in {PAPER_AXES[axis]} under {level:g} V.",
        printed="0",
        ours=f"{speed:.3f} {SPEED_UNIT[axis]}",
        verdict=judge(not moving),
        why=f"The model of Table 3 starts to move at {breakaway:.3f} V already.",
        numbers=plain(voltage=level, speed=speed, breakaway_voltage=breakaway),
    )


def _force(robot: Robot, axis: str) -> Claim:
    """Table 1 against itself: force from its voltage and speed by (11), beside its printed force."""
    column, printed = AXES.index(axis), printed_force(axis)
    ours = drive_wrench(robot, printed_twist(axis), printed_voltage(axis))[:, column]
    resistance = float(np.mean(robot.motor.resistance)) * ours[0] / printed[0]  # at rest i = u/R
    drop = float(np.abs(printed_voltage(axis)[0]).max()) * (1.0 - printed[0] / ours[0])
    agreeing = int(same(ours, printed).sum())
    return Claim(
        key=f"force-{axis}",
        place="Table 1, eq (11)",
        statement=f"Voltage, speed and force of Table 1 along {PAPER_AXES[axis]} belong to one motor.",
        printed=f"{listed(printed)} {FORCE_UNIT[axis]}",
        ours=f"{listed(ours)} {FORCE_UNIT[axis]} from voltage and speed",
        verdict=judge(agreeing == len(ours)),
        why=f"{agreeing} of {len(ours)} rows agree within {100 * TOLERANCE:g} %. At rest the current is u/R: the "
        f"printed force implies R = {resistance:.2f} ohm where Table 3 prints {np.mean(robot.motor.resistance):g}, or "
        f"{drop:.2f} V lost of the largest voltage.",
        numbers=plain(
            printed=printed, ours=ours, implied_resistance=resistance, implied_drop=drop, rows_that_agree=agreeing
        ),
    )


def no_load_turning(robot: Robot, voltage: FloatArray) -> FloatArray:
    """Turning speed at which unloaded motors would spin the robot [rad/s]. `voltage` [V], equal on all wheels."""
    per_turn = wheel_speed(robot.wheels, [0.0, 0.0, 1.0])
    return (no_load_speed(robot.motor, voltage) / per_turn).min(axis=-1)


def _no_load(robot: Robot) -> Claim:
    highest, printed = no_load_turning(robot, printed_voltage("yaw"))[1:], printed_speed("yaw")[1:]
    over = printed / highest - 1.0
    return Claim(
        key="no-load",
        place="Table 1, Table 3",
        statement="Motor, gear and radii of Table 3 can turn the robot as fast as Table 1 says.",
        printed=f"{listed(printed)} rad/s",
        ours=f"at most {listed(highest)} rad/s without any load",
        verdict=judge(bool((over < 0.0).all())),
        why=f"The printed speeds are {listed(100 * over, '.1f')} % above what the motor reaches without friction: r, "
        "b, the gear ratio, K_v or the voltages are not those of the robot that was measured.",
        numbers=plain(measured=printed, no_load=highest, excess=over),
    )
