"""Write tables of benchmarks into the pages of docs/, between marks, with the machine and the date; pictures too."""

from __future__ import annotations

import os
import platform
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from benchmarks.table import Table

DOCS = Path(__file__).resolve().parents[1] / "docs"
FIGURES = "identify-figures.md"  # takes every `identify_...`, also one that it does not show yet
PAGES = {  # and so do these take theirs
    **dict.fromkeys(("groups", "real_fit"), FIGURES),
    **dict.fromkeys(("first_minutes", "ten_robots", "outputs", "coloured", "forces", "wrong_worlds", "ladder",
                     "blind", "group_shapes", "laws_identified", "laws_ladder"), "trust-figures.md"),
}  # fmt: skip
VERSIONS = ("numpy", "scipy", "numba", "mujoco", "lmfit")


def begin(name: str) -> str:
    """The mark before the table of benchmark `name`."""
    return f"<!-- begin: benchmarks.{name} -->"


def end(name: str) -> str:
    """The mark behind it."""
    return f"<!-- end: benchmarks.{name} -->"


def page_of(name: str, docs: Path = DOCS) -> Path | None:
    """The page that shows a benchmark; None where none does."""
    for page in sorted(docs.glob("*.md")):
        if begin(name) in page.read_text("utf-8"):
            return page
    own = FIGURES if name.startswith("identify_") else PAGES.get(name)
    return None if own is None else docs / own


def publish(name: str, table: Table, docs: Path = DOCS) -> None:
    """Put the table in its place, or behind all else of the page, and its pictures into docs/images.

    Raises LookupError where no page is for it.
    """
    page = page_of(name, docs)
    if page is None:
        raise LookupError(f"no page of {docs} has {begin(name)}")
    title, _, body = table.as_text().partition("\n\n")
    text = page.read_text("utf-8")
    if begin(name) not in text:
        text = f"{text.rstrip()}\n\n{title}\n\n{begin(name)}{end(name)}\n"
    before, _, rest = text.partition(begin(name))
    after = rest.partition(end(name))[2]
    page.write_text(f"{before}{begin(name)}\n\n{body.rstrip()}\n- {where()}\n\n{end(name)}{after}", "utf-8")
    for picture, draw in table.pictures.items():
        (docs / "images").mkdir(exist_ok=True)
        (docs / "images" / picture).write_bytes(draw())


def where() -> str:
    """Date, processor and versions of a measurement."""
    found = [f"{name} {version}" for name in VERSIONS if (version := _version(name))]
    return f"{datetime.now(UTC).date().isoformat()}; {_processor()}, {os.cpu_count()} cores; {', '.join(found)}"


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""


def _processor() -> str:
    """Its name, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.machine()
