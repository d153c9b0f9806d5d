"""Lines of motors as text for people and as dictionaries for machines."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from omnidyn.identification.motors.drive_line import DriveLine, DriveStudy
from omnidyn.identification.steady.study_table import bullet, table_text

DRIVE_HEAD = ("motor", "windows", "slope rad/s per unit", "+-", "dead band", "+-", "95 % interval", "inertia", "unit")


def drive_rows(study: DriveStudy) -> list[list[str]]:
    """The lines of the motors, a row each."""
    return [_drive_row(line) for line in study.lines]


def _drive_row(line: DriveLine) -> list[str]:
    low, high = line.ci95["dead_band"]
    return [
        line.motor, f"{line.windows}", f"{line.gain:.4g}", f"{line.gain_std:.2g}", f"{line.value['dead_band']:.3g}",
        f"{line.std['dead_band']:.2g}", f"[{low:.3g}, {high:.3g}]", f"{line.value['inertia']:.2g}", line.unit,
    ]  # fmt: skip


def drive_summary(study: DriveStudy) -> str:
    """The lines of the motors as plain text."""
    windows = study.windows
    lines = [
        f"motors: {windows.kind} [{windows.unit}] against speed from {windows.speed_from}, "
        + ("steady windows" if windows.settled else f"windows of {windows.length:g} s in integral form"),
        "",
        *table_text(DRIVE_HEAD, drive_rows(study)),
        "",
    ]
    for words in study.statements:
        lines += bullet("-", words)
    for words in study.warnings:
        lines += bullet("warning:", words)
    return "\n".join(lines) + "\n"


def drive_to_dict(study: DriveStudy) -> dict[str, Any]:
    """The lines of the motors as JSON can hold them."""
    return {
        "input": study.windows.kind,
        "unit": study.windows.unit,
        "speed_from": study.windows.speed_from,
        "window_s": study.windows.length,
        "motors": [{**asdict(line), "dead_band_seen": line.dead_band_seen} for line in study.lines],
        "statements": list(study.statements),
        "warnings": list(study.warnings),
    }
