"""Words: what the library says, as a page says it: options by the names that a page has for them, no paths."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from omnidyn.sensors import SENSORS

PAGE_NAMES = {  # option of a call -> where a page has it
    "assume": "--assume",
    "column": "Columns and units (tab Log)",
    "current_unsigned": "--current-unsigned",
    "free": "Free (tab Fit)",
    "hold_out": "hold out (tab Fit)",
    "invert": "other sign (tab Log, Columns and units)",
    "unit": "in unit (tab Log, Columns and units)",
}
AS_WRITTEN = ("columns", "numbers", "reading", "unused", "values")  # of a result: no words of the library
AXES = ("vx", "vy", "omega")
CHANNEL_NAMES = {"twist": "speed over the ground", "wheel_speed": "wheel speeds", "wheel_angle": "wheel angles"}
LATE = (*SENSORS, "heading", "position")
_LATENCY = re.compile(rf"\blatency\.({'|'.join(LATE)})\b(?!\.\w)")  # no file that is called latency.csv
_TWIST = re.compile(r"\btwist\[([0-2])\](?!\.\w)")
_OPTION = re.compile(r"`([a-z]+(?:_[a-z]+)*)`")
_NESTED = re.compile(r"\(([^()]*) \(([^()]*)\)\)")


def in_page_names(text: str) -> str:
    """A text with each option in backticks as a page has it, else as the command line has it."""
    named = _NESTED.sub(r"(\1, \2)", _OPTION.sub(_of_page, text))
    return _LATENCY.sub(_of_channel, _TWIST.sub(lambda match: AXES[int(match[1])], named))


def number_in_words(name: str) -> str:
    """What a page calls a number of a log, such as "latency.twist"; "" for what has a name already."""
    if match := _LATENCY.fullmatch(name):
        return _of_channel(match)
    return name.replace("_", " ") if name.isidentifier() else ""


def _of_channel(match: re.Match[str]) -> str:
    return f"latency of the {CHANNEL_NAMES.get(match[1], match[1].replace('_', ' '))}"


def _of_page(match: re.Match[str]) -> str:
    name = match[1]
    return PAGE_NAMES.get(name) or (f"--{name.replace('_', '-')}" if "_" in name else name)


def each_text(value: Any, change: Callable[[str], str]) -> Any:
    """A plain value with each text of it changed, but for what stands as a file has it."""
    if isinstance(value, str):
        return change(value)
    if isinstance(value, list):
        return [each_text(item, change) for item in value]
    if isinstance(value, dict):
        return {key: item if key in AS_WRITTEN else each_text(item, change) for key, item in value.items()}
    return value
