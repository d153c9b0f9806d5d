"""What `identify` says of a wrong log: whether it is silent and tight, finds the misfit, names its cause.

The contract: Estimate.lack_of_fit with found, channels and remedies (key, words, gain, same_as), best first;
Estimate.rests_on: number -> fixed key -> relative change per percent (-0.11: by -11 %).
Where they are missing nothing is found.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from benchmarks.wrong_worlds.kinds import KINDS, Kind, by_name
from benchmarks.wrong_worlds.log import Case, clean, logged, right_case, robot_of, truths
from benchmarks.wrong_worlds.remedies import FRICTION, NUISANCES, held
from benchmarks.wrong_worlds.sizes import SIZES
from omnidyn.errors import OmnidynError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.run import Run

FIRST_SEED, SEEDS_EACH = 20_000, 100
SPREAD = 0.4  # of the logarithm of a size, either way
OFF_STD, OFF_SHARE = 3.0, 0.03
VISIBLE = 12.5  # of the log likelihood, between the truth and what was fitted: five standard errors
SURE = 2.0  # standard errors of its gain from which on a remedy is a confident one
# What an owner knows of the numbers in the file, std in percent: with `rests_on` part of what an interval owes.
KNOWN = {
    "body.mass_kg": 0.5,
    "body.inertia_kg_m2": 5.0,
    "wheels.wheel_radius_m": 0.5,
    "wheels.robot_radius_m": 0.5,
    "motor.resistance_ohm": 1.0,
    "motor.torque_constant_Nm_A": 1.0,
    "motor.emf_constant_Vs_rad": 1.0,
}


@dataclass
class Seen:
    """Of one log. off: a number beyond OFF_STD and OFF_SHARE. named: the cause is in any group; early: first or second,
    or in the group of the first. sure: a confident remedy that is not near the cause. visible: what the likelihood of
    the truth gains. held: intervals after the true remedy."""

    large: bool
    off: bool = False
    found: bool = False
    named: bool = False
    early: bool = False
    sure: bool = False
    visible: bool = False
    held: list[bool] = field(default_factory=list)
    first: str = ""
    worst: str = ""
    seconds: float = 0.0
    words: str = ""

    @property
    def silent(self) -> bool:
        """Silent and tight."""
        return self.off and not self.found and not self.named


def drawn(kind: Kind, number: int) -> tuple[Case, int, bool]:
    """(wrong case, seed, whether it is a large one) of a log of a kind."""
    seed = FIRST_SEED + SEEDS_EACH * KINDS.index(kind) + number
    large = number % 2 == 1
    factor = np.exp(np.random.default_rng([seed, 4]).uniform(-SPREAD, SPREAD))
    return kind.make(right_case(seed), min(SIZES[kind.name][large] * float(factor), kind.most)), seed, large


def score(name: str, number: int) -> Seen:
    """A log of a kind by itself, asked as a user does: its friction, all else by default."""
    kind = by_name(name)
    case, seed, large = drawn(kind, number)
    run, out = logged(case, seed), Seen(large)
    estimate = _asked(out, case, run)
    if estimate is None:
        return out
    out.visible = _visible(case, seed, estimate)
    same = _remedies(out, kind, estimate)
    if kind.key:
        out.held = held(kind.key, same, case, run)
    return out


def score_two(number: int) -> Seen:
    """A log of two kinds at once; named, early: by either cause."""
    seed = FIRST_SEED - 1 - number
    random = np.random.default_rng([seed, 5])
    kinds, case = [KINDS[k] for k in random.choice(len(KINDS), 2, replace=False)], right_case(seed)
    for kind in kinds:
        case = kind.make(case, min(SIZES[kind.name][int(random.integers(2))], kind.most))
    out = Seen(large=False)
    estimate = _asked(out, case, logged(case, seed))
    if estimate is not None:
        either = [replace(out), replace(out)]
        for kind, each in zip(kinds, either, strict=True):
            _remedies(each, kind, estimate)
        out = replace(either[0], named=any(e.named for e in either), early=any(e.early for e in either))
    if out.silent:
        out.words = f"{number}, {' and '.join(kind.name for kind in kinds)}: {out.worst}"
    return out


def _asked(out: Seen, case: Case, run: Run) -> Any:
    """The estimate of a log, and how far it is off; None of one that is refused."""
    began = time.process_time()
    try:
        estimate = identify(run, robot_of(case.told), OutputError(free=FRICTION)).estimate
        found = bool(getattr(estimate.lack_of_fit, "found", False))
    except OmnidynError as error:  # a refusal is no silence
        out.found, out.words = True, str(error)
        return None
    out.seconds, out.found = time.process_time() - began, found
    out.worst, out.off = worst(estimate, estimate.rests_on or {}, truths(case.told, case.told.shape))
    return estimate


def worst(estimate: Any, rests: Any, true: dict[str, float]) -> tuple[str, bool]:
    """(the number that is furthest off, in its standard errors; whether any is off)."""
    errors, is_off = {}, False
    for name, value in true.items():
        if name not in estimate.value or name in estimate.unidentifiable:
            continue
        own, at = estimate.std[name], abs(estimate.value[name])
        fixed = (slope * KNOWN.get(key.partition("[")[0], 0.0) * at for key, slope in rests.get(name, {}).items())
        std = float(np.sqrt(own**2 + sum(each**2 for each in fixed)))
        off = abs(estimate.value[name] - value)
        errors[name] = off / std if std > 0.0 else float("inf") if off > 0.0 else 0.0
        is_off = is_off or (errors[name] > OFF_STD and off > OFF_SHARE * abs(value))
    name = max(errors, key=lambda each: errors[each]) if errors else ""
    return f"{name} {errors[name]:.1f}" if errors else "", is_off


def _visible(case: Case, seed: int, wrong: Any) -> bool:
    """Whether a test that knows the truth sees it: by how much the same noise fits worse than in the right world."""
    right_log = logged(clean(case), seed)
    right = identify(right_log, robot_of(case.told), OutputError(free=FRICTION)).estimate
    gain = 0.0
    for name in set(right.noise) & set(wrong.noise):  # type: ignore[attr-defined]
        gain += right_log.t.size * np.log(wrong.noise[name] / right.noise[name])  # type: ignore[attr-defined]
    return bool(gain > VISIBLE)


def _remedies(out: Seen, kind: Kind, estimate: Any) -> tuple[str, ...]:
    """What lack_of_fit says, into `out`; the group of the cause."""
    remedies = list(getattr(estimate.lack_of_fit, "remedies", ()) or ())
    groups = [(each.key, *(getattr(each, "same_as", ()) or ())) for each in remedies]
    out.first = groups[0][0] if groups else ""
    hits = [any(is_same(key, kind.key) for key in group) for group in groups]
    out.named = bool(kind.key) and any(hits)
    out.early = bool(kind.key) and bool(groups) and (hits[0] or any(is_same(g[0], kind.key) for g in groups[:2]))
    if any(is_same(name, kind.key) for name in getattr(estimate, "nuisances", ())):  # fitted without being asked for
        out.named = out.early = True
    own = [kind.key, *kind.near]
    near = bool(groups) and any(is_same(key, each) for key in groups[0] for each in own if each)
    out.sure = out.found and bool(remedies) and not near and is_sure(remedies[0])
    group = next((group for group, hit in zip(groups, hits, strict=True) if hit), ())
    return tuple(key for key in group if not is_same(key, kind.key))


def is_same(key: str, cause: str) -> bool:
    """Whether a key names the cause: itself, an entry of it, the list in which it stands, a nuisance of one channel."""
    if key == cause or not key or not cause:
        return key == cause
    entry = key.startswith(f"{cause}[") or cause.startswith(f"{key}[")
    return entry or (cause in NUISANCES and key.startswith(f"{cause}."))


def is_sure(remedy: Any) -> bool:
    """Whether its gain stands clear of its standard error."""
    gain = getattr(remedy, "gain", 0.0)
    if isinstance(gain, tuple | list):
        value, std = gain[0], gain[1]
    else:
        value, std = getattr(gain, "value", gain), getattr(gain, "std", getattr(remedy, "gain_std", 0.0))
    return bool(value > SURE * std) and bool(getattr(remedy, "confident", True))
