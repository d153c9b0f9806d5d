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
from omnidyn.report.figures.robot import wheel_places
from omnidyn.report.figures.tracking import COLOURS, draw_tracking, draw_voltages
from omnidyn.report.html import Section, escaped, page, section
from omnidyn.statement import Statement

SIZE, MARGIN, TEXT = 480, 16, 20  # pixels
FINE = 2  # drawn so many times larger, then made small: lines are smooth
LEAST_HEIGHT = 0.45  # of the width
FRAME, MOST_FRAMES = 0.05, 240  # [s] of the run to a frame; longer runs go faster
TAIL = 1.0  # [s] of its way that a robot draws behind it
LARGEST = 0.12  # share of the picture that a robot is drawn at the most
PALE, INK, WAY = (236, 236, 236), (34, 34, 34), (178, 178, 178)


def animation(found: Sequence[Tracking], robot: Robot) -> bytes:
    """The bytes of a GIF that repeats: the path, each robot with its wheels, and a tail of where it was."""
    from PIL import Image

    t = found[0].run.t
    step = max(FRAME, float(t[-1]) / MOST_FRAMES)
    times = np.arange(0.0, float(t[-1]) + 0.5 * step, step)
    place = _scale(found)
    frames = [_frame(found, robot, place, float(time)) for time in times]
    palette = frames[0].quantize(colors=64)
    frames = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in frames]
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


def _scale(found: Sequence[Tracking]) -> Scale:
    """How all of it goes into the picture."""
    poses = [each.run.pose for each in found if each.run.pose is not None]
    every = np.concatenate([each[:, :2] for each in (found[0].wanted, *poses)])
    near = found[0].wanted[:, :2]
    span = float(np.ptp(near, axis=0).max()) or 1.0
    middle = 0.5 * (near.max(axis=0) + near.min(axis=0))
    every = np.clip(every, middle - 2.0 * span, middle + 2.0 * span)  # one that ran away does not shrink the rest
    low, high = every.min(axis=0), every.max(axis=0)
    room = max(float((high - low).max()), 1e-3)
    size = FINE * (1.0 - 2.0 * LARGEST) * (SIZE - 2 * MARGIN) / room
    share = min(1.0, max(LEAST_HEIGHT, (high[1] - low[1]) / room * (1.0 - 2.0 * LARGEST) + 2.0 * LARGEST))
    return Scale(0.5 * (low + high), size, FINE * round(share * SIZE))


def _frame(found: Sequence[Tracking], robot: Robot, scale: Scale, time: float) -> Any:
    """One picture."""
    from PIL import Image, ImageDraw, ImageFont

    width, top = FINE * SIZE, FINE * TEXT
    image = Image.new("RGB", (width, scale.height + top), "white")
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(FINE * 13)

    def seen(points: FloatArray) -> list[tuple[float, float]]:
        x, y = ((points - scale.middle) * scale.size).T
        return list(zip((width / 2 + x).tolist(), (scale.height / 2 - y + top).tolist(), strict=True))

    draw.line(seen(found[0].wanted[:, :2]), fill=WAY, width=3 * FINE, joint="curve")
    t = found[0].run.t
    now = min(int(np.searchsorted(t, time)), len(t) - 1)
    x = float(FINE * MARGIN)
    for k, each in enumerate(found):
        assert each.run.pose is not None
        colour = COLOURS[k % len(COLOURS)]
        behind = max(0, now - round(TAIL / each.dt))
        if now > behind:
            draw.line(seen(each.run.pose[behind : now + 1, :2]), fill=colour, width=2 * FINE)
        _robot(draw, robot, each.run.pose[now], scale.size, seen, colour)
        draw.text((x, 4), each.controller, fill=colour, font=font)
        x += draw.textlength(each.controller, font=font) + FINE * 14
    draw.ellipse(_around(seen(found[0].wanted[now : now + 1, :2])[0], 4 * FINE), fill=INK)
    draw.text((width - FINE * 64, 4), f"{time:.2f} s", fill=INK, font=font)
    return image.resize((SIZE, (scale.height + top) // FINE), Image.Resampling.LANCZOS)


def _robot(draw: Any, robot: Robot, pose: FloatArray, scale: float, seen: Any, colour: str) -> None:
    """The robot from above: a body, its wheels, a line to where it looks."""
    places = wheel_places(robot.wheels)
    reach = float(np.linalg.norm(places, axis=1).max())
    size = min(1.0, LARGEST * FINE * SIZE / (reach * scale))
    turn = np.array([[math.cos(pose[2]), -math.sin(pose[2])], [math.sin(pose[2]), math.cos(pose[2])]])
    centre = seen(pose[None, :2])[0]
    draw.ellipse(_around(centre, 0.85 * reach * scale * size), outline=colour, width=2 * FINE)
    ahead = pose[:2] + turn @ np.array([0.85 * reach * size, 0.0])
    draw.line([centre, seen(ahead[None])[0]], fill=colour, width=2 * FINE)
    for wheel, place in enumerate(places):
        rolling = robot.wheels.wrench_matrix[:2, wheel] / np.hypot(*robot.wheels.wrench_matrix[:2, wheel])
        ends = np.stack([place - rolling * robot.wheels.radii[wheel], place + rolling * robot.wheels.radii[wheel]])
        draw.line(seen(pose[:2] + size * ends @ turn.T), fill=INK, width=4 * FINE)


def _around(point: tuple[float, float], radius: float) -> tuple[float, float, float, float]:
    return point[0] - radius, point[1] - radius, point[0] + radius, point[1] + radius


# The report of `omnidyn track`: what the path asks for, how near each controller came, pictures, a moving one


def render_tracking(
    found: Sequence[Tracking], robot: Robot, provenance: Mapping[str, Any], *, notes: Sequence[Statement] = ()
) -> str:
    """The page as HTML: it needs no other file. robot: that was driven. notes: what the path asks for."""
    told = trackings_document(found, notes)
    limit = per_wheel(robot.motor.voltage_limit, robot.wheels.count)
    sections = [
        section("controllers", "Controllers", told["controllers"]),
        section("tracking", "Path and errors", draw_tracking(found)),
        Section("moving", "In motion", _moving(found, robot)),
        section("voltages", "Voltages", draw_voltages(found, limit)),
        section("warnings", "Warnings", told["warnings"], none="None."),
    ]
    if notes:
        sections.insert(1, section("path", "What the path asks for", told["path"]))
    title = f"{found[0].plant} along {found[0].path}"
    introduction = (
        "A simulated robot, driven step by step. Errors are distances from where the path is at that time. Position "
        "and heading: root mean square; effort: that of a voltage; change: of a voltage from step to step."
    )
    return page(title, introduction, sections, provenance, verdict=told.verdict_text)


def _moving(found: Sequence[Tracking], robot: Robot) -> str:
    """The animation inside the page."""
    data = base64.b64encode(animation(found, robot)).decode()
    names = ", ".join(each.controller for each in found)
    words = "The dot is where the path is at that time. To scale, a large robot apart."
    image = f'<img alt="{escaped(f"{robot.name} driven by {names}")}" src="data:image/gif;base64,{data}">'
    return f'<figure id="animation"><div class="frame">{image}</div><figcaption>{escaped(words)}</figcaption></figure>'
