"""Identification as a whole: what the robot that comes out says of its drive, and what is advised."""

from types import SimpleNamespace

import numpy as np
import pytest

from omnidyn import Run, load_robot, simulate
from omnidyn.identification import advice
from omnidyn.identification.default_method import as_driven
from omnidyn.identification.identify import identify
from omnidyn.model.robot_file import parse_robot, robot_to_toml


@pytest.fixture(scope="module")
def duties():
    """A log of duties and a supply of 6 V, and no voltage."""
    rng = np.random.default_rng(0)
    voltage = np.repeat(rng.uniform(-6.0, 6.0, (30, 3)), 20, axis=0)
    run = simulate(load_robot("axebot"), voltage, 0.02)
    noisy = run.wheel_speed + 0.05 * rng.normal(size=run.wheel_speed.shape)
    return run.replace(
        voltage=None,
        duty=run.voltage / 6.0,
        supply=np.full(len(run), 6.0),
        wheel_speed=noisy,
        current=None,
        twist=None,
        pose=None,
        source="duty.csv",
    )


def test_a_robot_fitted_to_duties_has_a_drive_of_duties(duties):
    robot = load_robot("axebot")
    for fitted in (identify(duties, robot).robot, identify(duties, robot).estimate.robot):
        assert (fitted.drive.kind, fitted.drive.supply) == ("duty", 6.0)
        again = parse_robot(robot_to_toml(fitted))
        assert again.drive == fitted.drive
        run = simulate(again, duty=duties.duty[:-1], dt=0.02)
        np.testing.assert_allclose(run.wheel_speed, duties.wheel_speed, atol=1.0)


def test_a_drive_that_the_file_states_stays(duties):
    robot = load_robot("axebot")
    assert as_driven(robot, [duties.replace(duty=None, voltage=6.0 * duties.duty)]) is robot
    assert as_driven(robot, []) is robot
    coasting = robot.replace(drive=robot.drive.replace(kind="duty", off="coast", supply=7.0))
    assert as_driven(coasting, [duties]) is coasting
    told = robot.replace(drive=robot.drive.replace(supply=7.0))
    assert as_driven(told, [duties]).drive.supply == 7.0


@pytest.mark.parametrize("right", [True, False])
def test_a_longer_log_is_asked_for_against_noise_only(right):
    fit = SimpleNamespace(
        value={"body.mass_kg": 2.0},
        std={"body.mass_kg": 0.6},
        at_bound=(),
        unidentifiable=(),
        half_width=lambda _: 0.6 * 1.96 / 2.0,
        is_known=lambda _: True,
        lack_of_fit=SimpleNamespace(found=not right),
    )
    words = str(*advice._wide(fit))
    assert ("times as long" in words) is right
    assert ("a longer log does not help" in words) is not right


def test_a_fit_to_200_logs_without_noise_that_overlap_ends():
    robot = load_robot("axebot")
    voltage = np.repeat(np.random.default_rng(0).uniform(-6.0, 6.0, (100, 3)), 25, axis=0)
    run = simulate(robot, voltage, 0.02)
    cuts = [slice(k * 10, k * 10 + 400) for k in range(200)]
    runs = [
        Run(t=run.t[cut], voltage=run.voltage[cut], wheel_speed=run.wheel_speed[cut], source=f"log{k}.csv")
        for k, cut in enumerate(cuts)
    ]
    axes = robot.friction.axes.replace(coulomb=(1.5, 1.0, 0.05))
    fit = identify(runs, robot.replace(friction=robot.friction.replace(axes=axes))).estimate
    np.testing.assert_allclose(fit.robot.friction.axes.coulomb, robot.friction.axes.coulomb, rtol=1e-3)
