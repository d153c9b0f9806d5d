"""Robots that move, from above and to scale: a GIF, drawn by pillow, which comes with matplotlib."""

from __future__ import annotations

import base64
import io
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.files import write_atomic
from omnidyn.logs.path import drawable_path
from omnidyn.model.robot import Robot
from omnidyn.report.figures.robot import wheel_lines, wheel_places
from omnidyn.report.figures.tracking import COLOURS
from omnidyn.run import Run

SIZE, MARGIN, TEXT = 480, 16, 20  # pixels
OVERSAMPLING = 2  # drawn so many times larger, then made small: lines are smooth
LEAST_HEIGHT = 0.45  # of the width
FRAME, MOST_FRAMES = 0.05, 240  # [s] of the run to a frame; longer runs go faster
TAIL = 1.0  # [s] of its way that a robot draws behind it
BODY_SHARE = 0.85  # of the distance of the outermost wheel: the circle that stands for the body
PALE, INK, WAY = (236, 236, 236), (34, 34, 34), (178, 178, 178)


@dataclass(frozen=True)
class Animation:
    """A moving picture. gif: the bytes of a GIF that repeats. A notebook shows it."""

    gif: bytes = field(repr=False)

    def save(self, path: str | os.PathLike, force: bool = False) -> None:
        """Write it as a file `.gif`. Raises InputError for another ending, or where it exists, unless `force`."""
        if not os.fspath(path).lower().endswith(".gif"):
            raise InputError("another kind of file", got=os.fspath(path), expected="a name that ends in .gif")
        write_atomic(path, self.gif, force)

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        return f'<img alt="animation" src="data:image/gif;base64,{base64.b64encode(self.gif).decode()}">'


def animate(run: Run, robot: Robot) -> Animation:
    """The robot on the way that a run went. Raises InputError for a run that does not say where that is."""
    path = drawable_path(run, robot)
    pose = np.column_stack([path.position, path.heading])
    rows = np.isfinite(pose).all(axis=1)
    return Animation(moving_picture(robot, run.t[rows], {robot.name: pose[rows]}, pose[rows, :2]))


def moving_picture(
    robot: Robot, t: FloatArray, poses: Mapping[str, FloatArray], path: FloatArray, target: FloatArray | None = None
) -> bytes:
    """The bytes of a GIF that repeats: the path, each robot with its wheels, and a tail of where it was.

    Args:
        robot: that is drawn, to scale.
        t: times [s], shape (n,).
        poses: name -> poses at these times, shape (n, 3).
        path: that is drawn below them [m], shape (points, 2).
        target: where the path is at these times [m], shape (n, 2); None for no dot there.
    """
    from PIL import Image

    start, end = float(t[0]), float(t[-1])
    step = max(FRAME, (end - start) / MOST_FRAMES)
    scene = _Scene(robot, t, poses, path, target, _scale(robot, poses, path))
    frames = [_frame(scene, float(time)) for time in np.arange(start, end + 0.5 * step, step)]
    palette = frames[0].quantize(colors=64)
    frames = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    stream = io.BytesIO()
    frames[0].save(
        stream,
        "GIF",
        save_all=True,
        append_images=frames[1:],
        duration=round(1e3 * min(step, FRAME)),
        loop=0,
        optimize=False,
    )
    return stream.getvalue()


class Scale(NamedTuple):
    """The middle of all that is shown [m], fine pixels per metre, height of the picture in fine pixels, text apart."""

    middle: FloatArray
    size: float
    height: int


class _Scene(NamedTuple):
    """What all frames share; the arguments of `moving_picture`, and the scale."""

    robot: Robot
    t: FloatArray
    poses: Mapping[str, FloatArray]
    path: FloatArray
    target: FloatArray | None
    scale: Scale


def _scale(robot: Robot, poses: Mapping[str, FloatArray], path: FloatArray) -> Scale:
    """How all of it goes into the picture."""
    reach = _reach(robot) + float(robot.wheels.radii.max())
    span = float(np.ptp(path, axis=0).max()) or 1.0
    middle = 0.5 * (path.max(axis=0) + path.min(axis=0))
    points = np.concatenate([path, *(pose[:, :2] for pose in poses.values())])
    points = np.clip(points, middle - 2.0 * span, middle + 2.0 * span)  # one that ran away does not shrink the rest
    low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
    room = float((high - low).max())
    size = OVERSAMPLING * (SIZE - 2 * MARGIN) / room
    share = min(1.0, max(LEAST_HEIGHT, (high[1] - low[1]) / room))
    return Scale(0.5 * (low + high), size, OVERSAMPLING * round(share * SIZE))


def _reach(robot: Robot) -> float:
    """Distance of the outermost wheel [m]."""
    return float(np.linalg.norm(wheel_places(robot.wheels), axis=1).max())


def _frame(scene: _Scene, time: float) -> Any:
    """One picture."""
    from PIL import Image, ImageDraw, ImageFont

    scale, t = scene.scale, scene.t
    width, top = OVERSAMPLING * SIZE, OVERSAMPLING * TEXT
    image = Image.new("RGB", (width, scale.height + top), "white")
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(OVERSAMPLING * 13)

    def seen(points: FloatArray) -> list[tuple[float, float]]:
        x, y = ((points - scale.middle) * scale.size).T
        return list(zip((width / 2 + x).tolist(), (scale.height / 2 - y + top).tolist(), strict=True))

    draw.line(seen(scene.path), fill=WAY, width=3 * OVERSAMPLING, joint="curve")
    now = min(int(np.searchsorted(t, time)), len(t) - 1)
    behind = int(np.searchsorted(t, time - TAIL))
    x = float(OVERSAMPLING * MARGIN)
    for k, (name, pose) in enumerate(scene.poses.items()):
        colour = COLOURS[k % len(COLOURS)]
        if now > behind:
            draw.line(seen(pose[behind : now + 1, :2]), fill=colour, width=2 * OVERSAMPLING)
        _robot(draw, scene.robot, pose[now], scale.size, seen, colour)
        draw.text((x, 4), name, fill=colour, font=font)
        x += draw.textlength(name, font=font) + OVERSAMPLING * 14
    if scene.target is not None:
        draw.ellipse(_around(seen(scene.target[now : now + 1])[0], 4 * OVERSAMPLING), fill=INK)
    draw.text((width - OVERSAMPLING * 64, 4), f"{time:.2f} s", fill=INK, font=font)
    _ruler(draw, scale, top, font)
    return image.resize((SIZE, (scale.height + top) // OVERSAMPLING), Image.Resampling.LANCZOS)


def _ruler(draw: Any, scale: Scale, top: int, font: Any) -> None:
    """A round length below, to the left."""
    longest = 0.25 * OVERSAMPLING * SIZE / scale.size
    power = 10.0 ** math.floor(math.log10(longest))
    length = max(digit * power for digit in (1.0, 2.0, 5.0) if digit * power <= longest)
    left, bottom = OVERSAMPLING * MARGIN, top + scale.height - OVERSAMPLING * 6
    draw.line([(left, bottom), (left + length * scale.size, bottom)], fill=INK, width=2 * OVERSAMPLING)
    draw.text((left, bottom - OVERSAMPLING * 18), f"{length:g} m", fill=INK, font=font)


def _robot(draw: Any, robot: Robot, pose: FloatArray, scale: float, to_pixels: Any, colour: str) -> None:
    """The robot from above: a body, its wheels, a line to where it looks."""
    body = BODY_SHARE * _reach(robot)
    turn = np.array([[math.cos(pose[2]), -math.sin(pose[2])], [math.sin(pose[2]), math.cos(pose[2])]])
    centre = to_pixels(pose[None, :2])[0]
    draw.ellipse(_around(centre, body * scale), outline=colour, width=2 * OVERSAMPLING)
    draw.line([centre, to_pixels((pose[:2] + turn @ [body, 0.0])[None])[0]], fill=colour, width=2 * OVERSAMPLING)
    for ends in wheel_lines(robot.wheels):
        draw.line(to_pixels(pose[:2] + ends @ turn.T), fill=INK, width=4 * OVERSAMPLING)


def _around(point: tuple[float, float], radius: float) -> tuple[float, float, float, float]:
    return point[0] - radius, point[1] - radius, point[0] + radius, point[1] + radius
