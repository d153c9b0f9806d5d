"""A driver with a dead band and a latency, and logs that show a robot late, beside a simulator that shares no code."""

import numpy as np
import pytest

import omnidyn
from benchmarks.wrong_worlds.log import robot_of
from benchmarks.wrong_worlds.world import World, drive
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage, moving_axes
from omnidyn.model.drive import Drive
from omnidyn.model.keys import Key
from omnidyn.model.log_effects import Lateness, LogEffects
from omnidyn.model.surroundings import Floor
from omnidyn.simulation.delays import clock
from omnidyn.simulation.sensitivity.derivatives import derivatives
from omnidyn.simulation.simulate import simulate

DEAD, LATE = 0.7, 0.0173
WORLD = World(dead=DEAD)
FRAME = World(dead=DEAD, frame=True)  # for the implicit engine


def robot(world=WORLD, **driver):
    exact = robot_of(world).replace(friction=omnidyn.load_robot("axebot").friction)
    axes = exact.friction.axes.replace(viscous=world.viscous, coulomb=world.coulomb, breakaway=None)
    return exact.replace(friction=exact.friction.replace(axes=axes), drive=Drive(**driver))


def volts(seed, rows=300):
    rng = np.random.default_rng(seed)
    return np.repeat(rng.uniform(-9.0, 9.0, (rows // 25, 3)), 25, axis=0)


@pytest.mark.parametrize("world", [WORLD, FRAME], ids=["exact", "implicit"])
def test_dead_band_and_latency_are_those_of_another_simulator(world):
    voltage, t = volts(1), np.arange(301) * 0.01
    run = simulate(robot(world, dead_band=DEAD, latency=LATE), voltage, 0.01)
    assert ("exact engine" not in run.source) == world.frame
    held = np.vstack([np.zeros((1, 3)), voltage])
    true = drive(world, np.append(0.0, t[:-1] + LATE), held, t, 2e-4)
    assert np.abs(run.twist - true.twist).max() < 2e-3 * np.abs(true.twist).max()
    assert np.array_equal(run.voltage[:-1], voltage)  # as a log has it: before the driver


def test_a_speed_loop_behind_a_dead_band_and_a_latency():
    """What the loop asks for, tick by tick, put into the other simulator: the wheels turn alike."""
    looped = robot(kind="speed", kp=0.6, ki=6.0, rate=100.0, dead_band=DEAD, latency=0.03)
    set_speed = np.repeat(np.random.default_rng(2).uniform(-15.0, 15.0, (8, 3)), 40, axis=0)
    run = simulate(looped, wheel_speed_command=set_speed, dt=0.01)
    assert not run.twist[:4].any()  # 30 ms after the first command nothing has happened yet
    true = drive(WORLD, run.t, run.voltage, run.t, 2e-4)
    assert np.abs(run.twist - true.twist).max() < 2e-3 * np.abs(true.twist).max()
    ideal = simulate(looped.replace(drive=looped.drive.replace(dead_band=0.0)), wheel_speed_command=set_speed, dt=0.01)
    assert np.abs(ideal.twist - run.twist).max() > 0.05


@pytest.mark.parametrize("key", ["drive.dead_band_V", "friction.axes.coulomb[0]", "motor.resistance_ohm[1]"])
def test_derivatives_behind_a_dead_band(key):
    one, voltage = robot(FRAME, dead_band=DEAD), volts(3, 150)
    found = derivatives(one, voltage, 0.01, keys=[key])
    step = 1e-4 * Key.parse(key).get(one)
    ends = [
        simulate(Key.parse(key).set(one, Key.parse(key).get(one) + s), voltage, 0.01, tol=1e-9) for s in (step, -step)
    ]
    by = (ends[0].twist - ends[1].twist) / (2.0 * step)
    assert np.abs(found.twist[:, :, 0] - by).max() < 2e-3 * np.abs(by).max()
    assert np.array_equal(found.run.voltage[:-1], voltage)


def test_derivatives_of_a_loop_behind_a_dead_band():
    looped = robot(kind="speed", kp=0.6, ki=6.0, rate=100.0, dead_band=DEAD)
    key, given = (
        "drive.kp_V_s_rad",
        {"wheel_speed_command": np.repeat([[8.0, -6.0, 4.0], [-9.0, 7.0, 12.0]], 40, axis=0)},
    )
    found = derivatives(looped, dt=0.01, keys=[key], **given)
    ends = [simulate(Key.parse(key).set(looped, 0.6 + s), dt=0.01, tol=1e-9, **given).twist for s in (1e-5, -1e-5)]
    by = (ends[0] - ends[1]) / 2e-5
    assert np.abs(found.twist[:, :, 0] - by).max() < 5e-3 * np.abs(by).max()
    with pytest.raises(UnsupportedError, match="no derivative by the dead band behind a speed loop"):
        derivatives(looped, dt=0.01, keys=["drive.dead_band_V"], **given)
    late = looped.replace(drive=looped.drive.replace(latency=0.01))
    with pytest.raises(UnsupportedError, match=r"derivatives of a run know no latency; got 0\.01 s"):
        derivatives(late, dt=0.01, keys=[key], **given)


def test_the_dead_zone_has_the_dead_band_in_it():
    """Along x and about yaw all motors that push have the same voltage: the dead band is added."""
    ideal, real = robot(), robot(dead_band=DEAD)
    patterns = axis_patterns(ideal)
    before, after = breakaway_voltage(ideal, patterns), breakaway_voltage(real, patterns)
    equal = [k for k, row in enumerate(np.abs(patterns)) if np.ptp(row[row > 0.0]) < 1e-9]
    assert 2 in equal
    assert after[equal] == pytest.approx(before[equal] + DEAD, rel=1e-9)
    yaw = np.ones(3) * after[2]
    assert moving_axes(real, 1.001 * yaw)[2]
    assert not moving_axes(real, 0.999 * yaw)[2]


def test_steps_of_a_simulation_end_where_commands_act_and_channels_look():
    """u = 1, 2, 4 held for 1 s each, acting 0.25 s late, seen 0.1 s late and 0.2 s early."""
    found = clock(np.ones(3), 0.25, (0.0, 0.1, -0.2))
    edges = np.concatenate([[0.0], np.cumsum(found.dt)])
    assert edges[found.at[0]] == pytest.approx([0.0, 1.0, 2.0, 3.0])
    assert edges[found.at[1]] == pytest.approx([0.0, 0.9, 1.9, 2.9])
    assert edges[found.at[2]] == pytest.approx([0.2, 1.2, 2.2, 3.2])
    middle = 0.5 * (edges[1:] + edges[:-1])
    assert found.row.tolist() == [int(np.floor(m - 0.25)) if m < 3.25 else 2 for m in middle]


def test_a_log_shows_each_channel_late_in_its_own_way():
    """Speeds 20 ms late and a heading 50 ms: what was there so many rows ago, on a grid of 10 ms, to rounding."""
    voltage, late = volts(4), LogEffects(latency=Lateness(wheel_speed=0.02, heading=0.05))
    plain, seen = simulate(robot(), voltage, 0.01), simulate(robot(), voltage, 0.01, log=late)
    assert seen.wheel_speed[2:] == pytest.approx(plain.wheel_speed[:-2], abs=1e-9)
    assert seen.pose[5:, 2] == pytest.approx(plain.pose[:-5, 2], abs=1e-9)
    assert seen.pose[:, :2] == pytest.approx(plain.pose[:, :2], abs=1e-9)
    assert seen.twist == pytest.approx(plain.twist, abs=1e-9)


def test_a_push_of_the_log_is_no_current_of_the_motors():
    pushed = LogEffects(push=(3.0, 0.0, 0.0))
    still = simulate(robot(), np.zeros((50, 3)), 0.01, log=pushed)
    assert not still.current.any()
    gone = simulate(robot(), np.zeros((50, 3)), 0.01, log=LogEffects(push=(5.0, 0.0, 0.0)))
    assert gone.twist[-1, 0] > 0.0
    rim = WORLD.G.T @ gone.twist[-1]
    assert gone.current[-1] == pytest.approx(-WORLD.ke * rim / np.array(WORLD.resistance))


def test_a_tilt_of_the_log_is_a_slope_under_the_robot():
    pull = 4.0
    degrees = float(np.degrees(np.arcsin(pull / (robot().body.mass * 9.81))))
    slope = robot().replace(floor=Floor(tilt=degrees, downhill=90.0))
    run = simulate(robot(), volts(4), 0.01, log=LogEffects(tilt=(0.0, pull)), pose=(0.0, 0.0, 0.6))
    assert "implicit" in run.source
    same = simulate(slope, volts(4), 0.01, pose=(0.0, 0.0, 0.6))
    assert run.twist == pytest.approx(same.twist, abs=1e-9)
    assert run.pose == pytest.approx(same.pose, abs=1e-9)


def test_a_tilt_of_three_numbers_was_a_push():
    with pytest.raises(InputError, match=r"tilt \[0.4, 0.0, 0.0\] has three entries.*on the body: call it push"):
        LogEffects(tilt=(0.4, 0.0, 0.0))  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ({"dead_band": -0.1}, "dead_band"),
        ({"latency": 11.0}, "latency"),
        ({"latency": float("nan")}, "latency"),
    ],
)
def test_what_no_driver_can_be(bad, words):
    with pytest.raises(InputError, match=words):
        Drive(**bad)
