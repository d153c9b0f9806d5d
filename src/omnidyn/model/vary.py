"""vary: the robot that carries something, stands on another floor or a slope, or has another battery.

A robot like any other, with a name that says what was changed.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from omnidyn.arguments import check_order
from omnidyn.errors import InputError
from omnidyn.model.log_effects import KeyCorrelation, key_correlation
from omnidyn.model.robot import Prior, Robot
from omnidyn.model.surroundings import KINDS, Battery, Floor, Payload, Surface

ON_FLOOR = ("axes", "direction")  # the parts of friction that a floor has; that at the wheels is of bearings and gears


def vary_robot(
    robot: Robot,
    *,
    payload: str | Payload = "",
    floor: str | Surface = "",
    tilt: str | Floor = "",
    battery: str | Battery = "",
) -> Robot:
    """The robot with a load, on another floor, on a slope, with another battery: by the names of its file, or by value.

    payload: adds mass and inertia, and moves the centre of mass towards its own. floor: friction between robot and
    floor. tilt: a slope, whose pull stays where it is in the room. battery: what duties are shares of, and the most
    that a motor gets.
    What is known of a number that is replaced goes; what is known of one that grows stays. The robot no longer knows
    the kinds that were chosen. Raises InputError for a name that the file does not have, or a load under which the
    robot would tip over.
    """
    check_order("vary_robot(robot)", (robot, Robot))
    chosen = {"payload": payload, "floor": floor, "tilt": tilt, "battery": battery}
    said = []
    own = robot
    for kind, choice in chosen.items():
        if isinstance(choice, str) and not choice:
            continue
        value = _named(own, kind, choice) if isinstance(choice, str) else _of_kind(kind, choice)
        robot = _CHANGES[kind](robot, value, _priors_of(own, kind, choice))
        said.append(f"{kind} {choice}" if isinstance(choice, str) else kind)
    if not said:
        return robot
    gone = [kind for kind, choice in chosen.items() if choice]
    heads = tuple(f"variations.{kind}." for kind in gone)
    return robot.replace(
        name=f"{robot.name} with {', '.join(said)}"[:400],
        variations=own.variations.replace(**{k: {} for k in gone}),
        priors={key: prior for key, prior in robot.priors.items() if not key.startswith(heads)},
    )


def vary_as(robot: Robot, text: str) -> Robot:
    """`vary_robot` by a text such as "payload=2kg,floor=carpet"; the robot for an empty one. Raises InputError."""
    chosen: dict[str, Any] = {}
    for part in filter(None, (each.strip() for each in text.split(","))):
        kind, equals, name = (each.strip() for each in part.partition("="))
        if not equals or not name:
            raise InputError("not a variation", got=part, expected="kind=name, such as payload=2kg", where="with")
        if kind not in KINDS:
            raise InputError("no such kind of variation", got=kind, remedy=_nearest(kind, KINDS), where="with")
        if kind in chosen:
            raise InputError("asked for twice", got=f"{kind}={chosen[kind]}, {part}", expected="one", where="with")
        chosen[kind] = name
    return vary_robot(robot, **chosen)


def _named(robot: Robot, kind: str, name: str) -> Any:
    """What a robot file knows under a name. Raises InputError, with the nearest name, where there is none."""
    known: Mapping[str, Any] = getattr(robot.variations, kind)
    if name in known:
        return known[name]
    if not known:
        raise InputError(
            f"{robot.name} knows no {kind} by name",
            got=name,
            expected=f"[variations.{kind}.{name}]",
            remedy="add the table to the robot file",
            where=kind,
        )
    raise InputError(f"no {kind} of this name", got=name, remedy=_nearest(name, list(known)), where=kind)


def _of_kind(kind: str, value: Any) -> Any:
    wanted = {"payload": Payload, "floor": Surface, "tilt": Floor, "battery": Battery}[kind]
    if not isinstance(value, wanted):
        raise InputError("not a variation", got=value, expected=f"a name, or {wanted.__name__}(..)", where=kind)
    return value


def _nearest(name: str, known: Sequence[str]) -> str:
    close = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    return f"did you mean {close[0]}?" if close else f"known names: {', '.join(known)}"


def _priors_of(robot: Robot, kind: str, choice: object) -> dict[str, Prior]:
    """What the file says of the numbers of a variation, by their keys in its table."""
    head = f"variations.{kind}.{choice}."
    return {key.removeprefix(head): prior for key, prior in robot.priors.items() if key.startswith(head)}


def _loaded(robot: Robot, payload: Payload, told: Mapping[str, Prior]) -> Robot:
    """Body and load as one: their common centre of mass, and their inertias about it by Steiner's theorem."""
    body, total = robot.body, robot.body.mass + payload.mass
    centre = (body.mass * np.array(body.centre) + payload.mass * np.array(payload.offset)) / total
    moved, beside = (float(np.sum((each - centre) ** 2)) for each in (np.array(body.centre), np.array(payload.offset)))
    inertia = (body.inertia + body.mass * moved) + (payload.inertia + payload.mass * beside)
    centred = _of_centre(robot, payload.mass / total, told)
    priors = {key: prior for key, prior in robot.priors.items() if key != "body.centre_m" or not centred} | centred
    for name in ("mass_kg", "inertia_kg_m2"):
        before, more = priors.get(f"body.{name}"), told.get(name)
        if before is not None and more is not None and before.std is not None and more.std is not None:
            priors[f"body.{name}"] = before.replace(std=float(np.hypot(before.std, more.std)))
    try:
        return robot.replace(body=body.replace(mass=total, inertia=inertia, centre=centre.tolist()), priors=priors)
    except InputError as error:
        raise error.at("payload") from None


def _of_centre(robot: Robot, share: float, told: Mapping[str, Prior]) -> dict[str, Prior]:
    """What is known of the common centre of mass, of which the load is a share: by key."""
    found = {}
    for k in range(2):
        before, more = (
            of.get(f"{name}[{k}]", of.get(name)) for of, name in ((robot.priors, "body.centre_m"), (told, "offset_m"))
        )
        known = more or before
        if known is not None:
            parts = [(before, 1.0 - share), (more, share)]
            std = math.hypot(*(part * each.std for each, part in parts if each is not None and each.std is not None))
            found[f"body.centre_m[{k}]"] = known.replace(std=std or None)
    return found


def _on_surface(robot: Robot, surface: Surface, told: Mapping[str, Prior]) -> Robot:
    parts = {*ON_FLOOR, *surface.friction.model_fields_set}
    friction = robot.friction.replace(**{part: getattr(surface.friction, part) for part in sorted(parts)})
    gone = tuple(f"friction.{part}" for part in parts)
    priors = {key: prior for key, prior in robot.priors.items() if not key.startswith(gone)}
    told = {key if key != "traction_mu" else "wheels.traction_mu": prior for key, prior in told.items()}
    if surface.traction_mu is not None:
        robot = robot.replace(wheels=robot.wheels.replace(traction_mu=surface.traction_mu))
    return robot.replace(friction=friction, priors=priors | dict(told), correlation=_without(robot.correlation, gone))


def _without(known: KeyCorrelation | None, gone: tuple[str, ...]) -> KeyCorrelation | None:
    """The correlations of the numbers that stay; None where fewer than two do."""
    kept = [k for k, key in enumerate(known.keys if known is not None else ()) if not key.startswith(gone)]
    if known is None or len(kept) < 2:
        return None
    keys, std = tuple(known.keys[k] for k in kept), known.std
    return key_correlation(keys, known.of(keys), None if std is None else tuple(std[k] for k in kept))


def _on_slope(robot: Robot, floor: Floor, told: Mapping[str, Prior]) -> Robot:
    return robot.replace(floor=floor, priors=robot.priors | {f"floor.{key}": prior for key, prior in told.items()})


def _fed(robot: Robot, battery: Battery, told: Mapping[str, Prior]) -> Robot:
    limit = robot.motor.voltage_limit
    least = tuple(min(each, battery.supply) for each in np.atleast_1d(limit).tolist())
    motor = robot.motor.replace(voltage_limit=least if isinstance(limit, tuple) else least[0])
    drive = robot.drive.replace(supply=battery.supply)
    priors = {key: prior for key, prior in robot.priors.items() if key != "drive.supply_V"}
    return robot.replace(motor=motor, drive=drive, priors=priors | {f"drive.{key}": each for key, each in told.items()})


_CHANGES: dict[str, Callable[[Robot, Any, Mapping[str, Prior]], Robot]] = {
    "payload": _loaded,
    "floor": _on_surface,
    "tilt": _on_slope,
    "battery": _fed,
}
