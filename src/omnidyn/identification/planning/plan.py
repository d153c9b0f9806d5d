"""plan: a program of moves for a robot, and how well each of its numbers will be known after it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from omnidyn.arguments import check_order, is_number
from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError, InsufficientDataError, UnsupportedError
from omnidyn.identification.methods import OutputError
from omnidyn.identification.planning.information import Prediction, information_of, told_by
from omnidyn.identification.planning.moves import FORWARD, RAMP, SIDEWAYS, STEP, TURN, PlannedMove, all_moves
from omnidyn.identification.planning.planned import Plan, Predicted
from omnidyn.identification.planning.recorded import Noise, driven, noise_of, recorded
from omnidyn.identification.planning.search import (
    UNKNOWN,
    Score,
    TriedMove,
    chosen,
    geometric_mean,
    of_number,
    tried,
)
from omnidyn.model.drive import DUTY, SPEED
from omnidyn.model.keys import expand, friction_keys
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress, Report, silent
from omnidyn.run import Run
from omnidyn.simulation.batch.sample import sample

DRAWS, GUESS = 10, (0.7, 1.3)  # robots that may be meant; share of a number of which nothing is known
ROOM_SHARE = 0.8  # of the way to the border: what a plan uses of it
HELD_OUT_SHARE = 0.15  # of the time: a second program, to judge the fit by
SEARCHES, SEARCHES_OF_REST = 8, 24  # plans that are compared whole
BEGUN_SHARE = 0.6  # of a ramp: one that was driven so far is not begun anew
KEPT = 0.6  # of the moves: what each of them may choose from
SMALLER = 0.8  # of the reach of a move, where a whole plan left the room
ATTEMPTS = 4  # at a plan that stays inside
SMALLEST_ROOM, LARGEST_ROOM = 0.1, 1000.0  # [m]
SHORTEST, LONGEST = 20.0, 3600.0  # [s]
SLOWEST, FASTEST = 5.0, 1000.0  # [Hz]
DOUBTED = ("gain", "dead_band")  # what a fit may need beside the numbers of the file: moves must tell that apart too
SEED = 0  # of the robots and of the noise
REST = 1.0  # [s] before the first move


def plan(
    robot: Robot,
    area: Sequence[float] = (3.0, 3.0),
    seconds: float = 60.0,
    *,
    free: Sequence[str] | None = None,
    aim: str = "",
    noise: Mapping[str, Any] | None = None,
    rate: float = 100.0,
    progress: Progress = silent,
) -> Plan:
    """Which minute of driving tells most about a robot, and how much that is.

    Moves from rest to rest, each followed by its mirror image, inside a room; first slow ramps, then those
    that tell most for their time. What is predicted is what `identify` would say of a log of it: the fit's own problem,
    at robots that may be meant, in the middle and at the worst of ten. The numbers that the fit may add by itself, such
    as a latency, are not counted.

    Args:
        robot: What is known now. Robots that may be meant are drawn by the std in its file, else 30 % off.
        area: Free floor along x and y [m]; the robot begins in the middle, along x.
        seconds: Of all of it, with the part that is held out [s].
        free: What is to be learnt, by keys of the robot file; default: as `identify`.
        aim: One of these numbers, to learn it best; default: the geometric mean of all standard errors.
        noise: Channel (wheel_angle, wheel_speed, current, twist, pose) -> std of what is recorded, one number or one
            per component; of wheel_angle the step of a count [rad]. Default: by the [sensors] of the robot file, counts
            and poses; where it says nothing of counts, wheel speeds that are differences of 2048 a turn.
        rate: Of commands and of the log [Hz].
        progress: Hears what is done.

    Raises InputError for a room, a time or a noise that cannot be, and for an aim that is not free; UnsupportedError
    for a robot whose firmware holds the speeds of its wheels; InsufficientDataError where no move fits into the room.

    >>> import omnidyn
    >>> made = omnidyn.plan(omnidyn.load_robot("axebot"), (3.0, 3.0), 30.0, noise={"twist": (0.02, 0.02, 0.1)})
    >>> max(made.reach) < 1.5, len(made.learnt)
    (True, 6)
    """
    check_order("plan(robot, area, seconds)", (robot, Robot), (area, object), (seconds, object))
    width, depth = _room(area)
    _check("seconds", seconds, SHORTEST, LONGEST, "s")
    _check("rate", rate, SLOWEST, FASTEST, "Hz")
    if robot.drive.kind == SPEED:
        raise UnsupportedError(
            "a firmware holds the speeds of the wheels: no plan is made for its set points",
            got=robot.name,
            expected="a robot that takes volts or duties",
            remedy="plan for the same robot without [drive] kind = speed, if its motors can be driven directly",
        )
    dt = 1.0 / rate
    planner = _Planner(robot, _robots(robot), dt, noise_of(robot, dt, noise), _question(robot, free))
    return planner.planned((width, depth), seconds, aim, progress)


def plan_rest(
    robot: Robot,
    driven: FloatArray,
    seconds: float,
    area: Sequence[float] = (3.0, 3.0),
    *,
    promised: Mapping[str, float],
    noise: Mapping[str, Any] | None = None,
    rate: float = 100.0,
    progress: Progress = silent,
) -> Plan:
    """The rest of a plan whose drive was ended: what was driven counts, and what is left of the time is planned anew.

    Args:
        robot: As for `plan`.
        driven: The input of what was driven and recorded, in rows of the plan, as share of the largest input.
            Shape (rows, wheels).
        seconds: That are left [s], for the program alone.
        promised: Key -> half of the interval that the plan promised, as a share; all of them are to be reached.
        area, noise, rate, progress: As for `plan`.

    What it promises is for the logs of both drives together. Raises as `plan`.
    """
    width, depth = _room(area)
    dt = 1.0 / rate
    planner = _Planner(
        robot, _robots(robot), dt, noise_of(robot, dt, noise), _question(robot, tuple(promised)), driven, promised
    )
    return planner.that_tells().planned((width, depth), seconds / (1.0 - HELD_OUT_SHARE), "", progress)


@dataclass(frozen=True, eq=False)
class _Programs:
    """The rows of both programs, and the moves of the first."""

    share: FloatArray
    held_out: FloatArray
    moves: tuple[tuple[float, PlannedMove], ...]


@dataclass(frozen=True, eq=False)
class _Planner:
    """What moves do with a robot, and with others that may be meant, and what they tell."""

    robot: Robot
    robots: Sequence[Robot]
    dt: float
    noise: Noise
    question: OutputError
    driven: FloatArray | None = None  # and recorded already, as share of the largest input
    promised: Mapping[str, float] = field(default_factory=dict)  # half the interval of each number, as a share of it

    def planned(self, area: tuple[float, float], seconds: float, aim: str, progress: Progress) -> Plan:
        """A plan that stays inside the room, in so many seconds with the part that is held out."""
        width, depth = area
        border = ROOM_SHARE * 0.5 * min(width, depth)
        progress(Report("trying moves"))
        moves = self.tried()
        for _ in range(ATTEMPTS):
            fitting = [one for one in moves if one.reach <= border and one.moved]
            try:
                made = self.search(fitting, seconds, aim, progress)
            except InsufficientDataError:  # nothing that fits moves it so far that its sensors see it
                break
            progress(Report("driving it with robots that may be meant"))
            reach = self.reach((made.share, made.held_out))
            if reach[0] < 0.5 * width and reach[1] < 0.5 * depth:
                return self.predicted(made, area, reach)
            border *= SMALLER
        raise InsufficientDataError(
            "no plan moves the robot visibly and stays inside the room, for all robots that may be meant",
            got=f"{width:g} m x {depth:g} m",
            expected="a larger room, or a robot that is known better",
            remedy="drive it by hand for a minute, slowly and both ways along each axis, and plan for what identify "
            "makes of that log",
            where="area",
        )

    def that_tells(self) -> _Planner:
        """The same without what was driven, where that tells nothing: it had hardly begun."""
        if self.driven is None:
            return self
        try:
            told_by([self._recorded(self.robot, self.driven, np.random.default_rng(SEED))], self.robot, self.question)
        except InsufficientDataError:
            return replace(self, driven=None)
        return self

    def tried(self) -> list[TriedMove]:
        """All moves that end at rest, with the one that goes farthest of the robots beside that of the file."""
        probe = PlannedMove(FORWARD, STEP, 1.0, 1.2)
        distance = [_farthest(driven(robot, probe.input(robot, self.dt), self.dt)) for robot in self.robots]
        ends = [self.robot, self.robots[int(np.argmax(distance))], self.robots[int(np.argmin(distance))]]
        return [found for move in all_moves() if (found := tried(move, ends, self.dt)) is not None]

    def search(self, moves: Sequence[TriedMove], seconds: float, aim: str, progress: Progress) -> _Programs:
        """The best of a few plans from these moves, each from a part of them, compared whole."""
        opening = self._left_of(_opening(moves))
        candidates = [one.move for one in moves]
        rng = np.random.default_rng(SEED)
        runs = [self._recorded(self.robot, move.both(self.robot, self.dt), rng) for move in candidates]
        asked = replace(self.question, nuisances=DOUBTED)
        names, information = information_of(runs, self.robot, asked)
        score = self._score(names, aim)
        begun = information[[candidates.index(move) for move in opening]].sum(axis=0)
        if self.driven is not None:
            told_names, more = information_of([self._recorded(self.robot, self.driven, rng)], self.robot, asked)
            places = [names.index(name) for name in told_names]  # a short drive tells nothing of some
            begun[np.ix_(places, places)] += more[0]
        time = (1.0 - HELD_OUT_SHARE) * seconds - REST - sum(move.duration for move in opening)
        best, best_score = None, math.inf
        count = SEARCHES_OF_REST if self.promised else SEARCHES
        for k in range(count):
            progress(Report("choosing moves", k, count))
            kept = np.flatnonzero(rng.random(len(candidates)) < KEPT) if k else np.arange(len(candidates))
            order = [int(kept[i]) for i in chosen([candidates[j] for j in kept], information[kept], time, score, begun)]
            made = self._programs(opening, [candidates[j] for j in order], seconds)
            question = self.question if self.promised else asked  # a promise is without doubts
            predictions = told_by(self._logs(self.robot, made.share, rng), self.robot, question)
            of_plan = _beside(predictions, self.promised) if self.promised else _of(predictions, aim)
            if best is None or of_plan < best_score:
                best, best_score = made, of_plan
        assert best is not None
        return best

    def _score(self, names: tuple[str, ...], aim: str) -> Score:
        if not aim:
            return geometric_mean
        free = [name for name in names if name not in DOUBTED]
        if aim not in free:
            raise InputError("not a number that is free", got=aim, expected=", ".join(free), where="aim")
        return of_number(names.index(aim))

    def _programs(self, opening: Sequence[PlannedMove], moves: Sequence[PlannedMove], seconds: float) -> _Programs:
        """The rows of a plan. Held out: a step from rest along each axis, then its moves once more, other side first,
        as many as there is time for."""
        program = [*opening, *moves]
        rows = [move.both(self.robot, self.dt) for move in program]
        starts = REST + self.dt * np.cumsum([0, *(len(row) for row in rows)])
        rest = np.zeros((round(REST / self.dt), self.robot.wheels.count))
        remaining, held_out = max(HELD_OUT_SHARE * seconds - REST, min(move.duration for move in program)), [rest]
        for move in dict.fromkeys(reversed(program)):
            if move.duration <= remaining:
                held_out.append(-move.both(self.robot, self.dt))
                remaining -= move.duration
        moved = tuple((float(start), move) for start, move in zip(starts[:-1], program, strict=True))
        return _Programs(np.concatenate([rest, *rows]), np.concatenate(held_out), moved)

    def reach(self, programs: Sequence[FloatArray]) -> tuple[float, float]:
        """How far the robots go along x and along y at most [m]: one program after the other, from the middle each."""
        runs = [driven(robot, share, self.dt) for robot in self.robots for share in programs]
        places = np.abs(np.concatenate([np.asarray(run.pose)[:, :2] for run in runs]))
        return float(places[:, 0].max()), float(places[:, 1].max())

    def predicted(self, made: _Programs, area: tuple[float, float], reach: tuple[float, float]) -> Plan:
        """The plan, with what the fit would say of its log for each robot that may be meant."""
        rng = np.random.default_rng(SEED)
        predictions = [told_by(self._logs(robot, made.share, rng), robot, self.question) for robot in self.robots]
        values = told_by(self._logs(self.robot, made.share, rng), self.robot, self.question, cures=True)
        halves = {name: 2.0 * np.array([one.of(name) for one in predictions]) for name in values.names}
        predicted = {
            name: Predicted(float(value), float(np.median(halves[name])), float(halves[name].max()))
            for name, value in zip(values.names, values.value, strict=True)
        }
        is_duty = self.robot.drive.kind == DUTY
        limit = np.ones(1) if is_duty else np.broadcast_to(self.robot.motor.voltage_limit, self.robot.wheels.count)
        unit = DUTY if is_duty else "V"
        return Plan(
            self.robot,
            self.dt,
            made.share,
            made.held_out,
            unit,
            limit,
            made.moves,
            area,
            reach,
            predicted,
            self.noise,
            len(self.robots),
            values.blind,
        )

    def _left_of(self, opening: list[PlannedMove]) -> list[PlannedMove]:
        """What of the opening was not driven yet, or only a little."""
        durations = np.array([move.duration for move in opening])
        enough = REST + np.cumsum(durations) - (1.0 - BEGUN_SHARE) * durations
        seconds = 0.0 if self.driven is None else len(self.driven) * self.dt
        return [move for move, end in zip(opening, enough.tolist(), strict=True) if end > seconds]

    def _logs(self, robot: Robot, share: FloatArray, rng: np.random.Generator) -> list[Run]:
        """The log of a program, and that of what was driven before."""
        return [self._recorded(robot, rows, rng) for rows in (share, self.driven) if rows is not None]

    def _recorded(self, robot: Robot, share: FloatArray, rng: np.random.Generator) -> Any:
        return recorded(robot, share, self.dt, self.noise, rng)


def _of(predictions: Prediction, aim: str) -> float:
    """The score of a whole plan: less is better."""
    names = (aim,) if aim else predictions.names
    return float(np.mean([math.log(min(predictions.of(name), UNKNOWN)) for name in names]))


def _beside(predictions: Prediction, promised: Mapping[str, float]) -> float:
    """How far the widest interval is beyond what was promised: less is better."""
    return max(predictions.of(name) / min(half, UNKNOWN) for name, half in promised.items())


def _opening(moves: Sequence[TriedMove]) -> list[PlannedMove]:
    """Slow ramps through the dead zone, the least that move it: a spin first, which needs no room, then x and y."""
    opening = []
    for direction in (TURN, FORWARD, SIDEWAYS):
        fitting = [one.move for one in moves if one.move.direction == direction and one.move.shape == RAMP]
        longest = max((move.seconds for move in fitting), default=0.0)
        opening += sorted((move for move in fitting if move.seconds == longest), key=lambda move: move.level)[:1]
    return opening


def _robots(robot: Robot) -> list[Robot]:
    """Robots that may be meant: by the std of the file, else with friction and torque up to 30 % off."""
    try:
        return list(sample(robot, DRAWS, SEED))
    except InsufficientDataError:
        keys = [*friction_keys(robot), "motor.resistance_ohm"]
        return list(sample(robot, DRAWS, SEED, factors=dict.fromkeys(keys, GUESS)))


def _question(robot: Robot, free: Sequence[str] | None) -> OutputError:
    keys = None if free is None else tuple(key for name in free for key in map(str, expand(name, robot)))
    return OutputError(free=keys, nuisances=())


def _farthest(run: Run) -> float:
    return float(np.hypot(*np.asarray(run.pose)[:, :2].T).max())


def _room(area: object) -> tuple[float, float]:
    sizes = tuple(area) if isinstance(area, Sequence | np.ndarray) and not isinstance(area, str) else ()
    if len(sizes) != 2 or not all(is_number(size) and SMALLEST_ROOM <= size <= LARGEST_ROOM for size in sizes):
        expected = f"(x, y) in m, {SMALLEST_ROOM:g} to {LARGEST_ROOM:g} each"
        raise InputError("not the size of a room", got=area, expected=expected, where="area")
    return float(sizes[0]), float(sizes[1])


def _check(name: str, value: object, least: float, most: float, unit: str) -> None:
    if not is_number(value) or not least <= value <= most:  # type: ignore[operator]
        raise InputError("out of range", got=value, expected=f"{least:g} to {most:g} {unit}", where=name)
