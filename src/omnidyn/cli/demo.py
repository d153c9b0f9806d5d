"""omnidyn demo: the paper, end to end."""

from __future__ import annotations

import contextlib
import json
import os
import shlex
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import omnidyn
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.streams import say, to_json, width
from omnidyn.cli.terminal.telling import as_json, tell
from omnidyn.errors import InputError
from omnidyn.files import write_atomic
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


# The folder of the demo: ours to replace if a marker says that we made it, else somebody's property

MARKER = ".omnidyn-demo"


def check_folder(path: str, force: bool = False) -> Path:
    """Refuse, before any work is done, a folder that is not ours to write in. Raises InputError."""
    try:
        if "\0" in path:
            raise ValueError("a null character in the name")
        return _checked(Path(path), force)
    except (OSError, ValueError) as error:
        raise InputError("cannot use this folder", got=str(error), where=path[:80]) from None


def _checked(folder: Path, force: bool) -> Path:
    if folder.exists() and not folder.is_dir():
        raise InputError("cannot write the demo there", got="a file", expected="a folder", where=str(folder))
    if folder.is_dir():
        if any(folder.iterdir()) and not (folder / MARKER).is_file() and not force:
            raise InputError(
                "the folder has other things in it",
                expected="a new folder, or one that the demo made",
                remedy="use --out with another name, or --force to write into it",
                where=str(folder),
            )
        target = folder
    else:
        target = folder.absolute().parent
    if not target.is_dir():
        raise InputError(
            "the folder does not exist",
            got=str(target),
            remedy=f"mkdir -p {shlex.quote(str(target))}",
            where=str(folder),
        )
    if not os.access(target, os.W_OK | os.X_OK):
        raise InputError("the folder is not writable", got=str(target), where=str(folder))
    return folder


def write_folder(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write all files, each whole or not at all; what an earlier demo wrote and this one does not is removed.

    `files`: path below the folder -> content. What anybody else put there stays.
    """
    try:
        folder.mkdir(exist_ok=True)
        for name in files:
            (folder / name).parent.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError("cannot make the folder", got=error.strerror or str(error), where=str(folder)) from None
    earlier = _made_before(folder)
    # First the marker: a demo that is killed from here on leaves a folder that the next one may complete.
    write_atomic(folder / MARKER, json.dumps(sorted({*files, *earlier}), indent=1) + "\n", force=True)
    for name, content in files.items():
        write_atomic(folder / name, content, force=True)
    for name in earlier - set(files):
        with contextlib.suppress(OSError):
            (folder / name).unlink()
    write_atomic(folder / MARKER, json.dumps(sorted(files), indent=1) + "\n", force=True)


def _made_before(folder: Path) -> set[str]:
    """Names in the marker of an earlier demo; a damaged marker names nothing, and no name leads out of the folder."""
    try:
        names = json.loads((folder / MARKER).read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return set()
    names = names if isinstance(names, list) else []
    parts = {name: Path(name).parts for name in names if isinstance(name, str) and not Path(name).is_absolute()}
    return {name for name, file_name in parts.items() if file_name and ".." not in file_name}
