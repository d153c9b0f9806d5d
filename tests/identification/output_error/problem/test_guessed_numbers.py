"""What a guess of `init` becomes in a fit: rotors on a scale that knows 0; gains of a loop that were given."""

import numpy as np

from omnidyn.identification.output_error.problem.parameters import robot_parameter
from omnidyn.identification.output_error.solve.loop import loop_keys
from omnidyn.model.first_guess import first_guess
from omnidyn.model.keys import GAINS, ROTOR
from omnidyn.model.wheels import Wheels

FOUR = Wheels(azimuth_deg=(45.0, 135.0, 225.0, 315.0), robot_radius=0.2, wheel_radius=0.05)


def test_a_rotor_that_is_not_there_costs_no_more_than_its_prior_says():
    """On a logarithmic scale 0 is infinitely far, and a robot without rotors kept 1 % of mass of the guess."""
    mean = float(np.mean(first_guess("mine", FOUR, 6.0, 12.0).motor.rotor_inertia))
    rotor = robot_parameter(first_guess("mine", FOUR, 6.0, 12.0), ROTOR, (mean, mean))
    assert rotor.inner_prior is not None
    centre, std = rotor.inner_prior
    assert abs((rotor.inner(rotor.low) - centre) / std) <= 1.0
    assert rotor.low < 0.01 * mean


def test_gains_that_were_given_are_known_and_guessed_ones_are_free():
    given = first_guess("mine", FOUR, 6.0, 12.0, speed_loop=(0.6, 4.0, 100.0))
    guessed = first_guess("mine", FOUR, 6.0, 12.0, speed_loop=(100.0,))
    moved = np.full(3, True)
    assert not {*GAINS} & {*loop_keys(given, moved)}
    assert {*GAINS} <= {*loop_keys(guessed, moved)}
