"""What residuals are found to follow: nothing in right worlds, whatever memory the noise has; in wrong ones, the cause.

Noise of a memory is drawn here; the wrong worlds are those of the benchmark, whose simulator shares no code with ours.
"""

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.signal import lfilter

from benchmarks.wrong_worlds.kinds import by_name
from benchmarks.wrong_worlds.log import COUNTS, TICKS, logged, right_case, robot_of
from benchmarks.wrong_worlds.remedies import FRICTION
from benchmarks.wrong_worlds.score import drawn
from benchmarks.wrong_worlds.world import World
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.linear.rounding_noise import of_rounding
from omnidyn.identification.output_error.memory.autoregression import autoregression
from omnidyn.identification.verdict import fits_verdict
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, excitation
from tests.support.codes import codes

AXEBOT = load_robot("axebot")


def remembered(rho, seed):
    """A log of the right robot with noise of a memory."""
    clean = simulate(AXEBOT, dt=0.01, voltage=excitation(30.0, 100.0, seed))
    white = np.random.default_rng(seed).normal(size=(len(clean.t) + 500, 3))
    noise = lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], white, axis=0)[500:] * NOISE
    return Run(t=clean.t, voltage=clean.voltage, twist=clean.twist + noise, source="log")


@pytest.mark.parametrize(("rho", "seed"), [(0.0, 7), (0.9, 9), (0.98, 8)])
@pytest.mark.some(1)
def test_a_memory_alone_is_no_lack_of_fit(rho, seed):
    assert not identify(remembered(rho, seed), AXEBOT, OutputError(nuisances=())).lack_of_fit.found


def test_errors_that_last_as_long_as_the_log_are_not_called_noise():
    """Of a right robot, with a memory of twenty seconds in a log of thirty. Nothing is found, and that is said."""
    fit = identify(remembered(0.999, 7), AXEBOT, OutputError(nuisances=())).estimate
    lack = fit.lack_of_fit
    assert not lack.found
    assert lack.drifts
    assert lack.to_dict()["drifts"]
    assert lack.statements()[0].code == "slow_errors"
    assert codes(fits_verdict({"": fit}, {})) == ["slow_errors", "not_compared"]


def test_friction_at_the_wheels_under_a_box_is_found_by_counts():
    """A Coulomb level of 0 where it is 4.1 N, and angles 1 rad off, which were called noise."""
    seed = 142_004
    case = by_name("wheels").make(right_case(seed), 0.00638747)
    assert case.setup.sensor == COUNTS
    fit = identify(logged(case, seed), robot_of(case.told), OutputError(free=FRICTION)).estimate
    assert fit.value["friction.axes.coulomb[1]"] < 0.5
    assert fit.lack_of_fit.found
    assert fit.lack_of_fit.remedies[0].key == "friction.wheels"


@pytest.mark.long
def test_a_gross_misfit_of_angles_is_found():
    """A current limit under a file without one: viscous friction 12 times too large. Rows in which an encoder counts
    next to nothing are no rows of the residuals: taken as if none were missing there, their memory told nothing."""
    case, seed, _ = drawn(by_name("current limit"), 4)
    case = case.setup_but(sensor=TICKS, memory=0.0)
    fit = identify(logged(case, seed), robot_of(case.told), OutputError(free=FRICTION)).estimate
    assert fit.value["friction.axes.viscous[0]"] > 5.0 * case.told.viscous[0]
    assert fit.lack_of_fit.found
    assert not fit.lack_of_fit.drifts
    for name, share in fit.lack_of_fit.channels.items():  # of the speeds of the same log: .94, .95, .90
        assert 0.5 < share < 1.0
        assert fit.lack_of_fit.sizes[name] == pytest.approx(share**0.5 * fit.noise[name], rel=0.1)
    noise = fit.lack_of_fit.noise["wheel_angle[0]"]
    assert noise.residual == pytest.approx(fit.noise["wheel_angle[0]"], rel=0.1)  # of the fit, not of a step beyond it
    right = case.world_but(limit=World.limit)
    fit = identify(logged(right, seed), robot_of(right.told), OutputError(free=FRICTION)).estimate
    assert not fit.lack_of_fit.found
    assert not fit.lack_of_fit.drifts


def test_how_well_the_power_of_slow_errors_is_known_follows_from_the_memory():
    """Of many series of one memory: the scatter of what is estimated, against what the degrees of freedom say."""
    rng, rho, rows = np.random.default_rng(5), 0.9, 2000
    power, degrees = [], []
    for _ in range(300):
        series = lfilter([1.0], [1.0, -rho], rng.normal(size=rows + 300))[300:]
        model = autoregression([series[:, None]], order_limit=1)
        power.append(model.variance / (1.0 - model.coefficients.sum()) ** 2)
        degrees.append(model.degrees)
    scatter = np.std(power) / np.mean(power)
    assert np.sqrt(2.0 / np.median(degrees)) == pytest.approx(scatter, rel=0.2)


COUNTED = 2.0 * np.pi / 600.0  # [rad], the encoder of the benchmark


def counted(robot, seed, rate=50.0):
    """A log whose speeds are differences of counts."""
    fine = simulate(robot, dt=0.002, voltage=np.repeat(excitation(30.0, rate, seed), int(500 / rate), axis=0))
    angle = cumulative_simpson(fine.wheel_speed, dx=0.002, axis=0, initial=0.0)[:: int(500 / rate)]
    counts = np.floor(angle / COUNTED + np.random.default_rng(seed).uniform(size=3))
    speed = np.diff(counts, axis=0, prepend=counts[:1]) * COUNTED * rate
    return Run(t=fine.t[:: int(500 / rate)], voltage=fine.voltage[:: int(500 / rate)], wheel_speed=speed)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_an_encoder_rounds_is_no_lack_of_fit(seed):
    """Rounding repeats itself where a wheel turns by simple shares of a tick from row to row."""
    found = identify(counted(AXEBOT, seed), AXEBOT, OutputError(nuisances=())).lack_of_fit
    assert not found.found


@pytest.mark.parametrize("seed", [4])
def test_wheels_that_slip_at_random_are_no_lack_of_fit(seed):
    """Their angles are a random walk, a memory without an end: it follows nothing."""
    log = counted(AXEBOT, seed)
    slipped = np.cumsum(np.random.default_rng(seed).normal(size=log.wheel_speed.shape) * 0.5, axis=0)
    angle = np.cumsum(log.wheel_speed, axis=0) / 50.0 + np.round(slipped) * COUNTED
    log = log.replace(wheel_speed=None, wheel_angle=angle)
    assert not identify(log, AXEBOT, OutputError(nuisances=())).lack_of_fit.found


@pytest.mark.parametrize("kind", ["resistance", "Stribeck"])
@pytest.mark.some(1)
def test_a_wrong_model_of_a_robot_with_encoders_is_found(kind):
    """The sum of counts wanders where the model is wrong: it was taken for a memory that says nothing."""
    case, _, _ = drawn(by_name(kind), 69)
    assert case.setup.sensor == COUNTS
    found = lack(kind, 69, ("latency",))
    assert found.found
    assert max(found.channels.values()) > 0.5


def test_the_variance_of_what_is_rounded_is_that_of_many_beginnings():
    """Sums of rounding over directions, against draws of where between its ticks each wheel begins."""
    rows, rng = 600, np.random.default_rng(3)
    turned = np.concatenate([np.full(200, 0.5), np.full(200, 1.01), np.full(200, 0.37)]).cumsum() * COUNTED
    ways = np.array([np.ones(rows), np.arange(rows) < 200, np.sin(np.arange(rows) / 30.0)]).T
    ways /= np.linalg.norm(ways, axis=0)
    begun = turned + rng.uniform(0.0, COUNTED, (4000, 1))
    rounding = np.floor(begun / COUNTED) * COUNTED - begun + 0.5 * COUNTED
    truth = (rounding @ ways).var(axis=0) / (COUNTED**2 / 12.0)
    ratio = of_rounding(turned, COUNTED, ways)
    assert 1.0 + ratio == pytest.approx(truth, rel=0.1, abs=0.1)
    assert truth.max() > 3.0


def test_noise_beside_rounding_spreads_it():
    turned = np.full(600, 1.0).cumsum() * COUNTED
    way = np.full((600, 1), 600.0**-0.5)
    assert of_rounding(turned, COUNTED, way)[0] == pytest.approx(599.0, rel=0.1)
    assert abs(of_rounding(turned, COUNTED, way, 1.0)[0]) < 1e-3


def lack(kind, number=61, nuisances=None):
    """Of a log of a wrong world, a large one; 20 s are enough, but a load is put on late. nuisances: without those of
    the default, a constant force is not fitted."""
    case, seed, large = drawn(by_name(kind), number)
    assert large
    if kind != "payload":
        case = case.setup_but(seconds=20.0)
    return identify(
        logged(case, seed), robot_of(case.told), OutputError(free=FRICTION, nuisances=nuisances)
    ).lack_of_fit


@pytest.mark.parametrize("kind", ["backward", "sag"])
@pytest.mark.some(1)
def test_what_nobody_offers_is_found_and_has_no_confident_remedy(kind):
    found = lack(kind, nuisances=("latency",))
    assert found.found
    assert not any(remedy.confident for remedy in found.remedies[:1])


def test_a_force_in_the_room_is_called_one():
    found = lack("umbilical", nuisances=("latency",))
    assert "stays in the room" in str(found.statement())
    assert (found.remedies[0].key, found.remedies[0].confident) == ("tilt", True)


@pytest.mark.parametrize(
    ("kind", "key"),
    [
        ("mass", "body.mass_kg"),
        ("payload", "change"),
    ],
)
@pytest.mark.some(1)
def test_the_cause_is_named_first(kind, key):
    """Others in test_remedies.py, and in bench wrong_worlds."""
    found = lack(kind)
    best = found.remedies[0]
    assert found.found
    assert key in (best.key, *best.same_as)


@pytest.mark.parametrize("scale", [1.0, 1.1])
@pytest.mark.some(1)
def test_logs_with_other_sensors_are_diagnosed_together(scale):
    """One log has the speeds of the body, the other those of the wheels too, of which one may read 10 % more."""
    of_body = remembered(0.0, 7)
    run = simulate(AXEBOT, excitation(30.0, 100.0, 8), 0.01)
    draws = np.random.default_rng(8)
    twist = run.twist + draws.normal(size=run.twist.shape) * NOISE
    wheels = run.wheel_speed * (scale, 1.0, 1.0) + 0.2 * draws.normal(size=run.wheel_speed.shape)
    of_all = Run(t=run.t, voltage=run.voltage, twist=twist, wheel_speed=wheels, source="all")
    for logs in ([of_body, of_all], [of_all, of_body]):
        fit = identify(logs, AXEBOT, OutputError(nuisances=()))
        assert not fit.failures
        assert fit.lack_of_fit.found == (scale != 1.0)
        if fit.lack_of_fit.found:
            assert fit.lack_of_fit.follows[0].theme == "what each sensor shows"


def test_a_gyro_alone_leaves_the_other_axes_unasked():
    """Nothing was measured along x and y: no noise to be told from, and no share of it."""
    robot = load_robot("axebot")
    run = simulate(robot, excitation(20.0, 50.0), 0.02)
    random = np.random.default_rng(4)
    assert run.twist is not None
    assert run.wheel_speed is not None
    gyro = np.full(run.twist.shape, np.nan)
    gyro[:, 2] = run.twist[:, 2] + 0.02 * random.standard_normal(len(gyro))
    wheels = run.wheel_speed + 0.1 * random.standard_normal(run.wheel_speed.shape)
    fit = identify(Run(t=run.t, voltage=run.voltage, twist=gyro, wheel_speed=wheels), robot, OutputError()).estimate
    assert fit.lack_of_fit is not None
    assert not fit.lack_of_fit.found
    assert fit.lack_of_fit.channels["twist[0]"] == fit.lack_of_fit.channels["twist[1]"] == 0.0


def test_gaps_leave_pieces_that_tell_their_starts_unequally():
    """One begins at rest, others in motion, one where an axis stands still: what each has taken out has a width."""
    log = remembered(0.0, 1)
    kept = np.ones(len(log.t), dtype=bool)
    kept[510:760] = kept[1300:1400] = False
    cut = Run(t=log.t[kept], voltage=log.voltage[kept], twist=log.twist[kept], source="log")
    assert not identify(cut, AXEBOT, OutputError(nuisances=())).lack_of_fit.found
