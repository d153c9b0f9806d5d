"""A fit to a robot whose rotors weigh: 6.2 kg, 1.5e-6 kg m^2 behind 30:1 at wheels of 50 mm, 1.08 kg of it along x.

The logs come from the Moreau stepper of tests/reference, which shares no code with simulation/.
"""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.keys import ROTOR
from omnidyn.model.motor import Motor
from omnidyn.model.robot import Body, Prior, Robot
from omnidyn.model.wheels import Wheels
from omnidyn.run import Run
from omnidyn.simulation.exact.exact_march import why_not_exact
from tests.reference.modes import plant_of
from tests.reference.modes_stepper import stepped

J, SECONDS, DT, NOISE = 1.5e-6, 20.0, 0.02, np.array([0.01, 0.01, 0.05])
DISC = Friction(direction=DirectionFriction(coulomb=(14.0, 14.0), viscous=5.0, yaw_coulomb=1.4, yaw_viscous=0.1))
BOX = Friction(axes=AxesFriction(viscous=(5.0, 6.0, 0.1), coulomb=(14.0, 12.0, 1.4)))


def heavy(friction, rotor=J):
    """Four omni wheels at 45 degrees, 6.2 kg."""
    return Robot(
        name="heavy",
        body=Body(mass=6.2, inertia=0.14, rotating_frame=friction is DISC),
        wheels=Wheels(azimuth_deg=(45.0, 135.0, 225.0, 315.0), robot_radius=0.18, wheel_radius=0.05),
        motor=Motor(
            resistance=2.0,
            torque_constant=0.012,
            emf_constant=0.012,
            gear_ratio=30.0,
            voltage_limit=12.0,
            rotor_inertia=rotor,
        ),
        friction=friction,
    )


def log_of(robot, seed=1):
    """Levels held 0.2 to 0.8 s in any direction, by the stepper; its twist with noise."""
    rng, rows = np.random.default_rng(seed), []
    while len(rows) * DT < SECONDS:
        level = np.clip(rng.uniform(-9.0, 9.0, 3) @ robot.wheels.wrench_matrix, -12.0, 12.0)
        rows += [np.round(level, 2)] * int(rng.uniform(0.2, 0.8) / DT)
    voltage = np.array(rows[: round(SECONDS / DT)])
    twist = np.vstack([np.zeros(3), stepped(plant_of(robot), voltage, DT, 1e-4)[0]])
    return Run(
        t=np.arange(len(voltage) + 1) * DT,
        voltage=np.vstack([voltage, voltage[-1:]]),
        twist=twist + rng.normal(size=twist.shape) * NOISE,
        source="stepper",
    )


LOGS = {}


def log(friction):
    """The log of a robot, once for all tests."""
    name = "disc" if friction is DISC else "box"
    if name not in LOGS:
        LOGS[name] = log_of(heavy(friction))
    return LOGS[name]


@pytest.mark.parametrize("friction", [DISC, BOX], ids=["disc", "box"])
@pytest.mark.some(1)
def test_the_friction_comes_out_right_with_the_rotor_in_the_file(friction):
    """As one fits a robot of which only the mass is known; both models follow the log equally well.

    By least squares: what the true numbers leave of the disc's log is more than the noise that was added, and coloured.
    """
    robot = heavy(friction)
    assert bool(why_not_exact(robot)) == (friction is DISC)
    key = "friction.direction.coulomb[0]" if friction is DISC else "friction.axes.coulomb[0]"
    free, fits = ("friction", "motor.resistance_ohm", "body.inertia_kg_m2"), {}
    for rotor in (J, 0.0):
        start = heavy(halved(friction), rotor)
        fit = fits[rotor] = identify([log(friction)], start, OutputError(free=free, covariance="sandwich")).estimate
        print(f"{key} = {fit.value[key]:.3f} +- {fit.std[key]:.3f}, noise {fit.noise['twist[0]']:.4g}")
    right, wrong = fits[J], fits[0.0]
    assert abs(right.value[key] - 14.0) < 4.0 * right.std[key]
    assert right.std[key] < 0.155
    assert abs(right.value["body.inertia_kg_m2"] - 0.14) < 4.0 * right.std["body.inertia_kg_m2"]
    # Without it, all forces are too small by the share of the mass that the rotors have, and nothing shows it.
    assert wrong.value[key] == pytest.approx(right.value[key] * 6.2 / (6.2 + 2.0 * J * 900.0 / 0.0025), rel=0.01)
    assert wrong.noise["twist[0]"] == pytest.approx(right.noise["twist[0]"], rel=0.02)


def halved(friction):
    """Where the fit begins."""
    if friction is DISC:
        return Friction(direction=DirectionFriction(coulomb=(7.0, 7.0), viscous=2.0, yaw_coulomb=0.7, yaw_viscous=0.05))
    return Friction(axes=AxesFriction(viscous=(2.0, 2.0, 0.05), coulomb=(7.0, 7.0, 0.7)))


@pytest.mark.parametrize("friction", [DISC, BOX], ids=["disc", "box"])
def test_the_rotor_itself_can_be_fitted(friction):
    """Mass and motors known, friction and rotor free: both engines."""
    start = heavy(halved(friction), 0.6e-6)
    fit = identify([log(friction)], start, OutputError(free=("friction", ROTOR))).estimate
    print(fit.value[ROTOR], fit.std[ROTOR])
    assert abs(fit.value[ROTOR] - J) < 4.0 * fit.std[ROTOR]
    assert fit.std[ROTOR] < 0.1 * J
    assert fit.robot.motor.rotor_inertia == fit.value[ROTOR]


def test_the_rotor_of_one_motor():
    """It couples the axes: fitted by the engine that knows that, from a robot that the other one could serve."""
    robot = heavy(BOX, (J, J, 3 * J, J))
    fit = identify([log_of(robot)], heavy(BOX, J), OutputError(free=("friction", f"{ROTOR}[2]"))).estimate
    print(fit.value[f"{ROTOR}[2]"], fit.std[f"{ROTOR}[2]"])
    assert abs(fit.value[f"{ROTOR}[2]"] - 3 * J) < 4.0 * fit.std[f"{ROTOR}[2]"]
    assert fit.std[f"{ROTOR}[2]"] < 0.2 * J


def test_a_prior_of_the_rotor_is_heard():
    """With mass free beside it, only the prior tells which of the two it is."""
    start = heavy(halved(BOX), 1.6e-6).replace(priors={ROTOR: Prior(std=0.1e-6, origin="guess")})
    fit = identify([log(BOX)], start, OutputError(free=("friction", "body.mass_kg", ROTOR))).estimate
    print(fit.value[ROTOR], fit.std[ROTOR], fit.value["body.mass_kg"], fit.std["body.mass_kg"])
    assert fit.value[ROTOR] == pytest.approx(1.6e-6, rel=0.1)
    assert abs(fit.value["body.mass_kg"] - 6.2) < 4.0 * fit.std["body.mass_kg"]
