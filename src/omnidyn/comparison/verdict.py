"""How well a model follows what was measured: one judgement for `compare` and for `identify`.

The error of a component as a share of its spread is 1 - fit / 100 (metrics.py). Up to FOLLOWS of it the model follows,
up to HALF roughly; errors that are white are the noise of the sensor, whatever their share.

A model fails where it follows nothing (`nothing_followed`). A fit fails too where it misses one of the signals that it
was fitted to (`is_missed`), for its numbers stand for that signal as well. Both rules stand here and nowhere else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from omnidyn.comparison.traces import unit
from omnidyn.document import all_of
from omnidyn.logs.channels import place
from omnidyn.sensors import TABLE
from omnidyn.statement import ERROR, NOTE, WARNING, Statement

FOLLOWS, HALF, NOTHING = 0.2, 0.5, 1.0  # error over spread
ROUGH_ERROR = 3.0  # times what a signal scatters by from row to row: errors beyond are no noise
WHITE = 0.05  # p-value from which errors are noise
WELL, NOISE, ROUGHLY, HARDLY, NOT = range(5)  # how a component is followed, best first
LEVELS = ("well", "noise", "roughly", "hardly", "not")  # the same for machines
THE_MODEL = "the model"
PLAIN = {
    ("twist", 0): "speed over the ground",
    ("twist", 1): "speed over the ground",
    ("twist", 2): "turn rate",
    ("pose", 0): "position",
    ("pose", 1): "position",
    ("pose", 2): "heading",
}


class Scored(Protocol):
    """What a comparison, or a validation, knows of a component."""

    @property
    def rmse(self) -> float: ...
    @property
    def fit_percent(self) -> float | None: ...
    @property
    def whiteness(self) -> float | None: ...


@dataclass(frozen=True)
class FollowedSignal:
    """How a model follows one kind of measurement. name: in plain words. level: WELL to NOT. share: error over spread,
    and error: its rms in `unit`, each the largest of the components.
    """

    name: str
    level: int
    share: float
    error: float
    unit: str

    def statement(self) -> Statement:
        """The same as a statement."""
        numbers = {"level": LEVELS[self.level], "share": self.share, "error": self.error, "unit": self.unit}
        return Statement("signal_followed", NOTE if self.level <= ROUGHLY else WARNING, self.name, numbers)


def followed(scores: Mapping[str, Scored]) -> list[FollowedSignal]:
    """How well each kind of measurement is followed, best first; components of one kind apart where they differ.

    What never changes is left out: there is nothing to follow.
    """
    kinds: dict[str, list[tuple[str, FollowedSignal]]] = {}
    for name, score in scores.items():
        if score.fit_percent is not None:
            signal = FollowedSignal(name, _level(score), _share(score), score.rmse, unit(name))
            kinds.setdefault(plain_name(name), []).append((name, signal))
    signals = []
    for plain, members in kinds.items():
        alike: dict[int, list[tuple[str, FollowedSignal]]] = {}
        for member in members:
            alike.setdefault(member[1].level, []).append(member)
        for group in alike.values():
            share, error = (
                max(values) for values in zip(*((signal.share, signal.error) for _, signal in group), strict=True)
            )
            label = plain if len(alike) == 1 else f"{all_of([name for name, _ in group])} ({plain})"
            signals.append(FollowedSignal(label, group[0][1].level, share, error, group[0][1].unit))
    return sorted(signals, key=lambda signal: signal.level)


def nothing_followed(signals: Sequence[FollowedSignal]) -> bool:
    """Whether the model does not follow: something changes, and nothing of it is followed even roughly."""
    return bool(signals) and all(signal.level >= HARDLY for signal in signals)


def is_missed(share: float, error: float, scatter: float = 0.0) -> bool:
    """Whether a model misses a signal: its errors are more than half of the spread, and neither is noise.

    share: error over spread. error: its rms. scatter: by how much the signal scatters from row to row
    (`statistics.difference_noise`), in the same unit; a signal of mere noise, as of a position that hardly moves, can
    not be followed, and is not to blame. At 0: of no noise.
    """
    return share > HALF and error > ROUGH_ERROR * scatter * max(share, 1.0)


def plain_name(component: str) -> str:
    """The kind of measurement that a component belongs to, in plain words."""
    location = place(component)
    if location is None:
        return component
    return TABLE[location[0]].words or PLAIN.get(location, component)


def _share(score: Scored) -> float:
    assert score.fit_percent is not None
    return 1.0 - score.fit_percent / 100.0


def _level(score: Scored) -> int:
    share = _share(score)
    if share <= FOLLOWS:
        return WELL
    if score.whiteness is not None and score.whiteness >= WHITE:
        return NOISE
    return ROUGHLY if share <= HALF else HARDLY if share < NOTHING else NOT


def follows(model: str, followed_signals: Sequence[FollowedSignal]) -> Statement:
    """How well a model follows each kind of measurement. model: its name."""
    signals = {"signals": [signal.statement() for signal in followed_signals]}
    if not followed_signals:
        return Statement("nothing_changes", WARNING, model)
    if nothing_followed(followed_signals):
        return Statement("model_does_not_follow", ERROR, model, signals)
    return Statement("follows", NOTE, model, signals)


def compared(
    robots: Sequence[str], scores: Sequence[Mapping[str, Scored]], better: Mapping[str, str | None]
) -> Statement:
    """The verdict of a comparison. better: component -> the robot that is surely nearer, None where none is."""
    if len(robots) == 1:
        return follows(THE_MODEL, followed(scores[0]))
    models = [follows(robot, followed(score)) for robot, score in zip(robots, scores, strict=True)]
    nearer = [
        Statement("nearer", NOTE, robot, {"components": components})
        for robot in robots
        if (components := [name for name, best in better.items() if best == robot])
    ]
    return Statement("models_compared", NOTE, numbers={"nearer": nearer, "models": models})
