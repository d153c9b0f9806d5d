"""Steps: the line Log, Robot, Fit, Drive, Track, Compare: what is done, what is missing, and what comes next."""

from __future__ import annotations

from dataclasses import dataclass

from omnidyn.studio.session import Session
from omnidyn.studio.task import Task

DONE, WORKING, READY, WAITING, WRONG = "done", "working", "ready", "waiting", "wrong"
NEEDS = {"no_log": "needs a log", "no_robot": "needs a robot"}
MARKS = {DONE: "✓", WORKING: "…", READY: "○", WAITING: "–", WRONG: "✕"}


@dataclass(frozen=True)
class StepState:
    """A step. state: one of MARKS. words: what there is, or what is missing. next: what a user does here next."""

    name: str
    state: str
    words: str
    next: str = ""


def steps(session: Session, last: Task, why: str) -> list[StepState]:
    """All steps, in their order. last: fit; why: what keeps from the next one, "" for nothing."""
    log, robot, fit = _log(session), _robot(session), _fit(last, why)
    ready = robot.state == DONE
    use = (READY, "ready") if ready else (WAITING, "needs a robot")
    over = use if session.logs or not ready else (WAITING, "needs a log")
    return [log, robot, fit, StepState("Drive", *use), StepState("Track", *use), StepState("Compare", *over)]


def following(line: list[StepState]) -> StepState | None:
    """The first step at which something is to be done; None where all are done."""
    return next((step for step in line if step.next), None)


def _log(session: Session) -> StepState:
    logs = list(session.logs.values())
    bad = [log for log in logs if log.error or (log.result and log.result["has_errors"])]
    count = f"{len(logs)} log{'s' * (len(logs) > 1)}"
    if not logs:
        return StepState("Log", READY, "no log yet", "drop a log, or use the example")
    if bad:
        return StepState(
            "Log", WRONG, f"{len(bad)} of {count} not usable", f"look at what is wrong with {bad[0].label}"
        )
    if any(log.progress for log in logs):
        return StepState("Log", WORKING, "being read")
    return StepState("Log", DONE, count)


def _robot(session: Session) -> StepState:
    if session.robot:
        return StepState("Robot", DONE, session.robot)
    return StepState("Robot", READY, "none chosen", "choose a robot, or describe one")


def _fit(last: Task, why: str) -> StepState:
    if last.running:
        return StepState("Fit", WORKING, "fitting")
    if last.result is not None:
        return StepState(
            "Fit", WRONG if last.result["failed"] else DONE, "failed" if last.result["failed"] else "fitted"
        )
    if last.error or last.stopped:
        return StepState("Fit", WRONG, "stopped", "run the fit again")
    if why:
        return StepState("Fit", WAITING, NEEDS.get(why, "not yet"))
    return StepState("Fit", READY, "ready", "fit the robot to the logs")
