"""What adaptive steps cost: none is taken only to be thrown away, and no robot keeps its user waiting for ever."""

import numpy as np
import pytest

from omnidyn import load_robot, simulate
from omnidyn.errors import InputError
from omnidyn.model.layout import new_state
from omnidyn.model.stick_slip.plant import plant
from omnidyn.simulation.implicit import implicit_march as implicit
from omnidyn.simulation.speed_loop import no_loop

AXEBOT = load_robot("axebot")
LIMITED = AXEBOT.replace(
    motor=AXEBOT.motor.replace(inductance=2e-4, electrical="dynamic", current_limit=1.4),
    body=AXEBOT.body.replace(rotating_frame=True),
)


def test_steps_far_below_the_shortest_share_are_not_halved_in_vain():
    """Below SHORT the error goes with h^3 and its share of tol does not: the next step is its cube root.

    Taken as a square root every other try was refused and cut in half, 2.7 times the work.
    """
    voltage = np.random.default_rng(0).uniform(-6, 6, (50, 3))
    numbers = plant(LIMITED)
    outcome = implicit.run_implicit(
        numbers, voltage, np.full((50, 3), 1.4), np.full(50, 1e-3), new_state(numbers), np.zeros(3), no_loop(3), 1e-6
    )
    assert outcome.steps.sum() < 70_000
    fine = simulate(LIMITED, voltage, 1e-3, tol=1e-9)
    np.testing.assert_allclose(outcome.state.x[:, :2], fine.twist[:, :2], rtol=0, atol=1e-6)


def test_a_robot_too_fast_to_be_followed_is_refused(monkeypatch):
    monkeypatch.setattr(implicit, "MOST_STEPS", (2e3, 1e4))
    voltage = np.random.default_rng(0).uniform(-6, 6, (50, 3))
    with pytest.raises(InputError, match=r"moves too fast to be followed; got more than 2\.5e\+03 steps up to row \d"):
        simulate(LIMITED, voltage, 1e-3)
    assert simulate(LIMITED, voltage, 1e-3, tol=None).twist.shape == (51, 3)
    simulate(AXEBOT.replace(body=LIMITED.body), np.full((50, 3), 3.0), 1e-3)  # one that is not


@pytest.mark.parametrize("electrical", ["quasi-static", "dynamic"])
def test_a_friction_far_below_the_forces_at_work_still_stops_what_it_stops(electrical):
    """A millionth of the axebot's friction in yaw, as a fit has it at its lower bound, while the robot drives on.

    In steps of 0.1 us, M v/tau of the drive rounds to more than such a friction. Held against that, a stage could not
    tell sliding from sticking: yaw went to and fro at 1e-14 m/s, an event in each of thousands of steps a row, or in a
    fit of half a million.
    """
    friction = AXEBOT.friction
    robot = AXEBOT.replace(
        body=AXEBOT.body.replace(rotating_frame=True),
        motor=AXEBOT.motor.replace(electrical=electrical),
        friction=friction.replace(axes=friction.axes.replace(coulomb=(2.2, 1.5, 0.099e-6))),
    )
    voltage = np.repeat([[3.0, 3.0, 3.0], [-1.0, -4.0, 5.0]], [10, 140], axis=0)
    numbers = plant(robot)
    outcome = implicit.run_implicit(
        numbers,
        voltage,
        np.full((150, 3), np.inf),
        np.full(150, 0.02),
        new_state(numbers),
        np.zeros(3),
        no_loop(3),
        1e-5,
    )
    turns = outcome.state.x[1:, 2]
    assert outcome.steps.max() < 1000
    assert turns[9] > 0.1
    assert (turns[140:] == 0.0).all()
    assert (np.abs(outcome.state.x[141:, :2]) > 0.1).all()


def test_what_rests_does_not_keep_the_steps_short_where_friction_falls_with_the_speed():
    """Driven along x, past a fall that is the same with and without a fall of the axes that rest: as many steps.

    A resting fall took 38 times as many: an error was taken to grow by its fall, without end as nothing moved.
    """
    voltage = np.outer(np.repeat([2.0, -3.5, 0.5, 4.0, 0.0], 30), [0.0, 1.0, -1.0])
    steps = []
    for hold in ((3.3, 2.25, 0.15), (3.3, *AXEBOT.friction.axes.coulomb[1:])):
        axes = AXEBOT.friction.axes.replace(breakaway=hold, stribeck_speed=(0.01, 0.01, 0.1))
        robot = AXEBOT.replace(friction=AXEBOT.friction.replace(axes=axes))
        numbers = plant(robot)
        outcome = implicit.run_implicit(
            numbers,
            voltage,
            np.full((150, 3), np.inf),
            np.full(150, 0.02),
            new_state(numbers),
            np.zeros(3),
            no_loop(3),
            1e-6,
        )
        assert (outcome.state.x[:, 1:] == 0.0).all()
        assert (outcome.state.x[:, 0] != 0.0).any()
        steps.append(int(outcome.steps.sum()))
    assert steps[0] <= 1.05 * steps[1]
