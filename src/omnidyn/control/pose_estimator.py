"""PoseEstimator: where a robot is now, from poses that are late and noisy and from its speeds since.

    now = a + R(heading of a - heading counted then) (counted now - counted then)      a: the pose believed of `then`
    a  += g (pose seen - pose believed of the time it was taken),   g = p/(p + s^2),   p -> (1 - g) p

`counted` adds the measured twists up. s: std of a pose, its noise and what the robot moves in the time by which its age
may differ from the mean: it waits for a step. p, the variance of what is believed, grows from one new pose to the next
by (2 u)^(4/3) s^(2/3), where u is by how far the count may have drifted meanwhile: a share of the distance, for wheels
are of a slightly other size, and of the time, for a gyroscope has a bias. With that, the error of a steady drift, u/g,
and that of the noise, s sqrt(g/2), are least together. A pose that comes again as it was is no new one. One farther off
than all that explains is of a robot that was moved: it is believed at once.

Where the file of the robot says nothing of its sensors, and the logs of its fit had late poses, poses that the same
wheels have counted are known by moving with them from the first step on: these are taken as they are.
"""

from __future__ import annotations

import math

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import kernel, machine_code, part
from omnidyn.model.log_effects import Sensors
from omnidyn.model.robot import Robot

NOISE = (1e-3, 2e-3)  # [m], [rad] std of a late pose, where nobody says
DISTANCE_DRIFT, TURN_DRIFT = 3e-3, 3e-3  # share of the distance, and of the angle turned
RIM_DRIFT = 3e-4  # [rad] times the distance over the radius of the robot: wheels that differ turn it
TIME_DRIFT, TURN_TIME_DRIFT = 1e-4, 2e-4  # [m/s], [rad/s]
LONGEST = 1.5  # steps after the one before, of which a mean of the twist is all
OUTLIER_SQUARE = 36.0  # of an innovation, in variances
MOST_ROWS, TURN, ALL_OF_IT = 2000, 2.0 * math.pi, 0.9999
SEEN, ANCHOR, THEN, TWIST, CLOCK, LAST, FIRST = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
)  # rows; LAST: the pose of the step before; FIRST: the oldest place of the last steps
KNOWN, FIRM = (SEEN, 3), 2.0  # whether a pose was seen, and one of a time since which all was counted
PLACE_VARIANCE, TURN_VARIANCE = (ANCHOR, 3), (THEN, 3)
COUNT = (TWIST, 3)  # of the places kept
TIME, DRIFT, TURN_DRIFTED, BEGUN = (CLOCK, 0), (CLOCK, 1), (CLOCK, 2), (CLOCK, 3)
KIND = (LAST, 3)  # of the poses, where that is not told
COUNTED, OLD = 1.0, 2.0  # new, late; 0: nobody knows
ALIKE, TINY = 0.05, 1e-6  # share of the way by which two counts of it may differ; [m], [rad]
(
    AGE,
    AVERAGED,
    PLACE_STD,
    TURN_STD,
    BY_DISTANCE,
    BY_TURN,
    TURN_BY_DISTANCE,
    BY_TIME,
    TURN_BY_TIME,
    WAIT_STD,
    UNSURE,
    STEP,
) = range(12)


@part
def seen_after(memory, k, dx, dy, turn):
    """A place seen from a body that has moved on by (dx, dy), then turned."""
    x, y, cos, sin = memory[k, 0] - dx, memory[k, 1] - dy, math.cos(turn), math.sin(turn)
    memory[k, 0], memory[k, 1] = cos * x + sin * y, cos * y - sin * x
    memory[k, 2] -= turn


@part
def count_on(memory, numbers, passed, state):
    """Add a step to what was counted: places of the steps before, as seen from where the robot is now."""
    share = 1.0 if numbers[AVERAGED] != 0.0 else 0.5
    x = passed * (share * state[3] + (1.0 - share) * memory[TWIST, 0])
    y = passed * (share * state[4] + (1.0 - share) * memory[TWIST, 1])
    turn = passed * (share * state[5] + (1.0 - share) * memory[TWIST, 2])
    for i in range(3):
        memory[TWIST, i] = state[3 + i]
    cos, sin = math.cos(0.5 * turn), math.sin(0.5 * turn)
    dx, dy = cos * x - sin * y, sin * x + cos * y
    count = int(memory[COUNT])
    for k in range(FIRST, FIRST + count):
        memory[k, 3] += passed
        seen_after(memory, k, dx, dy, turn)
    seen_after(memory, THEN, dx, dy, turn)
    distance = math.hypot(x, y)
    memory[DRIFT] += numbers[BY_DISTANCE] * distance + numbers[BY_TIME] * passed
    memory[TURN_DRIFTED] += (
        numbers[BY_TURN] * abs(turn) + numbers[TURN_BY_DISTANCE] * distance + numbers[TURN_BY_TIME] * passed
    )
    room = len(memory) - FIRST
    while (count == room) | ((count > 1) & (memory[FIRST + 1, 3] >= numbers[AGE])):
        for k in range(FIRST, FIRST + count - 1):
            for i in range(4):
                memory[k, i] = memory[k + 1, i]
        count -= 1
    for i in range(4):
        memory[FIRST + count, i] = 0.0
    memory[COUNT] = count + 1.0


@part
def place_then(memory, numbers, i):
    """Entry i of the place at which a pose that arrives now was taken, straight between two steps."""
    later = FIRST + 1 if memory[COUNT] > 1.0 else FIRST
    between = memory[FIRST, 3] - memory[later, 3]
    share = max((memory[FIRST, 3] - numbers[AGE]) / between, 0.0) if between > 0.0 else 0.0
    return memory[FIRST, i] + share * (memory[later, i] - memory[FIRST, i])  # at first the oldest there is


@part
def from_anchor(memory):
    """The pose now."""
    turn = memory[ANCHOR, 2] - memory[THEN, 2]
    cos, sin = math.cos(turn), math.sin(turn)
    x, y = memory[THEN, 0], memory[THEN, 1]
    return memory[ANCHOR, 0] - cos * x + sin * y, memory[ANCHOR, 1] - sin * x - cos * y, turn


@part
def gain_of(variance, drift, std, off_square, dimensions):
    """(gain, variance after it) of a new pose off by so much; a gain of 1 believes it at once."""
    noise = std * std
    variance += (2.0 * drift) ** (4.0 / 3.0) * std ** (2.0 / 3.0)
    if (noise == 0.0) | (not off_square <= dimensions * OUTLIER_SQUARE * (variance + noise)):
        return 1.0, noise
    gain = variance / (variance + noise)
    return gain, gain * noise


@part
def correct(memory, numbers, state):
    """Believe a new pose as far as its noise allows."""
    then = place_then(memory, numbers, 0), place_then(memory, numbers, 1), place_then(memory, numbers, 2)
    if memory[KNOWN] < FIRM:
        past = state[0], state[1], state[2]
        memory[PLACE_VARIANCE], memory[TURN_VARIANCE] = numbers[PLACE_STD] ** 2, numbers[TURN_STD] ** 2
    else:
        x, y, heading = from_anchor(memory)
        cos, sin = math.cos(heading), math.sin(heading)
        past = x + cos * then[0] - sin * then[1], y + sin * then[0] + cos * then[1], heading + then[2]
    off_x, off_y, off = state[0] - past[0], state[1] - past[1], state[2] - past[2]
    off -= TURN * round(off / TURN)
    speed, turning = math.hypot(memory[TWIST, 0], memory[TWIST, 1]), memory[TWIST, 2]
    std = math.hypot(numbers[PLACE_STD], numbers[WAIT_STD] * speed)
    gain, memory[PLACE_VARIANCE] = gain_of(
        memory[PLACE_VARIANCE], memory[DRIFT], std, off_x * off_x + off_y * off_y, 2.0
    )
    std = math.hypot(numbers[TURN_STD], numbers[WAIT_STD] * turning)
    turn_gain, memory[TURN_VARIANCE] = gain_of(memory[TURN_VARIANCE], memory[TURN_DRIFTED], std, off * off, 1.0)
    memory[ANCHOR, 0], memory[ANCHOR, 1] = past[0] + gain * off_x, past[1] + gain * off_y
    memory[ANCHOR, 2] = past[2] + turn_gain * off
    for i in range(3):
        memory[SEEN, i], memory[THEN, i] = state[i], then[i]
    memory[DRIFT] = memory[TURN_DRIFTED] = 0.0
    memory[KNOWN] = FIRM if memory[FIRST, 3] >= ALL_OF_IT * numbers[AGE] else 1.0  # how it moved till then is counted


@part
def tell_kind(memory, numbers, passed, pose, state):
    """Find out whether poses are counted by the same wheels, and so new: from rest they then move at once.

    pose: as it was measured, before the step is counted.
    """
    share = 1.0 if numbers[AVERAGED] != 0.0 else 0.5
    x = passed * (share * state[3] + (1.0 - share) * memory[TWIST, 0])
    y = passed * (share * state[4] + (1.0 - share) * memory[TWIST, 1])
    turn = passed * (share * state[5] + (1.0 - share) * memory[TWIST, 2])
    middle = memory[LAST, 2] + 0.5 * turn
    cos, sin = math.cos(middle), math.sin(middle)
    off = math.hypot(
        pose[0] - memory[LAST, 0] - cos * x + sin * y,
        pose[1] - memory[LAST, 1] - sin * x - cos * y,
    )
    turn_off = pose[2] - memory[LAST, 2] - turn
    turn_off -= TURN * round(turn_off / TURN)
    moved = math.hypot(x, y)
    if moved + abs(turn) > TINY:
        alike = (off <= ALIKE * moved + TINY) & (abs(turn_off) <= ALIKE * abs(turn) + TINY)
        memory[KIND] = COUNTED if alike & (memory[KIND] != OLD) else OLD


@part
def bring_up(memory, numbers, t, state):
    """Change a measured state (6,) into one with the pose at time t [s]; NaN where it holds no number."""
    for i in range(6):
        if not math.isfinite(state[i]):
            for k in range(3):
                state[k] = math.nan
            return
    passed = t - memory[TIME]
    if (memory[BEGUN] == 0.0) | (not passed > 0.0):
        for k in range(len(memory)):
            for i in range(4):
                memory[k, i] = 0.0
        passed = 0.0
    memory[TIME], memory[BEGUN] = t, 1.0
    pose = state[0], state[1], state[2]
    if (numbers[UNSURE] > 0.0) & (passed > 0.0) & (passed < LONGEST * numbers[STEP]):
        tell_kind(memory, numbers, passed, pose, state)
    for i in range(3):
        memory[LAST, i] = pose[i]
    count_on(memory, numbers, passed, state)
    is_new = memory[KNOWN] == 0.0
    for i in range(3):
        is_new = is_new or state[i] != memory[SEEN, i]
    if is_new:
        correct(memory, numbers, state)
    if memory[KIND] != COUNTED:
        state[0], state[1], state[2] = from_anchor(memory)


@kernel
def estimate_pose(memory, numbers, t, state):
    """`bring_up`, of one robot."""
    bring_up(memory, numbers, t, state)


@kernel
def estimate_each(memories, numbers, t, states):
    """The same of many. memories (n, rows, 4); states (n, 6)."""
    for k in range(len(states)):
        bring_up(memories[k], numbers, t, states[k])


def pose_estimator(
    robot: Robot, dt: float, before: PoseEstimator | None = None, noise: tuple[float, float] | None = None
) -> PoseEstimator | None:
    """That of a robot in a loop with steps of dt [s]; None where its poses are new, and nothing is said of their noise.

    before: of the same controller; where the sensors are the same its memory is kept. noise: std [m], [rad], in place
    of what the sensors say.
    """
    sensors = robot.sensor_model
    if sensors.pose_age(dt) == 0.0 and sensors.pose_noise is None and sensors.heading_noise is None:
        return None
    made = PoseEstimator(estimator_numbers(robot, dt, noise), dt)
    if before is not None and (before.numbers[:2] == made.numbers[:2]).all():
        made.memory = before.memory.copy()
    return made


def pose_noise_of(sensors: Sensors) -> tuple[float, float]:
    """Std of the noise of a pose [m], [rad]: as told, else usual ones."""
    place, heading = sensors.pose_noise, sensors.heading_noise
    return NOISE[0] if place is None else place, NOISE[1] if heading is None else heading


def estimator_numbers(robot: Robot, dt: float, noise: tuple[float, float] | None = None) -> FloatArray:
    """What an estimator knows, in the order of AGE, AVERAGED, ... Shape (12,)."""
    sensors = robot.sensor_model
    place, heading = noise or pose_noise_of(sensors)
    by_gyroscope = sensors.has_gyroscope
    turn_by_time = TURN_TIME_DRIFT + (sensors.gyro_bias or 0.0) + (sensors.gyro_noise or 0.0) * math.sqrt(dt)
    radius = float(np.max(robot.wheels.robot_radius))
    return np.array(
        [
            sensors.pose_age(dt),
            float(sensors.averaged),
            place,
            heading,
            DISTANCE_DRIFT,
            0.0 if by_gyroscope else TURN_DRIFT,
            0.0 if by_gyroscope else RIM_DRIFT / radius,
            TIME_DRIFT,
            turn_by_time,
            (dt if robot.sensors is None else sensors.pose_wait(dt)) / math.sqrt(12.0),  # a log does not say the rate
            float(robot.sensors is None),
            dt,
        ]
    )


def rows_of(age: float, dt: float) -> int:
    """How many places are kept, where steps may be half as long as they should be."""
    return min(math.ceil(2.0 * age / dt) + 2, MOST_ROWS)


class PoseEstimator:
    """That of one controller: numbers as of `estimator_numbers`, for steps of dt [s]."""

    def __init__(self, numbers: FloatArray, dt: float) -> None:
        self.numbers, self.memory = numbers, np.zeros((FIRST + rows_of(float(numbers[AGE]), dt), 4))
        self._estimate = estimate_pose

    @property
    def noise(self) -> tuple[float, float]:
        """Std of the noise of a pose that it expects [m], [rad]."""
        return float(self.numbers[PLACE_STD]), float(self.numbers[TURN_STD])

    def reset(self) -> None:
        """Forget all poses."""
        self.memory[:] = 0.0

    def estimate(self, t: float, state: FloatArray) -> None:
        """Change a state measured at t [s], shape (6,), into one with the pose of now."""
        arguments = self.memory, self.numbers, t, state
        if self._estimate is estimate_pose:
            self._estimate = machine_code(estimate_pose, *arguments)
        self._estimate(*arguments)

    def memories(self, count: int) -> FloatArray:
        """What as many robots remember before the first step. Shape (count, rows, 4)."""
        return np.zeros((count, *self.memory.shape))

    def estimate_each(self, memories: FloatArray, t: float, states: FloatArray) -> None:
        """The same of many robots, states (n, 6)."""
        estimate_each(memories, self.numbers, t, states)
