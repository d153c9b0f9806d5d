"""The map of the dead zone: whole, readable, the same every time, and its lines are the model's numbers."""

import importlib
import struct
from itertools import combinations
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.text import Text

from omnidyn.model.deadzone import dead_zone_force, dead_zone_map
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.robot_file import load_robot
from omnidyn.report.figures.dead_zone_map import draw_dead_zone_map
from omnidyn.report.style import look

AXEBOT, ROBOTINO = load_robot("axebot"), load_robot("robotino")
WEAK = ROBOTINO.replace(motor=ROBOTINO.motor.replace(current_limit=1.0))  # too weak along x, not along y
SHAPES = {
    "box": AXEBOT.replace(friction=Friction(axes=AxesFriction(viscous=(0.0,) * 3, coulomb=(2.2, 1.5, 0.099)))),
    "disc": AXEBOT.replace(friction=Friction(direction=DirectionFriction(coulomb=(1.8, 1.8), yaw_coulomb=0.1))),
    "ellipse": AXEBOT.replace(friction=Friction(direction=DirectionFriction(coulomb=(2.2, 1.5), yaw_coulomb=0.1))),
    "wheels": AXEBOT.replace(friction=Friction(wheels=WheelFriction(coulomb=0.95))),
}
CASES = {"one robot": {"robotino": ROBOTINO}, "shapes": SHAPES, "weak": {"weak": WEAK}}


def drawn(robots):
    """The figure as it is when it is saved, and the picture of it."""
    module, caught = importlib.import_module("omnidyn.report.figures.dead_zone_map"), []
    with pytest.MonkeyPatch.context() as patch:
        made = module.picture
        patch.setattr(module, "picture", lambda *parts: caught.append(parts[-1]) or made(*parts))
        shown = draw_dead_zone_map(robots)
    return caught[0], shown


@pytest.fixture(scope="module")
def maps():
    return {name: drawn(robots) for name, robots in CASES.items()}


@pytest.mark.parametrize("case", CASES)
def test_the_lines_are_the_numbers_of_the_model(maps, case):
    figure, _ = maps[case]
    for axes, level_of in zip(figure.axes, (lambda *of: dead_zone_map(*of)[0], dead_zone_force), strict=True):
        for line, (name, robot) in zip(axes.lines, CASES[case].items(), strict=True):
            angle, level = line.get_xdata(), line.get_ydata()
            assert line.get_label() == name
            assert len(angle) == 361
            wanted = level_of(robot, angle[::40])
            np.testing.assert_array_equal(level[::40], np.where(np.isinf(wanted), np.nan, wanted))


def test_what_never_moves_is_a_gap(maps):
    level = maps["weak"][0].axes[1].lines[0].get_ydata()
    assert 0 < np.isnan(level).sum() < len(level)


@pytest.mark.parametrize("case", CASES)
def test_both_formats_are_whole(maps, case):
    shown = maps[case][1]
    assert struct.unpack(">II", shown.png[16:24]) == (1200, 765)
    assert ElementTree.fromstring(shown.svg).tag == "{http://www.w3.org/2000/svg}svg"
    assert shown.name == "dead_zone_map"
    assert len(shown.caption) > 60


def test_the_same_map_is_the_same_file(maps):
    again = draw_dead_zone_map(CASES["one robot"])
    assert (again.png, again.svg) == (maps["one robot"][1].png, maps["one robot"][1].svg)


@pytest.mark.parametrize("case", CASES)
def test_no_text_is_cut_off_or_covers_another(maps, case):
    figure = maps[case][0]
    with look():
        figure.canvas.draw()
        texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
        boxes = {text: text.get_window_extent() for text in texts}
    page = figure.bbox
    assert len(texts) > 20
    for box in boxes.values():
        assert page.x0 <= box.x0 < box.x1 <= page.x1
        assert page.y0 <= box.y0 < box.y1 <= page.y1
    covered = [(a.get_text(), b.get_text()) for a, b in combinations(texts, 2) if boxes[a].overlaps(boxes[b])]
    assert not covered


@pytest.mark.parametrize("case", CASES)
def test_units_and_directions_are_on_the_page(maps, case):
    texts = {text.get_text() for text in maps[case][0].findobj(Text)}
    assert {"voltage of the most loaded motor, V", "push of the motors, N", "x\nforward", "y\nleft"} <= texts
    assert set(CASES[case]) <= texts


def test_forward_is_up_and_left_is_left(maps):
    axes = maps["one robot"][0].axes[0]
    up, left = (
        axes.transData.transform((angle, 1.0)) - axes.transData.transform((0.0, 0.0)) for angle in (0, np.pi / 2)
    )
    assert (abs(up[0]) < 1e-6, up[1] > 0) == (True, True)
    assert (left[0] < 0, abs(left[1]) < 1e-6) == (True, True)


@pytest.mark.parametrize("count", [0, 5])
def test_four_robots_are_the_most_on_one_page(count):
    with pytest.raises(ValueError, match=f"{count} robots; expected 1 to 4"):
        draw_dead_zone_map({str(k): AXEBOT for k in range(count)})
