"""plot(): the picture of each result, as a matplotlib Figure. The public package hands it down to them: shown.py."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from matplotlib.figure import Figure

from omnidyn.campaigns.results import Campaign
from omnidyn.comparison.drift import Drift
from omnidyn.comparison.model_bands import with_fitted_band
from omnidyn.comparison.result import Comparison
from omnidyn.control.tracking import Tracking
from omnidyn.errors import InputError
from omnidyn.findings.finding import Verdict
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.friction_curve import FrictionCurve, sliding_force
from omnidyn.identification.identification import Identification
from omnidyn.identification.motors.study import MotorStudy
from omnidyn.identification.planning.planned import Plan
from omnidyn.identification.steady.study_table import SteadyStudy
from omnidyn.logs.path import drawable_path
from omnidyn.model.frames import AXES
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import top_speeds
from omnidyn.report.drift_picture import draw_drift
from omnidyn.report.figures.campaign import draw_campaign
from omnidyn.report.figures.channels import draw_run
from omnidyn.report.figures.dead_zone_map import draw_dead_zone_map
from omnidyn.report.figures.friction_speed import ONLY_GROUP, draw_estimates, draw_friction_speed, speeds_up_to
from omnidyn.report.figures.motor_lines import draw_motor_lines
from omnidyn.report.figures.overlay import draw_overlay
from omnidyn.report.figures.path import draw_path
from omnidyn.report.figures.plan import draw_plan
from omnidyn.report.figures.raw_log import draw_raw_log
from omnidyn.report.figures.robot import draw_robot
from omnidyn.report.figures.shapes import draw_polar
from omnidyn.report.figures.tracking import draw_tracking
from omnidyn.report.style import Picture
from omnidyn.run import Run


def plot(result: Any, **options: Any) -> Figure:
    """The figure of a result; its title and caption are those of the page. Raises InputError for wrong options."""
    picture = next(draw(result, **options) for kind, draw in PICTURES.items() if isinstance(result, kind))
    picture.figure.set_label(picture.title)
    return picture.figure


def _robot(robot: Robot, what: str) -> Picture:
    pictures: dict[str, Callable[[], Picture]] = {
        "layout": lambda: draw_robot(robot),
        "dead zone": lambda: draw_dead_zone_map({robot.name: robot}),
        "friction": lambda: draw_friction_speed({robot.name: _of_file(robot)}, banded=False),
    }
    if what not in pictures:
        raise InputError("no such picture", got=what, expected=", ".join(pictures), where="what")
    return pictures[what]()


def _run(run: Run, channels: Sequence[str] = (), path: bool = False, robot: Robot | None = None) -> Picture:
    if not path:
        return draw_run(run, channels)
    return draw_path([drawable_path(run, robot)])


def _verdict(verdict: Verdict) -> Picture:
    if verdict.log is None:
        raise InputError(
            "the log was checked in blocks, and is not kept", expected="the verdict of check(log) on the whole log"
        )
    return draw_raw_log(verdict.log, verdict)


def _motors(study: Any) -> Picture:
    windows = study.windows or study.drawn
    if windows is None:
        raise InputError("the logs have no windows to draw", expected="motors that turn, at more than 10 rows a second")
    return draw_motor_lines(study.motors, windows, study.starts, study.curves)


def _identification(result: Identification, what: str) -> Picture:
    """Friction or motors; or the free run of the first group."""
    if what == "friction":
        return draw_estimates(result.groups) if result.groups else _motors(result.study)
    if what != "runs" or not result.validations:
        expected = "friction, runs" if result.validations else "friction"
        raise InputError("no such picture", got=what, expected=expected, where="what")
    group, validation = next(iter(result.validations.items()))
    return draw_overlay(with_fitted_band(validation.held_out or validation.fitted, result.groups[group].robot))


def _of_file(robot: Robot) -> list[FrictionCurve]:
    """The curves of a robot as its file has it."""
    curves = []
    for axis, top in enumerate(top_speeds(robot)):
        speed = speeds_up_to(float(top))
        curves.append(FrictionCurve(AXES[axis], speed, sliding_force(robot, axis, speed), 0.0 * speed))
    return curves


PICTURES: dict[type, Callable[..., Picture]] = {
    Run: _run,
    Robot: _robot,
    Verdict: _verdict,
    Comparison: draw_overlay,
    Drift: draw_drift,
    Estimate: lambda estimate: draw_estimates({ONLY_GROUP: estimate}),
    Identification: _identification,
    MotorStudy: _motors,
    SteadyStudy: draw_polar,
    Tracking: draw_tracking,
    Campaign: draw_campaign,
    Plan: draw_plan,
}
