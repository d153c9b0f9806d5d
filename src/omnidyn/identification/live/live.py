"""Live: the numbers of a robot while it drives, with their intervals, each second."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from omnidyn.arguments import check_order, is_number
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.live.change import MASSES, changes
from omnidyn.identification.live.model import LiveModel, PredictedStretch
from omnidyn.identification.live.rows import Rows, part
from omnidyn.identification.live.status import LiveNumber, LiveStatus
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.prepare import free_by_default, guesses
from omnidyn.identification.output_error.problem.nuisances import LATENCY, PUSH
from omnidyn.identification.output_error.solve.loop import loop_keys
from omnidyn.model.drive import SPEED
from omnidyn.model.keys import Key, expand
from omnidyn.model.layout import N_AXES
from omnidyn.model.robot import Robot
from omnidyn.run import Run

RESISTANCE = "motor.resistance_ohm"
EVERY = 1.0  # [s] of the log between two answers
STRETCH = 5.0  # [s] whose rows are predicted before they count
LOOP_SHARE = 0.1  # of the log: so long at least is a stretch in a speed loop, each of which simulates the whole log
FIRST = 4.0  # [s] of the log before the first fit
SURE = 10.0  # [s] of the log in a whole fit that may say that the model leaves something out
GROWTH, SOONER = 2.0, 1.15  # times as much log at which all is fitted anew; where that seems to be needed
MOVED = 0.2  # standard errors that a number of a long log may move before all rows are taken anew
FIT_ROWS = 8_000  # rows of a whole fit: with so many, the noise is known
MOST_ROWS = 60_000  # rows that are kept; what older ones said stays in the sums
WIDEST = 0.1  # half an interval as a share of its number, by default
LONGEST_GAP = 0.5  # [s] between two rows, from which on it is said


class Live:
    """What a robot's log tells of it, while it grows.

    `add` takes rows as they come and answers each second: numbers with 95 % intervals, what is still unknown, whether
    the last stretch was predicted, and whether that is enough. The rows are those of `identify`, whitened as there;
    their sums add up, and all is fitted anew when the log has doubled or the numbers have moved.

    Args:
        robot: What is known before.
        method: What is fitted, as for `identify`; by default friction, resistance, guesses of the file, latencies and
            a constant push; with a reference mass and inertia instead of the resistance; through a speed loop friction,
            gains that are not given, guesses and latencies.
        within: How wide half an interval may be, as a share of its number, to be enough; or key -> share, and then
            only these numbers count.
        reference: The robot as it was fitted before: what differs from it is said, as floor, payload or wear.

    Rows of set speeds without voltages or duties are followed through the speed loop of the robot: from rest, up to the
    first gap, for what the loop remembers is known no longer then. Its gains are fitted too where they are guesses.

    Raises InputError for what cannot be used.

    >>> import numpy as np, omnidyn
    >>> robot, rng = omnidyn.load_robot("axebot"), np.random.default_rng(0)
    >>> run = omnidyn.simulate(robot, np.repeat(rng.uniform(-5.0, 5.0, (30, 3)), 40, axis=0), dt=0.01)
    >>> log = omnidyn.Run(t=run.t, voltage=run.voltage, twist=run.twist + 0.005 * rng.normal(size=run.twist.shape))
    >>> live = omnidyn.Live(robot)
    >>> number = live.add(log).numbers["friction.axes.coulomb[0]"]
    >>> number.low < 2.2 < number.high
    True
    >>> live.robot_now.friction.axes.coulomb[0] == number.value
    True
    """

    def __init__(
        self,
        robot: Robot,
        method: OutputError | None = None,
        *,
        within: float | Mapping[str, float] = WIDEST,
        reference: Robot | None = None,
    ) -> None:
        check_order("Live(robot, method)", (robot, (Robot,)), (method, (OutputError, type(None))))
        if reference is not None and reference.wheels.count != robot.wheels.count:
            raise InputError(
                "the fit before is of another robot",
                got=f"{reference.wheels.count} wheels",
                expected=f"{robot.wheels.count}, as {robot.name} has",
                remedy="give a fit of this robot",
                where="reference",
            )
        self.robot, self.reference = robot, reference
        self._asked, self._asked_within = method, within
        self._ask(has_loop=False)
        self._rows, self._model = Rows(), None
        self._start = self._answered = math.nan
        self._fitted_rows, self._fitted_at = 0, 0.0
        self._next_try, self._gap, self._waiting = FIRST, 0.0, f"the first fit takes {FIRST:g} s of rows"
        self._was_reached, self._enough_at, self._held_out = False, None, None
        self._missed, self._unexplained = list[PredictedStretch](), None
        self._model: LiveModel | None
        self._enough_at: float | None
        self._held_out: PredictedStretch | None
        self._unexplained: PredictedStretch | None
        self._status = LiveStatus(robot.name, waiting=self._waiting)

    def _ask(self, has_loop: bool) -> None:
        """Settle what is fitted. has_loop: the rows have set speeds and no voltages."""
        self._has_loop = has_loop
        self.method = self._asked or _default_method(self.robot, self.reference is not None, has_loop)
        self._fitted = _fitted(self.robot, self.method)
        self._within = _shares(self._asked_within, self._fitted, self.method)

    @property
    def status(self) -> LiveStatus:
        """The last answer."""
        return self._status

    @property
    def robot_now(self) -> Robot:
        """The robot with the numbers as they are now."""
        return self.robot if self._model is None else self._model.problem.robot_at(self._model.values)

    def add(self, run: Run) -> LiveStatus:
        """Take more rows, and answer. Time may go on, leave gaps, or begin anew.

        Raises InputError for rows of another robot.
        """
        for _ in self.answers(run):
            pass
        return self._status

    def answers(self, run: Run) -> Iterator[LiveStatus]:
        """Take more rows: the answer of each second of them. Raises InputError as `add` does."""
        check_order("add(run)", (run, (Run,)))
        if run.wheels is not None and run.wheels != self.robot.wheels.count:
            raise InputError(
                "the log has another number of wheels",
                got=run.wheels,
                expected=f"{self.robot.wheels.count}, as {self.robot.name} has",
                remedy="give the robot that the log is of",
                where=run.source,
            )
        if self._rows.count == 0 and self.robot.drive.kind == SPEED:
            self._ask(has_loop=run.voltage is None and run.duty is None)
        repeated = self._rows.repeated(run)
        if len(run) == repeated:
            return
        run = part(run, repeated, len(run)) if repeated else run
        before, shifted = self._rows.last, self._rows.on_clock(run)
        gaps = np.diff(shifted.t, prepend=before if math.isfinite(before) else shifted.t[0])
        self._gap = max(self._gap, float(gaps.max()) if gaps.max() > LONGEST_GAP else 0.0)
        if math.isnan(self._start):
            self._start = self._answered = float(shifted.t[0])
        first = 0
        while first < len(shifted):  # an answer each second, however many rows come at once
            due = max(self._answered + EVERY, float(shifted.t[first]))
            stop = min(int(np.searchsorted(shifted.t, due)) + 1, len(shifted))
            self._rows.add(part(shifted, first, stop))
            first = stop
            if self._rows.last >= self._answered + EVERY:
                self._answered = self._rows.last
                self._update(self._answered)
                self._status = self._answer()
                yield self._status
        if self._model is None:
            self._status = self._answer()

    def finish(self) -> LiveStatus:
        """The answer when the drive has ended: all rows that are kept fitted anew.

        Where errors are autocorrelated, the likelihood has several optima, some tenths of a standard error apart. This
        is the one at which `identify` ends too, as long as the log is no longer than a whole fit here.
        """
        if self._rows.last - self._start >= FIRST and self._fitted_at < self._rows.last:
            self._fit(self._rows.last)
        self._status = self._answer() if self._rows.count else self._status
        return self._status

    def _update(self, now: float) -> None:
        if self._model is None:
            if now - self._start >= self._next_try:
                self._fit(now)
                self._was_reached = self._model is not None and self._is_reached()
            return
        model = self._model
        stretch = max(STRETCH, LOOP_SHARE * (now - self._start)) if model.has_loop else STRETCH
        is_whole = now - model.start >= stretch
        if is_whole or not model.has_loop:
            model.take(self._rows, now)
        if not is_whole:
            return
        self._held_out = model.judge(now)
        self._missed += [self._held_out] if self._held_out.missed else []
        seems_enough = self._was_reached and self._held_out.predicted and self._is_reached()
        model.close(now)
        age, is_small = now - self._start, self._rows.count <= FIT_ROWS or model.has_loop
        has_grown = age >= GROWTH * (self._fitted_at - self._start) and self._fitted_rows < FIT_ROWS
        is_doubtful = bool(self._held_out.missed) or (seems_enough and self._enough_at is None)
        if has_grown or (is_doubtful and age >= SOONER * (self._fitted_at - self._start)):
            self._fit(now)
        elif is_small or (model.moved > MOVED and age >= SOONER * (model.fitted_at - self._start)):
            model.linearise(self._rows, now)
        self._was_reached = self._is_reached()
        if self._held_out.missed or self._model.misfit:
            self._enough_at = None
        elif self._enough_at is None and seems_enough and self._was_reached:
            stretches = (self._model.unexplained(self._rows, missed.start, missed.end) for missed in self._missed)
            self._unexplained = next(filter(None, stretches), None)
            self._enough_at = age if self._unexplained is None else None
        if self._rows.count > MOST_ROWS and not model.has_loop:
            self._model.freeze()
            self._rows.forget(self._model.start - STRETCH)

    def _fit(self, now: float) -> None:
        """Fit the last rows anew, and all others at what comes out; where they tell nothing, what was before stays."""
        run = self._rows.between(-math.inf, now)
        assert run is not None
        has_loop = self._has_loop or (self._model is not None and self._model.has_loop)
        last = run if has_loop else part(run, max(len(run) - FIT_ROWS, 0), len(run))
        try:
            model = LiveModel(last, self.robot, self.method)
        except InsufficientDataError as error:
            self._waiting, self._next_try = str(error), GROWTH * self._next_try
            return
        if self._model is not None:
            model.go_on(self._model)
        if len(last) < len(run) or model.past is not None:
            model.linearise(self._rows, now)
        self._model, self._fitted_rows, self._fitted_at = model, len(last), now

    def _is_reached(self) -> bool:
        return all(number.is_reached for number in self._numbers().values())

    def _numbers(self) -> dict[str, LiveNumber]:
        model = self._model
        assert model is not None
        std, ci95 = model.intervals()
        robot_names = {p.name for p in model.problem.robot_parameters}
        numbers = {}
        for name, value, is_unknown in zip(model.problem.names, model.values.tolist(), model.unknown, strict=True):
            within = self._within.get(name, self._within.get("", 0.0) if name in robot_names else 0.0)
            numbers[name] = LiveNumber(value, std[name], *ci95[name], within, bool(is_unknown))
        for name in self._fitted:  # what the fit held, such as friction along an axis that never moved
            if name not in numbers:
                within = self._within.get(name, self._within.get("", 0.0))
                numbers[name] = LiveNumber(
                    float(Key.parse(name).get(self.robot)), math.inf, -math.inf, math.inf, within, True
                )
        return numbers

    def _answer(self) -> LiveStatus:
        seconds = self._rows.last - self._start
        status = LiveStatus(
            self.robot.name, seconds, self._rows.total, restarts=self._rows.restarts, gap=self._gap,
            waiting=self._waiting,
        )  # fmt: skip
        if self._model is None:
            return status
        changed = () if self.reference is None else changes(self._model, self.reference)
        return replace(
            status,
            numbers=self._numbers(),
            held_out=self._held_out,
            enough_at=self._enough_at,
            unexplained=self._unexplained,
            misfit=self._model.misfit if self._fitted_at - self._start >= SURE else (),
            changes=changed,
            used_until=None if self._model.used_until is None else self._model.used_until - self._start,
            waiting="",
        )


def _default_method(robot: Robot, is_compared: bool, has_loop: bool) -> OutputError:
    """What is fitted where nothing is asked for. is_compared: with a fit before, which knows the resistance; through a
    speed loop it and the masses show in its currents at best, and are fitted where they are guesses."""
    if has_loop:
        keys = (*loop_keys(robot, np.ones(N_AXES, bool)), *guesses(robot, has_loop=True))
        return OutputError(free=tuple(dict.fromkeys(keys)), nuisances=(LATENCY,))
    more = MASSES if is_compared else tuple(map(str, expand(RESISTANCE, robot)))
    keys = (*free_by_default(robot), *guesses(robot), *more)
    return OutputError(free=tuple(dict.fromkeys(keys)), nuisances=(LATENCY, PUSH))


def _fitted(robot: Robot, method: OutputError) -> list[str]:
    """The numbers of the robot that are asked for. Raises InputError for a name that is none."""
    names = (*free_by_default(robot), *guesses(robot)) if method.free is None else method.free
    return [str(Key.parse(key)) for name in names for key in expand(name, robot)]


def _shares(within: object, fitted: list[str], method: OutputError) -> dict[str, float]:
    """Key -> share; "" for all numbers of the robot. Raises InputError for what is no share, and for a key that is not
    fitted: it would be waited for in vain, or not at all."""
    shares = dict(within) if isinstance(within, Mapping) else {"": within}
    for name in shares:
        if name and name not in fitted and name.partition(".")[0] not in (method.nuisances or (LATENCY, PUSH)):
            raise InputError(
                "not fitted", got=name, expected=", ".join(fitted), remedy="free it, or leave it out of `within`",
                where="within",
            )  # fmt: skip
    for name, share in shares.items():
        if not is_number(share) or not 0.0 < share < math.inf:  # type: ignore[operator]
            raise InputError(
                "not half the width of an interval", got=share, expected="a share above 0, such as 0.1 for 10 %",
                where=f"within {name}".strip(),
            )  # fmt: skip
    return {name: float(share) for name, share in shares.items()}  # type: ignore[arg-type]
