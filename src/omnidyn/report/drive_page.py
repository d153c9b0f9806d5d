"""A page to print before a drive: the room, each move, and where it is expected to end."""

from __future__ import annotations

import numpy as np

from omnidyn.document import sentence
from omnidyn.driving.program import DriveProgram
from omnidyn.report.figures.drive import draw_program
from omnidyn.report.html import Section, page, section, table


def render_drive(program: DriveProgram) -> str:
    """The page of a program, as HTML."""
    rows = [
        (
            str(k),
            f"{leg.first * program.dt:.1f}",
            leg.words,
            f"{leg.pose[0]:+.2f}",
            f"{leg.pose[1]:+.2f}",
            f"{np.degrees(leg.pose[2]):+.0f}",
            "\N{BALLOT BOX}",
        )
        for k, leg in enumerate(program.legs, 1)
    ]
    head = ("move", "at s", "leads, as predicted", "x m", "y m", "heading deg", "")
    stops = (
        "Begin at the ring, along the arrow: x to the right of the picture, y up. Stop where it does otherwise than this "
        "page says, or comes near the border."
    )
    sections = [
        section("room", "The room", draw_program(program)),
        Section("moves", "Moves, and where each should end", table(head, rows, "moves")),
    ]
    record = {"command": f"omnidyn drive --to page, of {program.source or 'a program'}", "inputs": []}
    from omnidyn import __version__

    return page(
        f"A drive for {program.robot.name}",
        stops,
        sections,
        {"omnidyn": __version__, **record},
        verdict=sentence(str(program.verdict)),
    )
