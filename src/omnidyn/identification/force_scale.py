"""What all forces of a fit scale with: the numbers that were taken as they stand, and that no log can correct.

    M v' = G (l K_t/r) i - friction,   i = (u - K_v l w)/R

Masses, friction and K_t/R, all s times as large, move the robot in the same way under the same volts: of forces a log
of volts and speeds shows ratios. What is fixed of the masses, or of the motors, says how large all of them are. A
measured current tells R, not K_t. Where no speed in m/s or position was measured, all of it hangs on the radius of the
wheels too.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np

from omnidyn.model.deadzone import push_lost_per_volt
from omnidyn.model.keys import DEAD_BAND, EMF, GAINS, ROTOR, TORQUE, WHEEL, Key, name_of, unit
from omnidyn.model.mass import added_mass
from omnidyn.model.robot import GIVEN, Prior, Robot

MASS, INERTIA, RADIUS = "body.mass_kg", "body.inertia_kg_m2", "wheels.wheel_radius_m"
AT = "@"  # KEY@GROUP is the number that a group has for itself
RATIO = f"the ratio of {TORQUE} to {EMF}"
RESISTANCE = "motor.resistance_ohm"
STEP = 0.1  # [V] of a dead band
UNITS = "N", "N", "N m"  # of a push


def scale_of_motion(robot: Robot, free: Collection[str], current: bool, metres: bool) -> str:
    """The sentence of a fit to whole logs.

    free: keys that were fitted. current: whether motor currents were. metres: whether a speed in m/s or a position was.
    """
    names = {Key.parse(key.partition(AT)[0]).name for key in free}
    masses = [key for key in (MASS, INERTIA) if key not in names][:1]
    # K_t alone, the EMF constant with it, is told by back-EMF; so is R where the current is measured.
    open_motors = {TORQUE, EMF} <= names or (RESISTANCE in names and not current) or bool(names & set(GAINS))
    motors = (
        []
        if open_motors
        else [key for key in (TORQUE, RESISTANCE) if key not in names and not (key == RESISTANCE and current)]
    )
    if not open_motors and TORQUE in names:
        motors.append(RATIO)
    held_keys = [*masses, *motors]
    if not held_keys:
        priors = [key for key in (MASS, TORQUE, RESISTANCE) if key in names]
        return f"the scale of all forces is that of the priors of {_listed(priors)}: all of them are free"
    radius = [] if metres or RADIUS in names else [RADIUS]
    return _sentence(robot, [*held_keys, *radius], names)


def scale_of_traction(robot: Robot, from_current: bool) -> str:
    """The sentence of a fit to steady stretches, whose forces are those of the motors, l K_t i/r."""
    words = _sentence(robot, [TORQUE, *(() if from_current else (RESISTANCE,)), "motor.gear_ratio", RADIUS])
    return words if from_current else f"{words}; {_behind(robot)}"


def _behind(robot: Robot) -> str:
    """What a dead band, which steady stretches do not tell from Coulomb friction, would take off it."""
    lost = [f"{STEP * force:.2g} {unit}" for force, unit in zip(push_lost_per_volt(robot), UNITS, strict=True)]
    band = f"a dead band of {_known(robot, DEAD_BAND)}" if robot.drive.dead_band else "no dead band of the driver"
    return (
        f"of the voltages {band} was taken off: every {STEP:g} V more would be up to {_listed(lost)} less Coulomb "
        "friction along x, y and about yaw, and a fit to whole logs, which tells the two apart, differs by that"
    )


def _sentence(robot: Robot, held_keys: Collection[str], free: Collection[str] = ()) -> str:
    key_texts = [f"{key} ({_known(robot, key)}{_spin(robot, free) if key == MASS else ''})" for key in held_keys]
    return f"all forces scale with {_listed(key_texts)}"


def _listed(words: Collection[str]) -> str:
    *first_words, last = words
    return f"{', '.join(first_words)} and {last}" if first_words else last


def _spin(robot: Robot, free: Collection[str]) -> str:
    """What rotors and wheels add to the mass, where they are taken as they stand."""
    keys = [
        key
        for key, value in ((ROTOR, robot.motor.rotor_inertia), (WHEEL, robot.wheels.wheel_inertia))
        if np.any(value) and key not in free
    ]
    if keys:
        spin_mass = float(np.diag(added_mass(robot))[:2].mean())
        return f"; {_listed([f'{key}, {_known(robot, key)},' for key in keys])} adds {spin_mass:.3g} kg"
    return "" if {ROTOR, WHEEL} & set(free) else "; no rotor is in the robot file"


def _known(robot: Robot, key: str) -> str:
    """A number or the range of a list, and what is known of it: "6.2 kg, given"; of a ratio, that it was kept."""
    if key == RATIO:
        return "kept"
    place, priors = Key.parse(key), list(_priors(robot, key))
    count = robot.wheels.count if place.name.startswith(("motor", "wheels")) else 1
    values = [Key(place.name, k if count > 1 else None).get(robot) for k in range(count)]
    low, high = min(values), max(values)
    size = f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
    origins = _listed(list(dict.fromkeys(prior.origin for prior in priors)))
    stds = [prior.std for prior in priors if prior.std is not None]
    std = f", std {max(stds):.2g}" if stds else ""
    return f"{size} {unit(key)}".rstrip() + f", {'a guess' if origins == 'guess' else origins}{std}"


def _priors(robot: Robot, key: str) -> Iterator[Prior]:
    """What is known of a number, or of the entries of its list."""
    priors = [prior for name, prior in robot.priors.items() if name_of(name) == key]
    yield from priors or [Prior(origin=GIVEN)]
