"""Pictures of where logs went, and of friction against speed: what was driven is what is drawn."""

import numpy as np

import omnidyn
from omnidyn.logs.path import path_of
from omnidyn.report.figures.friction_speed import draw_friction_speed, estimate_curves
from omnidyn.report.figures.path import SECTORS, draw_path
from omnidyn.run import Run
from tests.support.figures import shown_texts


def straight(direction_deg, metres):
    angle = np.radians(direction_deg)
    t = np.linspace(0.0, metres, 101)
    return path_of(Run(t=t, twist=np.tile([np.cos(angle), np.sin(angle), 0.0], (101, 1))))


def test_metres_per_direction_are_those_driven():
    drawn = draw_path([straight(0.0, 2.0), straight(90.0, 1.0), straight(-120.0, 3.0)])
    bars = drawn.figure.axes[1].patches
    metres = {round(np.degrees(bar.get_x() + 0.5 * bar.get_width())) % 360: bar.get_height() for bar in bars}
    assert len(metres) == SECTORS
    driven = {way: round(length, 6) for way, length in metres.items() if length > 1e-9}
    assert driven == {0: 2.0, 90: 1.0, 240: 3.0}
    assert "6 m in all" in drawn.caption
    assert "drift" in drawn.caption


def test_nothing_is_cut_off():
    figure = draw_path([straight(way, 1234.5) for way in range(0, 360, 45)]).figure
    for words, box in shown_texts(figure):
        assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1, words
        assert figure.bbox.y0 <= box.y0 <= box.y1 <= figure.bbox.y1, words


def test_a_robot_that_never_moved_is_drawn_too():
    assert draw_path([straight(0.0, 1e-300)]).png.startswith(b"\x89PNG")


def test_what_was_not_fitted_is_dotted_and_said():
    from omnidyn.identification.steady.steady_state import fit_steady_state
    from omnidyn.logs.steady_table import SteadyTable

    rows = SteadyTable(["x"] * 4, np.array([-0.2, 0.4, 0.6, 0.8]), np.array([-2.4, 2.55, 2.8, 2.9]))
    estimate = fit_steady_state(omnidyn.load_robot("axebot"), rows)
    drawn = draw_friction_speed({"axebot": estimate_curves(estimate)}, [(0.1, 0.8), None, None])
    x, y, yaw = drawn.figure.axes
    assert "not fitted" not in x.get_title("left")
    assert ", not fitted" in y.get_title("left")
    assert ", not fitted" in yaw.get_title("left")
    assert "y and yaw were not fitted" in drawn.caption
    assert len(x.collections) == 2  # a band on either side
