"""Numbers while a robot drives: do their intervals hold at the end and where Live says "enough", are they those of the
whole fit, and how often is "enough" too early, beside the rules of PX4 and of WPILib on the same runs?

The paper's robot and a four-wheel robot, by simulators that share no code with omnidyn: `moved`, exact between stops,
and benchmarks/ten_robots/world.py. Truth: a latency of 20 ms, a push, friction half of what the file says.
"""

from __future__ import annotations

import dataclasses
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import lfilter

import omnidyn
from benchmarks.identification import ordinary, ordinary_robots
from benchmarks.size import WHOLE, scaled
from benchmarks.table import Table, machine, one_core
from benchmarks.ten_robots.robots import Sensors, cases, write_log
from benchmarks.ten_robots.score import truths
from omnidyn.cli import main
from omnidyn.identification.live.rows import part
from omnidyn.identification.output_error.fit import Fit
from omnidyn.model.keys import BOX, Key
from tests.support.axebot_logs import NOISE, TRUTH, voltages, with_friction

Array = np.ndarray[Any, Any]
RUNS, BATCH, ORDINARY = scaled(100, 1), scaled(14, 1), scaled(4, 1)  # of each noise; of these beside the whole fit
LOOPED = scaled(10, 1)
SECONDS, RATE = 60.0, 100.0
LATE, PUSH = 2, np.array([0.15, -0.1, 0.01])  # rows, and [N, N, N m]
WITHIN = 0.15  # half an interval that is enough
TOO_FAR = 2.0  # times that: "enough" was false where a number is further off
MEMORY, COUNTS = 0.9, 4096
RESISTANCE, MASS, INERTIA, RADIUS, REACH, TORQUE, GEAR = 1.69, 1.5, 0.025, 0.035, 0.1, 0.0059, 19.0  # Table 3
AZIMUTH = np.deg2rad([180.0, -60.0, 60.0])
WRENCH = np.stack([-np.sin(AZIMUTH), np.cos(AZIMUTH), np.full(3, REACH)])  # wrench of unit forces at the rims
PULL = GEAR * TORQUE / (RESISTANCE * RADIUS)  # [N/V]
LOSS = (GEAR * TORQUE / RADIUS) ** 2 / RESISTANCE * np.einsum("ai,ai->a", WRENCH, WRENCH)  # back-EMF as friction
VISCOUS, COULOMB = np.array([0.94, 0.96, 0.01]), np.array([2.2, 1.5, 0.099])
KINDS = ("white", "AR(1) 0.9", "encoder differences")
NUMBERS = {"motor.resistance_ohm": RESISTANCE, "push.x": PUSH[0], "push.y": PUSH[1], "push.yaw": PUSH[2], **TRUTH}
Z_LIMIT = 5.0


def moved(volts: Array, rate: float = RATE) -> tuple[Array, Array]:
    """(twist, angles of the wheels) of many robots at once, shape (rows + 1, runs, 3), from rest.

    Per axis M dv/dt = F - B v - C sgn v, each row exactly, stops and reversals within it too.
    """
    mass = np.array([MASS, MASS, INERTIA])
    rates = (VISCOUS + LOSS) / mass
    v = np.zeros((volts.shape[1], 3))
    way, twist, angle = v.copy(), [v], [v]
    for u in volts:
        drive = (PULL * u @ WRENCH.T + PUSH) / mass
        side = np.where(v != 0.0, np.sign(v), np.sign(drive) * (np.abs(drive) > COULOMB / mass))
        left = np.full(v.shape, 1.0 / rate)
        for _ in range(2):  # up to where it stops, and from there
            end = np.where(side == 0.0, 0.0, (drive - side * COULOMB / mass) / rates)
            turns = (side != 0.0) & (v != 0.0) & (end * side < 0.0)
            stop = np.log((v - end) / np.where(turns, -end, 1.0), where=turns, out=np.full(v.shape, np.inf)) / rates
            span = np.minimum(left, stop)
            decay = np.exp(-rates * span)
            way = way + np.where(side == 0.0, 0.0, end * span + (v - end) * (1.0 - decay) / rates)
            v = np.where((side == 0.0) | (stop <= left), 0.0, end + (v - end) * decay)
            left = left - span
            side = np.where(stop <= span, np.sign(drive) * (np.abs(drive) > COULOMB / mass), side)
        twist.append(v)
        angle.append(way @ WRENCH / RADIUS)
    return np.array(twist), np.array(angle)


def logs(kind: str, numbers: range, seconds: float = SECONDS, rate: float = RATE) -> list[omnidyn.Run]:
    """A log of each number, all that is measured LATE rows late."""
    volts = [voltages(np.random.default_rng(7000 + number), seconds, rate) for number in numbers]
    twist, angle = moved(np.stack(volts, axis=1), rate)
    late = round(LATE * rate / RATE)
    made = []
    for k, number in enumerate(numbers):
        rng = np.random.default_rng([number, KINDS.index(kind)])
        u = np.concatenate([volts[k], volts[k][-1:]])
        t = np.arange(len(u)) / rate
        v, turned = (np.concatenate([np.repeat(x[:1, k], late, axis=0), x[: len(u) - late, k]]) for x in (twist, angle))
        if kind == "encoder differences":
            tick = 2.0 * np.pi / COUNTS
            counts = np.floor(turned / tick + rng.random(3))
            speed = np.diff(counts, axis=0, prepend=counts[:1]) * tick * rate
            made.append(omnidyn.Run(t=t, voltage=u, wheel_speed=speed))
            continue
        noise = rng.normal(size=v.shape) * NOISE
        if kind != "white":
            noise = lfilter([np.sqrt(1.0 - MEMORY**2)], [1.0, -MEMORY], noise, axis=0)
        made.append(omnidyn.Run(t=t, voltage=u, twist=v + noise))
    return made


class Regression:
    """What others do on the robot: dv/dt against (drive, v, sgn v) of each axis, by least squares of all rows so far.

    "Enough" by PX4 (mc_autotune_attitude_control): the variance of each coefficient, white noise assumed, is below a
    threshold, here that of our own half interval. By WPILib (SysId): the velocity simulated with the coefficients
    explains 0.9 of the variance of the measured one.
    """

    def __init__(self, run: omnidyn.Run) -> None:
        self.dt = float(run.t[1])
        twist = run.twist if run.twist is not None else run.wheel_speed @ np.linalg.pinv(WRENCH) * RADIUS
        window = np.ones(5) / 5.0  # rows that SysId and PX4 filter over
        self.twist = np.stack([np.convolve(column, window, "same") for column in twist.T], axis=1)
        self.drive = run.voltage @ WRENCH.T * PULL

    def stops(self, rows: int) -> tuple[bool, bool, bool]:
        """(PX4's rule, WPILib's, whether a coefficient is further off than "enough" promises, twice) after so many
        rows."""
        calm, agrees, is_far = True, True, False
        for axis, mass in enumerate((MASS, MASS, INERTIA)):
            v, force = self.twist[:rows, axis], self.drive[:rows, axis]
            rate = np.gradient(v, self.dt)
            moves = np.abs(v) > 2.0 * NOISE[axis]
            design = np.stack([force, v, np.sign(v)], axis=1)[moves]
            if len(design) < 50:
                return False, False, True
            theta, *_ = np.linalg.lstsq(design, rate[moves], rcond=None)
            error = rate[moves] - design @ theta
            std = np.sqrt(error.var() * np.diag(np.linalg.pinv(design.T @ design)))
            truth = np.array([1.0, -(VISCOUS + LOSS)[axis], -COULOMB[axis]]) / mass
            is_far |= bool((np.abs(theta / truth - 1.0) > TOO_FAR * WITHIN).any())
            calm &= bool((1.96 * std < WITHIN * np.abs(theta)).all())
            simulated, state = np.zeros(rows), 0.0
            for k in range(1, rows):
                side = np.sign(state) if state else np.sign(force[k - 1])
                new = state + self.dt * (theta[0] * force[k - 1] + theta[1] * state + theta[2] * side)
                held = state == 0.0 and abs(theta[0] * force[k - 1]) <= abs(theta[2])
                state = 0.0 if held or new * side < 0.0 else new
                simulated[k] = state
            agrees &= bool(1.0 - (v - simulated).var() / max(v.var(), 1e-12) > 0.9)
        return calm, agrees, is_far


def far(values: dict[str, float]) -> bool:
    """Whether any of the six friction numbers is off by more than "enough" promises, twice."""
    return any(abs(values[name] / TRUTH[name] - 1.0) > TOO_FAR * WITHIN for name in BOX)


def errors(number: Any, truth: float) -> float:
    """Standard errors from the truth, of which half an interval has 1.96."""
    return 1.96 * (number.value - truth) / (0.5 * (number.high - number.low))


def z_of(live: omnidyn.Live, status: Any) -> dict[str, tuple[float, bool]]:
    """Number -> (standard errors from the truth, whether the interval holds it)."""
    channel = next(name for name in status.numbers if name.startswith("latency"))
    truth = NUMBERS | {channel: LATE / RATE}
    return {
        name: (errors(number, truth[name]), number.low <= truth[name] <= number.high)
        for name, number in status.numbers.items()
        if not number.is_unknown
    }


def measure() -> Table:
    """All of it, minutes of processor time."""
    table = Table(
        "live: numbers while the robot drives",
        ["what", "runs", "hold at the end %", "hold at the stop %", "largest z", "false enough %", "stopped %",
         "stop s", "near the whole fit %", "while driving %", "another start %", "cpu % of a core"],
    )  # fmt: skip
    table.notes += [
        machine(),
        "the truth is by a simulator of this benchmark; start: friction 2 x wrong, resistance right, 60 s at 100 Hz",
        f"enough: all 7 numbers within {100 * WITHIN:.0f} %; false: one of friction further off than twice that",
        "PX4 and WPILib: their rules on a regression of accelerations of the same runs, see Regression",
        "near: share of numbers within 0.3 standard errors of the fit of the whole log, after `finish` and before it;"
        " another start: so near is that fit itself, begun at the truth",
    ]
    robot = omnidyn.load_robot("axebot")
    wrong = with_friction(robot, [2.0 * value for value in TRUTH.values()])
    rival_stops: dict[str, list[tuple[float, bool]]] = {"PX4: variance": [], "WPILib: R2": []}
    held_total: list[bool] = []
    for kind in KINDS:
        end, stop, near, driving, restarted, false, stopped, cost, largest = [], [], [], [], [], [], [], 0.0, 0.0
        for number, log in enumerate(logs(kind, range(RUNS))):
            live, at_stop = omnidyn.Live(wrong, within=WITHIN), None
            begun = time.process_time()
            for first in range(0, len(log), 100):
                status = live.add(part(log, first, min(first + 100, len(log))))
                if status.is_enough and at_stop is None:
                    at_stop = status
            cost += time.process_time() - begun
            found = z_of(live, status)
            end += [holds for _, holds in found.values()]
            largest = max(largest, *(abs(z) for z, _ in found.values()))
            if at_stop is not None:
                found = z_of(live, at_stop)
                stop += [holds for _, holds in found.values()]
                largest = max(largest, *(abs(z) for z, _ in found.values()))
                stopped.append(at_stop.enough_at)
                false.append(far({name: at_stop.numbers[name].value for name in BOX}))
            if number < BATCH:
                finished = live.finish().numbers
                fit = Fit.of([log], wrong, live.method)
                solution = fit.weighed(fit.solve()).solution
                names, point = solution.solver.problem.names, solution.state.point
                late = [NUMBERS.get(name, LATE / RATE) for name in names]  # the truth
                other = solution.solver.minimise(dataclasses.replace(point, values=np.array(late))).state.point
                for name, whole, again in zip(names, point.values.tolist(), other.values.tolist(), strict=True):
                    limit = 0.3 * finished[name].std
                    near.append(abs(finished[name].value - whole) <= limit)
                    driving.append(abs(status.numbers[name].value - whole) <= limit)
                    restarted.append(abs(again - whole) <= limit)
            regression, done = Regression(log), set()
            for rows in range(500, len(log), 500):
                *rules, is_far = regression.stops(rows)
                for name, is_done in zip(rival_stops, rules, strict=True):
                    if is_done and name not in done:
                        done.add(name)
                        rival_stops[name].append((rows / RATE, is_far))
                if len(done) == len(rival_stops):
                    break
        held_total += end
        lowest = 92.0 if WHOLE else 80.0
        shares = [100.0 * float(np.mean(x)) if x else None for x in (end, stop, near, false, driving, restarted)]
        met = all(x is None or lowest <= x <= 98.0 for x in shares[:2]) and largest <= Z_LIMIT
        met &= (shares[2] is None or shares[2] >= 95.0) and (shares[3] is None or shares[3] <= 2.0)
        cells = {
            "runs": RUNS, "hold at the end %": shares[0], "hold at the stop %": shares[1], "largest z": largest,
            "near the whole fit %": shares[2], "while driving %": shares[4], "another start %": shares[5],
            "false enough %": shares[3], "stopped %": 100.0 * len(stopped) / RUNS,
            "stop s": float(np.median(stopped)) if stopped else None, "cpu % of a core": 100.0 * cost / RUNS / SECONDS,
        }  # fmt: skip
        table.add("92 to 98 %, z <= 5, false <= 2 %, near >= 95 %", met, what=kind, **cells)
    for name, found_stops in rival_stops.items():
        wrong_stops = 100.0 * float(np.mean([is_far for _, is_far in found_stops])) if found_stops else None
        seconds = float(np.median([at for at, _ in found_stops])) if found_stops else None
        stopped_share = 100.0 * len(found_stops) / (RUNS * len(KINDS))
        table.add(
            what=name, runs=RUNS * len(KINDS),
            **{"false enough %": wrong_stops, "stop s": seconds, "stopped %": stopped_share},
        )  # fmt: skip
    _ordinary(table)
    _looped(table)
    for kind in KINDS[:2]:
        table.add("<= 10 %", (share := fast(kind, wrong)) <= 10.0, what=f"1 kHz, {kind}", **{"cpu % of a core": share})
    return table


def _ordinary(table: Table) -> None:
    """Four wheels by duty: counts, a camera of 33 Hz that is 40 ms late, a robot file as `init` guesses it."""
    robot = dataclasses.replace(ordinary_robots.robots()[0], sensors=Sensors(counts=2048, capture=(0.003, 0.004)))
    held, largest, far_off, stopped, cost, seconds = [], 0.0, 0, 0, 0.0, 30
    for seed in range(1, 1 + ORDINARY):
        with tempfile.TemporaryDirectory() as folder:
            path, file = Path(folder, "log.csv"), Path(folder, "robot.toml")
            ordinary_robots.write_log(robot, seed, path)
            ordinary.initial(robot, file)
            model = omnidyn.load_robot(file)
            run = omnidyn.read_log(path, model, assume={"a": "ticks/2048"})
        supply = robot.world.voltage_limit
        true = ordinary.true_model(robot, model)
        model = model.replace(drive=model.drive.replace(kind="duty", supply=supply))
        pose = np.full_like(run.pose, np.nan)
        pose[4::3] = run.pose[:-4][::3]
        log = omnidyn.Run(
            t=run.t, duty=run.voltage / supply, supply=np.full(len(run), supply), wheel_angle=run.wheel_angle, pose=pose
        )
        live, begun = omnidyn.Live(model), time.process_time()
        for first in range(0, round(seconds * RATE), 100):
            status = live.add(part(log, first, first + 100))
        cost += time.process_time() - begun
        stopped += status.is_enough
        late = {"latency.position": 0.04, "latency.heading": 0.04, "latency.wheel_angle": 0.0}
        for name, number in status.numbers.items():
            if number.is_unknown or "rotor" in name:  # which the world does not have
                continue
            truth = 0.0 if name.startswith("push") else late.get(name)
            truth = Key.parse(name).get(true) if truth is None else truth
            held.append(number.low <= truth <= number.high)
            largest = max(largest, abs(errors(number, truth)))
            far_off += number.within > 0.0 and abs(number.value / truth - 1.0) > TOO_FAR * number.within
    table.add(
        what="four wheels by duty, counts, a late camera", runs=ORDINARY,
        **{
            "hold at the end %": 100.0 * float(np.mean(held)), "largest z": largest,
            "stopped %": 100.0 * stopped / ORDINARY, "cpu % of a core": 100.0 * cost / ORDINARY / seconds,
            "false enough %": 100.0 * far_off / max(len(held), 1),
        },
    )  # fmt: skip
    table.notes.append(
        "four wheels: of 30 s, by benchmarks/ten_robots/world.py; what a guess leaves unknown is not counted"
    )


def _looped(table: Table) -> None:
    """Four wheels behind a loop of 100 Hz, logged at 33 Hz: set speeds, speeds, currents; a file of `init`."""
    case = dataclasses.replace(next(case for case in cases() if case.name == "firmware"), seconds=40.0)
    held, largest, stopped, cost = [], 0.0, 0, 0.0
    with tempfile.TemporaryDirectory() as folder:
        path, file = Path(folder, "log.csv"), Path(folder, "robot.toml")
        assert main(["init", "mine", *case.init, "-o", str(file)]) == 0
        model = omnidyn.load_robot(file)
        for seed in range(LOOPED):
            write_log(case, seed, path)
            log = omnidyn.read_log(path, model)
            live, begun = omnidyn.Live(model), time.process_time()
            for first in range(0, len(log), 33):
                status = live.add(part(log, first, min(first + 33, len(log))))
            cost += time.process_time() - begun
            stopped += status.is_enough
            truth = truths(case.world, live.robot_now, True)
            for name, number in status.numbers.items():
                if not number.is_unknown and truth.get(name):
                    held.append(number.low <= truth[name] <= number.high)
                    largest = max(largest, abs(errors(number, truth[name])))
    table.add(
        "92 to 100 %, z <= 5", float(np.mean(held)) >= 0.92 and largest <= Z_LIMIT,
        what="four wheels behind a speed loop", runs=LOOPED,
        **{
            "hold at the end %": 100.0 * float(np.mean(held)), "largest z": largest,
            "stopped %": 100.0 * stopped / LOOPED, "cpu % of a core": 100.0 * cost / LOOPED / case.seconds,
        },
    )  # fmt: skip
    table.notes.append("behind a speed loop: 40 s, by the same simulator; what a guess leaves unknown is not counted")


def fast(kind: str, robot: omnidyn.Robot, seconds: float = 120.0) -> float:
    """Share of a core at 1 kHz in the first two minutes [%], whole fits among them."""
    log = logs(kind, range(1), seconds, 1000.0)[0]
    live = omnidyn.Live(robot)
    with one_core():
        begun = time.process_time()
        for first in range(0, len(log), 100):
            live.add(part(log, first, min(first + 100, len(log))))
        return 100.0 * (time.process_time() - begun) / seconds
