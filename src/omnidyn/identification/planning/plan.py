"""plan: a program of moves for a robot, and how well each of its numbers will be known after it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from omnidyn.arguments import check_order, is_number
from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.problem.nuisances import PUSH, TILT
from omnidyn.identification.planning.aims import NEXT, PlanAim, aim_of, fitted_keys, known_of, without_priors
from omnidyn.identification.planning.information import Prediction, information_of, told_by
from omnidyn.identification.planning.limits import GRIP, PlanLimits, limits_of
from omnidyn.identification.planning.moves import FORWARD, RAMP, SIDEWAYS, STEP, TURN, PlannedMove, all_moves
from omnidyn.identification.planning.planned import UNITS, Plan, Predicted
from omnidyn.identification.planning.recorded import Noise, driven, largest_input, noise_of, recorded
from omnidyn.identification.planning.search import ROOM, UNKNOWN, TriedMove, chosen, fitting, tried
from omnidyn.model.keys import COULOMB, Key, expand, find_key, friction_keys, with_priors
from omnidyn.model.known.told import numbers_told
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress, Report, silent
from omnidyn.run import Run
from omnidyn.simulation.batch.sample import sample

FACTOR = 0.49  # std of a guessed Coulomb friction, as a share of it: less than half, which makes it a factor
DRAWS, GUESS = 10, (0.7, 1.3)  # robots that may be meant; share of a number of which nothing is known
ROOM_SHARE = 0.8  # of the way to the border: what a plan uses of it
HELD_OUT_SHARE = 0.15  # of the time: a second program, to judge the fit by
SEARCHES = 8  # plans that are compared whole
KEPT = 0.6  # of the moves: what each of them may choose from
SMALLER = 0.8  # of the reach of a move, where a whole plan left the room
ATTEMPTS = 4  # at a plan that stays inside
SMALLEST_ROOM, LARGEST_ROOM = 0.1, 1000.0  # [m]
SHORTEST, LONGEST = 20.0, 3600.0  # [s]
SLOWEST, FASTEST = 5.0, 1000.0  # [Hz]
DOUBTED = ("gain", "dead_band")  # what a fit may need beside the numbers of the file: moves must tell that apart too
SEED = 0  # of the robots and of the noise
REST = 1.0  # [s] before the first move
OPENING = 1.2  # [s] of a first ramp: a longer one tells less than the steps that it takes the time of
VOLUME = PlanAim().score([])


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
    **limits: float,
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
        free: What is to be learnt, by keys of the robot file; default: as `identify`, after a fit what that told.
        aim: What is to be learnt best. Default, or "D": the geometric mean of all standard errors; "A": the root of the
            mean of their squares; a key: that number; two keys or nuisances, "gain,friction.axes.coulomb": which of
            these explanations is right; "next": the widest interval of a robot file that `identify` wrote, beside what
            its logs told.
        noise: Channel (wheel_angle, wheel_speed, current, twist, pose) -> std of what is recorded, one number or one
            per component; of wheel_angle the step of a count [rad]. Default: by the [sensors] of the robot file, counts
            and poses; where it says nothing of counts, wheel speeds that are differences of 2048 a turn.
        rate: Of commands and of the log [Hz].
        progress: Hears what is done.
        limits: current=, of all motors together [A]; heat=, of the hottest motor, in the mean of a move [W];
            traction=, force of a wheel over what it carries; default: 0.8 of the grip of wheels that may slip.

    Raises InputError for a room, a time, a limit or a noise that cannot be, for an aim that is not free, and for "next"
    of a robot that was not identified;
    InsufficientDataError where no move is left, or no log of these channels tells two explanations apart.

    >>> import omnidyn
    >>> made = omnidyn.plan(omnidyn.load_robot("axebot"), (3.0, 3.0), 30.0, noise={"twist": (0.02, 0.02, 0.1)})
    >>> max(made.reach) < 1.5, len(made.learnt)
    (True, 6)
    """
    check_order("plan(robot, area, seconds)", (robot, Robot), (area, object), (seconds, object))
    width, depth = _room(area)
    _check("seconds", seconds, SHORTEST, LONGEST, "s")
    _check("rate", rate, SLOWEST, FASTEST, "Hz")
    goal = aim_of(aim, robot)
    question = _question(robot, free, goal)
    planner = replace(_planner(robot, 1.0 / rate, noise, question, limits), aim=goal)
    if goal.criterion == NEXT:
        bare = [without_priors(one) for one in (planner.robot, planner.rolling, *planner.robots)]
        planner = replace(planner, robot=bare[0], rolling=bare[1], robots=bare[2:])
    return planner.planned((width, depth), seconds, progress)


def _planner(
    robot: Robot, dt: float, noise: Mapping[str, Any] | None, question: OutputError, limits: Mapping[str, float]
) -> _Planner:
    learns_grip = any(key.startswith(GRIP) for key in (*robot.priors, *(question.free or ())))
    rolling = robot if learns_grip else robot.replace(wheels=robot.wheels.replace(traction_mu=None))
    kept = limits_of(robot, limits, learns_grip)
    return _Planner(robot, _robots(robot), dt, noise_of(robot, dt, noise), question, kept, rolling)


@dataclass(frozen=True, eq=False)
class _Programs:
    """The rows of both programs, and the moves of the first."""

    share: FloatArray
    held_out: FloatArray
    moves: tuple[tuple[float, PlannedMove], ...]


@dataclass(frozen=True, eq=False)
class _Planner:
    """What moves do with a robot, and with others that may be meant, and what they tell. rolling: by which moves are
    compared, wheels as if they rolled, a tenth of the work; whole plans are compared, and predicted, with `robot`."""

    robot: Robot
    robots: Sequence[Robot]
    dt: float
    noise: Noise
    question: OutputError
    limits: PlanLimits
    rolling: Robot
    aim: PlanAim = field(default_factory=PlanAim)

    def planned(self, area: tuple[float, float], seconds: float, progress: Progress) -> Plan:
        """A plan that stays inside the room, in so many seconds with the part that is held out."""
        width, depth = area
        border = ROOM_SHARE * 0.5 * min(width, depth)
        progress(Report("trying moves"))
        moves, left_out = self.tried(), Counter[str]()
        for _ in range(ATTEMPTS):
            kept, left_out = fitting(moves, border, self.limits)
            if not kept:
                break
            try:
                made = self.search(kept, seconds, progress)
            except InsufficientDataError:  # nothing that fits moves it so far that its sensors see it
                break
            progress(Report("driving it with robots that may be meant"))
            reach = self.reach((made.share, made.held_out))
            if reach[0] < 0.5 * width and reach[1] < 0.5 * depth:
                return replace(self.predicted(made, area, reach), left_out=dict(left_out), tried=len(moves))
            border *= SMALLER
        raise _no_plan(width, depth, left_out, self.limits)

    def tried(self) -> list[TriedMove]:
        """All moves, of the robot of the file, and of those that go farthest and least far."""
        slips = self.rolling.wheels.traction_mu is not None
        robots = [one if slips else one.replace(wheels=self.rolling.wheels) for one in self.robots]
        probe = PlannedMove(FORWARD, STEP, 1.0, 1.2)
        distance = [_farthest(driven(robot, probe.input(robot, self.dt), self.dt)) for robot in robots]
        ends = [self.rolling, robots[int(np.argmax(distance))], robots[int(np.argmin(distance))]]
        return [tried(move, ends, self.limits, self.dt) for move in all_moves()]

    def search(self, moves: Sequence[TriedMove], seconds: float, progress: Progress) -> _Programs:
        """The best of a few plans from these moves, each from a part of them, compared whole."""
        opening = _opening(moves)
        candidates = [one.move for one in moves]
        rng = np.random.default_rng(SEED)
        runs = [self._recorded(self.rolling, move.both(self.robot, self.dt), rng) for move in candidates]
        asked = replace(self.question, nuisances=tuple(dict.fromkeys((*DOUBTED, *self.aim.nuisances))))
        names, information = information_of(runs, self.rolling, asked)
        earlier = self._known(names)
        score = self.aim.score(self.aim.places(names, sum(find_key(name) is not None for name in names)))
        begun = earlier + information[[candidates.index(move) for move in opening]].sum(axis=0)
        time = (1.0 - HELD_OUT_SHARE) * seconds - REST - sum(move.duration for move in opening)
        best, best_score = None, math.inf
        turn = self._quarter_turn(candidates) if {TILT, PUSH} <= set(self.aim.nuisances) else None
        time -= 2.0 * turn.duration if turn else 0.0
        # what is best by the volume is often good for another aim: it is compared too
        scores = list(dict.fromkeys((score, VOLUME) if self.aim != PlanAim() else (score,)))
        for k in range(SEARCHES):
            progress(Report("choosing moves", k, SEARCHES))
            kept = np.flatnonzero(rng.random(len(candidates)) < KEPT) if k else np.arange(len(candidates))
            for by in scores:
                some = [candidates[j] for j in kept]
                order = [int(kept[i]) for i in chosen(some, information[kept], time, by, begun)]
                made = self._programs(opening, [candidates[j] for j in order], seconds, turn)
                log = self._recorded(self.robot, made.share, np.random.default_rng(SEED))
                of_plan = self._score(told_by([log], self.robot, asked, is_coarse=True))
                if best is None or of_plan < best_score:
                    best, best_score = made, of_plan
        assert best is not None
        return best

    def _known(self, names: Sequence[str]) -> FloatArray:
        """What the fit before tells of these numbers, where the plan is for the next drive. Shape (names, names)."""
        return known_of(self.robot, names) if self.aim.criterion == NEXT else np.zeros((len(names), len(names)))

    def _beside(self, prediction: Prediction) -> Prediction:
        """The prediction beside what the fit before told."""
        if self.aim.criterion != NEXT:
            return prediction
        names = prediction.names[: prediction.robot_count]
        return prediction.beside(self._known(names))

    def _score(self, prediction: Prediction) -> float:
        """That of a whole plan: less is better."""
        after = self._beside(prediction)
        places = self.aim.places(after.names, after.robot_count)
        return self.aim.of_std(np.array([min(after.of(after.names[k]), UNKNOWN) for k in places]))

    def _quarter_turn(self, moves: Sequence[PlannedMove]) -> PlannedMove | None:
        """The step that turns the robot most nearly by a quarter: a floor that is not level pulls the other way then,
        what pushes the body does not."""
        turns = [replace(move, one_way=True) for move in moves if move.direction == TURN and move.shape == STEP]
        off = [
            abs((float(np.asarray(driven(self.rolling, move.input(self.robot, self.dt), self.dt).pose)[-1, 2]))
            % np.pi - 0.5 * np.pi)
            for move in turns
        ]  # fmt: skip
        return turns[int(np.argmin(off))] if turns else None

    def _programs(
        self,
        opening: Sequence[PlannedMove],
        moves: Sequence[PlannedMove],
        seconds: float,
        turn: PlannedMove | None,
    ) -> _Programs:
        """The rows of a plan, every other move after a `turn`, where there is one. Held out: a step from rest along
        each axis, then its moves once more, other side first, as many as there is time for."""
        program = [*opening, *moves]
        if turn:
            back = replace(turn, level=-turn.level)
            program = [*opening, *moves[::2], turn, *moves[1::2], back]
        rows = [move.both(self.robot, self.dt) for move in program]
        starts = REST + self.dt * np.cumsum([0, *(len(row) for row in rows)])
        rest = np.zeros((round(REST / self.dt), self.robot.wheels.count))
        remaining, held_out = max(HELD_OUT_SHARE * seconds - REST, min(move.duration for move in program)), [rest]
        for move in dict.fromkeys(reversed(program)):
            if not move.one_way and move.duration <= remaining:
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
        predictions = [
            self._beside(told_by([self._recorded(robot, made.share, rng)], robot, self.question))
            for robot in self.robots
        ]
        values = told_by([self._recorded(self.robot, made.share, rng)], self.robot, self.question, cures=True)
        apart = self._apart(values)
        names = values.names[: values.robot_count]
        halves = {name: 2.0 * np.array([one.of(name) for one in predictions]) for name in names}
        earlier = self._known(names)
        before = np.where(np.diag(earlier) > 0.0, np.diag(np.linalg.pinv(earlier, hermitian=True)), 0.0)
        predicted = {
            name: Predicted(
                float(value),
                float(np.median(halves[name])),
                float(halves[name].max()),
                2.0 * math.sqrt(variance) if variance > 0.0 else math.inf,
            )
            for name, value, variance in zip(names, values.value, before, strict=False)
        }
        return Plan(
            self.robot,
            self.dt,
            made.share,
            made.held_out,
            UNITS.get(self.robot.drive.kind, "V"),
            largest_input(self.robot),
            made.moves,
            area,
            reach,
            predicted,
            self.noise,
            len(self.robots),
            values.blind,
            aim=self.aim,
            apart=apart,
            limits=self.limits,
        )

    def _apart(self, prediction: Prediction) -> dict[str, float]:
        """Number of two explanations -> half its 95 % interval with all of both free: a share of it, of a nuisance that
        may be 0 in its own unit; empty where the plan is for something else.

        Raises InsufficientDataError where no log tells them apart.
        """
        if len(self.aim.names) < 2:
            return {}
        names = [prediction.names[k] for k in self.aim.places(prediction.names, prediction.robot_count)]
        if any(not np.isfinite(prediction.of(name)) for name in names):
            cures = [str(blind.how_to_show()) for blind in prediction.blind if set(names) & set(blind.changes)]
            raise InsufficientDataError(
                f"no plan tells {self.aim.names[0]} from {self.aim.names[1]} in a log of these channels",
                got=", ".join(self.noise),
                expected="another channel, or one of both measured",
                remedy=cures[0] if cures else "log another channel",
                where="aim",
            )
        return {name: 2.0 * prediction.of(name) for name in names}

    def _recorded(self, robot: Robot, share: FloatArray, rng: np.random.Generator) -> Any:
        return recorded(robot, share, self.dt, self.noise, rng)


def _no_plan(width: float, depth: float, left_out: Mapping[str, int], limits: PlanLimits) -> InsufficientDataError:
    """That there is none, and what stands in its way most."""
    most = max(left_out, key=lambda why: left_out[why], default=ROOM)
    if most in PlanLimits._fields:
        return InsufficientDataError(
            f"no plan moves the robot visibly within the limit of {most}",
            got=f"{getattr(limits, most):.3g}",
            expected="a limit that lets it move",
            remedy="a higher limit, or a robot that is known better",
            where="limits",
        )
    return InsufficientDataError(
        "no plan moves the robot visibly and stays inside the room, for all robots that may be meant",
        got=f"{width:g} m x {depth:g} m",
        expected="a larger room, or a robot that is known better",
        remedy="drive it by hand for a minute, slowly and both ways along each axis, and plan for what identify makes "
        "of that log",
        where="area",
    )


def _opening(moves: Sequence[TriedMove]) -> list[PlannedMove]:
    """Slow ramps through the dead zone, the least that move it: a spin first, which needs no room, then x and y."""
    opening = []
    for direction in (TURN, FORWARD, SIDEWAYS):
        ramps = [one.move for one in moves if one.move.direction == direction and one.move.shape == RAMP]
        opening += sorted(ramps, key=lambda move: (abs(move.seconds - OPENING), move.level))[:1]
    return opening


def _robots(robot: Robot) -> list[Robot]:
    """Robots that may be meant: by the std of the file, else with friction and torque up to 30 % off.

    A Coulomb friction that is a guess is drawn as a factor: none of them is without it, which would roll on for seconds
    after each move. Nor are the gains of a speed loop drawn: its firmware was tuned so that it holds speeds.
    """
    guesses = {key: prior for key, prior in numbers_told(robot).items() if prior.guessed and prior.std}
    dry = {key: prior for key, prior in guesses.items() if Key.parse(key).level == COULOMB}
    most = {key: FACTOR * abs(float(Key.parse(key).get(robot))) for key in dry}
    narrower = {key: prior.replace(std=min(prior.std or 0.0, most[key])) for key, prior in dry.items() if most[key]}
    loop = {key: prior.replace(std=None) for key, prior in numbers_told(robot).items() if key.startswith("drive.")}
    robot = with_priors(robot, narrower | loop)
    try:
        return list(sample(robot, DRAWS, SEED))
    except InsufficientDataError:
        keys = [*friction_keys(robot), "motor.resistance_ohm"]
        return list(sample(robot, DRAWS, SEED, factors=dict.fromkeys(keys, GUESS)))


def _question(robot: Robot, free: Sequence[str] | None, aim: PlanAim) -> OutputError:
    """What the fit of its log is asked. Of two explanations all numbers are free."""
    keys = None if free is None else tuple(key for name in free for key in map(str, expand(name, robot)))
    if aim.criterion == NEXT:
        keys = keys or fitted_keys(robot)
    if len(aim.names) > 1 and aim.keys:
        keys = tuple(dict.fromkeys((*(keys or friction_keys(robot)), *aim.keys)))
    return OutputError(free=keys, nuisances=aim.nuisances)


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
