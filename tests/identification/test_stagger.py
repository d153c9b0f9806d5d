"""Fits of logs whose channels share no stamps: the numbers of equal stamps, within a quarter of their interval."""

import numpy as np
import pytest

from benchmarks.logs.stagger import OFF_NUMBER, apart, robot_of
from omnidyn import MotorLine, identify
from omnidyn.logs.read_log import read_log
from tests.support.cases import case
from tests.support.staggered import Logged, topics

SECONDS = 20.0


@pytest.mark.parametrize(
    ("number", "offset", "jitter"), [pytest.param(4, 3e-3, 0.0, marks=pytest.mark.long), (8, 20e-6, 1e-3)]
)
def test_whole_logs(tmp_path, number, offset, jitter):
    """Four topics; eight, of which each wheel has one."""
    equal = Logged.of(topics(number, 0.0, seconds=SECONDS), SECONDS).csv(tmp_path / "equal.csv")
    log = Logged.of(topics(number, offset, jitter, seconds=SECONDS), SECONDS).csv(tmp_path / "log.csv")
    assert apart(log, equal, robot_of(tmp_path)) < OFF_NUMBER


def bench(path, offset, rows=3000):
    """A motor of 0.02 V s/rad, 0.35 V and 120 ms: a voltage holds from k 20 ms on, the speed is seen so much later."""
    step, parts, h = 0.02, 40, 0.0005
    rng = np.random.default_rng(1)
    volts = np.repeat(np.round(rng.uniform(-5.0, 5.0, rows // 30), 2), 30)
    volts[:60] = 0.0
    speed, fine = 0.0, np.empty(rows * parts)
    for k, put_in in enumerate(np.repeat(volts, parts).tolist()):
        fine[k] = speed
        free = speed + h * (put_in - 0.02 * speed) / (0.02 * 0.12)
        friction = h * 0.35 / (0.02 * 0.12)
        speed = free - friction if free > friction else min(free + friction, 0.0)
    t = np.arange(rows) * step
    seen = np.interp(t + offset, np.arange(len(fine)) * h, fine) + 0.05 * rng.standard_normal(rows)
    lines = [(a, f"{a!r},{u!r},") for a, u in zip(t.tolist(), volts.tolist(), strict=True)]
    if offset:
        lines += [(a, f"{a!r},,{w!r}") for a, w in zip((t + offset).tolist(), seen.tolist(), strict=True)]
    else:
        lines = [(a, line + repr(w)) for (a, line), w in zip(lines, seen.tolist(), strict=True)]
    path.write_text("\n".join(["t_s,u1_V,w1_rad_s", *(line for _, line in sorted(lines))]) + "\n")
    return path


@pytest.mark.long
@pytest.mark.parametrize(("offset", "off"), [(3e-6, OFF_NUMBER), (3e-3, 0.5)])
def test_motors(tmp_path, offset, off):
    """Slope and dead band: off those of equal stamps by so much of their interval; steps come elsewhere in a row."""
    equal = identify([read_log(bench(tmp_path / "equal.csv", 0.0))], None, MotorLine()).motors[0]
    found = identify([read_log(bench(tmp_path / "log.csv", offset))], None, MotorLine()).motors[0]
    for name, truth in (("slope", 0.02), ("dead_band", 0.35)):
        low, high = equal.ci95[name]
        assert abs(found.value[name] - equal.value[name]) <= off * (high - low)
        assert found.ci95[name][0] <= truth <= found.ci95[name][1]
    assert found.value["lag"] == pytest.approx(equal.value["lag"], abs=0.003)


def test_the_case_of_a_motor_whose_values_are_appended_one_after_the_other():
    found = identify([read_log(case("logs/wpilog_stagger/gap3us.wpilog"))], None, MotorLine()).motors[0]
    assert found.value["slope"] == pytest.approx(0.0200, abs=0.0001)
    assert found.value["dead_band"] == pytest.approx(0.350, abs=0.002)
    assert found.ci95["dead_band"][0] <= 0.350 <= found.ci95["dead_band"][1]
