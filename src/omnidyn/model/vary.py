"""vary: the robot that carries something, stands on another floor or a slope, or has another battery.

A robot like any other, with a name that says what was changed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from omnidyn.arguments import check_order
from omnidyn.errors import InputError, did_you_mean
from omnidyn.model.correlation import KeyCorrelation, key_correlation
from omnidyn.model.friction import Friction
from omnidyn.model.keys import BREAKAWAY, COULOMB, VISCOUS
from omnidyn.model.robot import Prior, Robot
from omnidyn.model.surroundings import Floor
from omnidyn.model.variations import KINDS, Battery, Payload, Surface

LEVELS = (VISCOUS, COULOMB, BREAKAWAY)
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

    What is known of a number that is replaced goes; what is known of one that grows stays. The robot no longer knows
    the kinds that were chosen.

    Args:
        robot: The robot.
        payload: Adds mass [kg] and inertia [kg m^2], and moves the centre of mass towards its own.
        floor: Friction between robot and floor.
        tilt: A slope, whose pull stays where it is in the room.
        battery: What duties are shares of [V], and the most that a motor gets.

    Raises InputError for a name that the file does not have, or a load under which the robot would tip over.
    """
    check_order("vary_robot(robot)", (robot, Robot))
    choices = {"payload": payload, "floor": floor, "tilt": tilt, "battery": battery}
    descriptions = []
    original = robot
    for kind, choice in choices.items():
        if isinstance(choice, str) and not choice:
            continue
        value = _named(original, kind, choice) if isinstance(choice, str) else _of_kind(kind, choice)
        robot = _CHANGES[kind](robot, value, _priors_of(original, kind, choice))
        descriptions.append(f"{kind} {choice}" if isinstance(choice, str) else kind)
    if not descriptions:
        return robot
    used_kinds = [kind for kind, choice in choices.items() if choice]
    heads = tuple(f"variations.{kind}." for kind in used_kinds)
    return robot.replace(
        name=f"{robot.name} with {', '.join(descriptions)}"[:400],
        variations=original.variations.replace(**{k: {} for k in used_kinds}),
        priors={key: prior for key, prior in robot.priors.items() if not key.startswith(heads)},
    )


def times_friction(robot: Robot, factor: float) -> Surface:
    """The floor of a robot with so many times its friction: every level of [friction.axes] and [friction.direction].

    Raises InputError for a factor below 0, or a level beyond any robot.
    """
    parts = {}
    for part in ON_FLOOR:
        law = getattr(robot.friction, part)
        levels = {name: getattr(law, name) for name in type(law).model_fields if any(word in name for word in LEVELS)}
        parts[part] = law.replace(
            **{name: (factor * np.array(level)).tolist() for name, level in levels.items() if level is not None}
        )
    return Surface(friction=Friction(**parts))


def vary_as(robot: Robot, text: str) -> Robot:
    """`vary_robot` by a text such as "payload=2kg,floor=carpet"; the robot for an empty one. Raises InputError."""
    choices: dict[str, Any] = {}
    for part in filter(None, (piece.strip() for piece in text.split(","))):
        kind, equals, name = (piece.strip() for piece in part.partition("="))
        if not equals or not name:
            raise InputError("not a variation", got=part, expected="kind=name, such as payload=2kg", where="with")
        if kind not in KINDS:
            raise InputError("no such kind of variation", got=kind, remedy=_nearest(kind, KINDS), where="with")
        if kind in choices:
            raise InputError("asked for twice", got=f"{kind}={choices[kind]}, {part}", expected="one", where="with")
        choices[kind] = name
    return vary_robot(robot, **choices)


def _named(robot: Robot, kind: str, name: str) -> Any:
    """What a robot file knows under a name. Raises InputError, with the nearest name, where there is none."""
    named_values: Mapping[str, Any] = getattr(robot.variations, kind)
    if name in named_values:
        return named_values[name]
    if not named_values:
        raise InputError(
            f"{robot.name} knows no {kind} by name",
            got=name,
            expected=f"[variations.{kind}.{name}]",
            remedy="add the table to the robot file",
            where=kind,
        )
    raise InputError(f"no {kind} of this name", got=name, remedy=_nearest(name, list(named_values)), where=kind)


def _of_kind(kind: str, value: Any) -> Any:
    value_type = {"payload": Payload, "floor": Surface, "tilt": Floor, "battery": Battery}[kind]
    if not isinstance(value, value_type):
        raise InputError("not a variation", got=value, expected=f"a name, or {value_type.__name__}(..)", where=kind)
    return value


def _nearest(name: str, names: Sequence[str]) -> str:
    return did_you_mean(name, names, f"known names: {', '.join(names)}")


def _priors_of(robot: Robot, kind: str, choice: object) -> dict[str, Prior]:
    """What the file says of the numbers of a variation, by their keys in its table."""
    head = f"variations.{kind}.{choice}."
    return {key.removeprefix(head): prior for key, prior in robot.priors.items() if key.startswith(head)}


def _loaded(robot: Robot, payload: Payload, load_priors: Mapping[str, Prior]) -> Robot:
    """Body and load as one: their common centre of mass, and their inertias about it by Steiner's theorem."""
    body, total = robot.body, robot.body.mass + payload.mass
    centre = (body.mass * np.array(body.centre) + payload.mass * np.array(payload.offset)) / total
    body_shift, load_shift = (
        float(np.sum((place - centre) ** 2)) for place in (np.array(body.centre), np.array(payload.offset))
    )
    inertia = (body.inertia + body.mass * body_shift) + (payload.inertia + payload.mass * load_shift)
    centred = _of_centre(robot, payload.mass / total, load_priors)
    priors = {key: prior for key, prior in robot.priors.items() if key != "body.centre_m" or not centred} | centred
    for name in ("mass_kg", "inertia_kg_m2"):
        before, load_prior = priors.get(f"body.{name}"), load_priors.get(name)
        if before is not None and load_prior is not None and before.std is not None and load_prior.std is not None:
            priors[f"body.{name}"] = before.replace(std=float(np.hypot(before.std, load_prior.std)))
    try:
        return robot.replace(body=body.replace(mass=total, inertia=inertia, centre=centre.tolist()), priors=priors)
    except InputError as error:
        raise error.at("payload") from None


def _of_centre(robot: Robot, share: float, load_priors: Mapping[str, Prior]) -> dict[str, Prior]:
    """What is known of the common centre of mass, of which the load is a share: by key."""
    priors = {}
    for k in range(2):
        before, load_prior = (
            of.get(f"{name}[{k}]", of.get(name))
            for of, name in ((robot.priors, "body.centre_m"), (load_priors, "offset_m"))
        )
        prior = load_prior or before
        if prior is not None:
            parts = [(before, 1.0 - share), (load_prior, share)]
            std = math.hypot(
                *(
                    part * one_prior.std
                    for one_prior, part in parts
                    if one_prior is not None and one_prior.std is not None
                )
            )
            priors[f"body.centre_m[{k}]"] = prior.replace(std=std or None)
    return priors


def _on_surface(robot: Robot, surface: Surface, surface_priors: Mapping[str, Prior]) -> Robot:
    parts = {*ON_FLOOR, *surface.friction.model_fields_set}
    friction = robot.friction.replace(**{part: getattr(surface.friction, part) for part in sorted(parts)})
    replaced_parts = tuple(f"friction.{part}" for part in parts)
    priors = {key: prior for key, prior in robot.priors.items() if not key.startswith(replaced_parts)}
    surface_priors = {
        key if key != "traction_mu" else "wheels.traction_mu": prior for key, prior in surface_priors.items()
    }
    if surface.traction_mu is not None:
        robot = robot.replace(wheels=robot.wheels.replace(traction_mu=surface.traction_mu))
    return robot.replace(
        friction=friction, priors=priors | dict(surface_priors), correlation=_without(robot.correlation, replaced_parts)
    )


def _without(correlation: KeyCorrelation | None, removed_keys: tuple[str, ...]) -> KeyCorrelation | None:
    """The correlations of the numbers that stay; None where fewer than two do."""
    indices = [
        k
        for k, key in enumerate(correlation.keys if correlation is not None else ())
        if not key.startswith(removed_keys)
    ]
    if correlation is None or len(indices) < 2:
        return None
    keys, std = tuple(correlation.keys[k] for k in indices), correlation.std
    return key_correlation(keys, correlation.of(keys), None if std is None else tuple(std[k] for k in indices))


def _on_slope(robot: Robot, floor: Floor, slope_priors: Mapping[str, Prior]) -> Robot:
    return robot.replace(
        floor=floor, priors=robot.priors | {f"floor.{key}": prior for key, prior in slope_priors.items()}
    )


def _fed(robot: Robot, battery: Battery, battery_priors: Mapping[str, Prior]) -> Robot:
    limit = robot.motor.voltage_limit
    limits = tuple(min(volts, battery.supply) for volts in np.atleast_1d(limit).tolist())
    motor = robot.motor.replace(voltage_limit=limits if isinstance(limit, tuple) else limits[0])
    drive = robot.drive.replace(supply=battery.supply)
    priors = {key: prior for key, prior in robot.priors.items() if key != "drive.supply_V"}
    return robot.replace(
        motor=motor, drive=drive, priors=priors | {f"drive.{key}": prior for key, prior in battery_priors.items()}
    )


_CHANGES: dict[str, Callable[[Robot, Any, Mapping[str, Prior]], Robot]] = {
    "payload": _loaded,
    "floor": _on_surface,
    "tilt": _on_slope,
    "battery": _fed,
}
