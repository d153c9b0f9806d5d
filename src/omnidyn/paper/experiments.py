"""The experiments behind Table 1, Table 4 and Figs. 2, 4 and 5, simulated: data for the figures, nothing drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.deadzone import breakaway_voltage
from omnidyn.model.frames import AXES
from omnidyn.model.robot import Robot
from omnidyn.paper.steady import measured_speed, pattern_of, settled_speed
from omnidyn.paper.tables import DEAD_ZONE_TEXT, TABLE_1, TABLE_4, Three
from omnidyn.paper.voltage_programs import ramp, steps
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

STEP_SECONDS, DT = 1.5, 1e-3  # ten time constants of the paper's robot
RAMP_SECONDS, RAMP_PEAK = 10.0, 1.5  # the ramp ends at RAMP_PEAK times the printed dead zone


@dataclass(frozen=True)
class StepResponse:
    """One step of Table 4 from rest.

    axis: x, y or yaw. level: the largest of the three voltages [V]. voltage: of the motors [V], shape (3,).
    run: the simulated response; its channel `twist` has the axis in column AXES.index(axis).
    settled_speed: where it ends in the model [m/s, yaw rad/s].
    measured_speed: what Table 1 prints for the same voltages [m/s, yaw rad/s], None where it has no such row.
    """

    axis: str
    level: float
    voltage: Three
    run: Run
    measured_speed: float | None
    settled_speed: float


@dataclass(frozen=True)
class Ramp:
    """A slow rise of the voltage along one axis, Fig. 5.

    pattern: voltage of the motors per volt of scale, shape (3,). scale: the rising scale [V], shape (samples,), as long
    as the run. run: the simulated ramp. breakaway_voltage: scale at which the model starts to move [V].
    printed_voltage: what section 4 says about [V].
    """

    axis: str
    pattern: Three
    scale: FloatArray
    run: Run
    breakaway_voltage: float
    printed_voltage: float


def table1_runs(robot: Robot) -> dict[str, list[Run]]:
    """The twelve steady experiments of Table 1 as simulated runs from rest, by axis, in the order of the rows.

    Each has voltage, current, wheel_speed, twist and pose; those of the axis x are Fig. 2.
    """
    return {axis: [_step(robot, row.voltage) for row in TABLE_1[axis]] for axis in AXES}


def step_responses(robot: Robot) -> dict[str, list[StepResponse]]:
    """The nine steps of Table 4, simulated, by axis; with the speeds of Table 1 where the voltages agree (Fig. 4)."""
    return {axis: [_step_response(robot, axis, voltage) for voltage in TABLE_4[axis]] for axis in AXES}


def dead_zone_ramps(robot: Robot) -> dict[str, Ramp]:
    """A slow voltage ramp along each axis, through the dead zone and out of it, simulated (Fig. 5)."""
    return {axis: _ramp(robot, axis, np.array(pattern_of(axis))) for axis in AXES}


def _step(robot: Robot, voltage: Three) -> Run:
    return simulate(robot, steps([voltage], STEP_SECONDS, DT), DT)


def _step_response(robot: Robot, axis: str, voltage: Three) -> StepResponse:
    return StepResponse(
        axis=axis,
        level=max(abs(volt) for volt in voltage),
        voltage=voltage,
        run=_step(robot, voltage),
        measured_speed=measured_speed(axis, voltage),
        settled_speed=settled_speed(robot, axis, voltage),
    )


def _ramp(robot: Robot, axis: str, pattern: FloatArray) -> Ramp:
    peak = RAMP_PEAK * DEAD_ZONE_TEXT[axis]
    scale = ramp([1.0], peak, RAMP_SECONDS, DT)
    run = simulate(robot, scale * pattern, DT)
    padded_scale = np.append(scale, scale[-1])  # a run repeats its last input row
    padded_scale.flags.writeable = False
    return Ramp(
        axis=axis,
        pattern=pattern_of(axis),
        scale=padded_scale,
        run=run,
        breakaway_voltage=float(breakaway_voltage(robot, pattern)),
        printed_voltage=DEAD_ZONE_TEXT[axis],
    )
