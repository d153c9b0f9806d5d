"""The first guess: a robot one can simulate, from what a ruler and a scale tell: azimuths, radii, mass.

Everything else is guessed from what such robots have in common, with a standard deviation so wide that a measurement
overrules it at once. What is known, by stall force per mass, friction per weight and yaw torque per (force * b):

    axebot (2012)    11 m/s^2    0.10..0.15    0.45
    axebot-lab       7.6 m/s^2   0.01..0.02    0.31
    robotino         15 m/s^2    0.46..0.54    not measured

Rotors behind a gear weigh: of 5 to 100 g cm^2 behind 15:1 to 30:1, as such robots have them, their spin adds 5 to 20 %
of the mass along x and y. That may be nothing (1:1) or as much as the robot itself (100:1): the guess is as wide as
it is large.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from omnidyn.model.drive import DUTY, SPEED, Drive
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.keys import (
    EMF,
    FRICTION,
    GAINS,
    ROTOR,
    TORQUE,
    VISCOUS,
    Key,
    all_keys,
    expand,
    find_key,
    name_of,
    with_priors,
)
from omnidyn.model.motor import Motor
from omnidyn.model.robot import GIVEN, GUESS, GUESSES, IMPORTED, MEASURED, Body, Origin, Prior, Robot
from omnidyn.model.surroundings import GRAVITY as GRAVITY
from omnidyn.model.wheels import PerWheel, Wheels

DIRECTION, BODY_AXES = "direction", "axes"
GEAR, LIMIT, RATE, SUPPLY = "motor.gear_ratio", "motor.voltage_limit_V", "drive.rate_Hz", "drive.supply_V"

TOP_SPEED = 1.0  # [m/s] that the robot reaches at the voltage limit, friction included
STALL_ACCELERATION = 8.0  # [m/s^2] stall force over mass: between a gentle robot (4) and a Robotino (15)
VOLTAGE_LIMIT = 12.0  # [V]
MOTOR_SPEED = 600.0  # [rad/s] no-load speed of the motor shaft: small brushed motors turn at 4000 to 10 000 rpm
FRICTION_SHARE = 0.2  # of the weight: Coulomb friction; 0.02 to 0.5 are known
VISCOUS_SHARE = 0.2  # of the Coulomb friction, added at 1 m/s
LOOP_TIME = 0.2  # [s] of a speed loop, kp/ki
ROTOR_SHARE = 0.1  # of the mass, that the spin of all rotors adds in the direction where it adds least
YAW_SHARE = 0.5  # of Coulomb friction * b: turning on the spot omni wheels roll, and hardly scrub

# Standard deviations over values. 0.5: a factor of about 2 either way; 1: only the order of magnitude is known.
SPREAD = {
    "body.inertia_kg_m2": 0.5,
    "motor.resistance_ohm": 1.0,
    "motor.torque_constant_Nm_A": 0.5,
    "motor.emf_constant_Vs_rad": 0.5,
    "motor.gear_ratio": 0.5,
    "motor.voltage_limit_V": 0.5,
    ROTOR: 1.0,
    "drive.supply_V": 0.5,
}
FRICTION_SPREAD = 1.0
LIKE_SPREAD = 0.3  # of what is taken over from another robot
EXACT_KEYS = ("wheels.azimuth_deg", "wheels.roller_angle_deg")  # a drawing, not a measurement

_COULOMB, _VISCOUS = f"{FRICTION_SHARE:g} of the weight", f"{VISCOUS_SHARE:g} C at 1 m/s"
_YAW = f"{YAW_SHARE:g} C b"
REASONS = {
    "body.inertia_kg_m2": "a uniform disc out to the wheels, M b^2/2",
    "motor.voltage_limit_V": "a common battery",
    "motor.resistance_ohm": f"stalled motors push with M * {STALL_ACCELERATION:g} m/s^2",
    "motor.torque_constant_Nm_A": "equal to the EMF constant in SI units",
    "motor.emf_constant_Vs_rad": f"the motor turns at {MOTOR_SPEED:g} rad/s at the voltage limit without load",
    "motor.gear_ratio": f"the robot reaches {TOP_SPEED:g} m/s at the voltage limit",
    "drive.kp_V_s_rad": "the whole voltage for an error of half the no-load speed",
    "drive.ki_V_rad": f"kp / {LOOP_TIME:g} s",
    ROTOR: f"the spin of all rotors adds {ROTOR_SHARE:g} M: at a wheel J l^2/r^2",
    "friction.axes.coulomb": f"{_COULOMB}, C; about yaw {_YAW}",
    "friction.axes.viscous": f"{_VISCOUS}, B; about yaw B b^2",
    "friction.direction.coulomb": f"{_COULOMB}, C, the same in every direction",
    "friction.direction.viscous": f"{_VISCOUS}, B",
    "friction.direction.yaw_coulomb": _YAW,
    "friction.direction.yaw_viscous": "B b^2",
}


def even_azimuths(count: int) -> tuple[float, ...]:
    """Evenly spaced wheels, none straight ahead, one straight behind when odd [degree]: 60, 180, 300; 45, 135, ..."""
    return tuple(180.0 / count * (2 * k + 1) for k in range(count))


def mecanum_wheels(wheel_radius: PerWheel, robot_radius: PerWheel) -> Wheels:
    """Four mecanum wheels, rollers in an X seen from above: front left, front right, rear left, rear right.

    robot_radius: half track + half wheelbase [m].
    """
    return Wheels(
        azimuth_deg=(90.0, -90.0, 90.0, -90.0),
        roller_angle_deg=(-45.0, 45.0, 45.0, -45.0),
        wheel_radius=wheel_radius,
        robot_radius=robot_radius,
    )


def first_guess(
    name: str,
    wheels: Wheels,
    mass: float,
    voltage_limit: float | None = None,
    shape: str = DIRECTION,
    speed_loop: Sequence[float] = (),
    supply: float | None = None,
) -> Robot:
    """A robot from its wheels and its mass [kg]; voltage_limit [V] where it is known.

    shape: where friction acts, on the "direction" of travel (a disc) or on the body "axes" (the paper's box).
    speed_loop: of the firmware, (kp, ki, rate) [V s/rad, V/rad, Hz], or the rate alone: then the gains are guessed.
    supply [V]: of a drive that takes duties; no voltage is above it.

    Its priors say of every number whether it was given or guessed, and how wide the guess is. Raises InputError.
    """
    body = Body(mass=mass, inertia=_round(0.5 * mass * _mean(wheels.robot_radius) ** 2), rotating_frame=True)
    friction = _friction(mass, _mean(wheels.robot_radius))
    voltage_limit = supply if voltage_limit is None else voltage_limit
    motor = _motor(wheels, mass, friction, VOLTAGE_LIMIT if voltage_limit is None else voltage_limit)
    robot = Robot(
        name=name,
        source="omnidyn init: a first guess, to be identified",
        body=body,
        wheels=wheels,
        motor=motor,
        friction=Friction(direction=friction) if shape == DIRECTION else Friction(axes=_as_box(friction)),
        priors={},
        drive=_speed_loop(motor, speed_loop) if supply is None else Drive(kind=DUTY, supply=supply),
    )
    given_keys = {"body.mass_kg", SUPPLY} | ({LIMIT} if voltage_limit is not None else set())
    given_keys |= {RATE} if len(speed_loop) == 1 else {RATE, *GAINS}
    priors = {}
    for key in map(Key.parse, all_keys(robot)):
        if key.name in given_keys or key.part == "wheels":
            priors[key.name] = Prior(origin=GIVEN)
        else:
            priors[str(key)] = Prior(std=spread(key, robot), origin=GUESS)
    return robot.replace(priors=priors)


def spread(key: Key, robot: Robot) -> float:
    """The standard deviation of a guess, by what it is a guess of: as wide as the first guess of a robot."""
    share = SPREAD.get(key.name, LIKE_SPREAD if key.part in ("body", "wheels") else FRICTION_SPREAD)
    return _round(share * abs(key.get(robot)))


def with_spread(robot: Robot) -> Robot:
    """The robot with a std for every guess that has none: a guess is never exact, and a fit must be free to leave it.

    A drawing stays as it is, and so does what is 0, for no share of it is a width.
    """
    bare = {name: prior for name, prior in robot.priors.items() if prior.origin == GUESS and prior.std is None}
    keys = {entry: prior for name, prior in bare.items() if find_key(name) for entry in expand(name, robot)}
    std = {name: spread(Key.parse(name), robot) for name in keys if name_of(name) not in EXACT_KEYS}
    return with_priors(robot, {name: keys[name].replace(std=value) for name, value in std.items() if value > 0.0})


def _speed_loop(motor: Motor, loop_numbers: Sequence[float]) -> Drive:
    """The firmware's loop, none where nothing is given of it.

    Guessed gains: the whole voltage for an error of half the no-load speed, and the integral takes over in 0.2 s.
    """
    if not loop_numbers:
        return Drive()
    if len(loop_numbers) == 3:
        return Drive(kind=SPEED, kp=loop_numbers[0], ki=loop_numbers[1], rate=loop_numbers[2])
    kp = _round(2.0 * float(np.mean(motor.emf_constant)) * float(np.mean(motor.gear_ratio)))
    return Drive(kind=SPEED, kp=kp, ki=_round(kp / LOOP_TIME), rate=loop_numbers[0])


def with_gear(robot: Robot, gear_ratio: float, source: str, origin: Origin = MEASURED) -> Robot:
    """The robot with a gear ratio that is known, and the same wheels under the same voltage: K l stays.

    So does J l^2 where the rotor is a guess, which says what it weighs at the wheels.
    """
    share = float(np.mean(robot.motor.gear_ratio)) / gear_ratio
    motor = robot.motor.replace(
        gear_ratio=gear_ratio,
        torque_constant=_times(robot.motor.torque_constant, share),
        emf_constant=_times(robot.motor.emf_constant, share),
    )
    shares = {TORQUE: share, EMF: share}
    if ROTOR in robot.priors and robot.priors[ROTOR].origin in GUESSES:
        motor, shares = motor.replace(rotor_inertia=_times(motor.rotor_inertia, share**2)), shares | {ROTOR: share**2}
    spreads = {
        key: prior.replace(std=_round(prior.std * shares[name_of(key)]))
        for key, prior in robot.priors.items()
        if name_of(key) in shares and prior.std is not None
    }
    priors = {key: prior for key, prior in robot.priors.items() if name_of(key) != GEAR}
    return robot.replace(motor=motor, priors=priors | spreads | {GEAR: Prior(source=source, origin=origin)})


def with_rotor(robot: Robot, rotor_inertia: float) -> Robot:
    """The robot with the inertia of a rotor as its maker gives it, at the motor shaft [kg m^2]."""
    motor = robot.motor.replace(rotor_inertia=rotor_inertia)
    priors = {key: prior for key, prior in robot.priors.items() if name_of(key) != ROTOR}
    return robot.replace(motor=motor, priors=priors | {ROTOR: Prior(origin=GIVEN)})


def default_prior(key: str, value: Any) -> Prior:
    """What is known of a number of `init` that its user took as it was offered: not much."""
    return Prior(
        std=None if key in EXACT_KEYS else _round(LIKE_SPREAD * value), source="default of omnidyn init, accepted"
    )


def _friction(mass: float, robot_radius: float) -> DirectionFriction:
    """A disc: on real floors friction is collinear with the motion and the same in every direction (EVIDENCE.md, 2).

    C = 0.2 M g;  B = 0.2 C per m/s;  about yaw the wheels slide at b, but mostly roll: C b/2 and B b^2.
    """
    coulomb = FRICTION_SHARE * mass * GRAVITY
    viscous = VISCOUS_SHARE * coulomb
    return DirectionFriction(
        coulomb=(_round(coulomb), _round(coulomb)),
        viscous=_round(viscous),
        yaw_coulomb=_round(YAW_SHARE * coulomb * robot_radius),
        yaw_viscous=_round(viscous * robot_radius**2),
    )


def _as_box(friction: DirectionFriction) -> AxesFriction:
    """The same levels on the body axes."""
    viscous, (along_x, along_y) = friction.viscous, friction.coulomb
    return AxesFriction(
        viscous=(viscous, viscous, friction.yaw_viscous), coulomb=(along_x, along_y, friction.yaw_coulomb)
    )


def _motor(wheels: Wheels, mass: float, friction: DirectionFriction, voltage_limit: float) -> Motor:
    """Motors from two things one knows of a robot that drives: how hard it pushes and how fast it gets.

    Under u_i = U g_i . e the wheels push along e with e^T G G^T e times the force f of one wheel, which falls from its
    stall value f0 to 0 at the no-load speed v0 of the rim. In the weakest direction, lambda = min eigenvalue of the
    x, y part of G G^T:

        stall      lambda f0 = F = M * 8 m/s^2
        top speed  F (1 - v/v0) = C + B v   =>   v0 = v F/(F - C - B v)

    v0 = U r/(K l) and f0 = l K U/(R r) then give  l = w0 r/v0,  K = U/w0,  R = U^2/(v0 f0),  w0 the motor's speed.
    The rotors J add lambda J l^2/r^2 = 0.1 M in that direction.
    """
    stall = mass * STALL_ACCELERATION
    rolling_force = friction.coulomb[0] + friction.viscous * TOP_SPEED
    no_load = TOP_SPEED * stall / (stall - rolling_force)
    plane = wheels.wrench_matrix[:2]
    weakest, radius = float(np.linalg.eigvalsh(plane @ plane.T)[0]), float(wheels.radii.mean())
    motor_stall, constant = stall / weakest, _round(voltage_limit / MOTOR_SPEED)
    gear = _round(MOTOR_SPEED * radius / no_load)
    return Motor(
        resistance=_round(voltage_limit**2 / (no_load * motor_stall)),
        torque_constant=constant,
        emf_constant=constant,
        gear_ratio=gear,
        voltage_limit=voltage_limit,
        rotor_inertia=_round(ROTOR_SHARE * mass * (radius / gear) ** 2 / weakest),
    )


def like(
    preset: Robot,
    name: str,
    wheels: Wheels,
    mass: float,
    voltage_limit: float | None = None,
    given_keys: Collection[str] = (),
) -> Robot:
    """A robot built like another one: its motors and drive, its inertia and friction scaled to the new size.

    Inertia goes with M b^2, friction with M (the weight on the floor), about yaw with M b, viscous M b^2.
    given_keys: keys of the file that were not taken from the preset. Raises InputError, also where the preset has
    one value per wheel and another number of wheels.
    """
    heavier, wider = mass / preset.body.mass, _mean(wheels.robot_radius) / _mean(preset.wheels.robot_radius)
    friction = _scaled(preset.friction, heavier, wider, preset.wheels.count / wheels.count)
    inertia = _times(preset.body.inertia, heavier * wider**2)
    motor = preset.motor if voltage_limit is None else preset.motor.replace(voltage_limit=voltage_limit)
    robot = Robot(
        name=name,
        source=f"omnidyn init: like {preset.name}, to be identified",
        wheels=wheels,
        motor=motor,
        body=Body(mass=mass, inertia=inertia, rotating_frame=preset.body.rotating_frame),
        drive=preset.drive,
        friction=friction,
        priors={},
    )
    return robot.replace(priors=_priors_like(robot, preset, given_keys))


def _priors_like(robot: Robot, preset: Robot, given_keys: Collection[str]) -> dict[str, Prior]:
    """Source and spread of every number: at least 30 %, more where the preset is less certain than that."""
    preset_keys, priors, copied_prior = all_keys(preset), {}, Prior(source=f"like {preset.name}", origin=IMPORTED)
    for text in all_keys(robot.replace(priors=preset.priors)):
        key = Key.parse(text)
        if key.name in given_keys:
            priors[key.name] = Prior(origin=GIVEN)
        elif key.name in EXACT_KEYS:
            priors[key.name] = copied_prior
        else:
            prior = preset.priors.get(text) or preset.priors.get(key.name) or Prior()
            value, before = key.get(robot), key.get(preset) if text in preset_keys else 0.0
            std = max(LIKE_SPREAD * abs(value), (prior.std or 0.0) * (abs(value / before) if before else 1.0))
            priors[text] = copied_prior.replace(std=_round(std) if std > 0.0 else None)
    return priors


def _scaled(friction: Friction, heavier: float, wider: float, wheels: float) -> Friction:
    """Friction of a robot `heavier` and `wider` times as much, with 1/`wheels` times as many wheels."""
    turning, turning_viscous = heavier * wider, heavier * wider**2
    axes, along, rim = friction.axes, friction.direction, friction.wheels
    about_yaw = {field: turning_viscous if field in PER_SPEED else turning for field in SCALED}
    return Friction(
        axes=_changed(axes, {field: (heavier, heavier, factor) for field, factor in about_yaw.items()}),
        direction=_changed(
            along, dict.fromkeys(SCALED, heavier) | {f"yaw_{field}": factor for field, factor in about_yaw.items()}
        ),
        wheels=_changed(rim, dict.fromkeys(SCALED, heavier * wheels)),
    )


# What of friction grows with the robot: levels, and what there is per speed or per way. Speeds and exponents stay.
PER_SPEED = ("viscous", "damping", "stiffness")
SCALED = ("coulomb", "coulomb_backward", "breakaway", "breakaway_backward", *PER_SPEED)


def _changed(law: Any, factors: Mapping[str, Any]) -> Any:
    """A law with some of its numbers times factors."""
    return law.replace(
        **{
            field: _times(getattr(law, field), factor)
            for field, factor in factors.items()
            if field in type(law).model_fields
        }
    )


def _times(value: Any, factor: float | tuple[float, ...]) -> Any:
    """value * factor for a number, a tuple or nothing; a product is rounded, what stays the same is not touched."""
    if value is None or factor == 1.0:
        return value
    if isinstance(value, tuple):
        factors = factor if isinstance(factor, tuple) else (factor,) * len(value)
        return tuple(_times(item, item_factor) for item, item_factor in zip(value, factors, strict=True))
    return _round(value * factor, 6)


def guessed(robot: Robot) -> list[str]:
    """What of a robot is a guess, as short names: ["inertia", "resistance", ...]; all friction is one word."""
    keys = [place for key, prior in robot.priors.items() if prior.origin in GUESSES and (place := find_key(key))]
    return list(dict.fromkeys(FRICTION if key.level else Key(key.name).words for key in keys))


def rests_on(robot: Robot, at_rest: bool = False) -> list[str]:
    """What of a robot an answer rests on that is a guess, as `guessed` names it.

    Numbers that only show together, and were fitted together, are right as the sum or product that any answer takes
    from them: they are not named. at_rest: of what a robot at rest does, which no mass, speed or back-EMF changes.
    """
    guesses = {key: prior for key, prior in robot.priors.items() if prior.guessed}
    if at_rest:
        guesses = {
            key: prior for key, prior in guesses.items() if (place := find_key(key)) and not _shows_in_motion(place)
        }
    return guessed(robot.model_copy(update={"priors": guesses}))


def rests_on_guesses(robot: Robot, at_rest: bool = False) -> str:
    """The same as a line of text; "" where nothing is a guess."""
    return guess_line(rests_on(robot, at_rest))


def guess_line(names: Sequence[str]) -> str:
    """What an answer rests on, as a line of text; "" where nothing is a guess."""
    return f"rests on guesses of the robot file: {', '.join(names)}" if names else ""


def _shows_in_motion(key: Key) -> bool:
    return (
        key.level == VISCOUS or key.name == EMF or key.part in ("body", "drive") or key.field.endswith("_inertia_kg_m2")
    )


def reasons(robot: Robot) -> list[tuple[str, str]]:
    """(key, why) of every guess of `first_guess`, in the order of the file."""
    keys = dict.fromkeys(name_of(key) for key, prior in robot.priors.items() if prior.origin in GUESSES)
    reason_of = (
        REASONS if GEAR in keys else REASONS | {EMF: REASONS[GEAR]}
    )  # behind a gear that is known the speed tells the constant
    return [(key, reason_of[key]) for key in keys if key in reason_of]


def _mean(value: PerWheel) -> float:
    return float(np.mean(value))


def _round(value: float, digits: int = 3) -> float:
    """A guess has no more digits than that."""
    return float(f"{value:.{digits}g}")
