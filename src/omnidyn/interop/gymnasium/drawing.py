"""Drawing: a robot from above as an array of pixels, for `render_mode="rgb_array"`. No library but NumPy.

Each shape is a distance d in pixels from its middle line; it covers clip(r - d + 1/2, 0, 1) of a pixel, r its half
width.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import FloatArray
from omnidyn.model.robot import Robot

SIZE = 256  # pixels of a side
FLOOR, LINE, BODY, WHEEL, FRONT, GOAL = (
    (255, 255, 255),
    (225, 225, 225),
    (80, 120, 190),
    (40, 40, 40),
    (255, 255, 255),
    (60, 160, 80),
)
Image = NDArray[Any]  # (SIZE, SIZE, 3), uint8


class Scene:
    """A square of floor around `middle` (2,), `reach` [m] to each side, and the path on it, (points, 2), if any."""

    def __init__(self, robot: Robot, middle: FloatArray, reach: float, path: FloatArray | None = None) -> None:
        self.scale, self.middle, self.robot = SIZE / (2.0 * reach), np.asarray(middle), robot
        rows = np.arange(SIZE) + 0.5
        self._x, self._y = rows[None, :], rows[:, None]
        floor = np.full((SIZE, SIZE, 3), FLOOR, np.uint8)
        step = 10.0 ** np.floor(np.log10(reach))  # a line every so many metres
        for k in range(-20, 21):
            place = (np.round(self.middle / step) + k) * step
            x, y = self._pixels(place)
            if 0 <= x < SIZE:
                floor[:, int(x)] = LINE
            if 0 <= y < SIZE:
                floor[int(y), :] = LINE
        if path is not None:
            points = path[:: max(1, len(path) // 200)]
            for first, last in pairwise(points):
                self._line(floor, first, last, 0.75 / self.scale, GOAL)
        self._floor = floor

    def draw(self, pose: FloatArray, goal: FloatArray | None = None) -> Image:
        """The robot at a pose, a goal as a smaller one. Shapes (3,)."""
        image = self._floor.copy()
        size = float(np.mean(self.robot.wheels.robot_radius))
        if goal is not None:
            self._disc(image, goal[:2], 0.8 * size, GOAL)
            self._line(image, goal[:2], self._at(goal, 0.8 * size, 0.0), 0.08 * size, FRONT)
        self._disc(image, pose[:2], size, BODY)
        for azimuth in np.radians(self.robot.wheels.azimuth_deg):
            x, y = size * np.cos(azimuth), size * np.sin(azimuth)
            half = 0.35 * float(np.mean(self.robot.wheels.radii)) + 0.1 * size
            along = half * np.array([-np.sin(azimuth), np.cos(azimuth)])
            first, last = (self._at(pose, x + sign * along[0], y + sign * along[1]) for sign in (-1.0, 1.0))
            self._line(image, first, last, 0.1 * size, WHEEL)
        self._line(image, pose[:2], self._at(pose, 0.7 * size, 0.0), 0.08 * size, FRONT)
        return image

    def _at(self, pose: FloatArray, x: float, y: float) -> FloatArray:
        """A point of the body in the world [m]."""
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        return np.array([pose[0] + cos * x - sin * y, pose[1] + sin * x + cos * y])

    def _pixels(self, point: FloatArray) -> tuple[float, float]:
        """Where a point of the floor [m] lies: column, row; y goes up."""
        x, y = self.scale * (np.asarray(point) - self.middle)
        return SIZE / 2 + float(x), SIZE / 2 - float(y)

    def _disc(self, image: Image, centre: FloatArray, radius: float, colour: tuple[int, int, int]) -> None:
        self._line(image, centre, centre, radius, colour)

    def _line(
        self, image: Image, first: FloatArray, last: FloatArray, half: float, colour: tuple[int, int, int]
    ) -> None:
        """A line with round ends, `half` [m] wide to each side."""
        (x0, y0), (x1, y1) = self._pixels(first), self._pixels(last)
        reach = half * self.scale + 1.0
        left, right = (int(np.clip(v, 0, SIZE)) for v in (min(x0, x1) - reach, max(x0, x1) + reach + 1.0))
        top, bottom = (int(np.clip(v, 0, SIZE)) for v in (min(y0, y1) - reach, max(y0, y1) + reach + 1.0))
        x, y = self._x[:, left:right] - x0, self._y[top:bottom] - y0
        length = (x1 - x0) ** 2 + (y1 - y0) ** 2
        along = np.clip((x * (x1 - x0) + y * (y1 - y0)) / length, 0.0, 1.0) if length else 0.0
        off = np.hypot(x - along * (x1 - x0), y - along * (y1 - y0))
        cover = np.clip(reach - 0.5 - off, 0.0, 1.0)[..., None]
        part = image[top:bottom, left:right]
        part[:] = np.round(part + cover * (np.array(colour) - part)).astype(np.uint8)
