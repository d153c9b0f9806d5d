"""Write the table of a benchmark into `benchmarks/results/NAME.md`, with the machine and the date; pictures too."""

from __future__ import annotations

import os
import platform
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from benchmarks.table import Table

RESULTS = Path(__file__).resolve().parent / "results"
IMAGES = RESULTS.parents[1] / "docs" / "images"
VERSIONS = ("numpy", "scipy", "numba", "mujoco", "lmfit")


def publish(name: str, table: Table, results: Path = RESULTS, images: Path = IMAGES) -> None:
    """Replace the last table of benchmark `name`, and its pictures."""
    results.mkdir(exist_ok=True)
    (results / f"{name}.md").write_text(f"{table.as_text().removeprefix('#').rstrip()}\n- {where()}\n", "utf-8")
    for picture, draw in table.pictures.items():
        images.mkdir(exist_ok=True)
        (images / picture).write_bytes(draw())


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
