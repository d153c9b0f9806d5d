"""The table of docs/exports.md: what each kind of export does with what a robot may have. `python docs/export_table.py`
writes it into the page, between its marks."""

from __future__ import annotations

from pathlib import Path

from omnidyn.export.features import FEATURES, SAYS, TABLE, cell

PAGE = Path(__file__).with_name("exports.md")
BEGIN, END = "<!-- begin: docs/export_table.py -->", "<!-- end: docs/export_table.py -->"
# Kinds that do the same with every feature share a column.
GROUPS = {
    "json": ("json",),
    "c-model, fmu": ("c-model", "fmu"),
    "c-controller": ("c-controller",),
    "wpilib, road-runner, gains": ("wpilib", "road-runner", "gains"),
    "mjcf": ("mjcf",),
    "urdf": ("urdf",),
    "sdf": ("sdf",),
    "ros2-control": ("ros2-control",),
    "ros2-node": ("ros2-node",),
}


def export_table() -> str:
    """The table as markdown."""
    head = ["a robot with", *GROUPS]
    rows = [[feature.words, *(_does(kinds, name) for kinds in GROUPS.values())] for name, feature in FEATURES.items()]
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _does(kinds: tuple[str, ...], feature: str) -> str:
    (does,) = {cell(kind, feature).does for kind in kinds}
    return does if does == SAYS else f"**{does}**"


def page_with(table: str) -> str:
    """The page with this table in its place."""
    text = PAGE.read_text("utf-8")
    before, _, rest = text.partition(BEGIN)
    return f"{before}{BEGIN}\n\n{table}\n\n{END}{rest.partition(END)[2]}"


if __name__ == "__main__":
    assert set(TABLE) == {kind for kinds in GROUPS.values() for kind in kinds}
    PAGE.write_text(page_with(export_table()), "utf-8")
