"""omnidyn compare LOG...: a model against what the robot did; omnidyn drift FIT...: fits of one robot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import omnidyn
from omnidyn.cli import log_options
from omnidyn.cli.log_options import NO_FLAGS, LogFlags, reads_logs
from omnidyn.cli.terminal.pictures import refuse_picture, write_picture
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.telling import brief_document, end_failed, tell
from omnidyn.progress import Progress

if TYPE_CHECKING:
    from omnidyn.comparison.result import Comparison
    from omnidyn.comparison.threshold import Threshold
    from omnidyn.document import Document
    from omnidyn.model.robot import Robot
    from omnidyn.run import Run

MOST_ROBOTS = 2


@reads_logs("current_unsigned")
def compare(
    log: list[str] = log_options.LOGS,
    robot: list[str] = typer.Option(..., "--robot", metavar="ROBOT", help="A preset or a robot file; at most twice."),
    with_: str = log_options.WITH,
    fail_if: list[str] = typer.Option(
        [], "--fail-if", metavar="RULE", help='Exit 5 where it holds for the first robot: "vx.rmse>0.05". Repeatable.'
    ),
    picture: str = typer.Option("", "--picture", metavar="FILE", help="Measured and models, as .png or .svg."),
    show_channels: str = typer.Option("", "--show", metavar="W1,I1", help="Channels of the picture; default: three."),
    band: bool = typer.Option(False, "--band", help="How far the model may be off by the std of its robot file."),
    segments: bool = typer.Option(False, "--segments", help="Show every segment too."),
    apply: str = typer.Option("", help="Input to replay: voltage, duty, wheel_speed_command or twist_command."),
    hold: float = typer.Option(0.2, min=0.0, help="How long a missing input keeps its last value [s]."),
    flags: LogFlags = NO_FLAGS,
    current_unsigned: bool = typer.Option(False, "--current-unsigned", help="Currents are |i|: compare by size."),
    force: bool = typer.Option(False, "--force", help="Replace files that exist."),
    full: bool = typer.Option(False, "--full", help="All that the comparison says, not only the first screen."),
    json: bool = typer.Option(False, "--json", help="The comparison for machines."),
) -> None:
    """Compare a model, or two, with the logs of a robot.

    The model runs free under the logged voltages (or duties, or set speeds through the speed loop of the robot file),
    from gap to gap. First a sentence: what it follows, and what not; then how far it ends up from what was measured.
    Exit code 4 where it follows nothing that was measured; the result is still written.
    """
    if len(robot) > MOST_ROBOTS:
        raise typer.BadParameter(f"--robot may be given once or twice, not {len(robot)} times.")
    refuse_picture(picture, force)
    files = log_options.keep_inputs(log, robot, [flags.map_file], picture, flags.save_map)
    log_options.refuse_missing(files)
    from omnidyn.comparison.threshold import parse_threshold, refuse_exceeded

    rules = [parse_threshold(text) for text in fail_if]
    options, maps = flags.options(), flags.maps(force)
    with shown_progress("reading") as progress:
        robots = _robots(robot, with_)
        runs, hashes = _runs(files, robots[0], options, flags.sort, maps, progress)
        channels = _channels(robots, runs, apply, rules, show_channels if picture else "")
        comparison = _compared(robots, runs, apply, hold, current_unsigned, band, progress)
    document = comparison.document(segments) if json or full or segments else _brief(comparison)
    tell(document, json, _record(robot, files, hashes))
    if picture:
        with shown_progress("drawing"):
            _draw(comparison, picture, channels, force)
    refuse_exceeded(comparison, rules)
    if comparison.failed:
        end_failed(comparison.verdict)


def _robots(names: Sequence[str], with_: str) -> list[Robot]:
    from omnidyn.model.vary import vary_as

    robots = [vary_as(omnidyn.load_robot(name), with_) for name in names]
    stems = [Path(name).stem for name in names]
    if len({robot.name for robot in robots}) < len(set(stems)):  # before and after a fit: told apart by their files
        return [robot.replace(name=stem) for robot, stem in zip(robots, stems, strict=True)]
    return robots


def _runs(
    files: Sequence[str], robot: Robot, options: Any, sort: bool, maps: log_options.Maps, progress: Progress
) -> tuple[list[Run], list[str]]:
    """The logs as Runs, and the hashes of their files. Currents stay as recorded: they may be compared by size."""
    runs, hashes = [], []
    for path, loaded in log_options.load_logs(files, robot, options, progress):
        maps.show(path, loaded.columns)
        run = loaded.to_run(sort=sort)
        runs.append(run.replace(warnings=(*run.warnings, *loaded.columns.doubts)))
        hashes.append(loaded.sha256)
    return runs, hashes


def _channels(
    robots: Sequence[Robot], runs: Sequence[Run], apply: str, rules: Sequence[Threshold], names: str
) -> list[str]:
    """The channels of the picture; refuses, before anything is simulated, rules and channels the logs cannot serve."""
    from omnidyn.comparison.compare import what_is_compared
    from omnidyn.comparison.threshold import refuse_absent

    compared = what_is_compared(robots, runs, apply or None)
    refuse_absent(rules, compared)
    channels = [name.strip() for name in names.split(",") if name.strip()]
    refuse_absent(channels, compared, "--show")
    return channels


def _compared(
    robots: Sequence[Robot],
    runs: Sequence[Run],
    apply: str,
    hold: float,
    current_unsigned: bool,
    band: bool,
    progress: Progress,
) -> Comparison:
    return omnidyn.compare(
        robots[0],
        runs,
        *robots[1:],
        apply=apply or None,
        hold=hold,
        current_unsigned=current_unsigned,
        progress=progress,
        band=band,
    )


def _brief(comparison: Comparison) -> Document:
    """The comparison on one screen."""
    return brief_document(
        comparison.verdict,
        comparison.brief_table(),
        comparison.warnings,
        head=comparison.brief_head(),
        row_word="component",
    )


def _draw(comparison: Comparison, path: str, channels: Sequence[str], force: bool) -> None:
    from omnidyn.report.figures.overlay import draw_overlay

    remark = f", the first of {len(comparison.measured)} logs" if len(comparison.measured) > 1 else ""
    write_picture(draw_overlay(comparison, channels=channels), path, force, remark)


def _record(robots: Sequence[str], files: Sequence[str], hashes: Sequence[str]) -> dict[str, Any]:
    logs = [{"role": "log", "name": path, "sha256": digest} for path, digest in zip(files, hashes, strict=True)]
    return provenance([*map(robot_input, robots), *logs])


def drift(
    fit: list[str] = typer.Argument(..., metavar="FIT...", help="Robot files that identify wrote, oldest first."),
    picture: str = typer.Option("", "--picture", metavar="FILE", help="Every number, fit by fit, as .png or .svg."),
    force: bool = typer.Option(False, "--force", help="Replace files that exist."),
    json: bool = typer.Option(False, "--json", help="The comparison for machines."),
) -> None:
    """Which numbers changed between fits of one robot, by more than they may.

    Compares the robot files that `identify -o` wrote for several floors, loads or weeks, by the covariances that they
    hold: each number by itself, and all of them together.
    """
    refuse_picture(picture, force)
    log_options.keep_inputs([], fit, [], picture)
    comparison = omnidyn.drift(fit)
    tell(comparison.document(), json, provenance([robot_input(path) for path in fit]))
    if picture:
        from omnidyn.report.drift_picture import draw_drift

        write_picture(draw_drift(comparison), picture, force)
