"""A robot with Karnopp's law is fitted by what its band stands in for; the band is no number of a robot."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError
from omnidyn.identification.output_error.prepare import guesses
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from tests.reference.modes import reference

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
    fit = omnidyn.identify([log()], guess, free=KEYS)
    for key, value in zip(KEYS[:2], (0.94, 2.2), strict=True):
        assert abs(fit.value[key] - value) <= 3.0 * fit.std[key]
    low, high = fit.ci95[KEYS[2]]
    assert low <= 2.8 <= high
    axes = fit.robot.friction.axes
    assert (axes.law, axes.karnopp_speed) == ("karnopp", guess.friction.axes.karnopp_speed)
    assert any("karnopp_speed is numerical" in words for words in fit.warnings)


def test_the_band_is_never_free():
    with pytest.raises(InputError, match="cannot be free"):
        omnidyn.identify([log()], robot_with(), free=(*KEYS, f"{BAND}[0]"))
    assert guesses(robot_with().replace(priors={BAND: Prior(std=1e-5, origin="guess")})) == ()
