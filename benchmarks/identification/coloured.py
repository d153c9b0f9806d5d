"""Errors with a memory: what intervals hold, and how near the estimate comes to the Cramer-Rao bound of that noise.

One log of 30 s at 100 Hz a draw, its noise drawn anew from its seed; the bound from finite differences of `simulate`
and the covariance of the noise, which share no code with the fit. Beside each the same by the sandwich.
The bound is that of a straight line through the truth. A robot that stops and goes bends: beside a memory of .9 stand
what the likelihood of the *true* covariance has at its peak, found by scipy, and the fit where noise is a tenth of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.optimize import least_squares
from scipy.signal import lfilter

from benchmarks.identification.identify_log import COUNTING, Draws
from benchmarks.size import WHOLE, scaled
from benchmarks.table import Table
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, truth, voltages, with_friction

LOGS = scaled(500, 10)
RATE, SECONDS = 100.0, 30.0
MEMORIES = (0.5, 0.9, 0.95, 0.98)
STD = {"twist": NOISE, "wheel_speed": np.full(3, 0.5)}  # [m/s, rad/s]
SETTLE = 3000  # rows before the log, in which a filter forgets how it began
TICK = 2.0 * np.pi / 1216.0  # [rad] of 64 counts on the motor, 19 to 1
FINE = 10  # steps in a row, of the angles that are counted
FLOOR = 0.1  # of the std, that is white beside what is filtered
STEP = 1e-4  # of a number, relative, for derivatives
LEAST, NEAR = 0.92, 1.10  # goals
LOOKED_AT, QUIET = 0.9, 0.1  # the memory at which the peak is found too; a share of the noise at which nothing bends


@dataclass(frozen=True)
class Colour:
    """A noise of variance 1: white noise through b/a, and `floor` of the std beside it that is white.

    A filter alone may leave nothing at some frequency, where its bound would be all but 0; a sensor's never is.
    """

    name: str
    b: np.ndarray
    a: np.ndarray
    floor: float = 0.0

    def draw(self, rng: np.random.Generator, rows: int) -> np.ndarray:
        """Shape (rows, 3)."""
        noise = lfilter(self.b, self.a, rng.normal(size=(SETTLE + rows, 3)), axis=0)[SETTLE:] / np.sqrt(self.power)
        return np.sqrt(1.0 - self.floor**2) * noise + self.floor * rng.normal(size=(rows, 3))

    @property
    def response(self) -> np.ndarray:
        """To one impulse, until it is forgotten."""
        return np.asarray(lfilter(self.b, self.a, np.eye(1, SETTLE)[0]))

    @property
    def power(self) -> float:
        return float((self.response**2).sum())

    def lags(self, rows: int) -> np.ndarray:
        """Autocovariance of rows 0 to rows - 1 apart."""
        found = np.correlate(self.response, self.response, "full")[SETTLE - 1 :] / self.power * (1.0 - self.floor**2)
        found[0] = 1.0
        return np.concatenate([found, np.zeros(max(rows - SETTLE, 0))])[:rows]


def colours() -> list[Colour]:
    """Autoregressions of order 1, and what filters of the speed make."""
    first = [Colour(f"AR(1) {m:g}", np.ones(1), np.array([1.0, -m])) for m in MEMORIES]
    pole = np.exp(-2.0 * np.pi * 15.0 / RATE)
    mean = Colour("mean of 5 rows", np.full(5, 0.2), np.ones(1), FLOOR)
    return [*first, mean, Colour("low-passed twice, 15 Hz", np.ones(1), np.array([1.0, -2.0 * pole, pole**2]), FLOOR)]


def bound(robot: Robot, clean: Run, output: str, lags: np.ndarray) -> np.ndarray:
    """Least standard errors of any unbiased fit. lags: autocovariance of the noise of variance 1. Shape (6,)."""
    assert clean.voltage is not None
    values = np.array(list(truth(robot).values()))
    slopes = []
    for j, value in enumerate(values):
        ends = []
        for side in (1.0, -1.0):
            moved = values.copy()
            moved[j] = value * (1.0 + side * STEP)
            run = simulate(with_friction(robot, moved), clean.voltage[:-1], 1.0 / RATE)
            ends.append(getattr(run, output))
        slopes.append((ends[0] - ends[1]) / (2.0 * STEP * value))
    information = np.zeros((6, 6))
    for c, std in enumerate(STD[output]):
        j = np.stack([slope[:, c] for slope in slopes], axis=1) / std
        information += j.T @ solve_toeplitz(lags, j)
    return np.sqrt(np.diag(np.linalg.inv(information)))


def measure_case(
    table: Table,
    robot: Robot,
    name: str,
    output: str,
    log: Callable[[int], Run],
    least: np.ndarray,
    goals: bool,
    nuisances: tuple[str, ...] = (),
) -> None:
    """One kind of noise: by default, and by the sandwich."""
    for kind in ("sandwich", "auto"):
        draws, chosen = Draws(truth(robot)), 0
        for seed in range(LOGS):
            fit = identify(log(seed), robot, OutputError(start="rest", covariance=kind, nuisances=nuisances)).estimate
            draws.add(fit)
            chosen += fit.covariance == "autoregressive"
        spread = np.sqrt(np.mean(np.array(draws.error) ** 2, axis=0)) / least
        held, std = float(draws.coverage.mean()), float(np.sqrt(np.mean(spread**2)))
        slack = 0.0 if WHOLE else COUNTING * np.sqrt(0.95 * 0.05 / (2.0 * LOGS))
        spare = 0.0 if WHOLE else COUNTING / np.sqrt(4.0 * LOGS)
        asked = goals and kind == "auto"
        table.add(
            f">= {LEAST}, <= {NEAR}" if asked else "",
            bool(held >= LEAST - slack and std <= NEAR + spare) if asked else None,
            noise=name,
            output=output,
            intervals=kind,
            logs=LOGS,
            coverage=held,
            least=float(draws.coverage.min()),
            **{
                "std/bound": std,
                "greatest": float(spread.max()),
                "stated/bound": float(np.median(np.array(draws.std) / least)),
                "autoregressive": chosen / LOGS,
            },
        )


def measure_peak(
    table: Table, robot: Robot, name: str, output: str, log: Callable[[int], Run], least: np.ndarray
) -> None:
    """What no estimate by least squares is nearer than: the peak of the likelihood of this autoregression, from the
    fit."""
    true, errors = np.array(list(truth(robot).values())), []
    spread = STD[output] * np.sqrt(1.0 - LOOKED_AT**2)
    for seed in range(LOGS):
        run = log(seed)
        measured, volts = getattr(run, output), run.voltage
        assert volts is not None

        def misses(share: np.ndarray, measured: np.ndarray = measured, volts: np.ndarray = volts) -> np.ndarray:
            moved = getattr(simulate(with_friction(robot, share * true), volts[:-1], 1.0 / RATE), output)
            left = measured - moved
            first = left[:1] * np.sqrt(1.0 - LOOKED_AT**2)
            return (np.concatenate([first, left[1:] - LOOKED_AT * left[:-1]]) / spread).ravel()

        fit = identify(run, robot, OutputError(nuisances=(), start="rest")).estimate
        begin = np.array([fit.value[key] for key in truth(robot)]) / true
        found = least_squares(misses, begin, diff_step=STEP, x_scale=least / true, xtol=1e-10, ftol=1e-12)
        errors.append((found.x * true - true) / least)
    size = np.sqrt(np.mean(np.array(errors) ** 2, axis=0))
    table.add(
        "",
        None,
        noise=name,
        output=output,
        intervals="peak of the true likelihood",
        logs=LOGS,
        **{"std/bound": float(np.sqrt(np.mean(size**2))), "greatest": float(size.max())},
    )


def counted(robot: Robot, voltage: np.ndarray) -> Callable[[int], Run]:
    """Logs of speeds from counts: what a firmware makes of two angles, each rounded to a tick from any phase."""
    fine = simulate(robot, np.repeat(voltage, FINE, axis=0), 1.0 / (RATE * FINE))
    assert fine.wheel_speed is not None
    assert fine.voltage is not None
    volts = fine.voltage[::FINE]
    steps = 0.5 * (fine.wheel_speed[1:] + fine.wheel_speed[:-1]) / (RATE * FINE)
    angle = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])[::FINE]

    def log(seed: int) -> Run:
        phase = np.random.default_rng(seed).uniform(size=3)
        ticks = np.floor(angle / TICK + phase)
        speed = np.vstack([np.zeros(3), np.diff(ticks, axis=0) * TICK * RATE])
        return Run(t=fine.t[::FINE], voltage=volts, wheel_speed=speed, source="counted")

    return log


def measure() -> Table:
    columns = [
        "noise",
        "output",
        "intervals",
        "logs",
        "coverage",
        "least",
        "std/bound",
        "greatest",
        "stated/bound",
        "autoregressive",
    ]
    table, robot = Table("Errors with a memory: 30 s at 100 Hz", columns), load_robot("axebot")
    clean = simulate(robot, voltages(np.random.default_rng(11), SECONDS, RATE), 1.0 / RATE)
    assert clean.voltage is not None
    for output in ("wheel_speed", "twist"):
        for colour in colours():
            values = getattr(clean, output)

            def log(
                seed: int,
                colour: Colour = colour,
                output: str = output,
                values: np.ndarray = values,
                share: float = 1.0,
            ) -> Run:
                noise = share * colour.draw(np.random.default_rng(seed), len(clean)) * STD[output]
                return Run(t=clean.t, voltage=clean.voltage, source="simulated", **{output: values + noise})

            least = bound(robot, clean, output, colour.lags(len(clean)))
            measure_case(table, robot, colour.name, output, log, least, colour.name.startswith("AR"))
            if colour.name == f"AR(1) {LOOKED_AT:g}":
                measure_peak(table, robot, colour.name, output, log, least)
                quiet = partial(log, share=QUIET)
                measure_case(table, robot, f"{colour.name}, a tenth", output, quiet, QUIET * least, False)
    rounding = (
        np.concatenate([[1.0, -0.5], np.zeros(len(clean) - 2)]) * TICK**2 / 6.0 * RATE**2 / STD["wheel_speed"][0] ** 2
    )
    measure_case(
        table,
        robot,
        "differenced counts",
        "wheel_speed",
        counted(robot, clean.voltage[:-1]),
        bound(robot, clean, "wheel_speed", rounding),
        False,
        nuisances=("latency.wheel_speed",),
    )
    table.notes += [
        "coverage: of all six 95 % intervals together; least: of the worst of them. std: root mean square error, over "
        "the Cramer-Rao bound of noise of that covariance; stated: what the fit says, in the median",
        "the bound of differenced counts takes their rounding as even noise, without the latency that is fitted there",
    ]
    return table
