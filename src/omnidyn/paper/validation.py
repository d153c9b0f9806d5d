"""Claims on the validation in section 4: Table 4, Figs. 2, 4 and 5, the dead zones."""

from __future__ import annotations

import numpy as np

from omnidyn.model.deadzone import breakaway_voltage, moving_axes
from omnidyn.model.frames import AXES
from omnidyn.model.robot import Robot
from omnidyn.paper.claim import TOLERANCE, Claim, ClaimVerdict, judge, listed, plain, same
from omnidyn.paper.steady import measured_speed, pattern_of, printed_voltage, settled_speed
from omnidyn.paper.tables import DEAD_ZONE_TEXT, FIG_2_SPEED, FIG_2_VOLTAGE, PAPER_AXES, TABLE_4


def validation_claims(robot: Robot) -> tuple[Claim, ...]:
    """The claims of this file."""
    dead_zones = [_dead_zone(robot, axis) for axis in AXES]
    return (_table_4(robot), _fig_2(robot), _fig_4(robot), *dead_zones, _other_figures())


def _table_4(robot: Robot) -> Claim:
    volts = np.array([row for axis in AXES for row in TABLE_4[axis]])
    moving = moving_axes(robot, volts)
    single_axis = bool((moving.sum(axis=1) == 1).all())
    inside = bool(np.abs(volts).max() <= np.min(robot.motor.voltage_limit))
    speeds = {axis: [settled_speed(robot, axis, row) for row in TABLE_4[axis]] for axis in AXES}
    return Claim(
        key="table-4",
        place="Table 4",
        statement="Nine voltage steps, each along one axis.",
        printed="2, 3 and 4 V on each axis",
        ours=f"{int(moving.any(axis=1).sum())} of {len(volts)} move the robot, each along one axis",
        verdict=judge(single_axis and inside),
        why=f"The largest is {np.abs(volts).max():g} V, the limit {np.max(robot.motor.voltage_limit):g} V. They "
        f"settle at v {listed(speeds['x'])}, v_n {listed(speeds['y'])} m/s and w {listed(speeds['yaw'])} rad/s.",
        numbers=plain(**speeds),
    )


def _fig_2(robot: Robot) -> Claim:
    voltage = FIG_2_VOLTAGE * np.array(pattern_of("x"))
    ours = settled_speed(robot, "x", voltage)
    off = ours / FIG_2_SPEED - 1.0
    return Claim(
        key="fig-2",
        place="Fig. 2",
        statement=f"{FIG_2_VOLTAGE:g} V give about {FIG_2_SPEED:g} m/s.",
        printed=f"{FIG_2_SPEED:g} m/s",
        ours=f"{ours:.3f} m/s",
        verdict=judge(bool(same(ours, FIG_2_SPEED))),
        why=f"The model is {100 * off:+.1f} % off. The traces of Fig. 2 are not in the text we have.",
        numbers=plain(printed=FIG_2_SPEED, ours=ours, relative_error=off),
    )


def _fig_4(robot: Robot) -> Claim:
    pairs = [
        (settled_speed(robot, axis, row), speed)
        for axis in AXES
        for row in TABLE_4[axis]
        if (speed := measured_speed(axis, row)) is not None
    ]
    ours, measured = np.array(pairs).T
    steps = sum(len(TABLE_4[axis]) for axis in AXES)
    off = ours / measured - 1.0
    agreeing = int(same(ours, measured).sum())
    return Claim(
        key="fig-4",
        place="Fig. 4",
        statement="The model follows the robot through the nine steps of Table 4.",
        printed="curves, not in the text we have",
        ours=f"{agreeing} of {len(off)} speeds within {100 * TOLERANCE:g} %",
        verdict=judge(agreeing == steps),
        why=f"Table 1 has the same voltages for {len(off)} of the {steps} steps. There the model settles "
        f"{listed(100 * off, '+.0f')} % off. How the robot got there was not printed as numbers.",
        numbers=plain(model=ours, measured=measured, relative_error=off),
    )


def _dead_zone(robot: Robot, axis: str) -> Claim:
    ours, text = float(breakaway_voltage(robot, pattern_of(axis))), DEAD_ZONE_TEXT[axis]
    largest_at_rest = float(np.abs(printed_voltage(axis)[0]).max())
    return Claim(
        key=f"dead-zone-{axis}",
        place="section 4, Fig. 5",
        statement=f"The dead zone of {PAPER_AXES[axis]} is about {text:g} V.",
        printed=f"about {text:g} V",
        ours=f"{ours:.3f} V",
        verdict=judge(bool(same(ours, text))),
        why=f"C of Table 2 and the motor of Table 3 give {100 * ours / text:.0f} % of it. Table 1 shows the robot at "
        f"rest at {largest_at_rest:g} V, {'more' if largest_at_rest > text else 'less'} than the text says.",
        numbers=plain(printed=text, ours=ours, at_rest_in_table_1=largest_at_rest),
    )


def _other_figures() -> Claim:
    return Claim(
        key="figs-1-3",
        place="Figs. 1, 3",
        statement="Figures without a number in the text we have.",
        printed="not in the text we have",
        ours="none",
        verdict=ClaimVerdict.NOT_IN_TEXT,
        why="We work from the text of the paper: of these figures it holds neither data nor numbers.",
    )
