"""path: a path by name, from a file or from a Run; with options, in Python or in the text of a command line."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from omnidyn.arguments import unknown_option
from omnidyn.arrays import FloatArray
from omnidyn.control.paths.adapter import DURATION, FunctionPath, as_path
from omnidyn.control.paths.curve import Curve, circle, eight, square, swinging, zigzag
from omnidyn.control.paths.goal import Goal
from omnidyn.control.paths.motion import Path
from omnidyn.control.paths.polyline import COLUMNS, Polyline, lines, path_of_file, path_of_run
from omnidyn.errors import InputError, did_you_mean
from omnidyn.run import Run

HEADINGS = ("held", "turning", "along")
LARGEST_OPTION = 1e6  # of any option: more is a unit that was mistaken
TURNING = {"heading": "held", "heading_rad": 0.0, "turn_rad_s": 0.0, "rounds": 2.0}
# Name -> its options and what they are by default; a None follows from the others.
OPTIONS: dict[str, dict[str, Any]] = {
    "eight": {"size_m": 0.6, "period_s": 6.0, **TURNING},
    "circle": {"radius_m": 0.5, "speed_m_s": 0.5, "period_s": None, **TURNING},
    "square": {"side_m": 0.8, "speed_m_s": 0.5, "period_s": None, **TURNING},
    "zigzag": {
        "speed_m_s": 0.15,
        "sideways_m_s": None,
        "turn_rad_s": 1.0,
        "period_s": 4.0,
        "lag_s": 0.3,
        "heading_rad": 0.0,
        "rounds": 3.0,
    },
    "goal": {
        "x_m": 1.0,
        "y_m": 0.0,
        "heading_rad": 0.0,
        "from_x_m": 0.0,
        "from_y_m": 0.0,
        "from_heading_rad": 0.0,
        "travel_s": 2.0,
        "hold_s": 2.0,
    },
}
POSITIVE = ("size_m", "period_s", "radius_m", "side_m", "speed_m_s", "rounds")


def path(what: Any, **options: Any) -> Path:
    """A path to follow.

    what: "eight", "circle", "square", "zigzag" or "goal"; the same with options in the text, as in
    "eight:period_s=3.2,heading=along"; a CSV file with t_s, x_m, y_m, heading_rad, its rows joined by straight lines;
    an array of such rows, shape (rows, 4); a Run, whose poses are the path; a function of the time [s] that gives
    (x, y, heading) [m, m, rad], smooth, its heading not wrapped; or an object with `at(t)`, which gives (pose,
    velocity, acceleration) in the world frame, shapes (*t.shape, 3), and `end` [s], from when on it stands still.
    options: of eight size_m, period_s; of circle radius_m, speed_m_s or period_s; of square side_m, speed_m_s or
    period_s; of zigzag speed_m_s, sideways_m_s, turn_rad_s, period_s, lag_s; of goal x_m, y_m, heading_rad, travel_s,
    hold_s and from_x_m, from_y_m, from_heading_rad. Of the first three also heading ("held", "turning", "along"),
    heading_rad at the start, turn_rad_s, and rounds to follow it for. Of a function duration_s, when it ends; without
    it the function goes on, and is followed for 10 s.
    Returns a Path: `at(t)` is where to be, how fast and how that changes, in the world frame.
    Raises InputError for an unknown name or option, or a value out of range.
    """
    if isinstance(what, Run):
        _refuse_options(options, "a run")
        return path_of_run(what)
    if not isinstance(what, str | os.PathLike):
        return _path_of_value(what, options)
    text = os.fspath(what)
    name, _, rest = text.partition(":")
    if name in OPTIONS:
        return _named(name, {**_parsed(rest, text), **options})
    if FilePath(text).suffix or os.path.exists(text):
        _refuse_options(options, "a file")
        return path_of_file(text)
    raise InputError(
        "unknown path",
        got=text,
        expected=f"{', '.join(OPTIONS)}, or a file of t_s, x_m, y_m, heading_rad",
        remedy=did_you_mean(name, OPTIONS),
        where="path",
    )


def is_several(what: Any) -> bool:
    """Whether a list holds paths, and not the rows of one."""
    rows = (list, tuple, int, float)
    return isinstance(what, list | tuple) and not any(isinstance(item, rows) or np.ndim(item) == 1 for item in what)


def _path_of_value(what: Any, options: Mapping[str, Any]) -> Path:
    """A path from an object that has `at`, a function, or an array of rows."""
    if hasattr(what, "at"):
        _refuse_options(options, "an object that is a path")
        return as_path(what)
    if callable(what):
        for option in options:
            if option != "duration_s":
                raise unknown_option("a function", option, ["duration_s"], "path")
        name = f"function {getattr(what, '__name__', type(what).__name__)}"
        end = _value("of a function", "period_s", options["duration_s"]) if "duration_s" in options else math.inf
        function: Any = what
        found = FunctionPath(name, function, DURATION if end == math.inf else end, end)
        found.at(0.0)  # what is no pose is said here
        return found
    _refuse_options(options, "an array")
    try:
        rows = np.asarray(what, dtype=float)
    except (TypeError, ValueError):
        rows: FloatArray = np.empty((0, 0))
    if rows.ndim != 2 or rows.shape[1] != len(COLUMNS):
        raise InputError(
            "not a path",
            got=f"{type(what).__name__}{f' of shape {rows.shape}' if rows.size else ''}",
            expected=f"a name, a file, a Run, a function, an object with at(t), or rows of {', '.join(COLUMNS)}",
            where="path",
        )
    return lines(rows[:, 0], rows[:, 1:], f"array of {len(rows)} rows")


def _refuse_options(options: Mapping[str, Any], what: str) -> None:
    if options:
        raise InputError(f"{what} is followed as it is", got=", ".join(options), expected="no options", where="path")


def _parsed(text: str, source: str) -> dict[str, str]:
    """Options in the text of a command line: "period_s=3.2,heading=along"."""
    options = {}
    for part in filter(None, text.split(",")):
        name, sign, value = part.partition("=")
        if not sign:
            raise InputError("not an option of a path", got=part, expected="name=value", where=source)
        options[name.strip()] = value.strip()
    return options


def _named(name: str, options: Mapping[str, Any]) -> Path:
    """A named path with its options checked."""
    defaults = OPTIONS[name]
    for option in options:
        if option not in defaults:
            raise unknown_option(name, option, defaults, f"path {name}")
    values = {option: _value(name, option, options.get(option, default)) for option, default in defaults.items()}
    words = ",".join(f"{option}={options[option]}" for option in options)
    return _MAKERS[name](f"{name}:{words}" if words else name, values, options)


def _value(name: str, option: str, value: Any) -> Any:
    """A value as a number within reach, or the word it must be."""
    place = f"path {name}, {option}"
    if option == "heading":
        if value not in HEADINGS:
            raise InputError("unknown heading", got=value, expected=" or ".join(HEADINGS), where=place)
        return value
    if value is None:
        return None
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError("not a number", got=value, expected="a number", where=place) from None
    if not -LARGEST_OPTION <= number <= LARGEST_OPTION:
        raise InputError(
            "out of range", got=number, expected=f"-{LARGEST_OPTION:g} to {LARGEST_OPTION:g}, in SI units", where=place
        )
    low = (
        1e-6
        if option in POSITIVE
        else 0.0
        if option.endswith("_s") and not option.startswith("turn")
        else -LARGEST_OPTION
    )
    if "_m_s" in option and option not in POSITIVE:
        low = -LARGEST_OPTION
    if number < low:
        raise InputError("out of range", got=number, expected=f"at least {low:g}", where=place)
    return number


def _turning(name: str, values: Mapping[str, Any], options: Mapping[str, Any]) -> dict[str, Any]:
    """What the heading of a curve does."""
    mode = values["heading"] if "heading" in options else ("turning" if values["turn_rad_s"] else "held")
    if mode == "held" and values["turn_rad_s"]:
        raise InputError(
            "a heading that is held does not turn",
            got=f"turn_rad_s={values['turn_rad_s']:g}",
            expected="heading=turning",
            where=name,
        )
    if mode == "along" and name == "square":
        raise InputError(
            "a heading along a square turns at once at its corners",
            got="heading=along",
            expected="held or turning",
            remedy="take an eight or a circle",
            where=name,
        )
    turn = values["turn_rad_s"] if "turn_rad_s" in options or mode != "turning" else 1.0
    return {"heading": values["heading_rad"], "turn": turn if mode == "turning" else 0.0, "along": mode == "along"}


def _curve(make: Callable[[Mapping[str, Any], float], Any], around: Callable[[Mapping[str, Any]], float]) -> Any:
    """A maker of a curve; `around`: its length [m], that a speed goes round in a period."""

    def made(name: str, values: Mapping[str, Any], options: Mapping[str, Any]) -> Path:
        period = values["period_s"]
        if period is None:
            period = around(values) / values["speed_m_s"]
        elif "speed_m_s" in options and "period_s" in options:
            raise InputError("speed and period say the same", got="both", expected="speed_m_s or period_s", where=name)
        kind = name.partition(":")[0]
        return Curve(name, make(values, period), period, period * values["rounds"], **_turning(kind, values, options))

    return made


def _zigzag(name: str, values: Mapping[str, Any], options: Mapping[str, Any]) -> Path:
    half, lag, speed = 0.5 * values["period_s"], values["lag_s"], values["speed_m_s"]
    sideways = 0.7 * speed if values["sideways_m_s"] is None else values["sideways_m_s"]
    swing = swinging(values["turn_rad_s"], half, 2.0 * lag)
    plane, period = zigzag(speed, sideways, half, lag), values["period_s"]
    return Curve(name, plane, period, period * values["rounds"], heading=values["heading_rad"], swing=swing)


def _goal(name: str, values: Mapping[str, Any], options: Mapping[str, Any]) -> Path:
    start: FloatArray = np.array([values["from_x_m"], values["from_y_m"], values["from_heading_rad"]])
    goal: FloatArray = np.array([values["x_m"], values["y_m"], values["heading_rad"]])
    duration = values["travel_s"] + values["hold_s"]
    if duration <= 0.0:
        raise InputError("a goal takes some time", got="0 s", expected="travel_s or hold_s above 0", where=name)
    return Goal(name, start, goal, values["travel_s"], duration)


_MAKERS: dict[str, Callable[[str, Mapping[str, Any], Mapping[str, Any]], Path]] = {
    "eight": _curve(lambda options, period: eight(options["size_m"], period), lambda options: math.nan),
    "circle": _curve(
        lambda options, period: circle(options["radius_m"], period), lambda options: 2.0 * math.pi * options["radius_m"]
    ),
    "square": _curve(
        lambda options, period: square(options["side_m"], 4.0 * options["side_m"] / period),
        lambda options: 4.0 * options["side_m"],
    ),
    "zigzag": _zigzag,
    "goal": _goal,
}

__all__ = ["Path", "Polyline", "path"]
