"""Frames that are assumed: a twist of the room is turned by the heading, a sensor or a marker by its angle."""

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.logs.column import Column
from omnidyn.logs.columns.mapping import ColumnMap, load_map, save_map
from omnidyn.logs.read_log import read_log
from tests.support.codes import said


@pytest.fixture
def spinning(tmp_path):
    """A robot that drives forward at 0.5 m/s and turns at 1 rad/s; its twist is in the frame of the room."""
    t = np.arange(200) * 0.02
    head = "t_s,x_m,y_m,heading_rad,vx_m_s,vy_m_s,omega_rad_s"
    table = np.column_stack(
        [t, 0.5 * np.sin(t), 0.5 - 0.5 * np.cos(t), t, 0.5 * np.cos(t), 0.5 * np.sin(t), 1.0 + 0 * t]
    )
    np.savetxt(tmp_path / "room.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
    return tmp_path / "room.csv"


def test_a_twist_of_the_room_is_turned_by_the_heading(spinning):
    run = read_log(spinning, assume={"twist": "room"})
    np.testing.assert_allclose(run.twist, np.tile([0.5, 0.0, 1.0], (200, 1)), atol=1e-8)
    assert any("turned from the frame of the room by the heading" in words for words in said(run.warnings))


def test_a_sensor_and_a_marker_at_an_angle(spinning):
    plain = read_log(spinning)
    run = read_log(spinning, assume={"twist": "90deg", "marker": "-30 deg"})
    np.testing.assert_allclose(run.twist[:, 0], plain.twist[:, 1], atol=1e-8)
    np.testing.assert_allclose(run.twist[:, 1], -plain.twist[:, 0], atol=1e-8)
    np.testing.assert_allclose(run.pose[:, 2], plain.pose[:, 2] + np.pi / 6.0, atol=1e-8)


def test_a_map_keeps_the_frame(spinning, tmp_path):
    columns = ColumnMap(
        {
            "t": Column("t_s", "s"),
            "heading": Column("heading_rad", "rad", frame="12 deg"),
            "vx": Column("vx_m_s", "m/s", frame="room"),
            "vy": Column("vy_m_s", "m/s", frame="room"),
        }
    )
    again = load_map(save_map(columns, tmp_path / "map.toml"))
    assert again == columns
    # The marker is 12 deg ahead of the robot: so much less it is turned.
    run = read_log(spinning, columns=again)
    assert np.degrees(np.arctan2(run.twist[0, 1], run.twist[0, 0])) == pytest.approx(12.0)


@pytest.mark.parametrize(
    "assume, words",
    [
        ({"twist": "moon"}, "not a frame"),
        ({"twist": "3 m"}, "not a frame"),
        ({"twist_command": "room"}, "no column has this frame"),
    ],
)
def test_what_is_no_frame_is_refused(spinning, assume, words):
    with pytest.raises(InputError, match=words):
        read_log(spinning, assume=assume)


def test_a_frame_of_the_room_needs_a_heading(tmp_path):
    (tmp_path / "a.csv").write_text("t_s,vx_m_s,vy_m_s\n" + "".join(f"{k * 0.1:.1f},1,0\n" for k in range(50)))
    with pytest.raises(InputError, match="needs a heading"):
        read_log(tmp_path / "a.csv", assume={"twist": "room"})


def test_only_what_has_a_direction_has_a_frame():
    with pytest.raises(InputError, match="only a heading and velocities"):
        ColumnMap({"u1": Column("u1", "V", frame="room")})
