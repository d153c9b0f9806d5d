"""Cost and stages of the program of one step: where the path goes, what that asks of the wheels, how a robot moves."""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.control.mpc.columns import PULL, WAY, WEIGHT
from omnidyn.control.mpc.linear_motion import STANDSTILL
from omnidyn.control.mpc.model import DECAY, FEED, TURNING
from omnidyn.control.mpc.observer import PUSH, SCALE
from omnidyn.control.mpc.small import matrix, minus, mv, plus, put3, vector
from omnidyn.control.mpc.stages import frame_at, friction_at, linear_stage

POSE_WEIGHT, TWIST_WEIGHT, LAST_WEIGHT, AGAIN, LEARN = 0, 3, 6, 7, 8  # entries of `settings`
SLEW, CURRENT, SPEED, SPEED_WEIGHT = 9, 10, 11, 14  # limits: V a step, whether, [m/s], cost
AVERAGED, SETTINGS_SIZE = 15, 16  # whether measured speeds are means over the step before
ARRIVED = (1.5e-5, 1.5e-5, 1e-4)  # [m, m, rad] from the path, where nothing more has to be overcome
HOME = (30.0, 30.0, 60.0)  # [1/s] speed of the way back per distance, for the direction of friction


@part
def homeward(preview, row, add, x, k):
    """The way from the pose predicted at step k to the path, in the body frame, as a speed [m/s, m/s, rad/s]."""
    cos, sin = math.cos(x[k, 2]), math.sin(x[k, 2])
    dx, dy = preview[row, 0] - x[k, 0], preview[row, 1] - x[k, 1]
    east, north, turn = cos * dx + sin * dy, cos * dy - sin * dx, preview[row, 2] + add - x[k, 2]
    east -= min(max(east, -ARRIVED[0]), ARRIVED[0])
    north -= min(max(north, -ARRIVED[1]), ARRIVED[1])
    return HOME[0] * east, HOME[1] * north, HOME[2] * (turn - min(max(turn, -ARRIVED[2]), ARRIVED[2]))


@part
def make_costs(numbers, settings, estimate, program, preview, start, add):
    """Costs of all steps and the inputs that the reference asks for, friction and push included."""
    linear, levels, pull = numbers.linear, numbers.levels, numbers.pull
    stage, bounds = program.stage, program.bounds
    n = len(stage)
    scale, push = estimate[SCALE], vector(estimate, PUSH, 0)
    feed, decay = matrix(linear, 0, FEED), matrix(linear, 0, DECAY)
    for k in range(n):
        row = start + k
        factor = settings[LAST_WEIGHT] if k == n - 1 else 1.0
        for i in range(6):
            weight = factor * settings[i]
            goal = preview[row + 1, i] + (add if i == 2 else 0.0)
            stage[k, WEIGHT + i], stage[k, PULL + i] = weight, -weight * goal
        now, then = vector(preview, row, 3), vector(preview, row + 1, 3)
        middle = 0.5 * (now[0] + then[0]), 0.5 * (now[1] + then[1]), 0.5 * (now[2] + then[2])
        velocity = homeward(preview, row, add, program.x, k)
        put3(stage, k, WAY, velocity)
        velocity = plus(middle, velocity)
        drive = plus(mv(feed, minus(then, mv(decay, now))), friction_at(linear, levels, scale, velocity, 1.0, False)[0])
        drive = minus(drive, push)
        if linear[0, TURNING] != 0.0:
            drive = minus(drive, frame_at(linear, middle)[0])
        for i in range(pull.shape[0]):
            volts = pull[i, 0] * drive[0] + pull[i, 1] * drive[1] + pull[i, 2] * drive[2]
            program.wanted[k, i] = min(max(volts, bounds[0, k, i]), bounds[1, k, i])


@part
def make_stages(numbers, estimate, program):
    """All steps along the motion predicted in x of a program.

    What is predicted to rest meets friction against the way back to the path: it has to be overcome to go there.
    """
    linear, levels, stage, x = numbers.linear, numbers.levels, program.stage, program.x
    push = vector(estimate, PUSH, 0)
    for k in range(len(stage)):
        end, velocity = vector(x, k + 1, 3), vector(stage, k, WAY)
        sense = (
            end[0] + min(max(velocity[0], -STANDSTILL[0]), STANDSTILL[0]),
            end[1] + min(max(velocity[1], -STANDSTILL[1]), STANDSTILL[1]),
            end[2] + min(max(velocity[2], -STANDSTILL[2]), STANDSTILL[2]),
        )
        friction = friction_at(linear, levels, estimate[SCALE], sense, 1.0, True)
        linear_stage(linear, friction, push, stage, k, x[k, 2], vector(x, k, 3), end)
