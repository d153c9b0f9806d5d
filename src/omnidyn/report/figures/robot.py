"""Fig. 1: the robot from above, to scale."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle, FancyBboxPatch
from matplotlib.transforms import Affine2D

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import Wheels, per_wheel, sin_cos_deg
from omnidyn.report.style import AXIS_COLOUR, GREY, INK, PALE, Picture, look, new_figure, note, picture

WHEEL_WIDTH = 0.5  # of the wheel radius; the paper prints no width
NAMES = {"x": "x forward, v", "y": "y left, vₙ", "yaw": "yaw, ω"}


def draw_robot(robot: Robot) -> Picture:
    """The robot seen from above: forward is up. Distances are to scale, arrows show the push of a positive voltage."""
    with look():
        figure = new_figure(6.2, 6.2)
        axes = figure.add_axes((0.01, 0.01, 0.98, 0.98))
        axes.set_axis_off()
        axes.set_aspect("equal")
        places = wheel_places(robot.wheels)
        reach = float(np.linalg.norm(places, axis=1).max()) + 2.3 * float(robot.wheels.radii.max())
        axes.set_xlim(-reach, reach)
        axes.set_ylim(-reach, reach)
        _body(axes, places)
        for wheel in range(robot.wheels.count):
            _wheel(axes, robot, wheel, places[wheel])
        _body_axes(axes, reach)
        _dimensions(axes, robot, reach)
        return picture("fig1_robot", f"Fig. 1: {robot.name} from above", _caption(robot), figure)


def _caption(robot: Robot) -> str:
    words = "an arrow at a wheel shows the way it pushes the robot when its voltage is positive"
    text = f"To scale, forward is up; {words}. The width of the wheels is not printed and only drawn."
    if _shared(robot.wheels).any():
        text += (
            " The robot file gives wheels on parallel axles one distance, not two: those wheels are drawn where they "
            "push and turn the robot as the file says, as if track and wheelbase were alike."
        )
    return text


def _shared(wheels: Wheels) -> BoolArray:
    """Which wheels have the azimuth and the distance of another one: the file does not say where each stands."""
    sin, cos = sin_cos_deg(wheels.azimuth_deg)
    place = per_wheel(wheels.robot_radius, wheels.count) * np.stack([cos, sin])
    apart = np.linalg.norm(place[:, :, None] - place[:, None, :], axis=0)
    return (apart < 1e-9).sum(axis=0) > 1


def wheel_places(wheels: Wheels) -> FloatArray:
    """Where each wheel is drawn in body coordinates [m]. Shape (wheels, 2).

    At its distance b along its azimuth. A wheel that would stand on another one is moved along its rolling direction
    by c, and to the distance a along its azimuth, so that its lever arm stays what it is: a + c tan(roller) = b, with
    |c| = a. Wheels with equal rollers, which nothing tells apart, stand side by side.
    """
    sin, cos = sin_cos_deg(wheels.azimuth_deg)
    roller_sin, roller_cos = sin_cos_deg(per_wheel(wheels.roller_angle_deg, wheels.count))
    tan, shared = roller_sin / roller_cos, _shared(wheels)
    along = per_wheel(wheels.robot_radius, wheels.count) / np.where(shared, 1.0 + np.abs(tan), 1.0)
    sideways = np.where(shared, np.sign(tan), 0.0) * along
    places = np.stack([along * cos - sideways * sin, along * sin + sideways * cos], axis=1)
    for wheel in range(1, wheels.count):
        while (np.linalg.norm(places[:wheel] - places[wheel], axis=1) < 1e-9).any():
            places[wheel] += 2.2 * wheels.radii[wheel] * np.array([-sin[wheel], cos[wheel]])
    return places


def wheel_lines(wheels: Wheels) -> FloatArray:
    """The two ends of each wheel seen from above, in body coordinates [m]. Shape (wheels, 2 ends, 2)."""
    direction = wheels.wrench_matrix[:2] / np.hypot(*wheels.wrench_matrix[:2])
    half = (direction * wheels.radii).T
    return wheel_places(wheels)[:, None] + np.stack([-half, half], axis=1)


def _seen(point: np.ndarray) -> tuple[float, float]:
    """Body coordinates (x forward, y left) on the page: x up, y to the left."""
    return -float(point[1]), float(point[0])


def _body(axes: Axes, places: FloatArray) -> None:
    distance = float(np.mean(np.linalg.norm(places, axis=1)))
    axes.add_patch(Circle((0.0, 0.0), distance, facecolor="#F6F6F6", edgecolor=GREY, linewidth=1.2, zorder=0))
    for place in places:
        end = _seen(place)
        axes.plot([0.0, end[0]], [0.0, end[1]], color=PALE, linewidth=1.5, zorder=0.5)


def _wheel(axes: Axes, robot: Robot, wheel: int, place: FloatArray) -> None:
    """The wheel as a box standing across its axle, its number, and the way it pushes."""
    radius = robot.wheels.radii[wheel]
    left, bottom = -radius, -0.5 * WHEEL_WIDTH * radius
    box = FancyBboxPatch(
        (left, bottom),
        2.0 * radius,
        WHEEL_WIDTH * radius,
        boxstyle=f"round,pad=0,rounding_size={0.2 * radius}",
        facecolor="#BDBDBD",
        edgecolor=INK,
        linewidth=1.2,
        zorder=2,
    )
    turn = Affine2D().rotate_deg(robot.wheels.azimuth_deg[wheel] + 180.0).translate(*_seen(place))
    box.set_transform(turn + axes.transData)
    axes.add_patch(box)
    sin, cos = sin_cos_deg(robot.wheels.azimuth_deg)
    outward = np.array([cos[wheel], sin[wheel]])
    axes.text(
        *_seen(place - 0.75 * radius * outward),
        str(wheel + 1),
        ha="center",
        va="center",
        fontsize=14,
        fontweight="bold",
        zorder=3,
    )
    push = robot.wheels.wrench_matrix[:2, wheel]
    start = place + 0.75 * radius * outward - 0.9 * radius * push
    _arrow(axes, start, start + 1.8 * radius * push, INK)


def _arrow(axes: Axes, start: np.ndarray, end: np.ndarray, colour: str) -> None:
    arrow_style = {"arrowstyle": "-|>,head_width=0.35,head_length=0.7", "color": colour, "linewidth": 2.2}
    axes.annotate(
        "", xy=_seen(end), xytext=_seen(start), arrowprops={**arrow_style, "shrinkA": 0, "shrinkB": 0}, zorder=4
    )


def _body_axes(axes: Axes, reach: float) -> None:
    length = 0.34 * reach
    for name, direction in (("x", np.array([1.0, 0.0])), ("y", np.array([0.0, 1.0]))):
        _arrow(axes, np.zeros(2), length * direction, AXIS_COLOUR[name])
    axes.text(0.0, 1.04 * length, NAMES["x"], color=AXIS_COLOUR["x"], ha="center", va="bottom")
    axes.text(-length, 0.05 * reach, NAMES["y"], color=AXIS_COLOUR["y"], ha="center", va="bottom")
    size = 0.36 * reach
    axes.add_patch(Arc((0.0, 0.0), size, size, theta1=-60.0, theta2=35.0, color=AXIS_COLOUR["yaw"], linewidth=2.2))
    tip = 0.5 * size * np.array([np.sin(np.radians(35.0)), -np.cos(np.radians(35.0))])
    _arrow(axes, tip, tip + 0.08 * size * np.array([0.8, 0.6]), AXIS_COLOUR["yaw"])
    axes.text(0.56 * size, 0.0, NAMES["yaw"], color=AXIS_COLOUR["yaw"], ha="left", va="center")


def _dimensions(axes: Axes, robot: Robot, reach: float) -> None:
    distance, radius = float(np.mean(robot.wheels.robot_radius)), float(robot.wheels.radii.mean())
    left, bottom = -0.95 * reach, -0.93 * reach
    axes.plot([left, left + distance], [bottom, bottom], color=INK, linewidth=3, solid_capstyle="butt")
    axes.text(left, bottom + 0.03 * reach, f"b = {distance:g} m", ha="left", va="bottom")
    axes.plot([left, left + radius], [bottom + 0.14 * reach] * 2, color=INK, linewidth=3, solid_capstyle="butt")
    axes.text(left, bottom + 0.17 * reach, f"r = {radius:g} m", ha="left", va="bottom")
    words = f"{robot.name}\n{robot.body.mass:g} kg, {robot.body.inertia:g} kg m²"
    if any(robot.body.centre):
        axes.plot(*_seen(np.array(robot.body.centre)), marker="P", markersize=11, color=INK, zorder=5)
        words += "\n+ centre of mass"
    note(axes, -0.95 * reach, 0.95 * reach, words, ha="left", va="top", fontsize=11)
