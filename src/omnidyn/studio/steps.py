"""Steps: the line Log, Robot, Fit, Drive, Track, Compare: what is done, what is missing, and what comes next."""

from __future__ import annotations

from dataclasses import dataclass

from omnidyn.studio.fit.state import Fitting
from omnidyn.studio.session import Session

DONE, WORKING, READY, WAITING, WRONG = "done", "working", "ready", "waiting", "wrong"
NEEDS = {"no_log": "needs a log", "no_robot": "needs a robot"}
MARKS = {DONE: "✓", WORKING: "…", READY: "○", WAITING: "–", WRONG: "✕"}


@dataclass(frozen=True)
class Step:
    """A step. state: one of MARKS. words: what there is, or what is missing. next: what a user does here next."""

    name: str
    state: str
    words: str
    next: str = ""


def steps(session: Session, fitting: Fitting) -> list[Step]:
    """All steps, in their order."""
    log, robot, fit = _log(session), _robot(session), _fit(fitting)
    ready = robot.state == DONE
    use = (READY, "ready") if ready else (WAITING, "needs a robot")
    over = use if session.logs or not ready else (WAITING, "needs a log")
    return [log, robot, fit, Step("Drive", *use), Step("Track", *use), Step("Compare", *over)]


def following(line: list[Step]) -> Step | None:
    """The first step at which something is to be done; None where all are done."""
    return next((step for step in line if step.next), None)


def _log(session: Session) -> Step:
    logs = list(session.logs.values())
    bad = [log for log in logs if log.error or (log.result and log.result["has_errors"])]
    count = f"{len(logs)} log{'s' * (len(logs) > 1)}"
    if not logs:
        return Step("Log", READY, "no log yet", "drop a log, or use the example")
    if bad:
        return Step("Log", WRONG, f"{len(bad)} of {count} not usable", f"look at what is wrong with {bad[0].label}")
    if any(log.progress for log in logs):
        return Step("Log", WORKING, "being read")
    return Step("Log", DONE, count)


def _robot(session: Session) -> Step:
    if session.robot:
        return Step("Robot", DONE, session.robot)
    return Step("Robot", READY, "none chosen", "choose a robot, or describe one")


def _fit(fitting: Fitting) -> Step:
    last, why = fitting.last, fitting.why_not()[0]
    if last.running:
        return Step("Fit", WORKING, "fitting")
    if last.result is not None:
        return Step("Fit", WRONG if last.result["failed"] else DONE, "failed" if last.result["failed"] else "fitted")
    if last.error or last.stopped:
        return Step("Fit", WRONG, "stopped", "run the fit again")
    if why:
        return Step("Fit", WAITING, NEEDS.get(why, "not yet"))
    return Step("Fit", READY, "ready", "fit the robot to the logs")
