"""Bands of a comparison: they hold the true run, and stand in the table, the JSON and the picture."""

import json

import numpy as np
import pytest

from omnidyn.comparison.compare import compare
from omnidyn.comparison.model_bands import with_bands
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot
from omnidyn.report.figures.overlay import draw_overlay
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation

AXEBOT = load_robot("axebot")
OFF = AXEBOT.replace(
    name="off by one std",
    friction=AXEBOT.friction.replace(axes=AXEBOT.friction.axes.replace(coulomb=(2.35, 1.42, 0.094))),
    priors={f"friction.axes.coulomb[{k}]": Prior(std=s, origin="guess") for k, s in enumerate((0.15, 0.08, 0.005))},
)


@pytest.fixture(scope="module")
def true_run():
    return simulate(AXEBOT, excitation(10.0), 0.01)


@pytest.fixture(scope="module")
def found(true_run):
    log = Run(t=true_run.t, voltage=true_run.voltage, twist=true_run.twist, current=true_run.current, source="log")
    return with_bands(compare(OFF, log), [OFF])


def test_the_band_holds_the_true_run(found):
    """One std off: everything is inside, but for the rows in which one moves already, or still, and the other not."""
    (segment,) = found.segments
    for name in ("vx", "vy", "omega"):
        low, high = found.band(OFF.name, name, segment)
        trace = found.trace(OFF.name, name, segment)
        assert np.mean((low - 1e-9 <= trace.measured) & (trace.measured <= high + 1e-9)) > 0.97
        assert np.mean((low - 1e-9 <= trace.model) & (trace.model <= high + 1e-9)) > 0.999
        assert 0.3 * found.rmse[name] < found.half_widths(OFF.name)[name] < 5.0 * found.rmse[name]


def test_the_table_and_the_json_tell_it(found):
    words = found.summary()
    assert "95 % band of off by one std, from the std of its file: mean half width beside the error" in words
    assert "the band of off by one std rests on guesses: friction.axes.coulomb[0], friction.axes" in " ".join(
        words.split()
    )
    told = json.loads(json.dumps(found.to_dict(), allow_nan=False))["bands"][OFF.name]
    assert set(told["half_width"]) == set(found.channels)
    assert told["guesses"] == [f"friction.axes.coulomb[{k}]" for k in range(3)]


def test_the_picture_has_it_behind_the_lines(found):
    drawn, bare = draw_overlay(found), draw_overlay(compare(OFF, found.measured[0]))
    assert "Bands: how far numbers that are off" in drawn.caption
    assert "Bands" not in bare.caption
    assert (
        drawn.svg.count(b"fill-opacity: 0.25") >= bare.svg.count(b"fill-opacity: 0.25") + 6
    )  # three panels, three errors


def test_one_robot_of_two_without_std_is_named(found):
    both = with_bands(compare(OFF, found.measured[0], AXEBOT), [OFF, AXEBOT], draws=20)
    assert list(both.bands) == [OFF.name]
    assert ("no_band", "axebot") in [(warning.code, warning.subject) for warning in both.warnings]


def test_currents_without_sign_have_a_band_without_sign(found):
    unsigned = with_bands(compare(OFF, found.measured[0], current_unsigned=True), [OFF], draws=20)
    low, high = unsigned.band(OFF.name, "i2", unsigned.segments[0])
    assert (low >= 0.0).all()
    assert (high >= low).all()


def test_only_the_logs_asked_for(found):
    two = with_bands(compare(OFF, [found.measured[0]] * 2), [OFF], logs=(1,), draws=20)
    assert two.band(OFF.name, "vx", two.segments[0]) is None
    assert two.band(OFF.name, "vx", two.segments[1]) is not None
