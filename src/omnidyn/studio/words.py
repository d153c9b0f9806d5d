"""Words: what the library says, as a page says it: options by the names that a page has for them, no paths."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

PAGE_NAMES = {  # option of a call -> where a page has it
    "assume": "--assume",
    "column": "Columns and units (tab Log)",
    "current_unsigned": "--current-unsigned",
    "free": "Free (tab Fit)",
    "hold_out": "hold out (tab Fit)",
    "invert": "other sign (tab Log, Columns and units)",
    "mapping": "Columns and units (tab Log)",
    "unit": "in unit (tab Log, Columns and units)",
}
AS_WRITTEN = ("columns", "reading", "unused", "values")  # of a result: no words of the library
_OPTION = re.compile(r"`([a-z]+(?:_[a-z]+)*)`")


def in_page_names(text: str) -> str:
    """A text with each option in backticks as a page has it, else as the command line has it."""
    return _OPTION.sub(_of_page, text)


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
