"""Wheels whose names do not count: the motion proposes order and signs, and takes nothing by itself."""

import numpy as np
import pytest

import omnidyn
from omnidyn.logs.read_log import read_log, recorded_log
from omnidyn.model.wheels import wheel_speed
from tests.support.axebot_logs import voltages
from tests.support.codes import said

NAMES = ("left_speed_rad_s", "right_speed_rad_s", "back_speed_rad_s")


def log_of(path, order, signs, seed=0, blank=1):
    """A CSV whose columns are wheels `order`, with `signs`; the body is measured each `blank` rows."""
    robot, rng = omnidyn.load_robot("axebot"), np.random.default_rng(seed)
    run = omnidyn.simulate(robot, voltages(rng, 6.0), 0.01)
    speed = wheel_speed(robot.wheels, run.twist) + rng.normal(0.0, 0.5, (len(run), 3))
    told = np.where(
        np.arange(len(run))[:, None] % blank == 0, run.twist + rng.normal(0.0, 0.02, run.twist.shape), np.nan
    )
    lines = [f"t_s,{','.join(NAMES)},vx_m_s,vy_m_s,omega_rad_s"]
    for k in range(len(run)):
        row = [k / 100, *(signs * speed[k, order]), *told[k]]
        lines.append(",".join("" if value != value else repr(float(value)) for value in row))
    path.write_text("\n".join(lines) + "\n")
    return path, speed


@pytest.mark.parametrize("blank", [1, 4])
@pytest.mark.parametrize(
    ("order", "signs"), [((0, 1, 2), (1, 1, 1)), ((2, 0, 1), (1, -1, 1)), ((1, 2, 0), (-1, -1, -1))]
)
def test_the_motion_proposes_the_order_and_the_signs(tmp_path, order, signs, blank):
    path, speed = log_of(tmp_path / "a.csv", np.array(order), np.array(signs), blank=blank)
    robot = omnidyn.load_robot("axebot")
    log = recorded_log(path, robot)
    assert "wheel_speed" not in log.channels
    told = {f"w{wheel + 1}": f"{'-' * (signs[k] < 0)}{NAMES[k]}" for k, wheel in enumerate(order)}
    words = ", ".join(f"{name}={told[name]}" for name in sorted(told))
    assert any(f"the motion says `column` {words})" in doubt for doubt in said(log.columns.doubts))
    np.testing.assert_allclose(read_log(path, robot, columns=told).wheel_speed, speed, rtol=1e-14)


def test_the_motion_agrees_with_places_or_is_asked_about(tmp_path):
    """left, right, back of an axebot, whose wheels stand at 180, -60 and 60 degrees: wheels 3, 2 and 1."""
    path, speed = log_of(tmp_path / "a.csv", np.array([2, 1, 0]), np.array([1, 1, 1]))
    robot = omnidyn.load_robot("axebot")
    log = recorded_log(path, robot)
    np.testing.assert_allclose(log.channels["wheel_speed"], speed, rtol=1e-14)
    assert not said(log.columns.doubts)


def test_without_a_robot_or_a_motion_it_is_asked_as_before(tmp_path):
    path, _ = log_of(tmp_path / "a.csv", np.arange(3), np.ones(3))
    path.write_text(path.read_text().replace("back_", "other_"))  # places all around would say which wheel each is
    assert any(
        "say `column` w1=left_speed_rad_s and so on" in doubt for doubt in said(recorded_log(path).columns.doubts)
    )
    text = path.read_text().splitlines()
    short = [",".join(line.split(",")[:4]) for line in text]
    path.write_text("\n".join(short) + "\n")
    log = recorded_log(path, omnidyn.load_robot("axebot"))
    assert any("say `column` w1=left_speed_rad_s and so on" in doubt for doubt in said(log.columns.doubts))
