"""The pictures: the same bytes every time, nothing clipped, no text over text, no trace in matplotlib's settings."""

import importlib
import struct
import subprocess
import sys
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import matplotlib
import numpy as np
import pytest

from omnidyn.identification.steady.line import confidence_band
from omnidyn.identification.steady.steady_state import fit_steady_state
from omnidyn.model.robot_file import load_robot, preset_names
from omnidyn.paper.friction import table_1_points
from omnidyn.report.figures.paper_pictures import paper_pictures
from omnidyn.report.figures.robot import draw_robot, wheel_lines, wheel_places
from omnidyn.report.style import AXIS_COLOUR, LEVEL_COLOURS, LOOK, look, new_figure, picture
from tests.support.figures import shown_texts

NAMES = ["fig1_robot", "fig2_traces", "fig3_friction", "fig4_steps", "fig5_dead_zone", "fig6_reconcile"]
MODULES = ["robot", "paper_dead_zone", "paper_friction", "paper_reconciliation", "paper_steps", "paper_traces"]


def size_of(png):
    """Width and height of a PNG image, from its head."""
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    return struct.unpack(">II", png[16:24])


@pytest.fixture(scope="module")
def figures(robot):
    """The figures themselves, by name, as they are when they are saved."""
    caught = {}
    with pytest.MonkeyPatch.context() as patch:
        for name in MODULES:
            module = importlib.import_module(f"omnidyn.report.figures.{name}")
            patch.setattr(module, "picture", lambda name, title, caption, figure: caught.setdefault(name, figure))
        list(paper_pictures(robot))
    return caught


def test_there_is_one_picture_per_figure(pictures):
    assert [each.name for each in pictures] == NAMES


def test_every_picture_says_what_it_shows(pictures):
    assert all(len(each.title) > 10 and len(each.caption) > 60 for each in pictures)


def test_both_formats_are_whole(pictures):
    for each in pictures:
        width, height = size_of(each.png)
        assert width >= 900
        assert height >= 500
        assert ElementTree.fromstring(each.svg).tag == "{http://www.w3.org/2000/svg}svg"


def test_the_same_picture_is_the_same_file(pictures, robot):
    again = list(paper_pictures(robot))
    assert [(a.png, a.svg) for a in again] == [(b.png, b.svg) for b in pictures]


def test_no_file_tells_when_it_was_made(pictures):
    for each in pictures:
        assert b"dc:date" not in each.svg
        assert b"Software" not in each.png
        assert b"tEXt" not in each.png.replace(b"tEXtdpi", b"")


@pytest.mark.parametrize("name", NAMES)
def test_no_text_is_cut_off(figures, name):
    figure = figures[name]
    page = figure.bbox
    outside = [
        words
        for words, box in shown_texts(figure)
        if box.x0 < page.x0 - 1 or box.y0 < page.y0 - 1 or box.x1 > page.x1 + 1 or box.y1 > page.y1 + 1
    ]
    assert not outside


@pytest.mark.parametrize("name", NAMES)
def test_no_text_covers_another(figures, name):
    texts = shown_texts(figures[name])
    assert len(texts) > 5
    covered = [(a, b) for (a, one), (b, other) in combinations(texts, 2) if _shared(one, other) > 0.1]
    assert not covered


def _shared(one, other):
    """Share of the smaller box that two boxes have in common."""
    width = min(one.x1, other.x1) - max(one.x0, other.x0)
    height = min(one.y1, other.y1) - max(one.y0, other.y0)
    smaller = min(one.width * one.height, other.width * other.height)
    return max(width, 0.0) * max(height, 0.0) / smaller


def test_a_user_s_matplotlibrc_changes_nothing(pictures, robot, monkeypatch):
    monkeypatch.setitem(matplotlib.rcParams, "font.size", 30.0)
    monkeypatch.setitem(matplotlib.rcParams, "axes.grid", False)
    assert draw_robot(robot).svg == pictures[0].svg


def test_the_settings_of_matplotlib_are_as_before(robot):
    before = {name: value for name, value in matplotlib.rcParams.items() if name != "backend"}
    draw_robot(robot)
    assert {name: value for name, value in matplotlib.rcParams.items() if name != "backend"} == before


def test_no_pyplot_and_no_window(tmp_path):
    script = (
        "import sys\nfrom omnidyn import load_robot\nfrom omnidyn.report.figures.robot import draw_robot\n"
        "draw_robot(load_robot('axebot'))\nprint('matplotlib.pyplot' in sys.modules)"
    )
    sources = str(Path(__file__).resolve().parents[2] / "src")
    result = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
        env={"PYTHONPATH": sources, "MPLBACKEND": "TkAgg", "HOME": str(tmp_path)},
    )
    assert result.stdout == "False\n"


@pytest.mark.parametrize("name", preset_names())
def test_every_preset_can_be_drawn(name):
    assert size_of(draw_robot(load_robot(name)).png)[0] > 500


@pytest.mark.parametrize("name", preset_names())
def test_wheels_are_drawn_apart_and_with_the_lever_arm_they_have(name):
    """Place x push = the yaw entry of the wrench matrix, whatever the azimuths and rollers; a caption owns up."""
    wheels = load_robot(name).wheels
    places, push = wheel_places(wheels), wheels.wrench_matrix
    assert min(np.linalg.norm(a - b) for a, b in combinations(places, 2)) > wheels.radii.max()
    np.testing.assert_allclose(places[:, 0] * push[1] - places[:, 1] * push[0], push[2], rtol=1e-12)
    assert ("as if track and wheelbase were alike" in draw_robot(load_robot(name)).caption) == (name == "mecanum")


def test_the_mecanum_preset_stands_on_its_own_corners():
    """Front left, front right, rear left, rear right: half track and half wheelbase 0.1 m, as its file says."""
    places = wheel_places(load_robot("mecanum").wheels)
    np.testing.assert_allclose(places, [[0.1, 0.1], [0.1, -0.1], [-0.1, 0.1], [-0.1, -0.1]], atol=1e-15)


def test_a_wheel_is_a_line_of_its_diameter_across_its_axle():
    wheels = load_robot("axebot").wheels  # at 30, 150 and 270 degrees, rolling at right angles to that
    ends = wheel_lines(wheels)
    along = ends[:, 1] - ends[:, 0]
    angle = np.deg2rad(wheels.azimuth_deg)
    np.testing.assert_allclose(ends.mean(axis=1), wheel_places(wheels), atol=1e-15)
    np.testing.assert_allclose(np.hypot(*along.T), 2.0 * wheels.radii, rtol=1e-12)
    np.testing.assert_allclose(along[:, 0] * np.cos(angle) + along[:, 1] * np.sin(angle), 0.0, atol=1e-15)


def test_wheels_that_nothing_tells_apart_stand_side_by_side(robot):
    wheels = robot.wheels.replace(azimuth_deg=(0.0, 0.0, 120.0, 240.0))
    places = wheel_places(wheels)
    assert min(np.linalg.norm(a - b) for a, b in combinations(places, 2)) > 2.0 * wheels.radii.max()


def test_a_failing_picture_leaves_the_settings_alone():
    before = matplotlib.rcParams["font.size"]
    with pytest.raises(ZeroDivisionError), look():
        raise ZeroDivisionError
    assert matplotlib.rcParams["font.size"] == before


def test_two_threads_draw_the_same(robot, pictures):
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(2) as pool:
        drawn = list(pool.map(lambda _: draw_robot(robot).svg, range(4)))
    assert set(drawn) == {pictures[0].svg}


def test_the_palette_keeps_its_distance():
    """Colours that share a picture differ in lightness or hue even for a reader without red or green cones."""
    for palette in (LEVEL_COLOURS, tuple(AXIS_COLOUR.values())):
        for one, other in combinations(palette, 2):
            rgb = np.array([[int(colour[k : k + 2], 16) for k in (1, 3, 5)] for colour in (one, other)])
            mixed = np.stack([rgb[:, :2].mean(axis=1), rgb[:, 2]], axis=1)  # red and green seen as one
            assert np.abs(mixed[0] - mixed[1]).max() > 25


def test_the_look_is_known_to_matplotlib():
    assert set(LOOK) <= set(matplotlib.rcParams)


def test_a_picture_keeps_its_words():
    with look():
        made = picture("a", "b", "c", new_figure(1.0, 1.0))
    assert (made.name, made.title, made.caption) == ("a", "b", "c")
    assert size_of(made.png) == (150, 150)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_confidence_band_is_that_of_a_shifted_fit(robot, axis):
    """With speeds counted from v0 the constant of a straight line is the force at v0, and its error the band's."""
    points = table_1_points()
    estimate = fit_steady_state(robot, points, rest_use="line")
    mine = points.axis_index == axis
    speed, force = points.speed[mine], points.force[mine]
    for centre in (0.0, 0.4, 1.1 * speed.max()):
        (_, level), covariance = np.polyfit(speed - centre, force, 1, cov=True)
        middle, half = confidence_band(estimate, axis, np.array([centre]))
        assert middle[0] == pytest.approx(level, rel=1e-9)
        assert half[0] == pytest.approx(4.302652729911275 * np.sqrt(covariance[1, 1]), rel=1e-6)  # t, 2 degrees
