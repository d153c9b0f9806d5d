"""Draws the house in CONTRIBUTING.md from the imports of src/omnidyn: run it after a room came or went."""

import ast
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.house.test_import_direction import FLOORS, PACKAGE, imports  # noqa: E402

PAGE = ROOT / "CONTRIBUTING.md"
MARK = r"(<!-- the house -->\n).*?(<!-- end of the house -->)"
WIDTH = 120


def graph() -> dict[str, set[str]]:
    """Room -> the rooms that its files import from. Files at the top of the package are no rooms."""
    rooms = [floor for floor in FLOORS if (PACKAGE / floor / "__init__.py").exists()]
    found: dict[str, set[str]] = {room: set() for room in rooms}
    for importer, _, imported in imports(PACKAGE):
        one, other = importer.split("/")[0], imported.split("/")[0]
        if one in found and other in found and one != other:
            found[one].add(other)
    return found


def levels(rooms: dict[str, set[str]]) -> dict[str, int]:
    """Room -> one more than the highest of those it imports from; 0 for what imports from none."""
    found: dict[str, int] = {}
    for room, others in rooms.items():  # FLOORS has the order
        found[room] = 1 + max((found[other] for other in others), default=-1)
    return found


def nearest(room: str, rooms: dict[str, set[str]]) -> list[str]:
    """What a room imports from, without what it reaches through another of them."""
    reached = {other: _below(other, rooms) for other in rooms[room]}
    return [other for other in rooms if other in rooms[room] and not any(other in below for below in reached.values())]


def _below(room: str, rooms: dict[str, set[str]]) -> set[str]:
    return rooms[room].union(*(_below(other, rooms) for other in rooms[room]))


def about(room: str) -> str:
    """The first sentence of the map of a room, or its first part."""
    text = ast.get_docstring(ast.parse((PACKAGE / room / "__init__.py").read_text("utf-8"))) or ""
    first = re.split(r"(?<=\?)\s|\.\s", " ".join(text.split()) + " ", maxsplit=1)[0]
    first = re.sub(r"^\w+: ", "", first)
    return first[:1].upper() + first[1:]


def picture() -> str:
    """The house as text, the ground last: the level of each room, what it stands on, and what it is."""
    rooms = graph()
    level = levels(rooms)
    stands = {room: f"{room} -> {', '.join(others)}" if (others := nearest(room, rooms)) else room for room in rooms}
    width, lines = max(map(len, stands.values())), []
    for floor in range(max(level.values()), -1, -1):
        for k, room in enumerate(room for room in rooms if level[room] == floor):
            line = f"{'' if k else floor!s:>2}  {stands[room]:<{width}}  {about(room)}"
            lines.append(line if len(line) <= WIDTH else f"{line[: WIDTH - 4].rpartition(' ')[0].rstrip(',')} ...")
    return "```text\n" + "\n".join(lines) + "\n```\n"


def filled(page: str) -> str:
    """The page with the picture between its marks."""
    return re.sub(MARK, lambda mark: mark[1] + picture() + mark[2], page, flags=re.DOTALL)


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text("utf-8")), "utf-8")
