"""omnidyn identify LOG...: a robot from whole logs, or from steady stretches, or from a table of steady points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from omnidyn.cli import log_options as options
from omnidyn.cli.progress import progress
from omnidyn.cli.streams import say, show, show_json

if TYPE_CHECKING:
    from omnidyn.cli.identify_fit import Ask, Out
    from omnidyn.cli.identify_logs import Loaded
    from omnidyn.identification.drive_line import DriveStudy
    from omnidyn.identification.estimate import Estimate
    from omnidyn.identification.steady_study import SteadyStudy
    from omnidyn.model.robot import Robot

OUTPUT_ERROR, STEADY_STATE = "output-error", "steady-state"
FRICTION, MOTORS, LINE = "friction", "motors", "line"


def identify(
    logs: list[str] = typer.Argument(
        metavar="LOG...", help="Logs (CSV, Parquet) or folders of them; or one table axis,speed,force."
    ),
    robot: str = typer.Option("", metavar="ROBOT", help="The robot to start from: a preset or a robot file."),
    method: str = typer.Option("", help="output-error (whole logs; the default) or steady-state (the paper's)."),
    free: list[str] = typer.Option([], metavar="KEY", help="Fit this; friction is all six. Repeatable."),
    fix: list[str] = typer.Option([], metavar="KEY", help="Leave this as the robot file has it. Repeatable."),
    nuisance: list[str] = typer.Option(
        [],
        metavar="NAME",
        help="Fit what the log does: latency, gain, dead_band, fade, none; default: auto. Repeatable.",
    ),
    loss: str = typer.Option("", help="gaussian, or student-t for logs with outliers."),
    use_priors: bool = typer.Option(False, "--use-priors", help="A std in the robot file counts as a prior."),
    hold_out: list[str] = typer.Option([], metavar="GLOB", help="Do not fit these logs: predict them. Repeatable."),
    per: list[str] = typer.Option([], metavar="NAME=GLOB", help="A group with friction of its own. Repeatable."),
    per_free: list[str] = typer.Option([], metavar="KEY", help="What each group has for itself instead. Repeatable."),
    profile: list[str] = typer.Option([], metavar="KEY", help="Interval by profile of the likelihood. Repeatable."),
    bootstrap: int = typer.Option(0, min=0, metavar="N", help="Intervals from N draws of whole runs instead."),
    start: str = typer.Option("", help="How logs begin: rest, free, or auto: at rest where that shows."),
    between: str = typer.Option("", help="Of the motors: input holds, or mean of two rows; default: auto."),
    what: str = typer.Option(FRICTION, help="friction, or motors: the line of each motor, wheels off the ground."),
    shape: str = typer.Option(
        "auto", help="box, disc, ellipse, wheel, wheels, disc+wheel, ...; auto: the best; line: per axis, the paper."
    ),
    speed: str = typer.Option("wheel", help="Which speed friction is a function of: wheel, set or ground."),
    force_from: str = typer.Option("", help="current or voltage; default: current where all logs have it."),
    input_: str = typer.Option("", "--input", help="Of the motors: voltage, duty or current; default: the first."),
    window: str = typer.Option("", metavar="A,B", help="Use these shares of each command's rows, such as 0.4,0.95."),
    group: list[str] = typer.Option([], metavar="NAME=GLOB", help="Logs of one floor or load. Repeatable."),
    rest: str = typer.Option("bound", help="Of a table: what a row at rest says: bound, line (the paper) or ignore."),
    report: str = typer.Option("", metavar="FILE.html", help="A page with pictures, numbers and what they say."),
    out: str = typer.Option("", "-o", "--out", metavar="OUT", help="Robot file to write (TOML), one per group."),
    force: bool = typer.Option(False, "--force", help="Replace files that exist."),
    json: bool = typer.Option(False, "--json", help="The result for machines."),
    map_file: str = options.MAP,
    column: list[str] = options.COLUMN,
    assume: list[str] = options.ASSUME,
    latency: list[str] = options.LATENCY,
    save_map: str = options.SAVE_MAP,
    sort: bool = options.SORT,
    no_header: bool = options.NO_HEADER,
    skip_bad_rows: bool = options.SKIP_BAD_ROWS,
    current_unsigned: bool = options.CURRENT_UNSIGNED,
) -> None:
    """Identify a robot from its logs: friction, and what --free names.

    By default the model runs freely under the logged voltages or duties, and the numbers are those that come nearest
    to all that was measured (output error). Where robot or logs do not allow that: friction from stretches of constant
    speed, or from a table of steady points. The answer carries standard errors, 95 % intervals and warnings in words,
    and says what the data cannot tell.
    """
    from omnidyn.cli.identify_fit import Ask, Out
    from omnidyn.cli.identify_logs import is_steady_table

    ask = Ask(free, fix, nuisance, loss, use_priors, hold_out, per, per_free, profile, bootstrap, between, start)
    steady = _given(shape=shape != "auto", window=window, group=group, rest=rest != "bound", force_from=force_from,
                    speed=speed != "wheel" and what == FRICTION)  # fmt: skip
    method = _method(method, what, ask, steady)
    if not robot and what == FRICTION:
        raise typer.BadParameter("Missing option '--robot'.")
    _refuse_places(out, report, force)
    if what == FRICTION and len(logs) == 1 and is_steady_table(logs[0]):
        _refuse_table(method)
        _from_table(logs[0], robot, rest, out, report, force, json)
        return
    maps = options.Maps(save_map, force)
    how = options.log_options(map_file, column, assume, latency, no_header, skip_bad_rows, current_unsigned)
    places = Out(report, out, force, json)
    with progress("reading") as now:
        loaded_robot = _robot(robot)
        loaded = _loaded(logs, ask, group, loaded_robot, how, sort, maps, now, keep=what == FRICTION)
        now("identifying")
        record = _record(robot, loaded)
        if what == MOTORS:
            _run_motors(method, loaded, loaded_robot, input_, speed, window, ask, record, places, now)
            return
        assert loaded_robot is not None
        if (method or _default(loaded, loaded_robot, ask)) == OUTPUT_ERROR:
            from omnidyn.cli.identify_fit import fit_logs

            if loaded.groups and not per:
                say("omnidyn: all folders are fitted together; --per NAME=GLOB makes groups of them")
                loaded = loaded._replace(groups=None)
            fit_logs(loaded, loaded_robot, ask, record, places, now)
            return
        loaded.logs.clear()
        if shape == LINE:
            _tell_lines(_lines(loaded, loaded_robot, speed, force_from, window), record, report, out, force, json)
            return
        study = _study(loaded, loaded_robot, shape, speed, force_from, window)
        now("writing")
        _tell_study(study, record, report, out, force, json)


def _given(**options: Any) -> list[str]:
    """Options of steady-state that were given, by their names."""
    return [f"--{name.replace('_', '-')}" for name, value in options.items() if value]


def _method(method: str, what: str, ask: Ask, steady: list[str]) -> str:
    """The method asked for, by its name or by its options; "" where neither is there. Refuses options of another."""
    from omnidyn.errors import InputError

    if method not in ("", OUTPUT_ERROR, STEADY_STATE):
        raise InputError("no such method", got=method, expected=f"{OUTPUT_ERROR} or {STEADY_STATE}", where="--method")
    if what not in (FRICTION, MOTORS):
        raise InputError("nothing of that name", got=what, expected=f"{FRICTION} or {MOTORS}", where="--what")
    own = ask.given()
    if what == MOTORS:
        other = [name for name in own if name not in ("--nuisance", "--loss", "--hold-out", "--between")]
        if other:
            raise InputError("not an option of the motors", got=other[0], where="--what motors")
    elif "--between" in own:
        raise InputError("an option of the motors", got="--between", expected="--what motors", where="--between")
    if own and (method == STEADY_STATE or (steady and not method)):
        remedy = "leave it out, or leave out " + (", ".join(steady) if steady else "--method")
        raise InputError(
            f"{STEADY_STATE} has no such option", got=own[0], expected=f"with {OUTPUT_ERROR}", remedy=remedy
        )
    if steady and method == OUTPUT_ERROR:
        remedy = "for groups use --per" if steady[0] == "--group" else "leave it out"
        raise InputError(
            f"{OUTPUT_ERROR} has no such option", got=steady[0], expected=f"with {STEADY_STATE}", remedy=remedy
        )
    return method or (OUTPUT_ERROR if own else STEADY_STATE if steady else "")


def _refuse_table(method: str) -> None:
    from omnidyn.errors import InputError

    if method == OUTPUT_ERROR:
        raise InputError("a table of steady points has no time in it", got="a table axis,speed,force",
                         expected=f"logs, or --method {STEADY_STATE}", where="--method")  # fmt: skip


def _loaded(
    logs: list[str], ask: Ask, group: list[str], robot: Robot | None, how: Any, sort: bool, maps: options.Maps,
    now: Any, keep: bool,
) -> Loaded:  # fmt: skip
    from omnidyn.cli.identify_logs import load_runs

    patterns, option = (list(ask.per), "--per") if ask.per else (group, "--group")
    return load_runs(logs, patterns, robot, how, sort=sort, maps=maps, now=now, option=option, keep=keep)


def _default(loaded: Loaded, robot: Robot, ask: Ask) -> str:
    """Output error where robot and logs support it, else steady state with one line that says why."""
    from omnidyn.identification.identify import why_not_output_error

    why = why_not_output_error(loaded.runs, robot)
    if why:
        say(f"omnidyn: {STEADY_STATE}, not {OUTPUT_ERROR}: {why}")
    return STEADY_STATE if why else OUTPUT_ERROR


def _run_motors(
    method: str, loaded: Loaded, robot: Robot | None, input_: str, speed: str, window: str, ask: Ask,
    record: dict[str, Any], places: Out, now: Any,
) -> None:  # fmt: skip
    if method == OUTPUT_ERROR:
        from omnidyn.cli.identify_fit import fit_motors
        from omnidyn.errors import InputError

        if speed != "wheel":
            raise InputError(f"{OUTPUT_ERROR} has no such option", got="--speed", expected=f"with {STEADY_STATE}")
        fit_motors(loaded, input_, ask, record, places, now)
        return
    drives = _drives(loaded, robot, input_, speed, window)
    now("writing")
    _tell_drives(drives, record, places.report, places.out, places.force, places.json)


def _refuse_places(out: str, report: str, force: bool) -> None:
    """Before any work: places where the result could not be written in the end."""
    from omnidyn.files import check_output

    for path in (out, report):
        if path:
            check_output(path, force)


def _robot(robot: str) -> Robot | None:
    from omnidyn.model.robot_file import load_robot

    return load_robot(robot) if robot else None


def _shares(window: str) -> tuple[float, float] | None:
    from omnidyn.cli.numbers import number_list
    from omnidyn.errors import InputError

    if not window:
        return None
    values = number_list("--window", window)
    if len(values) != 2 or not 0.0 <= values[0] < values[1] <= 1.0:
        raise InputError("not two shares", got=window, expected="such as 0.4,0.95", where="--window")
    return values[0], values[1]


def _study(loaded: Loaded, robot: Robot, shape: str, speed: str, force_from: str, window: str) -> SteadyStudy:
    from omnidyn.identification.steady_study import identify_steady

    return identify_steady(
        loaded.runs, robot, groups=loaded.groups, shape=shape, speed=speed, force_from=force_from,
        window=_shares(window),
    )  # fmt: skip


def _lines(loaded: Loaded, robot: Robot, speed: str, force_from: str, window: str) -> dict[str, Estimate]:
    from omnidyn.identification.steady_lines import identify_lines

    return identify_lines(
        loaded.runs, robot, groups=loaded.groups, speed=speed, force_from=force_from, window=_shares(window)
    )


def _drives(loaded: Loaded, robot: Robot | None, kind: str, speed: str, window: str) -> DriveStudy:
    from omnidyn.identification.drive_line import fit_drive_lines

    return fit_drive_lines(loaded.runs, kind=kind, speed=speed, robot=robot, share=_shares(window))


def _record(robot: str, loaded: Loaded) -> dict[str, Any]:
    from omnidyn.cli.session import provenance, robot_input

    return provenance([*([robot_input(robot)] if robot else []), *loaded.inputs])


def _tell_study(study: SteadyStudy, record: dict[str, Any], report: str, out: str, force: bool, json: bool) -> None:
    from omnidyn.cli.identify_logs import outputs
    from omnidyn.files import check_output, write_atomic
    from omnidyn.identification.study_table import study_summary, study_to_dict
    from omnidyn.model.robot_file import save_robot

    files = outputs(out, list(study.estimates))
    for path in files.values():
        check_output(path, force)
    if report:
        from omnidyn.report.steady_page import render_study

        write_atomic(report, render_study(study, record), force)
    for group, path in files.items():
        save_robot(study.estimates[group].robot, path, force)
    if json:
        for warning in study.warnings:
            say(f"omnidyn: warning: {warning}")
        show_json({**study_to_dict(study), "output": files or None, "report": report or None, "provenance": record})
    else:
        show(study_summary(study).rstrip("\n"))
    _say_written([*files.values(), report])


def _tell_lines(
    lines: dict[str, Estimate], record: dict[str, Any], report: str, out: str, force: bool, json: bool
) -> None:
    from omnidyn.cli.identify_logs import outputs
    from omnidyn.files import check_output
    from omnidyn.model.robot_file import save_robot

    files = outputs(out, list(lines))
    for path in files.values():
        check_output(path, force)
    for group, path in files.items():
        save_robot(lines[group].robot, path, force)
    if report:
        say("omnidyn: --shape line has no page; --report is not used")
    if json:
        groups = {group: estimate.to_dict() for group, estimate in lines.items()}
        show_json({"shape": LINE, "groups": groups, "output": files or None, "provenance": record})
    else:
        show("\n".join(estimate.summary() for estimate in lines.values()).rstrip("\n"))
    _say_written([*files.values()])


def _tell_drives(drives: DriveStudy, record: dict[str, Any], report: str, out: str, force: bool, json: bool) -> None:
    from omnidyn.files import write_atomic
    from omnidyn.identification.study_table import drive_summary, drive_to_dict

    if out:
        say("omnidyn: the lines of the motors do not go into a robot file; -o is not used")
    if report:
        from omnidyn.report.steady_page import render_drives

        write_atomic(report, render_drives(drives, record), force)
    if json:
        for warning in drives.warnings:
            say(f"omnidyn: warning: {warning}")
        show_json({**drive_to_dict(drives), "report": report or None, "provenance": record})
    else:
        show(drive_summary(drives).rstrip("\n"))
    _say_written([report])


def _say_written(paths: list[str]) -> None:
    for path in paths:
        if path:
            say(f"omnidyn: wrote {path}")


def _from_table(table: str, robot: str, rest: str, out: str, report: str, force: bool, json: bool) -> None:
    """The paper's way, from a table of steady points."""
    if report:
        raise typer.BadParameter("--report needs logs; a table of points has none.")
    with progress("identifying"):
        estimate, record = _estimated(table, robot, rest)
    if out:
        from omnidyn.model.robot_file import save_robot

        save_robot(estimate.robot, out, force)
    if json:
        for warning in estimate.warnings:
            say(f"omnidyn: warning: {warning}")
        show_json({**estimate.to_dict(), "output": out or None, "provenance": record})
    else:
        show(estimate.summary().rstrip("\n"))
    _say_written([out])


def _estimated(table: str, robot: str, rest: str) -> tuple[Estimate, dict[str, Any]]:
    """The estimate and the record of what it was made from; what the reader had to decide joins the warnings."""
    from dataclasses import replace

    from omnidyn.cli.session import provenance, robot_input
    from omnidyn.identification.steady_state import fit_steady_state
    from omnidyn.logs.steady_table import read_steady_table
    from omnidyn.model.robot_file import load_robot

    loaded, data = load_robot(robot), read_steady_table(table)
    estimate = fit_steady_state(loaded, data, rest=rest)
    record = provenance([robot_input(robot), {"role": "data", "name": table, "sha256": data.sha256}])
    return replace(estimate, warnings=(*data.notes, *estimate.warnings)), record
