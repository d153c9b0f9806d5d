"""Live: what a log tells while it grows, against the truth and against the fit of the whole log."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import omnidyn
from omnidyn.identification.live.rows import Rows, part
from omnidyn.identification.live.status import LiveNumber, LiveStatus
from omnidyn.identification.output_error.fit import Fit
from omnidyn.model.keys import BOX, Key
from tests.support.axebot_logs import NOISE, TRUTH, coloured, noisy, voltages, with_friction

SECONDS = 30.0
ROBOT = omnidyn.load_robot("axebot")
WRONG = with_friction(ROBOT, [2.0 * value for value in TRUTH.values()])


def fed(log, live=None, rows=37):
    live = live or omnidyn.Live(WRONG)
    for first in range(0, len(log), rows):
        live.add(part(log, first, min(first + rows, len(log))))
    return live


@pytest.fixture(scope="module")
def exact():
    return omnidyn.simulate(ROBOT, voltages(np.random.default_rng(3), SECONDS), 0.01)


@pytest.fixture(scope="module")
def log(exact):
    return noisy(exact, 1)


@pytest.fixture(scope="module")
def live(log):
    return fed(log)


def whole_fit(log, method):
    fit = Fit.of([log], WRONG, method)
    solution = fit.weighed(fit.solve()).solution
    return dict(zip(solution.solver.problem.names, solution.state.point.values.tolist(), strict=True))


def test_numbers_are_those_of_the_fit_of_the_whole_log(live, log):
    whole = whole_fit(log, live.method)
    for name, number in live.status.numbers.items():
        assert abs(number.value - whole[name]) < 0.3 * number.std, name


def test_the_robot_of_now_has_the_numbers_of_now(live):
    assert omnidyn.Live(WRONG).robot_now == WRONG
    for name in BOX:
        assert Key.parse(name).get(live.robot_now) == pytest.approx(live.status.numbers[name].value, rel=1e-12)


def test_a_drive_ends_with_the_whole_fit_where_errors_remember(exact):
    """Such a likelihood has several optima, some tenths of a standard error apart: sums may stay at another one."""
    log = coloured(exact, 2)
    live = fed(log)
    rows, seconds, values = live.status.rows, live.status.seconds, live.finish().numbers
    whole = whole_fit(log, live.method)
    assert {name: number.value for name, number in values.items()} == pytest.approx(whole, rel=1e-9)
    assert (live.status.rows, live.status.seconds) == (rows, seconds)
    assert live.finish().numbers == values
    assert omnidyn.Live(WRONG).finish().verdict.code == "live_waiting"


def test_intervals_hold_the_truth_with_a_start_twice_wrong(live):
    for name in BOX:
        number = live.status.numbers[name]
        assert abs(number.value - TRUTH[name]) < 3.0 * number.std
        assert number.std < 0.1 * TRUTH[name]


def test_errors_that_remember_are_whitened(exact, live):
    status = fed(coloured(exact, 2)).status
    z = [(status.numbers[name].value - TRUTH[name]) / status.numbers[name].std for name in BOX]
    assert np.abs(z).max() < 3.5
    assert status.numbers[BOX[3]].std > 1.5 * live.status.numbers[BOX[3]].std  # such noise tells less


def test_an_independent_simulator_agrees():
    """The equation of the paper by solve_ivp, sgn by tanh over 0.1 mm/s: no code of omnidyn makes the truth."""
    rate, seconds = 100.0, 20.0
    volts = voltages(np.random.default_rng(8), seconds)
    mass, viscous, level = np.array([1.5, 1.5, 0.025]), np.array(list(TRUTH.values())[:3]), np.array([2.2, 1.5, 0.099])
    azimuth = np.deg2rad([180.0, -60.0, 60.0])
    wrench = np.stack([-np.sin(azimuth), np.cos(azimuth), np.full(3, 0.1)])
    k = 19.0 * 0.0059 / 0.035

    def rate_of(t, v, u):
        force = wrench @ (k * (u - k * wrench.T @ v) / 1.69)
        return (force - viscous * v - level * np.tanh(v / np.array([1e-4, 1e-4, 1e-3]))) / mass

    v, twist = np.zeros(3), [np.zeros(3)]
    for u in volts:
        v = solve_ivp(rate_of, (0.0, 1.0 / rate), v, "LSODA", args=(u,), rtol=1e-6, atol=1e-8).y[:, -1]
        twist.append(v)
    noise = np.random.default_rng(9).normal(size=(len(twist), 3)) * NOISE
    log = omnidyn.Run(
        t=np.arange(len(twist)) / rate, voltage=np.concatenate([volts, volts[-1:]]), twist=np.array(twist) + noise
    )
    numbers = fed(log).status.numbers
    assert max(abs(numbers[name].value - TRUTH[name]) / numbers[name].std for name in BOX) < 3.5


def test_enough_needs_intervals_and_a_stretch_that_was_predicted(log):
    live, at = omnidyn.Live(WRONG, within=0.3), None
    for first in range(0, len(log), 100):
        status = live.add(part(log, first, first + 100))
        if at is None and status.is_enough:
            at = status
    assert at is not None
    assert at.held_out.predicted
    assert not at.missing
    assert at.held_out.end - at.held_out.start == pytest.approx(5.0, abs=0.05)
    strict = fed(log, omnidyn.Live(WRONG, within=1e-3)).status
    assert not strict.is_enough
    assert strict.verdict.code == "live_not_yet"


def test_numbers_that_do_not_predict_are_not_enough(exact):
    """The floor changes while nobody looks: the stretch after it is not predicted."""
    other = with_friction(ROBOT, [2.0 * value for value in TRUTH.values()])
    volts = voltages(np.random.default_rng(4), 10.0)
    first, second = noisy(exact, 1), noisy(omnidyn.simulate(other, volts, 0.01), 2)
    live = fed(part(first, 0, 2000), omnidyn.Live(WRONG, within=0.5))
    assert live.status.is_enough
    for status in live.answers(second.replace(t=second.t + 20.5)):
        assert status.is_enough == (status.verdict.code == "live_enough")
        assert not status.is_enough or not status.missing
        if status.held_out.missed:
            break
    assert status.held_out.missed
    assert status.enough_at is None
    assert "not yet" in str(status.verdict)


@pytest.mark.long
def test_a_model_that_leaves_something_out_is_said_and_never_enough():
    """Friction along the direction of travel, as one disc, by Euler steps of 0.5 ms; the model has it along each axis.
    All intervals are narrow, stretches are predicted within autocorrelated errors, and Coulomb friction is 70 % off."""
    volts = voltages(np.random.default_rng(100), 25.0)
    mass, viscous, level = np.array([1.5, 1.5, 0.025]), np.array(list(TRUTH.values())[:3]), np.array([2.2, 1.5, 0.099])
    azimuth = np.deg2rad([180.0, -60.0, 60.0])
    wrench = np.stack([-np.sin(azimuth), np.cos(azimuth), np.full(3, 0.1)])
    k, step, v, twist = 19.0 * 0.0059 / 0.035, 5e-4, np.zeros(3), [np.zeros(3)]
    for u in volts:
        for _ in range(20):
            rim = v * np.array([1.0, 1.0, 0.1])
            way = rim / max(np.sqrt(rim @ rim), 1e-3)
            v = v + step * (wrench @ (k * (u - k * wrench.T @ v) / 1.69) - viscous * v - level * way) / mass
        twist.append(v)
    noise = 0.1 * NOISE * np.random.default_rng(1).normal(size=(len(twist), 3))
    log = omnidyn.Run(t=np.arange(len(twist)) / 100.0, voltage=np.vstack([volts, volts[-1]]), twist=twist + noise)
    live = omnidyn.Live(WRONG, within=0.2)
    statuses = [status for first in range(0, len(log), 100) for status in live.answers(part(log, first, first + 100))]
    assert any(not status.missing and status.held_out.predicted for status in statuses[6:])  # what was enough before
    assert not any(status.is_enough for status in statuses)
    assert "the model leaves something out (its errors follow" in " ".join(map(str, statuses[-1].statements()))
    assert abs(statuses[-1].numbers[BOX[5]].value / TRUTH[BOX[5]] - 1.0) > 0.5


def test_a_stretch_with_a_lifted_wheel_is_never_enough():
    """For 3 s one wheel turns in the air: an Euler simulation of the paper's equations, with encoders of 4096 lines."""
    random, azimuth = np.random.default_rng(1), np.deg2rad([180.0, -60.0, 60.0])
    wrench = np.stack([-np.sin(azimuth), np.cos(azimuth), np.full(3, 0.1)])
    volts, row = np.zeros((6000, 3)), 50
    while row < len(volts) - 50:
        rows = int(random.integers(15, 120))
        twist = random.uniform(-1.0, 1.0, 3) * random.uniform(0.3, 1.0) * (random.random() < 0.83)
        volts[row : row + rows] = np.clip(wrench.T @ (twist * [7.0, 7.0, 70.0]), -6.0, 6.0)
        row += rows
    volts = volts[:4450].round(3)
    mass, viscous, level = np.array([1.5, 1.5, 0.025]), np.array([0.94, 0.96, 0.01]), np.array([2.2, 1.5, 0.099])
    k, step, v, turned = 19.0 * 0.0059 / 0.035, 5e-4, np.zeros(3), [np.zeros(3)]
    for row, u in enumerate(np.vstack([np.zeros((2, 3)), volts[:-2]])):
        is_up = (np.arange(3) == 1) & (3000 <= row < 3300)
        ground, angle = wrench * ~is_up, turned[-1]
        for _ in range(20):
            free = v + step * (ground @ (k * (u - k * ground.T @ v) / 1.69) - viscous * v) / mass
            v = np.sign(free) * np.maximum(np.abs(free) - step * level / mass, 0.0)
            angle = angle + step * np.where(is_up, 0.97 * u / (19.0 * 0.0059), wrench.T @ v / 0.035)
        turned.append(angle)
    tick = 2.0 * np.pi / 4096.0
    angles = np.floor(np.array(turned) / tick) * tick
    log = omnidyn.Run(t=np.arange(len(turned)) / 100.0, voltage=np.vstack([volts, volts[-1]]), wheel_angle=angles)
    live = omnidyn.Live(with_friction(ROBOT, [1.6 * value for value in TRUTH.values()]))
    statuses = [status for first in range(0, len(log), 50) for status in live.answers(part(log, first, first + 50))]
    assert not any(status.is_enough for status in statuses)
    assert "the numbers are known, but do not explain wheel_angle" in str(statuses[-1].verdict)


def test_an_unknown_width_is_said_in_words_and_percents_have_no_exponent():
    number = LiveNumber(0.0, 1.0, 0.0, 2.0, 0.1, False)
    status = LiveStatus("robot", 9.0, 900, {"friction.axes.viscous[0]": number})
    assert str(status.verdict).endswith("viscous friction forward is not within 100 %, wanted 10 %")
    assert "e+" not in str(status)
    late = LiveStatus("robot", 9.0, 900, {"friction.axes.viscous[0]": number}, enough_at=5.0)
    assert not late.is_enough  # a number that is wide again
    assert "interval" not in str(LiveStatus("robot", waiting="no rows"))


def test_the_floor_that_changed_is_said():
    fit = omnidyn.identify(
        noisy(omnidyn.simulate(ROBOT, voltages(np.random.default_rng(5)), 0.01), 5), ROBOT, quick=True
    )
    reference = next(iter(fit.groups.values())).robot
    rough = with_friction(ROBOT, [0.94, 0.96, 0.01, 1.5 * 2.2, 1.5 * 1.5, 1.5 * 0.099])
    heavy = ROBOT.replace(body=ROBOT.body.replace(mass=2.5, inertia=0.045))
    volts = voltages(np.random.default_rng(6), 25.0)
    kinds = {}
    for name, robot in (("same", ROBOT), ("floor", rough), ("payload", heavy)):
        status = fed(noisy(omnidyn.simulate(robot, volts, 0.01), 7), omnidyn.Live(ROBOT, reference=reference)).status
        kinds[name] = {change.subject for change in status.changes}
    assert kinds == {"same": set(), "floor": {"floor"}, "payload": {"payload"}}


def test_a_robot_at_rest_has_no_numbers_and_says_why():
    t = np.arange(800) / 100.0
    run = omnidyn.Run(t=t, voltage=np.zeros((800, 3)), twist=np.random.default_rng(0).normal(size=(800, 3)) * NOISE)
    status = fed(run).status
    assert not status.numbers
    assert "never visibly moved" in status.waiting
    assert "no numbers yet after 8 s and 800 rows" in str(status.verdict)


def test_what_a_dead_sensor_does_not_show_is_unknown_and_never_enough(log):
    twist = log.twist * np.array([1.0, 0.0, 0.0])
    status = fed(omnidyn.Run(t=log.t, voltage=log.voltage, twist=twist), omnidyn.Live(WRONG, within=0.5)).status
    assert not status.is_enough
    assert {BOX[1], BOX[2], BOX[4], BOX[5]} <= {*status.unknown} & {*status.missing}


def test_gaps_restarts_and_missing_values_are_survived_and_said(log, live):
    twist, voltage = log.twist.copy(), log.voltage.copy()
    twist[700:720], voltage[900:903] = np.nan, np.nan
    broken = omnidyn.Run(t=log.t, voltage=voltage, twist=twist)
    other = omnidyn.Live(WRONG)
    fed(part(broken, 0, 1200), other)
    later = part(broken, 1300, len(broken))  # a second of rows is lost
    fed(part(later, 0, 800), other)
    last = part(later, 800, len(later))
    fed(last.replace(t=last.t - last.t[0]), other)  # the logger begins anew
    status = other.status
    assert status.restarts == 1
    assert status.gap > 1.0
    assert {statement.code for statement in status.statements()} == {"live_restarts", "live_gap"}
    for name in BOX:
        assert abs(status.numbers[name].value - live.status.numbers[name].value) < 3.0 * live.status.numbers[name].std


def test_what_old_rows_said_stays_when_they_are_forgotten(log, live, monkeypatch):
    monkeypatch.setattr("omnidyn.identification.live.live.MOST_ROWS", 1500)
    other = fed(log)
    assert other._rows.count <= 1600
    for name in BOX:
        ours, whole = other.status.numbers[name], live.status.numbers[name]
        assert ours.std < 1.4 * whole.std
        assert abs(ours.value - whole.value) < 1.5 * whole.std


def test_rows_keep_time_and_join_channels():
    rows = Rows()
    first = omnidyn.Run(t=[0.0, 0.1], twist=np.zeros((2, 3)))
    second = omnidyn.Run(t=[0.0, 0.1], voltage=np.ones((2, 3)))
    for run in (first, second):
        rows.add(rows.on_clock(run))
    run = rows.between(-np.inf, np.inf)
    assert run.t.tolist() == pytest.approx([0.0, 0.1, 2.1, 2.2])
    assert np.isnan(run.twist[2:]).all()
    assert np.isnan(run.voltage[:2]).all()
    assert rows.restarts == 1
    rows.forget(2.0)
    assert rows.count == 2
    assert rows.total == 4


def test_a_row_that_is_sent_twice_does_not_begin_time_anew(log):
    live, once = omnidyn.Live(WRONG), part(log, 0, 120)
    for first, stop in ((0, 50), (49, 50), (49, 100), (99, 120)):
        live.add(part(log, first, stop))
    assert (live.status.restarts, live.status.rows, live.status.gap) == (0, 120, 0.0)
    np.testing.assert_array_equal(live._rows.between(-np.inf, np.inf).twist, once.twist)


def test_what_cannot_be_used_is_refused():
    with pytest.raises(omnidyn.OmnidynError, match="another number of wheels; got 4; expected 3, as axebot has; give"):
        omnidyn.Live(ROBOT).add(omnidyn.Run(t=[0.0, 0.1], voltage=np.zeros((2, 4)), twist=np.zeros((2, 3))))
    with pytest.raises(omnidyn.OmnidynError, match="got -1; expected a share above 0"):
        omnidyn.Live(ROBOT, within=-1)
    with pytest.raises(omnidyn.OmnidynError, match=r"within: not fitted; got body.mass_kg; expected friction.axes.v"):
        omnidyn.Live(ROBOT, within={"body.mass_kg": 0.1})  # else nothing need be known, and all is enough
    with pytest.raises(
        omnidyn.OmnidynError, match="fit before is of another robot; got 4 wheels; expected 3, as axebot"
    ):
        omnidyn.Live(ROBOT, reference=omnidyn.load_robot("mecanum"))
    with pytest.raises(omnidyn.OmnidynError, match="unknown key; got nonsense"):
        omnidyn.Live(ROBOT, omnidyn.OutputError(free=("nonsense",)))


def test_a_robot_with_a_speed_loop_is_followed_where_its_voltages_are_logged():
    """As `identify` fits it: what reached the motors drives the model, and the set speeds do not."""
    rng = np.random.default_rng(0)
    run = omnidyn.simulate(ROBOT, np.repeat(rng.uniform(-5.0, 5.0, (25, 3)), 40, axis=0), 0.01)
    speeds = run.wheel_speed + 0.05 * rng.standard_normal(run.wheel_speed.shape)
    log = omnidyn.Run(t=run.t, voltage=run.voltage, wheel_speed=speeds, wheel_speed_command=run.wheel_speed)
    live = omnidyn.Live(ROBOT.replace(drive=ROBOT.drive.replace(kind="speed", kp=0.5, ki=2.0, rate=100.0)))
    numbers = live.add(log).numbers
    for axis, truth in enumerate(ROBOT.friction.axes.coulomb):
        number = numbers[f"friction.axes.coulomb[{axis}]"]
        assert abs(number.value - truth) < number.high - number.low
        assert number.high - number.low < 0.1 * truth


def looped_robot():
    """The paper's robot behind a PI loop of 100 Hz, and 24 s of it: noisy speeds and currents, set speeds, no volts."""
    robot = ROBOT.replace(drive=ROBOT.drive.replace(kind="speed", kp=0.25, ki=1.0, rate=100.0))
    rng = np.random.default_rng(1)
    command = np.repeat(rng.uniform(-1.0, 1.0, (48, 3)) * [0.6, 0.6, 4.0], 50, axis=0)
    command[:20] = 0.0
    run = omnidyn.simulate(robot, dt=0.01, twist_command=command)
    speeds = run.wheel_speed + 0.3 * rng.standard_normal(run.wheel_speed.shape)
    current = run.current + 0.05 * rng.standard_normal(run.current.shape)
    return robot, omnidyn.Run(t=run.t, wheel_speed=speeds, current=current, twist_command=run.twist_command)


def test_a_speed_loop_is_followed_through_its_set_speeds():
    """Friction 1.5 times and gains half of the truth at first: all are found; the end is the fit of the whole log."""
    robot, log = looped_robot()
    start = Key.parse("drive.kp_V_s_rad").set(Key.parse("drive.ki_V_rad").set(robot, 0.5), 0.125)
    for axis, truth in enumerate(ROBOT.friction.axes.coulomb):
        start = Key.parse(f"friction.axes.coulomb[{axis}]").set(start, 1.5 * truth)
    live = omnidyn.Live(start, within=0.5)
    for first in range(0, len(log), 100):
        status = live.add(part(log, first, min(first + 100, len(log))))
    finished = live.finish().numbers
    for key in ("drive.kp_V_s_rad", "drive.ki_V_rad", *(f"friction.axes.coulomb[{axis}]" for axis in range(3))):
        truth = Key.parse(key).get(robot)
        for number in (status.numbers[key], finished[key]):
            assert abs(number.value - truth) < 4.0 * number.std
            assert number.std < 0.05 * truth
    assert status.enough_at is not None
    whole = omnidyn.identify(log, start, live.method).estimate
    for key, std in whole.std.items():
        assert abs(finished[key].value - whole.value[key]) < 0.3 * std


def test_what_follows_a_gap_in_a_speed_loop_is_not_used():
    robot, log = looped_robot()
    gap = slice(900, 1000)
    rows = np.delete(np.arange(len(log)), gap)
    lost = log.replace(t=log.t[rows], **{name: value[rows] for name, value in log.channels.items()})
    live, before = omnidyn.Live(robot), omnidyn.Live(robot)
    status = live.add(lost)
    before.add(part(log, 0, 900))
    assert status.used_until == pytest.approx(8.99)
    assert "nothing after the gap at 9.0 s is used" in str(status)
    finished = live.finish().numbers
    for key, number in before.finish().numbers.items():
        assert finished[key].value == pytest.approx(number.value, abs=0.3 * number.std)


def test_a_speed_loop_that_begins_in_motion_waits():
    robot, log = looped_robot()
    status = omnidyn.Live(robot).add(part(log, 400, 1200))
    assert not status.numbers
    assert "no log begins at rest" in status.waiting
