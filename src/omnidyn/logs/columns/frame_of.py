"""Frames of what was measured: a twist in the frame of the room, or a sensor that is mounted at an angle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.logs.column import ROOM, Column
from omnidyn.logs.columns.mapping import ColumnMap

# What `assume` calls a frame -> the components that are in it.
FRAMES = {"twist": ("vx", "vy"), "twist_command": ("vx_cmd", "vy_cmd"), "marker": ("heading",)}


def with_frames(columns: ColumnMap, assume: Mapping[str, str]) -> ColumnMap:
    """The map with the frames that are assumed: twist=room, twist=30deg, marker=30deg.

    Raises InputError for what is no frame, or where the log has no such column.
    """
    framed: dict[str, Column] = {}
    for name in FRAMES.keys() & assume.keys():
        keys = [key for key in FRAMES[name] if key in columns.columns]
        if not keys:
            raise InputError(
                f"no column has this frame: the log has no {' or '.join(FRAMES[name])}",
                got=f"{name}={assume[name]}",
                expected="a frame of a column that is there",
                where="assume",
            )
        framed |= {key: replace(columns.columns[key], frame=assume[name].strip()) for key in keys}
    return replace(columns, columns={**columns.columns, **framed}) if framed else columns


def turn_to_body(t: FloatArray, channels: dict[str, FloatArray], columns: ColumnMap, where: str) -> list[str]:
    """Turn headings and twists of `channels` (in SI, t [s], shape (rows,)) into the frame of the robot, in words.

    heading = heading of the marker - angle; twist = R(-angle) twist; in the frame of the room the angle is the heading.
    Raises InputError for a twist in the frame of the room without a heading.
    """
    notes = []
    marker = columns.columns.get("heading")
    if marker is not None and marker.frame:
        channels["pose"][:, 2] -= marker.mounted_at
        notes.append(f"the marker is mounted at {marker.frame}: the heading is that of {marker.name} less as much")
    for channel, keys in (("twist", ("vx", "vy")), ("twist_command", ("vx_cmd", "vy_cmd"))):
        frames = {columns.columns[key].frame for key in keys if key in columns.columns}
        if not any(frames):
            continue
        if len(frames) > 1 or any(key not in columns.columns for key in keys):
            raise InputError(
                f"{' and '.join(keys)} are turned together",
                got=", ".join(sorted(frames)),
                expected="one frame for both",
                where=where,
            )
        frame = frames.pop()
        angle = _heading(t, channels, channel, where) if frame == ROOM else columns.columns[keys[0]].mounted_at
        plane = (channels[channel][:, 0] + 1j * channels[channel][:, 1]) * np.exp(-1j * np.asarray(angle))
        channels[channel][:, 0], channels[channel][:, 1] = plane.real, plane.imag
        manner = "from the frame of the room by the heading" if frame == ROOM else f"back by {frame}"
        notes.append(f"{keys[0]} and {keys[1]} are turned {manner}")
    return notes


def _heading(t: FloatArray, channels: Mapping[str, FloatArray], channel: str, where: str) -> FloatArray:
    """The heading [rad] in each row; between two measurements on the line between them."""
    pose = channels.get("pose")
    measured = np.isfinite(t) & np.isfinite(pose[:, 2]) if pose is not None else np.zeros(len(t), dtype=bool)
    if pose is None or not measured.any():
        raise InputError(
            f"a {channel} in the frame of the room needs a heading to be turned by",
            got="no heading",
            expected="a column heading",
            remedy="say which column it is: `column` heading=NAME:deg",
            where=where,
        )
    order = np.flatnonzero(measured)[np.argsort(t[measured], kind="stable")]
    return np.where(measured, pose[:, 2], np.interp(t, t[order], pose[order, 2]))
