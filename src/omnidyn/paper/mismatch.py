"""Claims on how Tables 1 and 3 fit together, and on the controller of the conclusion."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from omnidyn.model.dynamics import state_space
from omnidyn.model.frames import AXES
from omnidyn.model.mass import axis_masses
from omnidyn.model.robot import Robot
from omnidyn.paper.claim import TOLERANCE, Claim, ClaimVerdict, judge, listed, plain, same
from omnidyn.paper.reconcile import FRICTION, Reconciliation, reconciliations
from omnidyn.paper.steady import printed_force
from omnidyn.paper.tables import MPC_SENTENCE, PAPER_AXES, SPEED_UNIT


def mismatch_claims(robot: Robot) -> tuple[Claim, ...]:
    """The claims of this file."""
    trials = reconciliations(robot)
    return (_one_robot(trials), _wanted(trials), _mpc(robot))


def _one_robot(trials: Sequence[Reconciliation]) -> Claim:
    everywhere = [trial for trial in trials if trial.axes == AXES]
    nothing = next(trial for trial in everywhere if not trial.freed)
    single, pair = (
        _best(trial for trial in everywhere if len(trial.freed) == n and FRICTION not in trial.freed) for n in (1, 2)
    )
    friction = next(trial for trial in everywhere if trial.freed == (FRICTION,))
    forces = [printed_force(axis).max() for axis in AXES]
    best_count = max(trial.explained for trial in everywhere)
    return Claim(
        key="one-robot",
        place="Tables 1, 3",
        statement="Table 3 describes the robot that was measured in Table 1.",
        printed=f"{nothing.rows} steady speeds",
        ours=f"{nothing.explained} of {nothing.rows} agree",
        verdict=judge(nothing.explains_all, any(trial.explains_all for trial in everywhere)),
        why=f"Of one number {single.words()} leaves least: {_left(single)}, {single.explained} rows; of two "
        f"{pair.words()}: {_left(pair)}, {pair.explained} rows. Friction alone wants {friction.words()}, against "
        f"forces of at most {listed(forces)} in Table 1, and leaves {_left(friction)}. No fit explains more than "
        f"{best_count} of {nothing.rows} rows, within {100 * TOLERANCE:g} % or at rest: no single change does, and no "
        "pair.",
        numbers=plain(
            agreeing=nothing.explained,
            most_agreeing=best_count,
            rows=nothing.rows,
            **{"rmse_" + ("_".join(trial.freed) or "nothing"): list(trial.rmse.values()) for trial in everywhere},
            **{"values_" + "_".join(trial.freed): trial.values for trial in everywhere if trial.freed},
        ),
    )


def _wanted(trials: Sequence[Reconciliation]) -> Claim:
    """What each axis would want of one number."""
    single_trials = {
        (trial.freed[0], trial.axes[0]): trial for trial in trials if len(trial.freed) == len(trial.axes) == 1
    }
    resistance = [single_trials["R", axis] for axis in AXES]
    drop = [single_trials["drop", axis] for axis in AXES]
    radius, wheel = single_trials["b", "yaw"], single_trials["r", "yaw"]
    values = [trial.values[0] for trial in resistance]
    return Claim(
        key="axes-disagree",
        place="Tables 1, 3",
        statement="One set of motor parameters holds for all three axes.",
        printed="Table 3",
        ours=f"R = {listed(values)} ohm for v, v_n, w",
        verdict=judge(bool(same(max(values), min(values)))),
        why=f"Fitted to each axis alone, the speeds want {_each(resistance)}; or a lost voltage: {_each(drop)}. What "
        f"mends w is the ratio of the radii: {radius.words()} brings its rmse from {trials[0].rmse['yaw']:.2f} to "
        f"{radius.rmse['yaw']:.2f} rad/s and leaves v and v_n as they are; {wheel.words()} does the same for w and "
        f"leaves {_left(wheel)}.",
        numbers=plain(
            resistance=values,
            rmse_resistance=[trial.rmse[axis] for trial, axis in zip(resistance, AXES, strict=True)],
            drop=[trial.values[0] for trial in drop],
            rmse_drop=[trial.rmse[axis] for trial, axis in zip(drop, AXES, strict=True)],
            robot_radius=radius.values[0],
            rmse_robot_radius=radius.rmse["yaw"],
            wheel_radius=wheel.values[0],
            rmse_wheel_radius=list(wheel.rmse.values()),
        ),
    )


def _best(trials: Iterable[Reconciliation]) -> Reconciliation:
    return min(trials, key=lambda trial: trial.cost)


def _left(trial: Reconciliation) -> str:
    parts = (f"{PAPER_AXES[axis]} {trial.rmse[axis]:.2f} {SPEED_UNIT[axis]}" for axis in AXES)
    return "rmse " + ", ".join(parts)


def _each(trials: Sequence[Reconciliation]) -> str:
    return ", ".join(f"{trial.words()} for {PAPER_AXES[trial.axes[0]]}" for trial in trials)


def _mpc(robot: Robot) -> Claim:
    """The controller of Araujo et al. 2011, as read by the project; it is not part of this paper."""
    system, mass = state_space(robot), axis_masses(robot)
    ours = system.B[2, 0]
    theirs = ours * mass[2] / mass[0]
    growth = float(np.abs(np.linalg.eigvals(system.A)).max())
    return Claim(
        key="mpc",
        place="conclusion",
        statement=f"The predictive controller of Araujo et al. 2011 {MPC_SENTENCE}.",
        printed=MPC_SENTENCE,
        ours="saturation only",
        verdict=ClaimVerdict.OTHER_PAPER,
        why="That paper, as read by the project, predicts without the non-linear part: friction is in its simulated "
        f"plant only. Its B divides the torque row by M instead of I_n, {theirs:.4f} instead of {ours:.4f} rad/s^2/V, "
        f"{ours / theirs:.0f} times less, and it puts continuous matrices into a discrete equation, where A would "
        f"multiply a speed by up to {growth:.1f} in every step.",
        numbers=plain(
            b_torque_row=ours, b_torque_row_divided_by_mass=theirs, ratio=ours / theirs, spectral_radius_of_a=growth
        ),
    )
