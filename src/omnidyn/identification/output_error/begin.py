"""What a fit begins with: the group of each run, and the logs, the robot and the question of each group."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from omnidyn.errors import InputError, UnsupportedError
from omnidyn.findings.needs import is_exact, why_no_inputs
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.kinds import kind_with
from omnidyn.identification.output_error.prepare import (
    Group,
    expand_keys,
    free_by_default,
    guesses,
    make_group,
    read_records,
    stays_exact,
)
from omnidyn.identification.output_error.problem.bristles import with_damping
from omnidyn.identification.output_error.problem.karnopp import without_band
from omnidyn.identification.output_error.problem.parameters import refuse_unknown
from omnidyn.identification.output_error.solve.loop import looped
from omnidyn.identification.output_error.trust.breakaway import asked_levels, refuse_level
from omnidyn.model.keys import Key
from omnidyn.model.robot import Robot
from omnidyn.run import Run

ALL_LOGS = "all"  # the name of the group where there are none


def group_names(runs: Sequence[Run], question: OutputError, groups: Sequence[str] | None) -> list[str]:
    """The group of each run. Raises InputError for names that are not one for each, or where there is one group."""
    if groups is None:
        if question.per_free:
            raise InputError(
                "there are no groups", got=question.per_free[0], expected="with `groups`", where="per_free"
            )
        return [ALL_LOGS] * len(runs)
    if len(groups) != len(runs) or len(set(groups)) < 2:
        received = f"{len(groups)} names, {len(set(groups))} of them different, for {len(runs)} runs"
        raise InputError(
            "groups need a name for every run", got=received, expected="two groups or more", where="groups"
        )
    return list(groups)


def begun(
    name: str, runs: Sequence[Run], robot: Robot, question: OutputError, joint: bool
) -> tuple[Group, OutputError]:
    """(the group of these runs, its question with every key written out). robot: as it is given; joint: whether there
    are other groups.

    Raises InputError for options and logs that cannot be used, InsufficientDataError where nothing moved,
    UnsupportedError for what an engine, or a fit of several groups, does not know.
    """
    rigid = without_band(robot, ())
    exact = is_exact(rigid)
    default_keys = free_by_default(rigid, exact)
    full_question = _written_out(question, robot, default_keys)
    free = full_question.free or ()
    robot = with_damping(without_band(robot, free), free)
    if joint:
        _refuse_joint(runs, robot, full_question)
    records = read_records(runs, robot, full_question)
    refuse_unknown(full_question.fixed, robot)
    for level in asked_levels(robot, free, full_question.fixed):
        refuse_level(level, robot, free)
    keys = full_question.free if full_question.free is not None else guesses(robot)
    exact = exact and stays_exact(robot, [key for key in keys if key not in full_question.fixed])
    engine = kind_with(has_loop=looped(records), exact=exact)
    group = make_group(name, records, robot, full_question, engine, default_keys, is_single=not joint)
    _refuse_profile(group, full_question)
    return group, full_question


def _refuse_profile(group: Group, question: OutputError) -> None:
    levels = [level for level in asked_levels(group.robot, question.free or (), question.fixed) if group.tells(level)]
    reason = "a speed loop" if group.engine.has_loop else ""
    if group.robot.wheels.traction_mu is not None:
        reason = "wheels that may slip"
    if reason and levels:
        raise UnsupportedError(
            "breakaway is profiled over voltages that are known, of wheels that roll",
            got=reason,
            expected="neither a speed loop nor a traction limit",
            where="free",
            remedy=f"give {Key.parse(levels[0]).table} a stribeck_speed and free it too: what falls with the speed is "
            "fitted here; or hold breakaway, at the force with which slow ramps first move the robot",
        )


def _written_out(question: OutputError, robot: Robot, default_keys: Sequence[str]) -> OutputError:
    """The question with every key written out, as this robot has them."""

    def every(keys: Iterable[str]) -> tuple[str, ...]:
        return expand_keys(tuple(keys), robot, default_keys)

    free = question.free
    return replace(
        question,
        free=None if free is None else every(free),
        fixed=every(question.fixed),
        per_free=every(question.per_free),
        profile=every(question.profile),
    )


def _refuse_joint(runs: Sequence[Run], robot: Robot, question: OutputError) -> None:
    levels = asked_levels(robot, question.free or ())
    if levels:
        raise UnsupportedError(
            "breakaway is not profiled in groups",
            got=levels[0],
            expected="other keys",
            remedy="fit each group alone",
            where="free",
        )
    reason = why_no_inputs(runs, robot)
    if reason:
        raise UnsupportedError("groups are fitted by output error only", got=reason, where="groups")
