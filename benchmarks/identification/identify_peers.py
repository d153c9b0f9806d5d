"""Others on the log that our fit is timed on, in the same run: mujoco.sysid, and lmfit on scipy's solve_ivp.

All start from friction twice too large, know the noise and everything else of the robot, and have its forces given.
Two errors of each, in standard errors of the Cramer-Rao bound: on the log without noise against the truth, which is
what the method itself adds; and on the noisy log against the maximum of the likelihood. That maximum is found without
anything of ours: motion from event to event in plain Python, and scipy's least_squares. A peer that is not installed is
skipped by name; docs/tested.md says how to install them.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import math
import time
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from benchmarks.identification.identify_log import cpu, cramer_rao
from benchmarks.simulation.tanh import run_tanh
from benchmarks.table import Table
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.dynamics import state_space
from omnidyn.model.keys import BOX
from omnidyn.model.mass import axis_masses
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from tests.support.axebot_logs import NOISE, RATE, bare, noisy_draw, truth, with_friction

WRONG = 2.0  # times the truth: where all begin
FASTER_SYSID, FASTER_LMFIT, SYSTEMATIC = 500.0, 5000.0, 0.1  # the goals
STEP = 0.002  # [s] of MuJoCo
EPS, RTOL = 0.01, 1e-6  # of tanh(v/eps), and of LSODA
INSTALL = "python -m pip install -r benchmarks/peers.txt"
JOINT = 'solreffriction="{} 1" solimpfriction="0.99 0.999 0.001"'  # the stiffest that this step bears
XML = """<mujoco><option timestep="{step}" gravity="0 0 0" integrator="implicitfast"><flag contact="disable"/></option>
<worldbody>{bodies}</worldbody><actuator>{motors}</actuator><sensor>{sensors}</sensor></mujoco>"""
BODY = """<body pos="0 {k} 0"><inertial pos="0 0 0" mass="{mass}" diaginertia="1 1 1"/>
<joint name="j{k}" type="slide" axis="1 0 0" damping="1" frictionloss="1" {friction}/></body>"""

Fit = Callable[[Robot, Run], np.ndarray]


class Peer(NamedTuple):
    """fit: (robot to start from, log) -> six numbers. faster: goal, how many times as fast we are."""

    name: str
    fit: Fit
    faster: float


def installed(name: str) -> ModuleType | None:
    """The module, where it is installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def installed_sysid() -> ModuleType | None:
    """mujoco.sysid, where all of it is: mujoco alone has an empty one."""
    found = installed("mujoco.sysid")
    return found if hasattr(found, "ParameterDict") else None


def peers(table: Table) -> Iterator[Peer]:
    """Those that are installed; a note for each that is not."""
    sysid, lmfit = installed_sysid(), installed("lmfit")
    if sysid is None:
        table.notes.append(f"mujoco.sysid skipped: not installed here ({INSTALL})")
    else:
        name = f"mujoco.sysid {importlib.import_module('mujoco').__version__}, {STEP * 1e3:g} ms"
        for words, fair in (("weights 1/sigma", False), ("its normalising undone", True)):
            yield Peer(f"{name}, {words}", lambda robot, log, fair=fair: by_sysid(robot, log, fair), FASTER_SYSID)
    if lmfit is None:
        table.notes.append(
            f"lmfit skipped: not installed here ({INSTALL}); scipy's least_squares, which it calls, runs"
        )
        yield Peer(f"scipy least_squares + solve_ivp (LSODA, tanh {EPS:g})", by_least_squares, FASTER_LMFIT)
    else:
        yield Peer(f"lmfit {lmfit.__version__} + solve_ivp (LSODA, tanh {EPS:g})", by_lmfit, FASTER_LMFIT)


def compare(table: Table, robot: Robot, clean: Run) -> None:
    """Time and both errors, ours first."""
    true, log, quiet, std = (
        np.array(list(truth(robot).values())),
        noisy_draw(clean, 0),
        bare(clean),
        cramer_rao(robot, clean),
    )
    wrong, best = with_friction(robot, WRONG * true), most_likely(robot, log)

    def add_errors(fit: np.ndarray, still: np.ndarray, ours: bool) -> None:
        for words, off in (("systematic error: log without noise", still - true), ("from the optimum", fit - best)):
            worst = float(np.max(np.abs(off) / std))
            goal, met = (f"< {SYSTEMATIC:g}", worst < SYSTEMATIC) if ours else ("", None)
            table.add(goal, met, what=f"... {words}", value=worst, unit="std")

    def fitted(run: Run) -> np.ndarray:
        return our_fit(wrong, run)

    spent = cpu(lambda: fitted(log), 30)
    table.add(what=f"one fit beside peers: ours, from {WRONG:g}x the truth", value=spent, unit="ms")
    add_errors(fitted(log), fitted(quiet), True)
    for peer in peers(table):
        start = time.process_time()
        found = peer.fit(wrong, log)
        theirs = (time.process_time() - start) * 1e3
        table.add(what=peer.name, value=theirs, unit="ms")
        times = theirs / spent
        table.add(f">= {peer.faster:g}", times >= peer.faster, what="... we are times as fast", value=times)
        add_errors(found, peer.fit(wrong, quiet), False)


def our_fit(robot: Robot, log: Run) -> np.ndarray:
    """The six numbers of our fit."""
    fit = identify(log, robot, OutputError(nuisances=(), start="rest")).estimate
    return np.array([fit.value[key] for key in BOX])


def run_events(robot: Robot, voltage: np.ndarray, dt: float) -> np.ndarray:
    """Twist at every sample, from event to event in plain Python, from rest. Shape (n + 1, 3)."""
    system = state_space(robot)
    out = np.zeros((len(voltage) + 1, 3))
    for axis in range(3):
        a, c, v = -float(system.A[axis, axis]), -float(system.K[axis, axis]), 0.0
        for k, g in enumerate((voltage @ system.B[axis]).tolist()):
            left = dt
            while left > 0.0 and (v != 0.0 or abs(g) > c):
                side = math.copysign(1.0, v if v != 0.0 else g)
                end = (g - side * c) / a
                late = end + (v - end) * math.exp(-a * left)
                if v == 0.0 or late * side > 0.0:
                    v = late
                    break
                left -= math.log1p(-v / end) / a
                v = 0.0
            out[k + 1, axis] = v
    return out


def most_likely(robot: Robot, log: Run) -> np.ndarray:
    """The six numbers at the maximum of the likelihood, by `run_events` and scipy."""
    true = np.array(list(truth(robot).values()))
    residual = residuals(robot, log, run_events)
    found = least_squares(lambda scaled: residual(scaled * true), np.ones(6), "3-point", diff_step=1e-5, xtol=1e-12)
    return found.x * true


def residuals(robot: Robot, log: Run, simulate: Callable[..., np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
    """Six numbers -> (measured - simulated)/noise of all samples."""
    assert log.voltage is not None
    voltage, twist = log.voltage[:-1], log.twist

    def residual(values: np.ndarray) -> np.ndarray:
        return ((twist - simulate(with_friction(robot, np.maximum(values, 0.0)), voltage, 1.0 / RATE)) / NOISE).ravel()

    return residual


def by_tanh(robot: Robot, voltage: np.ndarray, dt: float) -> np.ndarray:
    """Twist by LSODA with sgn v smoothed, no step longer than a row."""
    return run_tanh(robot, voltage, dt, EPS, RTOL, max_step=dt)


def by_least_squares(robot: Robot, log: Run) -> np.ndarray:
    """scipy's least_squares on solve_ivp."""
    start, residual = np.array(list(truth(robot).values())), residuals(robot, log, by_tanh)
    return least_squares(lambda scaled: residual(scaled * start), np.ones(6), diff_step=1e-4).x * start


def by_lmfit(robot: Robot, log: Run) -> np.ndarray:
    """lmfit's least_squares on solve_ivp, as its documentation writes it."""
    lmfit: Any = importlib.import_module("lmfit")
    residual, parameters = residuals(robot, log, by_tanh), lmfit.Parameters()
    for k, value in enumerate(truth(robot).values()):
        parameters.add(f"p{k}", value, min=0.0)

    def of(at: Any) -> np.ndarray:
        return np.array([at[f"p{k}"].value for k in range(6)])

    return of(lmfit.minimize(lambda at: residual(of(at)), parameters, method="least_squares", diff_step=1e-4).params)


def by_sysid(robot: Robot, log: Run, fair: bool) -> np.ndarray:
    """mujoco.sysid on three joints with damping (back-EMF and viscous) and frictionloss (coulomb).

    It divides each residual by the norm of its measurement after the weights. Its user writes 1/sigma; `fair` writes
    norm/sigma, so that maximum likelihood is what it looks for.
    """
    mujoco, sysid = (importlib.import_module(name) for name in ("mujoco", "mujoco.sysid"))
    assert log.voltage is not None
    assert log.twist is not None
    start, rows = np.array(list(truth(robot).values())), round(1.0 / RATE / STEP)
    system, mass = state_space(robot), axis_masses(robot)
    braking = -np.diag(system.A) * mass - start[:3]  # back-EMF
    friction = JOINT.format(2.0 * STEP)
    spec = mujoco.MjSpec.from_string(
        XML.format(
            step=STEP,
            bodies="".join(BODY.format(k=k, mass=mass[k], friction=friction) for k in range(3)),
            motors="".join(f'<motor name="m{k}" joint="j{k}"/>' for k in range(3)),
            sensors="".join(f'<jointvel name="s{k}" joint="j{k}"/>' for k in range(3)),
        )
    )
    parameters = sysid.ParameterDict()
    for k, key in enumerate(BOX):
        parameters.add(
            sysid.Parameter(
                key,
                nominal=start[k],
                min_value=0.0,
                max_value=5.0 * start[k],
                modifier=put_friction(k, braking),
            )
        )
    for k in range(6):
        parameters[BOX[k]].modifier(spec, parameters[BOX[k]])
    model = spec.compile()
    data = mujoco.MjData(model)
    force = np.repeat(log.voltage[:-1] @ system.B.T * mass, rows, axis=0)
    control = sysid.TimeSeries(np.arange(len(force) + 1) * STEP, np.vstack([force, force[-1]]))
    measured = sysid.TimeSeries.from_names(log.t, log.twist, model)
    state = sysid.create_initial_state(model, data.qpos, data.qvel, data.act)
    norm = np.linalg.norm(log.twist, axis=0) if fair else np.ones(3)
    residual = sysid.build_residual_fn(
        models_sequences=[sysid.ModelSequences("robot", spec, "log", state, control, measured)],
        sensor_weights={f"s{k}": float(norm[k] / NOISE[k]) for k in range(3)},
    )
    with contextlib.redirect_stdout(io.StringIO()):  # it talks whatever `verbose` says
        found, _ = sysid.optimize(initial_params=parameters, residual_fn=residual, optimizer="mujoco", verbose=False)
    return np.array(found.as_vector())


def put_friction(k: int, braking: np.ndarray) -> Callable[[Any, Any], None]:
    """What writes number k of BOX into a model: damping of joint k, or frictionloss of joint k - 3."""

    def put(spec: Any, number: Any) -> None:
        joint, value = spec.joint(f"j{k % 3}"), float(number.value[0])
        if k < 3:
            joint.damping = np.array([braking[k] + value, 0.0, 0.0]).reshape(np.shape(joint.damping))
        else:
            joint.frictionloss = value

    return put
