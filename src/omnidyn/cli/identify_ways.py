"""Which way `omnidyn identify` goes: what was asked for, what the logs allow, and what does not go together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import typer

from omnidyn.cli import identify_steady as steady
from omnidyn.cli import log_options as options
from omnidyn.cli.terminal.progress import progress
from omnidyn.cli.terminal.streams import say

if TYPE_CHECKING:
    from omnidyn.cli.identify_fit import Ask, Out
    from omnidyn.cli.identify_logs import Loaded
    from omnidyn.model.robot import Robot

OUTPUT_ERROR, STEADY_STATE = "output-error", "steady-state"
FRICTION, MOTORS, LINE = "friction", "motors", "line"


@dataclass(frozen=True)
class Asked:
    """The command line: every option under its own name."""

    logs: list[str]
    robot: str
    method: str
    free: list[str]
    fix: list[str]
    nuisance: list[str]
    loss: str
    use_priors: bool
    hold_out: list[str]
    per: list[str]
    per_free: list[str]
    profile: list[str]
    bootstrap: int
    start: str
    between: str
    what: str
    shape: str
    speed: str
    force_from: str
    input_: str
    window: str
    group: list[str]
    rest: str
    report: str
    out: str
    force: bool
    json: bool
    map_file: str
    column: list[str]
    assume: list[str]
    latency: list[str]
    save_map: str
    sort: bool
    no_header: bool
    skip_bad_rows: bool
    current_unsigned: bool

    def fit(self) -> Ask:
        """The options of output error."""
        from omnidyn.cli.identify_fit import Ask

        return Ask(self.free, self.fix, self.nuisance, self.loss, self.use_priors, self.hold_out, self.per,
                   self.per_free, self.profile, self.bootstrap, self.between, self.start)  # fmt: skip

    def of_steady(self) -> list[str]:
        """Options of steady-state that were given, by their names."""
        given = {
            "shape": self.shape != "auto", "window": self.window, "group": self.group, "rest": self.rest != "bound",
            "force_from": self.force_from, "speed": self.speed != "wheel" and self.what == FRICTION,
        }  # fmt: skip
        return [f"--{name.replace('_', '-')}" for name, value in given.items() if value]

    def places(self) -> Out:
        """Where results go."""
        from omnidyn.cli.identify_fit import Out

        return Out(self.report, self.out, self.force, self.json)


def run(asked: Asked) -> None:
    """Read, choose the way, go it."""
    from omnidyn.cli.identify_logs import is_steady_table

    ask = asked.fit()
    method = _method(asked.method, asked.what, ask, asked.of_steady())
    if not asked.robot and asked.what == FRICTION:
        raise typer.BadParameter("Missing option '--robot'.")
    _refuse_places(asked.out, asked.report, asked.force)
    options.keep_logs(asked.logs, asked.out, asked.report, asked.save_map)
    if asked.what == FRICTION and len(asked.logs) == 1 and is_steady_table(asked.logs[0]):
        _refuse_table(method)
        steady.from_table(asked.logs[0], asked.robot, asked.rest, asked.places())
        return
    with progress("reading") as now:
        robot = _robot(asked.robot)
        loaded = _loaded(asked, robot, now)
        now("identifying")
        record = _record(asked.robot, loaded)
        if asked.what == MOTORS:
            from omnidyn.cli.identify_motors import run_motors

            run_motors(method, loaded, robot, asked, record, now)
            return
        assert robot is not None
        if (method or _default(loaded, robot)) == OUTPUT_ERROR:
            _run_fit(loaded, robot, asked, record, now)
            return
        loaded.logs.clear()
        how = steady.How(asked.speed, asked.force_from, asked.window)
        if asked.shape == LINE:
            steady.tell_lines(steady.lines(loaded, robot, how), record, asked.places())
            return
        study = steady.study(loaded, robot, asked.shape, how)
        now("writing")
        steady.tell_study(study, record, asked.places())


def _run_fit(loaded: Loaded, robot: Robot, asked: Asked, record: dict[str, Any], now: Any) -> None:
    from omnidyn.cli.identify_fit import fit_logs
    from omnidyn.identification.identify import why_not_output_error

    slow = why_not_output_error(loaded.runs, robot)
    if slow and robot.drive.kind == "speed":
        say(f"omnidyn: {slow}; --method {STEADY_STATE} (--group instead of --per) answers in seconds")
    if loaded.groups and not asked.per:
        say("omnidyn: all folders are fitted together; --per NAME=GLOB makes groups of them")
        loaded = loaded._replace(groups=None)
    fit_logs(loaded, robot, asked.fit(), record, asked.places(), now)


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


def _loaded(asked: Asked, robot: Robot | None, now: Any) -> Loaded:
    from omnidyn.cli.identify_logs import load_runs

    how = options.log_options(asked.map_file, asked.column, asked.assume, asked.latency, asked.no_header,
                              asked.skip_bad_rows, asked.current_unsigned)  # fmt: skip
    patterns, option = (asked.per, "--per") if asked.per else (asked.group, "--group")
    return load_runs(asked.logs, patterns, robot, how, sort=asked.sort, maps=options.Maps(asked.save_map, asked.force),
                     now=now, option=option, keep=asked.what == FRICTION)  # fmt: skip


def _default(loaded: Loaded, robot: Robot) -> str:
    """Output error where robot and logs support it, else steady state with one line that says why."""
    from omnidyn.identification.identify import why_not_output_error

    why = why_not_output_error(loaded.runs, robot)
    if why:
        say(f"omnidyn: {STEADY_STATE}, not {OUTPUT_ERROR}: {why}")
    return STEADY_STATE if why else OUTPUT_ERROR


def _refuse_places(out: str, report: str, force: bool) -> None:
    """Before any work: places where the result could not be written in the end."""
    from omnidyn.files import check_output

    for path in (out, report):
        if path:
            check_output(path, force)


def _robot(robot: str) -> Robot | None:
    from omnidyn.model.robot_file import load_robot

    return load_robot(robot) if robot else None


def _record(robot: str, loaded: Loaded) -> dict[str, Any]:
    from omnidyn.cli.terminal.session import provenance, robot_input

    return provenance([*([robot_input(robot)] if robot else []), *loaded.inputs])
