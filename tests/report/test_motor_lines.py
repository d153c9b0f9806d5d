"""The picture of the motors: its panels, and what is drawn in them."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import omnidyn
from omnidyn.report.figures.motor_lines import BAND, LINE, STARTS, draw_motor_lines
from omnidyn.report.motors_page import render_motors
from tests.support.bench_motor import BenchMotor, ramps
from tests.support.figures import shown_texts

SPEED = np.linspace(-5.0, 5.0, 40)


def study(count, width=0.01) -> Any:
    """So many motors, u = 0.5 w + 0.4 sgn w, whose dead bands are known within `width`."""
    lines = [
        SimpleNamespace(
            motor=k,
            name=f"motor {k + 1}",
            value={"slope": 0.5, "dead_band": 0.4, "inertia": 0.0},
            ci95={"dead_band": (0.4 - width, 0.4 + width)},
        )
        for k in range(count)
    ]
    side = np.sign(SPEED)
    parts = (0.5 * SPEED + 0.4 * side, SPEED, 0.01 + 0.0 * SPEED, side, 0.0 * SPEED, side)
    windows = SimpleNamespace(kind="voltage", unit="V", speed_from="wheel_angle", of=lambda motor: parts)
    return lines, windows


@pytest.mark.parametrize(("count", "shape"), [(1, (1, 1)), (2, (1, 2)), (3, (1, 3)), (4, (2, 2)), (6, (2, 3))])
def test_panels_fill_their_rows_and_each_row_has_its_unit(count, shape):
    """Four motors stood as three and one, the first of each row named by its number and not by its place."""
    axes = draw_motor_lines(*study(count)).figure.axes
    assert axes[0].get_gridspec().get_geometry() == shape
    assert all(panel.axison for panel in axes)
    labels = [panel.get_ylabel() for panel in axes]
    assert labels == ["voltage, V" if k % shape[1] == 0 else "" for k in range(count)]


def test_a_dead_band_that_is_well_known_is_seen():
    """An interval of 20 mV on an axis of 3 V was less than a pixel high, below the line."""
    (panel,) = draw_motor_lines(*study(1)).figure.axes
    back, ahead = labelled(panel, BAND)
    assert back.get_ydata() == pytest.approx([-0.39, -0.41])
    assert ahead.get_ydata() == pytest.approx([0.39, 0.41])
    assert ahead.get_marker() == "_"
    assert ahead.get_zorder() > max(line.get_zorder() for line in labelled(panel, LINE))


def labelled(panel, label):
    return [line for line in panel.get_lines() if line.get_label() == label]


def test_a_start_that_was_seen_stands_where_the_line_does_not_cross():
    """Forward it sets off at 0.6 V, and the line of that direction crosses at 0.3: the bar shows the start."""
    nothing = (float("nan"), float("nan"))
    starts: Any = [
        SimpleNamespace(motor=0, side=side, value=value, ci95={"start": span})
        for side, value, span in (
            (1.0, {"start": 0.6, "offset": 0.3, "slope": 0.52}, (0.58, 0.62)),
            (-1.0, {"start": 0.6, "offset": float("nan")}, nothing),
        )
    ]
    drawn = draw_motor_lines(*study(1), starts)
    (panel,) = drawn.figure.axes
    (start,), (band,) = labelled(panel, STARTS), labelled(panel, BAND)
    assert start.get_ydata() == pytest.approx([0.58, 0.62])
    assert band.get_ydata() == pytest.approx([-0.39, -0.41])
    back, ahead = (np.asarray(line.get_ydata()) for line in labelled(panel, LINE))
    assert (back[0], back[-1]) == pytest.approx((-0.4, -2.9))
    assert (ahead[0], ahead[-1]) == pytest.approx((0.3, 2.9))
    assert "and not where the line crosses" in drawn.caption
    for words, box in shown_texts(drawn.figure):
        assert drawn.figure.bbox.x0 <= box.x0 <= box.x1 <= drawn.figure.bbox.x1, words


def test_free_runs_have_a_picture_too():
    t, put_in = ramps([3.0, -3.0], 0.8, 0.01)
    speed, *_ = BenchMotor().turn(t, put_in)
    study = omnidyn.identify(
        omnidyn.Run(t=t, voltage=put_in[:, None], wheel_speed=speed[:, None] + 1e-3), None, omnidyn.MotorFit()
    ).study
    (panel,) = study.plot().axes
    assert len(labelled(panel, STARTS)) == 2
    assert "<figure" in render_motors(study, {"omnidyn": "0.1.0", "command": "", "inputs": []})
