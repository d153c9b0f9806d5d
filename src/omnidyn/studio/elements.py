"""Elements of a page that are made in several places: a verdict, a table, a row of the map of columns."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ui

from omnidyn.document import in_clauses
from omnidyn.logs.channels import components
from omnidyn.run import CHANNELS

UNUSED = "-"  # what a column is that nobody takes
MARK = {"error": "✕", "warning": "!", "note": "i"}


def verdict(severity: str, words: str, name: str = "verdict") -> None:
    """What a result says: one line, then what it rests on as a list."""
    line, clauses = in_clauses(words)
    with ui.row().classes(f"verdict {severity}").props(f"id={name} role=status"):
        ui.label(MARK[severity]).classes("mark")
        with ui.column().classes("words"):
            ui.label(line).classes("text strong")
            if clauses:
                with ui.element("ul"):
                    for clause in clauses:
                        with ui.element("li"):
                            ui.label(clause).classes("text")


def table(table: dict[str, Any], name: str) -> None:
    """A table as it is, cell by cell."""
    with ui.element("div").classes("scroll"), ui.element("table").props(f"id={name}"):
        with ui.element("thead"), ui.element("tr"):
            for words in table["head"]:
                with ui.element("th" if words else "td"):
                    ui.label(words)
        with ui.element("tbody"):
            for row in table["rows"]:
                with ui.element("tr"):
                    for head, cell in zip(table["head"], row, strict=False):
                        with ui.element("td") as field:  # narrow pages show a row as a card: each cell with its head
                            field._props |= {"data-head": head, **({} if str(cell) else {"data-empty": ""})}
                            ui.label(cell)


def document(parts: list[dict[str, Any]], name: str) -> None:
    """Text, points and tables of a result, in their order; the id of its first table."""
    names = iter((name,))
    for part in parts:
        if "rows" in part:
            table(part, next(names, part["name"]))
        for severity, words in part.get("points", ()):
            ui.label(f"{severity}: {words}" if severity else words).classes("text")
        if "text" in part:
            ui.label(part["text"]).classes("text quiet")


def _component_names() -> list[str]:
    """All that a column can be."""
    return [UNUSED, "t", *(name for channel in CHANNELS for name in components(channel, 4))]


def column_row(row: dict[str, Any]) -> None:
    """A column of the file: what it is, in which unit."""
    names = _component_names()
    names += [row["component"]] if row["component"] not in names else []

    def take(name: str) -> Callable[[Any], None]:
        return lambda event: row.__setitem__(name, event.value)

    ui.label(row["column"]).classes("code")
    ui.select(names, value=row["component"], on_change=take("component")).props(
        f"dense aria-label='{_plain(row['column'])} is'"
    )
    ui.input(value=row["unit"], on_change=take("unit")).props(f"dense aria-label='unit of {_plain(row['column'])}'")
    ui.checkbox(value=row["motor"], on_change=take("motor")).props(f"aria-label='{_plain(row['column'])} at the motor'")
    ui.checkbox(value=row["invert"], on_change=take("invert")).props(f"aria-label='{_plain(row['column'])} other sign'")


def _plain(text: str) -> str:
    """A name of a file in an attribute."""
    return "".join(c for c in text if c.isalnum() or c in " _-./")
