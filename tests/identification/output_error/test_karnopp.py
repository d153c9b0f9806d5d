"""A robot with Karnopp's law is fitted by what its band stands in for; the band is no number of a robot."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError
from omnidyn.identification.output_error.prepare import guesses
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.keys import Key
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from tests.reference.modes import reference
from tests.support.codes import codes

AXEBOT = load_robot("axebot")
BAND = "friction.axes.karnopp_speed"
KEYS = tuple(f"friction.axes.{name}[0]" for name in ("viscous", "coulomb", "breakaway"))


def robot_with(viscous=0.94, coulomb=2.2, law: str = "karnopp"):
    axes = AxesFriction(
        viscous=(viscous, 0.96, 0.01), coulomb=(coulomb, 1.5, 0.099), breakaway=(2.8, 1.9, 0.13), law=law
    )
    return AXEBOT.replace(friction=Friction(axes=axes))


def log():
    """Of Coulomb friction with breakaway, which Karnopp's law means: slow ramps along x, both ways."""
    pushes = [np.linspace(0.2, (1.6, 2.5, 4.0)[k % 3], 20) * (-1) ** (k // 3) for k in range(12)]
    voltage = np.outer(np.concatenate(pushes), [0.0, 1.0, -1.0])
    twist = reference(robot_with(law="coulomb"), voltage, 0.02).twist
    noise = np.random.default_rng(0).normal(size=twist.shape) * [0.005, 0.005, 0.02]
    voltage = np.concatenate([voltage, voltage[-1:]])
    return Run(t=np.linspace(0.0, 0.02 * (len(voltage) - 1), len(voltage)), voltage=voltage, twist=twist + noise)


def test_its_levels_are_found_and_the_answer_keeps_the_law():
    guess = robot_with(1.2, 2.0)
    fit = omnidyn.identify([log()], guess, omnidyn.OutputError(free=KEYS)).estimate
    for key, value in zip(KEYS[:2], (0.94, 2.2), strict=True):
        assert abs(fit.value[key] - value) <= 3.0 * fit.std[key]
    low, high = fit.ci95[KEYS[2]]
    assert low <= 2.8 <= high
    axes = fit.robot.friction.axes
    assert (axes.law, axes.karnopp_speed) == ("karnopp", guess.friction.axes.karnopp_speed)
    assert "karnopp_as_coulomb" in codes(fit.warnings)


@pytest.mark.parametrize("place", ["direction", "wheels"])
def test_so_it_is_elsewhere(place):
    """Levels are found; the law and its bands, none of them the usual ones, come back."""
    table = f"friction.{place}"
    if place == "wheels":
        law = WheelFriction(coulomb=0.7, breakaway=0.9, viscous=0.3, law="karnopp", karnopp_speed=1e-3)
        keys = (f"{table}.coulomb", f"{table}.viscous")
    else:
        law = DirectionFriction(
            coulomb=(2.2, 1.5),
            breakaway=(2.8, 1.9),
            viscous=0.95,
            yaw_coulomb=0.099,
            yaw_breakaway=0.13,
            yaw_viscous=0.01,
            law="karnopp",
            karnopp_speed=1e-3,
            yaw_karnopp_speed=1e-2,
        )
        keys = (f"{table}.coulomb[0]", f"{table}.viscous")
    robot = AXEBOT.replace(friction=Friction(**{place: law}))
    pushes = np.repeat([1.5, -2.5, 3.5, 0.0, -4.0, 3.0], 10)
    voltage = np.outer(pushes, [0.0, 1.0, -1.0])
    twist = reference(robot.rigid, voltage, 0.03).twist
    noise = np.random.default_rng(0).normal(size=twist.shape) * [0.005, 0.005, 0.02]
    seen = Run(t=0.03 * np.arange(len(twist)), voltage=np.append(voltage, voltage[-1:], axis=0), twist=twist + noise)
    guess = robot
    for key in map(Key.parse, keys):
        guess = key.set(guess, 0.9 * key.get(guess))
    fit = omnidyn.identify([seen], guess, omnidyn.OutputError(free=keys)).estimate
    for key in keys:
        assert abs(fit.value[key] - Key.parse(key).get(robot)) <= 3.0 * fit.std[key]
    found = getattr(fit.robot.friction, place)
    assert (found.law, found.karnopp_speed) == ("karnopp", 1e-3)
    assert "karnopp_as_coulomb" in codes(fit.warnings)
    assert not fit.lack_of_fit.found
    with pytest.raises(InputError, match="cannot be free"):
        omnidyn.identify([seen], robot, omnidyn.OutputError(free=(*keys, f"{table}.karnopp_speed")))


def test_the_band_is_never_free():
    with pytest.raises(InputError, match="cannot be free"):
        omnidyn.identify([log()], robot_with(), omnidyn.OutputError(free=(*KEYS, f"{BAND}[0]")))
    assert guesses(robot_with().replace(priors={BAND: Prior(std=1e-5, origin="guess")})) == ()
