"""page: one page to print, with the room, the moves, and where each is expected to end."""

from __future__ import annotations

from omnidyn.driving.program import DriveProgram
from omnidyn.export.contract import Export
from omnidyn.report.drive_page import render_drive

NOTES = ("print it on one side, and tick each move",)


def page(program: DriveProgram) -> Export:
    """program.html: needs no other file, and prints on one side."""
    return Export("page", program.robot.name, {"program.html": render_drive(program)}, (), NOTES)
