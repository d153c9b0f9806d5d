"""Ramps of the motor of bench_motor.py, and how many intervals of its starts, stops and lines hold the truth."""

import numpy as np

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import MotorLine
from omnidyn.run import Run
from tests.support.bench_motor import BenchMotor, encoder, ramps

DT = 0.01
PEAKS = (3.0, -3.0, 3.0, -3.0)


def bench(motor=BenchMotor(), seed=0, noise=0.05, ticks=0, rate=0.8, peaks=PEAKS):  # noqa: B008
    """(run, stops): ramps up and down, either way, of a height and rate of their own."""
    rng = np.random.default_rng(seed)
    t, put_in = ramps([peak * rng.uniform(0.8, 1.2) for peak in peaks], rate * rng.uniform(0.7, 1.3), DT)
    speed, angle, _, stops = motor.turn(t, put_in)
    speed = encoder(t, angle, ticks) if ticks else speed + noise * rng.standard_normal(len(t))
    return Run(t=t, voltage=put_in[:, None], wheel_speed=speed[:, None], source="bench.csv"), stops


def both_ways(study):
    assert [each.direction for each in study.starts] == ["+", "-"]
    return study.starts


def held_of(motor, seed, names=("start",), **how):
    """name -> whether the interval holds the truth, of each direction of a draw."""
    run, stops = bench(motor, seed, **how)
    held = {name: [] for name in names}
    for each, hold, slide in zip(
        both_ways(identify([run], None, MotorLine()).study), motor.hold, motor.slide, strict=True
    ):
        rest = np.mean([side * put_in for side, put_in in stops if side == each.side])
        true = {"start": hold, "stop": rest, "slope": motor.slope, "offset": slide}
        true["lag"] = motor.inertia / motor.slope
        for name in names:
            low, high = each.ci95[name]
            held[name].append(bool(low - 1e-9 <= true[name] <= high + 1e-9))
    return held


def coverage(cases, draws, names=("start",), **how):
    """Share of the intervals that hold the truth: all names, directions and draws."""
    found = [held_of(motor, seed, names, **how) for motor in cases for seed in range(draws)]
    return {name: np.mean([each[name] for each in found]) for name in names}


ALL = ("start", "stop", "slope", "offset", "lag")
STICKY, EQUAL = BenchMotor(), BenchMotor(hold=(0.4, 0.55))
