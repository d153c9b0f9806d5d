"""A page to print before a drive: the room, each move, and where it is expected to end."""

from __future__ import annotations

import sys

from omnidyn.document import sentence
from omnidyn.driving.program import DriveProgram
from omnidyn.report.figures.drive import draw_program
from omnidyn.report.html import Section, page, section, table


def render_drive(program: DriveProgram) -> str:
    """The page of a program, as HTML."""
    rows, returns = [], (*program.returns, False)
    for k, leg in enumerate(program.legs):
        if returns[k]:
            continue
        number, words = (f"{k + 1}, {k + 2}", f"{leg.words}, and back") if returns[k + 1] else (f"{k + 1}", leg.words)
        rows.append((number, f"{leg.first * program.dt:.1f}", words, *leg.cells, "\N{BALLOT BOX}"))
    head = ("move", "at s", "leads, as predicted", "ends at x m", "y m", "heading deg", "seen")
    stops = (
        "Begin at the ring, along the arrow: x to the right of the picture, y up. Where a move leads back, its end is "
        "that of the way there. Stop where it does otherwise than this page says, or comes near the border."
    )
    sections = [
        section("room", "The room", draw_program(program)),
        Section("moves", "Moves, and where each should end", table(head, rows, "moves")),
    ]
    version = sys.modules["omnidyn"].__version__
    record = {"omnidyn": version, "command": f"omnidyn drive {program.source}.csv --to page", "inputs": []}
    return page(
        f"A drive for {program.robot.name}",
        stops,
        sections,
        record,
        verdict=sentence(str(program.verdict)),
    )
