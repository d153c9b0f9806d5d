"""omnidyn demo: the paper, end to end."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import typer

import omnidyn
from omnidyn.cli.demo_folder import check_folder, write_folder
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.streams import say, to_json, width
from omnidyn.cli.terminal.telling import as_json, tell
from omnidyn.progress import Progress, Report

if TYPE_CHECKING:
    from omnidyn.document import Document
    from omnidyn.paper.claim import Claim
    from omnidyn.report.style import Picture


TITLE = "A three-wheeled omnidirectional robot with friction: the paper, recomputed"
INTRODUCTION = (
    "M. Dourado Correia and A. G. S. Conceição, Modeling of a Three Wheeled Omnidirectional Robot Including "
    "Friction Models (2012). Every equation, table and figure is a claim; beside it stands what omnidyn "
    "computes, and the verdict. Lines in the figures are simulated exactly, dots are numbers that the paper "
    "prints."
)


def demo(
    out: str = typer.Option("omnidyn-demo", metavar="FOLDER", help="Folder for report, numbers and figures."),
    force: bool = typer.Option(False, "--force", help="Write into a folder that the demo did not make."),
    json: bool = typer.Option(False, "--json", help="The result for machines, instead of the table."),
) -> None:
    """Recompute the paper, end to end.

    Prints every claim with its verdict; writes report.html, result.json and the figures.
    """
    folder = check_folder(out, force)
    with shown_progress("loading") as progress:
        claims, pictures, record = _made(progress)
        document = _document(claims, pictures)
        progress(Report("writing the report"))
        write_folder(folder, _files(claims, pictures, document, record))
    tell(document, json, record, width=width())
    say(f"omnidyn: open {folder / 'report.html'}")


def _made(progress: Progress) -> tuple[tuple[Claim, ...], list[Picture], dict[str, Any]]:
    """Claims, pictures and the record of what they were made from."""
    from omnidyn.paper.claims import PRESET, all_claims
    from omnidyn.report.figures.paper_pictures import paper_pictures

    progress(Report("computing the claims (the first run compiles the simulation)"))
    claims = all_claims()
    pictures = []
    for picture in paper_pictures(omnidyn.load_robot(PRESET)):
        pictures.append(picture)
        progress(Report(f"drawing, {len(pictures)} figures done"))
    return claims, pictures, provenance([robot_input(PRESET)])


def _document(claims: tuple[Claim, ...], pictures: list[Picture]) -> Document:
    """What the claims say; for machines the figures too."""
    from omnidyn.paper.claims import claims_document

    document = claims_document(claims)
    figures = [{"name": picture.name, "title": picture.title, "caption": picture.caption} for picture in pictures]
    return replace(document, data={**document.data, "figures": figures})


def _files(
    claims: tuple[Claim, ...], pictures: list[Picture], document: Document, record: dict[str, Any]
) -> dict[str, bytes]:
    from omnidyn.report.page import render_page

    files = {
        "report.html": render_page(TITLE, INTRODUCTION, claims, pictures, record).encode(),
        "result.json": (to_json(as_json(document, record)) + "\n").encode(),
    }
    for picture in pictures:
        files |= {f"figures/{picture.name}.png": picture.png, f"figures/{picture.name}.svg": picture.svg}
    return files
