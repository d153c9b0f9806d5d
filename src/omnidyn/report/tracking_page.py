"""Robots on their path as a moving picture: a GIF, drawn by pillow, which comes with matplotlib."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.control.tracking import Tracking, trackings_document
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.report.figures.robot import wheel_lines, wheel_places
from omnidyn.report.figures.tracking import COLOURS, draw_tracking, draw_voltages
from omnidyn.report.html import Section, escaped, page, section
from omnidyn.statement import Statement

SIZE, MARGIN, TEXT = 480, 16, 20  # pixels
OVERSAMPLING = 2  # drawn so many times larger, then made small: lines are smooth
LEAST_HEIGHT = 0.45  # of the width
FRAME, MOST_FRAMES = 0.05, 240  # [s] of the run to a frame; longer runs go faster
TAIL = 1.0  # [s] of its way that a robot draws behind it
LARGEST_ROBOT_SHARE = 0.12  # share of the picture that a robot is drawn at the most
PALE, INK, WAY = (236, 236, 236), (34, 34, 34), (178, 178, 178)


def animation(trackings: Sequence[Tracking], robot: Robot) -> bytes:
    """The bytes of a GIF that repeats: the path, each robot with its wheels, and a tail of where it was."""
    from PIL import Image

    t = trackings[0].run.t
    step = max(FRAME, float(t[-1]) / MOST_FRAMES)
    times = np.arange(0.0, float(t[-1]) + 0.5 * step, step)
    place = _scale(trackings)
    frames = [_frame(trackings, robot, place, float(time)) for time in times]
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


def _scale(trackings: Sequence[Tracking]) -> Scale:
    """How all of it goes into the picture."""
    poses = [tracking.run.pose for tracking in trackings if tracking.run.pose is not None]
    all_points = np.concatenate([pose[:, :2] for pose in (trackings[0].wanted, *poses)])
    path_points = trackings[0].wanted[:, :2]
    span = float(np.ptp(path_points, axis=0).max()) or 1.0
    middle = 0.5 * (path_points.max(axis=0) + path_points.min(axis=0))
    all_points = np.clip(
        all_points, middle - 2.0 * span, middle + 2.0 * span
    )  # one that ran away does not shrink the rest
    low, high = all_points.min(axis=0), all_points.max(axis=0)
    room = max(float((high - low).max()), 1e-3)
    size = OVERSAMPLING * (1.0 - 2.0 * LARGEST_ROBOT_SHARE) * (SIZE - 2 * MARGIN) / room
    share = min(
        1.0,
        max(LEAST_HEIGHT, (high[1] - low[1]) / room * (1.0 - 2.0 * LARGEST_ROBOT_SHARE) + 2.0 * LARGEST_ROBOT_SHARE),
    )
    return Scale(0.5 * (low + high), size, OVERSAMPLING * round(share * SIZE))


def _frame(trackings: Sequence[Tracking], robot: Robot, scale: Scale, time: float) -> Any:
    """One picture."""
    from PIL import Image, ImageDraw, ImageFont

    width, top = OVERSAMPLING * SIZE, OVERSAMPLING * TEXT
    image = Image.new("RGB", (width, scale.height + top), "white")
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(OVERSAMPLING * 13)

    def seen(points: FloatArray) -> list[tuple[float, float]]:
        x, y = ((points - scale.middle) * scale.size).T
        return list(zip((width / 2 + x).tolist(), (scale.height / 2 - y + top).tolist(), strict=True))

    draw.line(seen(trackings[0].wanted[:, :2]), fill=WAY, width=3 * OVERSAMPLING, joint="curve")
    t = trackings[0].run.t
    now = min(int(np.searchsorted(t, time)), len(t) - 1)
    x = float(OVERSAMPLING * MARGIN)
    for k, tracking in enumerate(trackings):
        assert tracking.run.pose is not None
        colour = COLOURS[k % len(COLOURS)]
        behind = max(0, now - round(TAIL / tracking.dt))
        if now > behind:
            draw.line(seen(tracking.run.pose[behind : now + 1, :2]), fill=colour, width=2 * OVERSAMPLING)
        _robot(draw, robot, tracking.run.pose[now], scale.size, seen, colour)
        draw.text((x, 4), tracking.controller, fill=colour, font=font)
        x += draw.textlength(tracking.controller, font=font) + OVERSAMPLING * 14
    draw.ellipse(_around(seen(trackings[0].wanted[now : now + 1, :2])[0], 4 * OVERSAMPLING), fill=INK)
    draw.text((width - OVERSAMPLING * 64, 4), f"{time:.2f} s", fill=INK, font=font)
    return image.resize((SIZE, (scale.height + top) // OVERSAMPLING), Image.Resampling.LANCZOS)


def _robot(draw: Any, robot: Robot, pose: FloatArray, scale: float, to_pixels: Any, colour: str) -> None:
    """The robot from above: a body, its wheels, a line to where it looks."""
    places = wheel_places(robot.wheels)
    reach = float(np.linalg.norm(places, axis=1).max())
    size = min(1.0, LARGEST_ROBOT_SHARE * OVERSAMPLING * SIZE / (reach * scale))
    turn = np.array([[math.cos(pose[2]), -math.sin(pose[2])], [math.sin(pose[2]), math.cos(pose[2])]])
    centre = to_pixels(pose[None, :2])[0]
    draw.ellipse(_around(centre, 0.85 * reach * scale * size), outline=colour, width=2 * OVERSAMPLING)
    ahead = pose[:2] + turn @ np.array([0.85 * reach * size, 0.0])
    draw.line([centre, to_pixels(ahead[None])[0]], fill=colour, width=2 * OVERSAMPLING)
    for ends in wheel_lines(robot.wheels):
        draw.line(to_pixels(pose[:2] + size * ends @ turn.T), fill=INK, width=4 * OVERSAMPLING)


def _around(point: tuple[float, float], radius: float) -> tuple[float, float, float, float]:
    return point[0] - radius, point[1] - radius, point[0] + radius, point[1] + radius


# The report of `omnidyn track`: what the path asks for, how near each controller came, pictures, a moving one


def render_tracking(
    trackings: Sequence[Tracking], robot: Robot, provenance: Mapping[str, Any], *, notes: Sequence[Statement] = ()
) -> str:
    """The page as HTML: it needs no other file. robot: that was driven. notes: what the path asks for."""
    document = trackings_document(trackings, notes)
    limit = per_wheel(robot.motor.voltage_limit, robot.wheels.count)
    sections = [
        section("controllers", "Controllers", document["controllers"]),
        section("tracking", "Path and errors", draw_tracking(trackings)),
        Section("moving", "In motion", _moving(trackings, robot)),
        section("voltages", "Voltages", draw_voltages(trackings, limit)),
        section("warnings", "Warnings", document["warnings"], none="None."),
    ]
    if notes:
        sections.insert(1, section("path", "What the path asks for", document["path"]))
    title = f"{trackings[0].plant} along {trackings[0].path}"
    introduction = (
        "A simulated robot, driven step by step. Errors are distances from where the path is at that time. Position "
        "and heading: root mean square; effort: that of a voltage; change: of a voltage from step to step."
    )
    return page(title, introduction, sections, provenance, verdict=document.verdict_text)


def _moving(trackings: Sequence[Tracking], robot: Robot) -> str:
    """The animation inside the page."""
    data = base64.b64encode(animation(trackings, robot)).decode()
    names = ", ".join(tracking.controller for tracking in trackings)
    words = "The dot is where the path is at that time. To scale, a large robot apart."
    image = f'<img alt="{escaped(f"{robot.name} driven by {names}")}" src="data:image/gif;base64,{data}">'
    return f'<figure id="animation"><div class="frame">{image}</div><figcaption>{escaped(words)}</figcaption></figure>'
