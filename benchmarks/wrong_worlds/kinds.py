"""Forty kinds of wrong world: a right case and a size in, a wrong case out. At a size of 0 each is the right world.

key: what a right remedy is called, a key of the robot file, a nuisance, or "change"; "" where no candidate describes
the cause. near: keys that come so close that they are no false answer. known: whether a default fit takes care of it
by itself, so that it is sized without nuisances. most: beyond which a size means nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.wrong_worlds.log import SECONDS, SPEEDS, Case
from benchmarks.wrong_worlds.world import BOX, ELLIPSE, STEP, WHEELS, World

CHANGE = "change"
WHEN = 0.55 * SECONDS  # [s]
FINE, FINEST = STEP / 4.0, STEP / 20.0  # where kinks are no events: encoder counts would show longer steps


@dataclass(frozen=True)
class Kind:
    """A kind of wrong world; `make` takes a right case and a size."""

    name: str
    words: str
    make: Callable[[Case, float], Case]
    key: str = ""
    near: tuple[str, ...] = ()
    known: bool = False
    most: float = 1.0


def _peak(case: Case) -> float:
    """Current of a stalled motor at the largest command [A]."""
    return 0.85 * case.told.voltage_limit / case.told.resistance[0]


def _third(values: tuple[float, ...], which: int, factor: float) -> tuple[float, ...]:
    """One of the wheels changed by a factor."""
    return tuple(value * factor if i == which else value for i, value in enumerate(values))


def _plain(case: Case) -> Case:
    """Logged by plain wheel speeds: where another sensor would hide or replace what is wrong."""
    return case.setup_but(sensor=SPEEDS, memory=0.0)


def _shaped(case: Case, world: str, told: str, size: float) -> Case:
    """A shape under the file of another; size: how much of its moves are along two axes.

    Friction at three wheels also turns a robot that goes along y: there moves are along x first.
    """
    v, c, arm = case.told.viscous, case.told.coulomb, case.told.robot_radius
    level, rim = c[0] / 3.0**0.5, v[0] / 1.5
    if WHEELS in (world, told):
        c = (c[0], 2.0 * level, 3.0 * arm * level)
        v = (v[0], v[0], 3.0 * arm**2 * rim)
    both = case.both_but(coulomb=c, viscous=(v[0], v[0], v[2]), rim=(level, rim), shape=told, frame=False)
    return both.world_but(shape=world).setup_but(mix=size, apart=True, forward=WHEELS in (world, told))


def _turning(case: Case, size: float) -> Case:
    return case.both_but(frame=False).world_but(frame=True).setup_but(mix=size, apart=True)


def _tilted(case: Case, size: float) -> Case:
    """[rad]. The heading stays within some degrees, as a floor that is taken for a constant force asks for."""
    return case.setup_but(turns=False).world_but(pull=(9.81 * case.told.mass * size, 0.0))


def _world(field: str, neutral: float, slope: float = 1.0) -> Callable[[Case, float], Case]:
    """A number of the World at neutral + slope size."""
    return lambda case, size: case.world_but(**{field: neutral + slope * size})


def _at(case: Case, step: float) -> Case:
    return Case(case.world, case.told, case.setup, step)


def _lossy(case: Case, size: float) -> Case:
    """A jump of the force at every change of its sign: no event, so the error falls with the step alone."""
    return _at(case.world_but(efficiency=1.0 - size), FINEST)


def _scaled(field: str, sign: float = 1.0) -> Callable[[Case, float], Case]:
    """A number of the World times 1 + sign size."""
    return lambda case, size: case.world_but(**{field: getattr(case.told, field) * (1.0 + sign * size)})


def _one(field: str, which: int, sign: float) -> Callable[[Case, float], Case]:
    """That of one wheel times 1 + sign size."""
    return lambda case, size: case.world_but(**{field: _third(getattr(case.told, field), which, 1.0 + sign * size)})


def _setup(field: str, plain: bool = False) -> Callable[[Case, float], Case]:
    """The size as a number of how a log is made."""
    return lambda case, size: (_plain(case) if plain else case).setup_but(**{field: size})


def _rolling(fine: bool = True, **fields: float) -> Callable[[Case, float], Case]:
    """What turns with the wheels: fields at value x size."""

    def make(case: Case, size: float) -> Case:
        changed = {name: value * size for name, value in fields.items() if name not in ("bumps", "teeth")}
        kept = {name: value for name, value in fields.items() if name in ("bumps", "teeth")}
        return _at(_plain(case).world_but(**changed, **kept), FINE if fine else STEP)

    return make


def _cogged(case: Case, size: float) -> Case:
    """Of the Coulomb force along x, at each wheel."""
    return _at(_plain(case).world_but(cogging=size * case.told.coulomb[0], teeth=24.0), FINE)


def _rotors(case: Case, size: float) -> Case:
    """Inertia of three rotors as a share of the mass on the move along x."""
    told = case.told
    return case.world_but(rotor_inertia=size * told.mass * told.wheel_radius[0] ** 2 / (told.gear_ratio**2 * 1.5))


def _changed(**fields: float) -> Callable[[Case, float], Case]:
    """From WHEN on another robot: fields at 1 + value x size."""
    return lambda case, size: case.world_but(
        change=WHEN, **{name: 1.0 + value * size for name, value in fields.items()}
    )


def _limited(case: Case, size: float) -> Case:
    return _at(case.world_but(limit=_peak(case) * 1.6 * (1.0 - size) if size > 0.0 else World.limit), FINE)


def _slips(case: Case, size: float) -> Case:
    """Traction: at 0 more than any motor gives."""
    most = 1.6 * _peak(case) * float(case.told.ke[0])
    return _at(_plain(case).world_but(traction=most * (1.0 - size) if size > 0.0 else World.traction), FINE)


def _heats(case: Case, size: float) -> Case:
    return case.world_but(heating=size, load=0.3 * _peak(case))


AXES = "friction.axes"
KINDS: tuple[Kind, ...] = (
    Kind("fade", "a battery that fades over the log", _world("fade", 0.0), "fade", most=0.5),
    Kind("gain", "a supply lower than said", _world("gain", 1.0, -1.0), "gain", most=0.5),
    Kind("current limit", "a driver that limits the current", _limited, "motor.current_limit_A", most=0.9),
    Kind(
        "voltage drop",
        "of bridge and brushes [V]",
        _world("drop", 0.0),
        "motor.voltage_drop_V",
        ("dead_band",),
        most=3.0,
    ),
    Kind("dead band", "of the driver [V]", _world("dead", 0.0), "dead_band", ("motor.voltage_drop_V",), True, 3.0),
    Kind("gear loss", "friction that grows with the load", _lossy, "motor.gear_efficiency", most=0.5),
    Kind("rotors", "that spin, and are not in the file", _rotors, "motor.rotor_inertia_kg_m2"),
    Kind(
        "weak motor", "one magnet weaker", _one("torque_constant", 1, -1.0), "motor.torque_constant_Nm_A[1]", most=0.5
    ),
    Kind("resistance", "of one motor higher", _one("resistance", 2, 1.0), "motor.resistance_ohm[2]"),
    Kind(
        "wheel radius",
        "all wheels worn",
        lambda case, size: case.world_but(wheel_radius=tuple(r * (1.0 - size) for r in case.told.wheel_radius)),
        "wheels.wheel_radius_m",
        most=0.3,
    ),
    Kind("one wheel", "worn", _one("wheel_radius", 0, -1.0), "wheels.wheel_radius_m[0]", most=0.3),
    Kind(
        "robot radius", "wheels further out than measured", _scaled("robot_radius"), "wheels.robot_radius_m", most=0.5
    ),
    Kind("mass", "more than weighed", _scaled("mass"), "body.mass_kg"),
    Kind("inertia", "more than calculated", _scaled("inertia"), "body.inertia_kg_m2", most=3.0),
    Kind("turning frame", "left out", _turning, "body.rotating_frame"),
    Kind("tilt", "of the floor [rad], the heading kept", _tilted, "tilt", ("push",), most=0.15),
    Kind(
        "payload",
        "dropped on the way",
        lambda case, size: case.world_but(change=WHEN, after_mass=1.0 / (1.0 + size)),
        CHANGE,
        ("body.mass_kg",),
        most=3.0,
    ),
    Kind("floor", "another one on the way", _changed(after_friction=1.0), CHANGE),
    Kind("battery swap", "a full battery on the way", _changed(after_gain=1.0), CHANGE, ("gain", "fade"), most=0.5),
    Kind("breakaway", "above sliding friction", _world("breakaway", 1.0), f"{AXES}.breakaway", most=3.0),
    Kind(
        "ellipse", "under the file of a box", lambda case, size: _shaped(case, ELLIPSE, BOX, size), "friction.direction"
    ),
    Kind("box", "under the file of an ellipse", lambda case, size: _shaped(case, BOX, ELLIPSE, size), AXES),
    Kind(
        "wheels",
        "friction at the wheels under the file of a box",
        lambda case, size: _shaped(case, WHEELS, BOX, size),
        "friction.wheels",
    ),
    Kind("latency", "of the log [s]", _setup("latency"), "latency", (), True, 0.2),
    # What no candidate describes.
    Kind("sag", "a battery with an inner resistance [ohm]", _world("battery", 0.0), most=2.0),
    Kind("heating", "windings that warm up", _heats, most=2.0),
    Kind("off centre", "centre of mass ahead of the wheels' [m]", _world("centre", 0.0), "body.centre_m", most=0.08),
    Kind("backward", "friction that is less backward", _world("aside", 0.0), most=0.9),
    Kind(
        "Stribeck",
        "friction that falls with the speed",
        _world("stribeck", 0.0),
        f"{AXES}.stribeck_speed",
        (f"{AXES}.breakaway",),
        most=3.0,
    ),
    Kind("drag", "that grows with the square of the speed", _world("drag", 0.0), most=3.0),
    Kind("warming", "viscous friction that falls as it runs", _world("cooling", 0.0), near=(CHANGE,), most=0.9),
    Kind(
        "umbilical",
        "a pull in the world, the robot turning [N]",
        lambda case, size: case.world_but(pull=(size, 0.0)),
        "tilt",
        most=8.0,
    ),
    Kind(
        "slip",
        "wheels that spin where the floor gives no more",
        _slips,
        "wheels.traction_mu",
        ("motor.current_limit_A",),
        most=0.9,
    ),
    Kind("eccentric", "wheels out of round", _rolling(eccentric=1.0), most=0.3),
    Kind("rollers", "nine bumps a turn", _rolling(eccentric=1.0, bumps=9.0), most=0.1),
    Kind("cogging", "24 steps a turn", _cogged, most=2.0),
    Kind("backlash", "of the gears [m at the rim]", _rolling(gap=1.0), most=0.02),
    Kind("jitter", "of the stamps, a share of a row", _setup("jitter", True), most=3.0),
    Kind(
        "filter",
        "speeds through a first-order filter [s]",
        _setup("smoothing", True),
        near=("latency",),
        known=True,
        most=0.2,
    ),
    Kind("slow driver", "takes its command so often [s]", _setup("period"), near=("latency",), known=True, most=0.2),
)


def by_name(name: str) -> Kind:
    """The kind of a name."""
    return next(kind for kind in KINDS if kind.name == name)
