"""omnidyn warm: the compiler is waited for once, and not by the first run of each command."""

from __future__ import annotations

import os
import time
from typing import Any

import typer

from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import provenance
from omnidyn.cli.terminal.streams import say, show, show_json
from omnidyn.compiled.listeners import Compiling, heard
from omnidyn.progress import Progress, Report


def warm(json: bool = typer.Option(False, "--json", help="For machines.")) -> None:
    """Compile all that first runs need, once.

    Small runs, fits and closed loops of every kind are made; what is compiled for them stays on disk. Takes about a
    minute, and a second where all is there. After an update only what has changed is compiled.
    """
    start = time.monotonic()
    with shown_progress("loading", hint="") as progress, heard() as compiling:
        from omnidyn.compiled.warmed import circumstances, recalled, remember

        made_with = circumstances()
        caches = recalled(made_with)
        if not caches:
            caches = _make(progress, compiling)
            remember(caches, made_with)
    seconds = time.monotonic() - start
    if not caches:
        say("omnidyn: warning: no folder is writable, so each process compiles for itself; name one in NUMBA_CACHE_DIR")
        result: dict[str, Any] = {"folders": [], "entries": 0, "bytes": 0}
    else:
        from omnidyn.compiled.entries import take_stock

        stock = take_stock(caches)
        result = {"folders": list(stock.folders), "entries": stock.entries, "bytes": stock.size}
    _tell({"compiled": [{"kernel": name, "seconds": s} for name, s in compiling.done], **result}, seconds, json)


def _make(progress: Progress, compiling: Compiling) -> list[Any]:
    """Every run and fit, in turn; says which of them had to wait, for what and how long. Returns their kernels."""
    from omnidyn.compiled.kernel import kept
    from omnidyn.control import first_runs as of_control
    from omnidyn.identification import first_runs as of_identification

    runs = [*of_identification.first_runs(), *of_control.first_runs()]
    for k, (name, make) in enumerate(runs):
        compiled, step = len(compiling.done), f"{k + 1} of {len(runs)}, {name}"
        progress(Report(step))
        make()
        new = compiling.done[compiled:]
        if new:
            say(f"omnidyn: {step}: {', '.join(f'{name} {seconds:.1f} s' for name, seconds in new)}")
    return kept()


def _tell(result: dict[str, Any], seconds: float, json: bool) -> None:
    if json:
        show_json({**result, "provenance": provenance([])})
        return
    count, folders = len(result["compiled"]), result["folders"]
    show(f"{count} compiled in {seconds:.0f} s" if count else f"all is there ({seconds:.1f} s)")
    if folders:
        place = folders[0] if len(folders) == 1 else f"{len(folders)} folders below {os.path.commonpath(folders)}"
        show(f"{result['entries']} entries, {result['bytes'] / 1e6:.1f} MB, in {place}")
