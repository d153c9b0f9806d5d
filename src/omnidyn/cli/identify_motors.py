"""The part of `omnidyn identify` that fits motors, wheels off the ground: `--what motors`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from omnidyn.cli.identify_fit import Out, Part, nuisances
from omnidyn.cli.identify_logs import Loaded
from omnidyn.cli.identify_steady import How, say_written
from omnidyn.cli.terminal.streams import say, show, show_json

if TYPE_CHECKING:
    from omnidyn.identification.motors.study import MotorStudy
    from omnidyn.model.robot import Robot


def run_motors(method: str, loaded: Loaded, robot: Robot | None, asked: Any, record: dict[str, Any], now: Any) -> None:
    """Fit, write, tell."""
    from omnidyn.identification.motors.study import STEADY_STATE, identify_motors

    ask, part = asked.fit(), Part(loaded, asked.hold_out)
    study = identify_motors(
        part.runs, method=method or STEADY_STATE, kind=asked.input_, speed=asked.speed, robot=robot,
        share=How(asked.speed, asked.force_from, asked.window).shares(), between=ask.between or "auto",
        latency=_latency(nuisances(ask.nuisances)), loss=ask.loss or "gaussian", held_out=[run for run, _ in part.held],
        now=now,
    )  # fmt: skip
    now("writing")
    _tell(study, record, asked.places())


def _latency(asked: str | list[str]) -> bool | None:
    """Whether to fit a latency; None is where the logs show one."""
    from omnidyn.errors import InputError

    if asked == "auto":
        return None
    for name in asked:
        if name.partition(".")[0] != "latency":
            raise InputError("of the motors only latency can be fitted", got=name, where="nuisances")
    return bool(asked)


def _tell(study: MotorStudy, record: dict[str, Any], to: Out) -> None:
    """Write and show: report, JSON or the summary."""
    from omnidyn.files import write_atomic

    if to.out:
        say("omnidyn: the numbers of the motors do not go into a robot file; -o is not used")
    if to.report:
        from omnidyn.report.motors_page import render_motors

        write_atomic(to.report, render_motors(study, record), to.force)
    if to.json:
        for warning in study.doubts:
            say(f"omnidyn: warning: {warning}")
        show_json({**study.to_dict(), "report": to.report or None, "provenance": record})
    else:
        show(study.summary().rstrip("\n"))
    say_written([to.report])
