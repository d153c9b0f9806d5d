"""How many simulations a whole fit takes, from what `init` guesses: logs of a simulator of its own."""

import numpy as np
import pytest

from benchmarks.identification.ordinary import counted
from benchmarks.identification.ordinary_robots import driven, robots
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.model.first_guess import first_guess
from omnidyn.model.wheels import Wheels
from omnidyn.run import Run

ROWS, DT, TICK = 1000, 0.01, 2.0 * np.pi / 1440.0
MOST = 60  # 274 before
MOST_WITH_BAND = 150  # both fits


@pytest.fixture(scope="module")
def counts():
    """(the robot as guessed, its world, ten seconds of counts) of three omni wheels."""
    three = next(robot for robot in robots() if robot.name == "three")
    volts, _, way, _ = driven(three, 1)
    world, rows = three.world, slice(ROWS)
    radius = world.wheel_radius[0]
    angle = np.floor(way[rows] @ world.G / radius / TICK) * TICK
    wheels = Wheels(azimuth_deg=world.azimuth, robot_radius=world.robot_radius[0], wheel_radius=radius)
    guess = first_guess("mine", wheels, world.mass, voltage_limit=world.voltage_limit)
    return guess, world, Run(t=DT * np.arange(ROWS), voltage=volts[rows], wheel_angle=angle)


def test_a_fit_of_counts_takes_few_simulations(counts):
    guess, world, log = counts
    with counted() as count:
        fit = Fit.of([log], guess, OutputError())
        answer = fit.answer(fit.solve())
    assert count[0] <= MOST
    (estimate,) = answer.estimates.values()
    truths = {"coulomb[0]": world.coulomb[0], "coulomb[1]": world.coulomb[1], "yaw_coulomb": world.coulomb[2]}
    for name, truth in truths.items():
        key = f"friction.direction.{name}"
        assert abs(estimate.value[key] - truth) < 4.0 * estimate.std[key], key


@pytest.mark.parametrize(("late_rows", "dead_band"), [(0, 0.5), (4, 1.5)])
def test_a_dead_band_of_the_driver_is_fitted_where_it_is_there(counts, late_rows, dead_band):
    """Nobody asked for it: beside a fit that marches it was never tried, and friction and motor made up for it.

    With a dead band a fit begins anew: without one its latency had gone elsewhere, from where no step led back.
    """
    guess, world, log = counts
    sent = np.concatenate([log.voltage[late_rows:], np.zeros((late_rows, 3))])  # acts so many rows later
    behind_band = log.replace(voltage=sent + dead_band * np.sign(sent))
    with counted() as count:
        fit = Fit.of([behind_band], guess, OutputError())
        (estimate,) = fit.answer(fit.solve()).estimates.values()
    assert count[0] <= MOST_WITH_BAND
    assert estimate.nuisances["dead_band"].value == pytest.approx(dead_band, rel=0.02)
    assert estimate.nuisances["latency.wheel_angle"].value == pytest.approx(late_rows * DT, abs=0.05 * DT)
    for name, truth in zip(("coulomb[0]", "coulomb[1]", "yaw_coulomb"), world.coulomb, strict=True):
        assert estimate.value[f"friction.direction.{name}"] == pytest.approx(truth, rel=0.02), name
    assert "driver_dead_band" in [statement.code for statement in estimate.warnings]


def test_no_constant_force_is_fitted_where_all_outputs_add_up(counts):
    """No free run of blocks tells it there, whatever the likelihood gains."""
    guess, _, log = counts
    phases = []
    fit = Fit.of([log], guess, OutputError())
    fit.solve(FitProgress(lambda report: phases.append(report.phase)))
    assert not [phase for phase in phases if "constant force" in phase]
