"""The ladder on logs that no model helps: it ends after no more fits, and says what is so."""

import numpy as np
import pytest

from omnidyn.errors import InsufficientDataError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.fit import Fit
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.identification.structure.test_tails import AXEBOT, CLEAN

DEAD = 1


def wheels(speed, rows=slice(None)):
    assert CLEAN.voltage is not None
    return Run(t=CLEAN.t[rows], voltage=CLEAN.voltage[rows], wheel_speed=speed[rows], source="log")


def noisy():
    speed = CLEAN.wheel_speed
    assert speed is not None
    return speed + 0.1 * np.random.default_rng(1).normal(size=speed.shape)


def climbed(run, monkeypatch):
    """(what the ladder says, how many fits were begun, the estimate)."""
    made, raw = [], Fit.solve
    monkeypatch.setattr(Fit, "solve", lambda self, *a: made.append(self) or raw(self, *a))
    estimate = identify(run, AXEBOT, OutputError(nuisances=(), ladder=True)).estimate
    assert estimate.ladder is not None
    return estimate.ladder, len(made), estimate


@pytest.mark.parametrize("level", [0.1])
def test_an_encoder_that_is_dead_is_named_and_nothing_is_tried(level, monkeypatch):
    """A wheel radius beyond all bounds would explain it."""
    speed = noisy()
    speed[:, DEAD] = level
    ladder, fits, estimate = climbed(wheels(speed), monkeypatch)
    assert ladder.taken == ()
    assert ladder.rungs == ()
    assert ladder.end.code == "mend_first"
    assert fits <= 2  # as it is, and by Student's t
    assert f"wheel_speed[{DEAD}]" in estimate.not_followed
    (warning,) = [each for each in estimate.warnings if each.code == "not_followed"]
    numbers = warning.numbers
    assert (
        dict(zip(numbers["outputs"], numbers["shares"], strict=True))[f"wheel_speed[{DEAD}]"] is None
    )  # a dead sensor


def test_a_wheel_that_stands_still_as_the_model_has_it_is_no_dead_one():
    """Of the paper's test of turning about a wheel: u = (0, 2, -2) V along y."""
    volts = np.zeros((400, 3))
    volts[50:] = [0.0, 4.0, -4.0]
    volts[200:300] *= -1.0
    run = Run(t=np.linspace(0.0, 3.99, 400), voltage=volts, wheel_speed=np.zeros((400, 3)))
    made = simulate(AXEBOT, volts[:-1], 0.01)
    assert made.wheel_speed is not None
    speed = made.wheel_speed + [0.0, 0.1, 0.1] * np.random.default_rng(2).normal(size=(400, 3))
    speed[:, 0] = 0.0
    estimate = identify(
        run.replace(wheel_speed=speed), AXEBOT, OutputError(nuisances=(), free=("friction.axes.coulomb",))
    ).estimate
    assert estimate.not_followed == ()


@pytest.mark.parametrize("rows", [slice(0, 20), slice(0, None)])
def test_signals_that_are_constant_say_that_nothing_moved(rows):
    with pytest.raises(InsufficientDataError, match="never visibly moved"):
        identify(wheels(np.zeros_like(noisy()), rows), AXEBOT, OutputError(nuisances=(), ladder=True))


def test_twenty_rows_end(monkeypatch):
    ladder, fits, _ = climbed(wheels(noisy(), slice(200, 220)), monkeypatch)
    assert fits <= 12
    assert ladder.taken == ()
