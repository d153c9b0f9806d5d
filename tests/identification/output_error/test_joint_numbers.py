"""What a fit saves with the robot: correlations of its numbers, and a dead zone whose interval holds the true one."""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.steady.steady_state import fit_steady_state
from omnidyn.logs.steady_table import SteadyTable
from omnidyn.model.keys import BOX, EMF, TORQUE
from omnidyn.model.known.dead_zone import dead_zone
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from omnidyn.run import Run
from omnidyn.simulation.band import confidence_band
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import noisy_draw, voltages

AXEBOT = load_robot("axebot")
START = AXEBOT.replace(
    friction=AXEBOT.friction.replace(
        axes=AXEBOT.friction.axes.replace(viscous=(1.2, 0.8, 0.012), coulomb=(1.8, 1.8, 0.08))
    )
)
TRUE = np.array([row.scale for row in dead_zone(AXEBOT).rows])


def fitted(number, seconds=10.0, **options):
    run = simulate(AXEBOT, voltages(np.random.default_rng(number), seconds), 0.01)
    return identify(noisy_draw(run, number), START, OutputError(**options)).estimate


@pytest.fixture(scope="module")
def fit():
    return fitted(1)


def test_the_robot_file_holds_what_the_fit_knows(fit):
    again = parse_robot(robot_to_toml(fit.robot))
    assert again.correlation.keys == (*BOX, "drive.dead_band_V")
    for one in BOX:
        for other in BOX:
            wanted = fit.correlation.between(one, other)
            assert again.correlation.of((one, other))[0, 1 if one != other else 0] == pytest.approx(wanted, abs=1e-9)
    assert again.correlation.of((BOX[0], BOX[3]))[0, 1] < -0.5  # viscous and Coulomb friction trade


def test_an_emf_constant_goes_with_its_torque_constant():
    run = simulate(AXEBOT, voltages(np.random.default_rng(3), 6.0), 0.01)
    log = Run(t=run.t, voltage=run.voltage, twist=noisy_draw(run, 3).twist, current=run.current)
    fit = identify(log, START, OutputError(free=(TORQUE, *BOX))).estimate
    assert fit.robot.correlation.of((TORQUE, EMF))[0, 1] == 1.0
    assert fit.robot.correlation.of((BOX[3], EMF))[0, 1] == fit.robot.correlation.of((BOX[3], TORQUE))[0, 1] != 0.0


def test_a_later_fit_of_fewer_numbers_keeps_what_it_does_not_touch(fit):
    run = simulate(AXEBOT, voltages(np.random.default_rng(4), 6.0), 0.01)
    later = identify(noisy_draw(run, 4), fit.robot, OutputError(free=BOX[3:])).estimate
    kept = later.robot.correlation
    assert kept.of((BOX[0], BOX[1]))[0, 1] == fit.robot.correlation.of((BOX[0], BOX[1]))[0, 1]
    assert kept.of((BOX[0], BOX[3]))[0, 1] == 0.0


def test_a_line_of_steady_points_saves_it_too():
    speed = np.array([0.2, 0.4, 0.6, 0.8, 1.0])
    force = 2.2 + 0.94 * speed + np.array([0.01, -0.02, 0.005, 0.01, -0.01])
    fit = fit_steady_state(AXEBOT, SteadyTable(axis=("x",) * 5, speed=speed, force=force))
    keys = fit.correlation.names
    assert fit.robot.correlation.of(keys)[0, 1] == pytest.approx(fit.correlation.between(*keys), abs=1e-9)
    assert fit.robot.correlation.of(keys)[0, 1] < -0.8


def held(numbers):
    """Per log and axis, whether the interval holds the true dead zone; and shares of the true run inside the band."""
    inside, share = [], []
    test = voltages(np.random.default_rng(99), 8.0)
    true = simulate(AXEBOT, test, 0.01).twist
    for number in numbers:
        robot = fitted(number).robot
        ends = np.array([row.scale_interval for row in dead_zone(robot).rows])
        inside.append((ends[:, 0] <= TRUE) & (ends[:, 1] >= TRUE))
        low, high, _ = confidence_band(robot, test, 0.01, draws=50)
        share.append(np.mean((low.twist - 1e-9 <= true) & (true <= high.twist + 1e-9)))
    return np.array(inside), np.array(share)


def test_the_interval_is_neither_empty_nor_everything(fit):
    for row, true in zip(dead_zone(fit.robot).rows, TRUE, strict=True):
        low, high = row.scale_interval
        assert 0.005 < (high - low) / true < 0.2
        assert low < true < high


@pytest.mark.long
def test_the_interval_holds_the_true_dead_zone_as_often_as_it_says():
    """40 logs of 10 s, three axes: 90 to 99 %; the band holds the true run elsewhere, over all logs, as often."""
    inside, share = held(range(40))
    assert 0.90 <= inside.mean() <= 0.99, inside.mean(axis=0)
    assert (inside.mean(axis=0) > 0.84).all()
    assert 0.88 <= share.mean() <= 1.0
