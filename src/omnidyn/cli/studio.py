"""omnidyn studio [FILES]: logs, fits and a robot to drive, in the browser."""

from __future__ import annotations

import os
import runpy
import sys
from typing import Annotated

import typer

PORT = 8642
MODULE = "omnidyn.studio"  # a skin of its own, which this one does not import


def studio(
    files: Annotated[
        list[str] | None, typer.Argument(metavar="[FILE]...", help="Logs and robot files to begin with.")
    ] = None,
    host: str = typer.Option(
        "", metavar="ADDRESS", help="Serve other machines too, from this address; a page then needs the token printed."
    ),
    port: int = typer.Option(PORT, min=0, max=65535, help="Where the page is; the next free one where it is taken."),
    no_browser: bool = typer.Option(False, "--no-browser", help="Print the address, and open no browser."),
) -> None:
    """Open a page on this machine: look at logs, fit a robot, drive it.

    Only this machine can open it. Files stay here; what was dropped is removed at the end. Ctrl-C ends it.
    """
    sys.argv = [MODULE, *(os.fspath(file) for file in files or ()), f"--host={host}", f"--port={port}"]
    sys.argv += ["--no-browser"] if no_browser else []
    runpy.run_module(MODULE, run_name="__main__", alter_sys=False)
