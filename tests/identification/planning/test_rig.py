"""A plan for one motor: what identify makes of its log, simulated by small steps, and what the plan promised."""

import numpy as np
import pytest

import omnidyn
from tests.support.pages import command

AXEBOT = omnidyn.load_robot("axebot")
SLOPE, LAG, FORWARD, BACKWARD, HOLD = (
    0.12,
    0.09,
    0.5,
    0.7,
    1.15,
)  # V s/rad, s, V: friction by direction; times that, at rest
FINE, NOISE = 50, 0.125


def bench(volts, dt, seed=0, bend=0.0):
    """A motor by Euler's steps of dt/50; bend: of a driver that passes on less and less of a larger input."""
    rng, top = np.random.default_rng(seed), 6.0
    speed, w = [0.0], 0.0
    for u in volts:
        u = np.sign(u) * top * np.expm1(-bend * abs(u) / top) / np.expm1(-bend) if bend else u
        for _ in range(FINE):
            if w == 0.0:
                if -HOLD * BACKWARD <= u <= HOLD * FORWARD:
                    break
                friction = FORWARD if u > 0.0 else -BACKWARD
            else:
                friction = FORWARD if w > 0.0 else -BACKWARD
            new = w + dt / FINE * (u - friction - SLOPE * w) / (SLOPE * LAG)
            w = 0.0 if w * new < 0.0 else new
        speed.append(w)
    t = np.arange(len(speed)) * dt
    noisy = np.array(speed)[:, None] + NOISE * rng.normal(size=(len(speed), 1))
    return omnidyn.Run(t=t, voltage=np.append(volts, volts[-1:])[:, None], wheel_speed=noisy)


@pytest.fixture(scope="module")
def made():
    return omnidyn.plan_rig(AXEBOT, 60.0, noise={"wheel_speed": NOISE})


@pytest.fixture(scope="module")
def study(made):
    log = bench(made.commands().voltage[:, 0], made.dt)
    return omnidyn.identify([log], None, omnidyn.MotorFit(nuisances=("offset",)))


def test_the_log_of_a_rig_tells_each_number_of_a_motor(study):
    motor = study.motors[0]
    offset, band = 0.5 * (FORWARD - BACKWARD), 0.5 * (FORWARD + BACKWARD)
    for name, truth in {"slope": SLOPE, "lag": LAG, "offset": offset, "dead_band": band}.items():
        assert abs(motor.value[name] - truth) < max(0.75 * (motor.ci95[name][1] - motor.ci95[name][0]), 5e-3 * band)
    for start, level in zip(study.starts, (HOLD * FORWARD, HOLD * BACKWARD), strict=True):
        low, high = start.ci95["start"]
        assert low - 0.02 <= level <= high + 0.02
        assert high - low < 0.15 * level


def test_what_it_promised_is_what_it_gets(made, study):
    assert not made.missing
    motor = study.motors[0]
    for name, key in {"gain": "slope", "lag": "lag"}.items():
        got = 0.5 * (motor.ci95[key][1] - motor.ci95[key][0]) / motor.value[key]
        half, worst = made.predicted[name]
        assert 0.4 * half < got < 2.5 * worst


def test_a_driver_that_is_no_line_is_seen(made):
    log = bench(made.commands().voltage[:, 0], made.dt, bend=3.0)
    study = omnidyn.identify([log], None, omnidyn.MotorFit(nuisances=("offset",)))
    assert len(study.curves) == 1


def test_the_command_writes_a_program_for_one_motor(tmp_path):
    out = tmp_path / "rig.csv"
    words = ("plan", "axebot", "--rig", "--time", "30", "--noise", f"wheel_speed={NOISE}", "-o", out)
    said, code, err = command(*words, "--json")
    assert code == 0, err
    assert set(said["rig"]) >= {"first motion forward", "stop backward", "gain", "lag", "driver curve"}
    assert (tmp_path / "rig.json").exists()
    rows = np.genfromtxt(out, delimiter=",", skip_header=1)
    assert rows.shape[1] == 2
    assert np.abs(rows[:, 1]).max() == pytest.approx(6.0)
    _, code, err = command(*words)
    assert code == 3
    assert "exists" in err
    _, code, err = command("plan", "axebot", "--rig", "--next")
    assert code == 3
    assert "--next is for a whole robot" in err


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"seconds": 1.0}, "seconds: out of range"),
        ({"rate": 1e6}, "rate: out of range"),
        ({"noise": {"twist": 0.1}}, "nothing is recorded of a wheel"),
    ],
)
def test_what_cannot_be_planned_for_a_motor_is_refused(wrong, words):
    with pytest.raises(omnidyn.OmnidynError, match=words):
        omnidyn.plan_rig(AXEBOT, **wrong)


def test_a_firmware_that_holds_speeds_is_refused_with_a_reason():
    with pytest.raises(omnidyn.OmnidynError, match="holds the speeds"):
        omnidyn.plan_rig(omnidyn.load_robot("lekiwi"))
