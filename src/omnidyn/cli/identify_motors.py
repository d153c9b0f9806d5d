"""The part of `omnidyn identify` that fits motors, wheels off the ground: `--what motors`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from omnidyn.cli.identify_logs import Loaded
from omnidyn.cli.identify_show import Out, say_warnings, say_written
from omnidyn.cli.terminal.streams import say, show, show_json
from omnidyn.identification.question import OUTPUT_ERROR, Question

if TYPE_CHECKING:
    from omnidyn.identification.motors.drive_line import DriveStudy
    from omnidyn.identification.motors.fit import MotorFit
    from omnidyn.model.robot import Robot


def run_motors(
    question: Question, loaded: Loaded, robot: Robot | None, record: dict[str, Any], to: Out, now: Any
) -> None:
    """Fit, write, tell."""
    if question.method == OUTPUT_ERROR:
        _fit_motors(loaded, question, record, to, now)
        return
    drives = _drives(loaded, robot, question)
    now("writing")
    _tell_drives(drives, record, to)


def _fit_motors(loaded: Loaded, question: Question, record: dict[str, Any], to: Out, now: Any) -> None:
    """One output-error fit per motor, with and without a dead band, and free runs on what was held out."""
    import numpy as np

    from omnidyn.errors import InputError
    from omnidyn.identification.grouping import held_out
    from omnidyn.identification.motors.choice import is_late
    from omnidyn.identification.motors.fit import fit_motor
    from omnidyn.identification.motors.run import fit_rmse

    out = held_out([run.source for run in loaded.runs], question.hold_out)
    runs = [run for run, away in zip(loaded.runs, out, strict=True) if not away]
    held = [run for run, away in zip(loaded.runs, out, strict=True) if away]
    counts = [run.wheels or 1 for run in runs]
    other = [name for name in question.nuisances or () if name.partition(".")[0] != "latency"]
    if other:
        raise InputError("of the motors only latency can be fitted", got=other[0], where="nuisances")
    if to.out:
        say("omnidyn: the numbers of the motors do not go into a robot file; -o is not used")
    found: list[tuple[MotorFit, MotorFit, float, float]] = []
    for motor in range(min(counts)):
        now(f"fitting motor {motor + 1} of {min(counts)}")
        how: dict[str, Any] = {"kind": question.input, "between": question.between, "loss": question.loss}
        how["latency"] = is_late(runs, motor, **how) if question.nuisances is None else bool(question.nuisances)
        band, plain = (fit_motor(runs, motor, dead_band=with_band, **how) for with_band in (True, False))
        errors = [fit_rmse(fit, held) if held else np.nan for fit in (band, plain)]
        found.append((band, plain, float(errors[0]), float(errors[1])))
    _tell_motors(found, record, to)


def _tell_motors(found: Sequence[tuple[MotorFit, MotorFit, float, float]], record: dict[str, Any], out: Out) -> None:
    if out.report:
        from omnidyn.files import write_atomic
        from omnidyn.report.fit_page import render_motors

        write_atomic(out.report, render_motors(found, record), out.force)
    if out.json:
        motors = [
            {**band.to_dict(), "held_out_rmse_rad_s": held, "without_dead_band":
             {**plain.to_dict(), "held_out_rmse_rad_s": held_plain}}
            for band, plain, held, held_plain in found
        ]  # fmt: skip
        show_json({"method": "output-error", "motors": motors, "report": out.report or None, "provenance": record})
    else:
        from omnidyn.identification.advice import MOTOR_HEAD, motor_rows, motor_words
        from omnidyn.identification.steady.study_table import table_text

        lines = [f"- {each}" for each in motor_words(found)]
        show("\n".join([*table_text(MOTOR_HEAD, motor_rows(found)), "", *lines]))
    if out.report:
        say(f"omnidyn: wrote {out.report}")


def _drives(loaded: Loaded, robot: Robot | None, question: Question) -> DriveStudy:
    from omnidyn.identification.motors.drive_line import fit_drive_lines

    return fit_drive_lines(loaded.runs, kind=question.input, speed=question.speed, robot=robot, share=question.window)


def _tell_drives(drives: DriveStudy, record: dict[str, Any], to: Out) -> None:
    """Write and show the lines of the motors: report, JSON or the summary."""
    from omnidyn.files import write_atomic
    from omnidyn.identification.motors.drive_table import drive_summary, drive_to_dict

    if to.out:
        say("omnidyn: the lines of the motors do not go into a robot file; -o is not used")
    if to.report:
        from omnidyn.report.steady_page import render_drives

        write_atomic(to.report, render_drives(drives, record), to.force)
    if to.json:
        say_warnings(drives.warnings)
        show_json({**drive_to_dict(drives), "report": to.report or None, "provenance": record})
    else:
        show(drive_summary(drives).rstrip("\n"))
    say_written([to.report])
