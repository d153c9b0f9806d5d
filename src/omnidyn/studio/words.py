"""Words: what the library says, as a page says it: options by the names that a page has for them, no paths."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from omnidyn.logs.column import MOTOR_SIDE
from omnidyn.model.keys import find_key, in_words
from omnidyn.sensors import SENSORS

PAGE_NAMES = {  # option of a call -> where a page has it
    "assume": "--assume",
    "column": "Columns and units (tab Log)",
    "current_unsigned": "--current-unsigned",
    "fixed": "--fixed",
    "free": "Free (tab Fit)",
    "hold_out": "hold out (tab Fit)",
    "invert": "other sign (tab Log, Columns and units)",
    "ladder": "--ladder",
    "loss": "--loss",
    "nuisances": "--nuisances",
    "resume": "“It stands in the middle again: go on”",
    "unit": "in unit (tab Log, Columns and units)",
}
AS_WRITTEN = (
    "columns",
    "key",
    "learnt",
    "numbers",
    "reading",
    "unused",
    "values",
)  # of a result: no words of the library
CELLS = ("head", "rows")  # of a table: keys stand there
AXES = ("vx", "vy", "omega")
CHANNEL_NAMES = {"twist": "speed over the ground", "wheel_speed": "wheel speeds", "wheel_angle": "wheel angles"}
LATE = (*SENSORS, "heading", "position")
_LATENCY = re.compile(rf"\blatency\.({'|'.join(LATE)})\b(?!\.\w)")  # no file that is called latency.csv
_TWIST = re.compile(r"\btwist\[([0-2])\](?!\.\w)")
_OPTION = re.compile(r"`([a-z]+(?:_[a-z]+)*)`")
_PAIR = r"(?:\"[^\"]+\"|[^\s()\"=]+=[^\s()\"]+)"  # as --column takes it, in quotes where a name has spaces
_COLUMN = re.compile(rf"`column` ({_PAIR}(?:,? (?:`column` )?{_PAIR})*)((?: and so on)?)")
_IN_PAIR = re.compile(r"(?P<is>[^=]+)=(?P<sign>-?)(?P<column>.+?)(?::(?P<unit>[^:@]*))?(?:@(?P<side>\w+))?")
_ASSUME = re.compile(r"`assume` \w+=")
_KEY = re.compile(r"(?<![\w./\\-])[a-z_]+(?:\.[A-Za-z_]\w*)+(?:\[\d+\])?(?![\w/])")
_FREED = rf"(?:friction|{_KEY.pattern})"
_FREE = re.compile(rf"`free` ({_FREED}(?: (?:`free` )?{_FREED})*)")
_TWICE = re.compile(r"(\b[\w ]+\b) \(\1\)")
_NESTED = re.compile(r"\(([^()]*) \(([^()]*)\)\)")


def in_page_names(text: str) -> str:
    """A text with each option in backticks as a page has it, else as the command line has it; numbers in words."""
    named = _FREE.sub(_chosen, _COLUMN.sub(_taken, _ASSUME.sub("the unit: ", text)))
    named = _NESTED.sub(r"(\1, \2)", _OPTION.sub(_of_page, named))
    named = _LATENCY.sub(_of_channel, _TWIST.sub(lambda match: AXES[int(match[1])], named))
    return _TWICE.sub(r"\1", _KEY.sub(lambda match: in_words(match[0]), named))


def without_folders(text: str, folder: Path, paths: Iterable[str]) -> str:
    """A text without the numbered folders of a folder, and with the name alone of each of these files."""
    text = re.sub(rf"{re.escape(str(folder))}/(?:\d+/)+", "", text)
    for path in paths:
        for name in (path, str(Path(path).absolute())):
            text = text.replace(name, Path(path).name)
    return text


def number_in_words(name: str) -> str:
    """What a page calls a number of a log, such as "latency.twist"; "" for what has a name already."""
    if match := _LATENCY.fullmatch(name):
        return _of_channel(match)
    return name.replace("_", " ") if name.isidentifier() else ""


def _taken(match: re.Match[str]) -> str:
    """What columns are, as the table of columns has it."""
    pairs = [_IN_PAIR.fullmatch(pair.strip('"')) for pair in re.findall(_PAIR, match[1])]
    said = " and ".join(_in_table(pair) for pair in pairs if pair is not None)
    return f"that {said}{match[2]}: {PAGE_NAMES['column']}"


def _in_table(pair: re.Match[str]) -> str:
    unit = f" in {pair['unit']}" if pair["unit"] else ""
    side = " at the motor" if pair["side"] == MOTOR_SIDE else ""
    return f"{pair['column']} is {pair['is']}{unit}{side}{', other sign' if pair['sign'] else ''}"


def _chosen(match: re.Match[str]) -> str:
    """Numbers to be fitted, as the choice of a page has them."""
    keys = [in_words(key) for key in _KEY.findall(match[1]) if find_key(key)]
    return f"choose {', '.join(keys or ['friction'])} under {PAGE_NAMES['free']}"


def _of_channel(match: re.Match[str]) -> str:
    return f"latency of the {CHANNEL_NAMES.get(match[1], match[1].replace('_', ' '))}"


def _of_page(match: re.Match[str]) -> str:
    name = match[1]
    return PAGE_NAMES.get(name) or (f"--{name.replace('_', '-')}" if "_" in name else name)


def each_text(value: Any, change: Callable[[str], str], in_cells: Callable[[str], str]) -> Any:
    """A plain value with each text of it changed, in prose and in cells of tables, but for what is as a file has it."""
    if isinstance(value, str):
        return change(value)
    if isinstance(value, list):
        return [each_text(item, change, in_cells) for item in value]
    if isinstance(value, dict):
        of_key = dict.fromkeys(CELLS, in_cells)
        return {
            key: item if key in AS_WRITTEN else each_text(item, of_key.get(key, change), in_cells)
            for key, item in value.items()
        }
    return value
