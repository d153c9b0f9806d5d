"""omnidyn sweep SPEC.toml -o FOLDER: many simulations, in shards that survive; and what to do with such a folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

import omnidyn
from omnidyn.cli.terminal.pictures import refuse_picture, write_picture
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import input_file, provenance
from omnidyn.cli.terminal.streams import say
from omnidyn.cli.terminal.telling import end_failed, tell
from omnidyn.errors import InputError
from omnidyn.files import check_output
from omnidyn.progress import Report

if TYPE_CHECKING:
    from omnidyn.campaigns.results import Campaign

STATUS, RESUME, MERGE, PLOT = "status", "resume", "merge", "plot"


def sweep(
    what: str = typer.Argument(
        metavar="SPEC|status|resume|merge|plot", help="A spec, .toml; or what to do with FOLDER."
    ),
    folder: str = typer.Argument("", metavar="[FOLDER]", help="Of a campaign, behind status, resume, merge or plot."),
    out: str = typer.Option(
        "", "-o", "--out", metavar="FOLDER|FILE", help="Where shards go; of plot: .png, .svg; of merge: .csv."
    ),
    workers: int | None = typer.Option(None, min=1, help="Processes; default: as many as processors."),
    scheduler: str = typer.Option("", metavar="tcp://HOST:PORT", help="A Dask cluster that runs already."),
    shard: str = typer.Option("", metavar="I/N", help="Only the I-th of N parts, as in an array of Slurm."),
    repair: bool = typer.Option(False, "--repair", help="Of resume: make shards that have changed again."),
    metric: str = typer.Option("", metavar="NAME", help="What shares, limit and picture are about."),
    limit: float | None = typer.Option(None, help="Of the metric: which share of the samples keeps it."),
    force: bool = typer.Option(False, "--force", help="Replace a picture or table that exists."),
    json: bool = typer.Option(False, "--json", help="For machines."),
) -> None:
    """Run many simulations that vary a robot, a path or a controller, or many fits, in shards: a file each, done once.

    Whatever ends it, even the power, `omnidyn sweep resume FOLDER` goes on with what is missing.
    """
    if repair and what != RESUME:
        raise typer.BadParameter("--repair goes with resume FOLDER.")
    if what not in (STATUS, RESUME, MERGE, PLOT):
        if folder or not out:
            raise typer.BadParameter("a spec needs -o FOLDER; without a spec: status, resume, merge or plot FOLDER.")
        return _end(_run(what, out, workers, scheduler, shard, False), metric, limit, json)
    if not folder:
        raise typer.BadParameter(f"{what} needs a FOLDER.")
    if what == RESUME:
        return _end(_run("", folder, workers, scheduler, shard, repair), metric, limit, json)
    campaign = omnidyn.load_campaign(folder)
    if what == MERGE:
        _merge(campaign, out, force)
    if what == PLOT:
        if not out:
            raise typer.BadParameter("plot needs -o FILE, .png or .svg.")
        refuse_picture(out, force)
        from omnidyn.report.figures.campaign import draw_campaign

        with shown_progress("drawing", hint=""):
            picture = draw_campaign(campaign, metric=metric, limit=limit)
        write_picture(picture, out, force)
    _tell(campaign, metric, limit, json)


def _end(campaign: Campaign, metric: str, limit: float | None, json: bool) -> None:
    _tell(campaign, metric, limit, json)
    if campaign.verdict.code == "fits_failed":  # at the end, with everything else done
        end_failed(campaign.verdict)


def _run(
    spec: str,
    folder: str,
    workers: int | None,
    scheduler: str,
    shard: str,
    repair: bool,
) -> Campaign:
    part = _part(shard)
    with shown_progress("reading the spec") as progress:
        progress(Report("starting"))
        campaign = omnidyn.sweep(
            spec or None,
            folder,
            workers=workers,
            scheduler=scheduler,
            shard=part,
            repair=repair,
            progress=progress,
        )
    say(f"omnidyn: shards are in {folder}; one file of them: omnidyn sweep merge {folder}")
    return campaign


def _merge(campaign: Campaign, out: str, force: bool) -> None:
    """All shards as one file, and as a table for spreadsheets where that is asked for."""
    if out and not out.lower().endswith(".csv"):
        raise typer.BadParameter("merge takes -o FILE.csv; without it merged.parquet is written into FOLDER.")
    if out:
        check_output(out, force)
    with shown_progress("merging shards", hint=""):
        say(f"omnidyn: wrote {campaign.folder.merge()}")
        if out:
            campaign.folder.write_csv(Path(out), force)
            say(f"omnidyn: wrote {out}")


def _part(text: str) -> tuple[int, int]:
    """ "2/4" as (2, 4)."""
    first, slash, second = (text or "1/1").partition("/")
    if not slash or not first.isdecimal() or not second.isdecimal():
        raise InputError("no part of the shards", got=text, expected="I/N, such as 1/4", where="shard")
    return int(first), int(second)


def _tell(campaign: Campaign, metric: str, limit: float | None, json: bool) -> None:
    manifest = str(campaign.folder.path / "manifest.json")
    tell(campaign.document(metric, limit), json, provenance([input_file("campaign", manifest)]))
    if campaign.status.failed:
        end_failed(campaign.verdict)
