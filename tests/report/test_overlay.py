"""The overlay: its lines are the numbers of the comparison, gaps are seen, nothing is cut off."""

import importlib
import struct
from itertools import combinations
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.text import Text

import omnidyn
from omnidyn.errors import InputError
from omnidyn.model.robot_file import load_robot
from omnidyn.report.figures.overlay import draw_overlay
from tests.support.compared_logs import clean_log, coulomb_times, noisy
from tests.support.figures import shown_texts

AXEBOT = load_robot("axebot")


@pytest.fixture(scope="module")
def found():
    log = noisy(clean_log(AXEBOT, 1), 1)
    kept = np.r_[0:150, 200:401]
    cut = log.replace(t=log.t[kept], **{name: values[kept] for name, values in log.channels.items()})
    return omnidyn.compare(AXEBOT, cut, coulomb_times(AXEBOT, 1.3))


def drawn(*arguments, **more):
    """The figure as it is when it is saved, and the picture of it."""
    module, caught = importlib.import_module("omnidyn.report.figures.overlay"), []
    with pytest.MonkeyPatch.context() as patch:
        made = module.picture
        patch.setattr(module, "picture", lambda *parts: caught.append(parts[-1]) or made(*parts))
        shown = draw_overlay(*arguments, **more)
    return caught[0], shown


def test_the_lines_are_the_numbers(found):
    figure, shown = drawn(found, channels=["vx", "w2"])
    above, below = figure.axes[:2]
    measured, true, wrong = (line.get_ydata() for line in above.lines[:3])
    gap = np.isnan(measured)
    assert gap.sum() == 1  # one break between the pieces
    np.testing.assert_array_equal(measured[~gap], found.measured[0].twist[:, 0])
    np.testing.assert_array_equal(wrong[~gap], found.simulated["coulomb x 1.3"][0].twist[:, 0])
    errors = below.lines[1].get_ydata()
    np.testing.assert_allclose(errors[~gap], (true - measured)[~gap], atol=1e-15)
    shaded = [patch for axes in figure.axes for patch in axes.patches]
    assert len(shaded) == 4
    begin, end = found.segments[0].end, found.segments[1].begin
    assert (shaded[0].get_x(), shaded[0].get_x() + shaded[0].get_width()) == (begin, pytest.approx(end))
    assert struct.unpack(">II", shown.png[16:24])[0] == 1200
    assert ElementTree.fromstring(shown.svg).tag == "{http://www.w3.org/2000/svg}svg"
    assert "Grey: gaps" in shown.caption


def test_the_same_comparison_is_the_same_file(found):
    assert draw_overlay(found).png == draw_overlay(found).png


@pytest.mark.parametrize("channels", [("vx",), ("vx", "vy", "omega"), ("vx", "w1", "w2", "w3", "x", "heading")])
def test_no_text_is_cut_off_or_covers_another(found, channels):
    figure, _ = drawn(found, channels=channels)
    texts, page = shown_texts(figure), figure.bbox
    for text, box in texts:
        assert page.x0 <= box.x0 < box.x1 <= page.x1, text
        assert page.y0 <= box.y0 < box.y1 <= page.y1, text
    covered = [(a, b) for (a, one), (b, two) in combinations(texts, 2) if one.overlaps(two)]
    assert not covered


def test_units_and_names_are_on_the_page(found):
    texts = {text.get_text() for text in drawn(found)[0].findobj(Text)}
    assert {"vx, m/s", "vy, m/s", "omega, rad/s", "error", "time, s", "measured", "axebot", "coulomb x 1.3"} <= texts


@pytest.mark.parametrize("channels", [("i1",), ("vx",) * 7])
def test_what_cannot_be_drawn_is_refused(found, channels):
    with pytest.raises(InputError, match="cannot draw"):
        draw_overlay(found, channels=channels)


def test_sensors_with_clocks_of_their_own_are_drawn_at_their_own_rows():
    log = noisy(clean_log(AXEBOT, 1), 1)
    rows = np.arange(len(log))[:, None] % 4
    twist, speed = np.where(rows == 0, log.twist, np.nan), np.where(rows == 2, log.wheel_speed, np.nan)
    run = omnidyn.Run(log.t, voltage=log.voltage, twist=twist, wheel_speed=speed)
    figure, _ = drawn(omnidyn.compare(AXEBOT, run), channels=["vx"])
    above, below = figure.axes[:2]
    np.testing.assert_array_equal(above.lines[0].get_xydata().T, [log.t[::4], log.twist[::4, 0]])
    assert len(below.lines[1].get_xdata()) == len(log.t[::4])
