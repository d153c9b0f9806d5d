"""Set-ups: what is set free, how the robot is driven and what is logged; drawn beforehand, from the equation of motion.

    M v' = G (l K_t/r) i - B v - C sgn v,   i = (u - K_v l w)/R,   w = G' v/r,   M = mass + rotors (l/r)^2 G G'

lost: of a deficient set-up, numbers that its directions hold, and how many directions there are; of axes that did not
move, whose friction is not fitted, one each. cures: words of which one must be among the cures.
"""

from __future__ import annotations

from dataclasses import dataclass

MASS, INERTIA, ROTOR = "body.mass_kg", "body.inertia_kg_m2", "motor.rotor_inertia_kg_m2"
OHM, TORQUE, EMF = "motor.resistance_ohm", "motor.torque_constant_Nm_A", "motor.emf_constant_Vs_rad"
GEAR, RADIUS, ARM = "motor.gear_ratio", "wheels.wheel_radius_m", "wheels.robot_radius_m"
VISCOUS, COULOMB = (tuple(f"friction.axes.{level}[{k}]" for k in range(3)) for level in ("viscous", "coulomb"))
FRICTION = (*VISCOUS, *COULOMB)
TWIST, WHEELS, CURRENT, HEADING, POSE = "twist", "wheel_speed", "current", "heading", "pose"
RICH, FORWARD, SIDEWAYS, TURNS, STEADY = "rich", "x", "y", "yaw", "steady"


@dataclass(frozen=True)
class Setup:
    """free: keys. drive: how. logged: channels beside voltages. lost: keys that the directions hold; count: of them."""

    name: str
    free: tuple[str, ...]
    drive: str = RICH
    logged: tuple[str, ...] = (TWIST,)
    nuisances: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()
    count: int = 0
    cures: tuple[str, ...] = ()


WEIGH, MEASURE, LABEL, AMPS = "weigh the robot", "measure", "data sheet", "log currents"

DEFICIENT = (
    Setup(
        "masses, motors and friction",
        (MASS, INERTIA, TORQUE, OHM, *FRICTION),
        lost=(MASS, INERTIA, TORQUE, OHM, *VISCOUS),
        count=2,
        cures=(WEIGH, AMPS),
    ),
    Setup(
        "masses, resistance and friction",
        (MASS, INERTIA, OHM, *FRICTION),
        lost=(MASS, INERTIA, OHM, *FRICTION),
        count=1,
        cures=(WEIGH, AMPS),
    ),
    Setup(
        "masses, K_t and K_v apart, friction",
        (MASS, INERTIA, TORQUE, EMF, *FRICTION),
        lost=(MASS, INERTIA, TORQUE, EMF, *VISCOUS),
        count=2,
        cures=(WEIGH, LABEL),
    ),
    Setup("viscous friction against back-EMF", (EMF, *FRICTION), lost=(EMF, *VISCOUS), count=1, cures=(AMPS, LABEL)),
    Setup(
        "wheel radius and gear, speed over ground",
        (RADIUS, GEAR, *FRICTION),
        lost=(RADIUS, GEAR),
        count=1,
        cures=(MEASURE, "log wheel speeds"),
    ),
    Setup(
        "torque constant and resistance", (TORQUE, EMF, OHM, *COULOMB), lost=(TORQUE, OHM), count=1, cures=(AMPS, LABEL)
    ),
    Setup("torque and EMF constants and gear", (TORQUE, EMF, GEAR), lost=(TORQUE, EMF, GEAR), count=1, cures=(LABEL,)),
    Setup(
        "rotors, mass and inertia",
        (ROTOR, MASS, INERTIA, *FRICTION),
        lost=(ROTOR, MASS, INERTIA),
        count=1,
        cures=(WEIGH, LABEL),
    ),
    Setup(
        "rotors, mass and inertia, scale of all",
        (ROTOR, MASS, INERTIA, OHM, *FRICTION),
        lost=(ROTOR, MASS, INERTIA, OHM, *FRICTION),
        count=2,
        cures=(WEIGH, LABEL),
    ),
    Setup(
        "robot radius, inertia, friction of turning",
        (ARM, INERTIA, VISCOUS[2], COULOMB[2]),
        lost=(ARM, INERTIA, VISCOUS[2], COULOMB[2]),
        count=1,
        cures=(MEASURE, "log wheel speeds"),
    ),
    Setup(
        "wheel radius and masses, wheel speeds only",
        (RADIUS, MASS, INERTIA, *FRICTION),
        logged=(WHEELS,),
        lost=(RADIUS, MASS, INERTIA, *FRICTION),
        count=1,
        cures=(WEIGH, "log the speed over the ground"),
    ),
    Setup(
        "wheel radius and friction, all else, wheel speeds",
        (RADIUS, MASS, INERTIA, OHM, *FRICTION),
        logged=(WHEELS,),
        lost=(RADIUS, MASS, INERTIA, OHM, *FRICTION),
        count=2,
        cures=(WEIGH, MEASURE),
    ),
    Setup(
        "forward only",
        FRICTION,
        drive=FORWARD,
        lost=(VISCOUS[1], VISCOUS[2], COULOMB[1], COULOMB[2]),
        count=2,
        cures=("drive", "move"),
    ),
    Setup(
        "sideways only",
        FRICTION,
        drive=SIDEWAYS,
        lost=(VISCOUS[0], VISCOUS[2], COULOMB[0], COULOMB[2]),
        count=2,
        cures=("drive", "move"),
    ),
    Setup(
        "forward only, mass and resistance",
        (MASS, OHM, VISCOUS[0], COULOMB[0]),
        drive=FORWARD,
        lost=(MASS, OHM, VISCOUS[0], COULOMB[0]),
        count=1,
        cures=(WEIGH, AMPS),
    ),
    Setup(
        "inertia, driven forward only",
        (INERTIA, VISCOUS[0], COULOMB[0]),
        drive=FORWARD,
        lost=(INERTIA,),
        count=1,
        cures=(MEASURE, "drive"),
    ),
    Setup(
        "heading only",
        FRICTION,
        logged=(HEADING,),
        lost=(VISCOUS[0], VISCOUS[1], COULOMB[0], COULOMB[1]),
        count=4,
        cures=("log", "drive"),
    ),
    Setup(
        "one constant speed",
        (VISCOUS[0], COULOMB[0]),
        drive=STEADY,
        lost=(VISCOUS[0], COULOMB[0]),
        count=1,
        cures=("speeds",),
    ),
    Setup(
        "gain and motors",
        (OHM, *FRICTION),
        nuisances=("gain",),
        lost=(OHM, "gain", *VISCOUS),
        count=1,
        cures=(AMPS, LABEL),
    ),
    Setup(
        "mass at one constant speed", (MASS, COULOMB[0]), drive=STEADY, lost=(MASS,), count=1, cures=(WEIGH, "speeds")
    ),
)

FULL = (
    Setup("friction", FRICTION),
    Setup("friction, wheel speeds", FRICTION, logged=(WHEELS,)),
    Setup("friction, counts of pose", FRICTION, logged=(POSE,)),
    Setup("friction and masses", (MASS, INERTIA, *FRICTION)),
    Setup("friction and motors", (TORQUE, *FRICTION)),
    Setup("friction and resistance", (OHM, *FRICTION)),
    Setup("masses alone", (MASS, INERTIA)),
    Setup("motors with currents", (TORQUE, EMF, OHM, *FRICTION), logged=(TWIST, CURRENT)),
    Setup("back-EMF with currents", (EMF, *FRICTION), logged=(TWIST, CURRENT)),
    Setup("masses and motors with currents", (MASS, INERTIA, TORQUE, OHM, *FRICTION), logged=(TWIST, CURRENT)),
    Setup("gear and radius with wheel speeds", (RADIUS, GEAR, *FRICTION), logged=(TWIST, WHEELS)),
    Setup("robot radius with wheel speeds", (ARM, INERTIA, VISCOUS[2], COULOMB[2]), logged=(TWIST, WHEELS)),
    Setup("wheel radius and masses, both speeds", (RADIUS, MASS, INERTIA, *FRICTION), logged=(TWIST, WHEELS)),
    Setup("rotors and friction", (ROTOR, *FRICTION)),
    Setup("rotors, inertia and friction", (ROTOR, INERTIA, *FRICTION)),
    Setup("forward only, its own friction", (VISCOUS[0], COULOMB[0]), drive=FORWARD),
    Setup("turning only, its own friction", (VISCOUS[2], COULOMB[2]), drive=TURNS, logged=(HEADING,)),
    Setup("friction, latency and dead band", FRICTION, nuisances=("latency", "dead_band")),
    Setup("back-EMF and resistance with currents", (EMF, OHM, *COULOMB), logged=(WHEELS, CURRENT)),
    Setup("Coulomb friction at one constant speed", (COULOMB[0],), drive=STEADY),
)
