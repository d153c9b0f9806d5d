"""What two numbers are together where logs hardly tell them apart, and what intervals owe to the log alone."""

import numpy as np
import pytest
from scipy.special import ndtri

from benchmarks.wrong_worlds.log import NOISE, Case, Setup, logged, robot_of
from benchmarks.wrong_worlds.world import World, drive
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.linear.workbench import scaled
from omnidyn.identification.output_error.problem.parameters import Parameter
from omnidyn.identification.output_error.trust.search_ends import at_the_end
from omnidyn.model.keys import Key, expand
from omnidyn.model.robot import Prior
from omnidyn.run import Run

DEAD = 0.6
WORLD = World(dead=DEAD)


def turning(seed, world=WORLD, latency=0.0, seconds=30.0):
    """A log of turning on the spot only, by another simulator: all wheels alike, at a few levels, each way for half."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, seconds, 0.01)
    levels = np.repeat([1.0, -1.0], 10) * rng.uniform(3.0, 7.0, 20)
    voltage = np.repeat(levels, 150)[: len(t), None] * np.ones(3) * (t[:, None] > 0.5)
    motion = drive(world, t, voltage, np.clip(t - latency, 0.0, None))
    speed = motion.wheel_speed + NOISE * rng.normal(size=motion.wheel_speed.shape)
    return Run(t, voltage=voltage, wheel_speed=speed)


def sums(fit):
    return {one.name: one for one in fit.combinations}


def test_a_dead_band_and_coulomb_friction_that_trade_are_told_together():
    """The voltage to set off about yaw is d + C/g, g = 3 b l K_t/(R r): known several times better than either."""
    push = 3.0 * WORLD.robot_radius * WORLD.ke[0] / WORLD.resistance[0]
    truth = DEAD + WORLD.coulomb[2] / push
    off = []
    for seed in range(960, 963):
        fit = identify(turning(seed), robot_of(World()), OutputError(nuisances=("dead_band",))).estimate
        one = sums(fit)["sets_off.yaw"]
        assert one.correlation < -0.9
        assert one.std < 0.3 * fit.nuisances["dead_band"].std
        off.append((one.value - truth) / one.std)
        beside = fit.robot.correlation.of(("drive.dead_band_V", "friction.axes.coulomb[2]"))
        assert beside[0, 1] == pytest.approx(fit.correlation.between("dead_band", "friction.axes.coulomb[2]"))
        assert beside[0, 1] < -0.95
    assert np.sqrt(np.mean(np.square(off))) < 2.0
    assert str(one.statement()) in fit.summary()


def test_numbers_that_the_log_tells_apart_have_no_sum():
    fit = identify(
        logged(Case(WORLD, World()), 967), robot_of(World()), OutputError(nuisances=("latency", "dead_band"))
    ).estimate
    assert not [name for name in sums(fit) if name.startswith(("sets_off", "follows"))]


def test_a_latency_beyond_the_search_is_no_estimate():
    fit = identify(turning(968, World(), 0.36), robot_of(World()), OutputError(nuisances=("latency",))).estimate
    assert "latency.wheel_speed" in fit.unidentifiable
    assert "latency.wheel_speed: not determined" in fit.summary()
    assert [each.subject for each in fit.warnings if each.code == "search_end"] == ["latency.wheel_speed"]


@pytest.mark.parametrize(
    ("parameter", "value", "ended"),
    [
        (Parameter("dead_band", 0.0, 0.0, 2.0), 0.0, False),
        (Parameter("dead_band", 0.0, 0.0, 2.0), 2.0, True),
        (Parameter("fade", 0.0, -0.9, 0.9), -0.9, True),
        (Parameter("gain", 1.0, 0.1, 10.0, True), 0.1, True),
        (Parameter("friction.axes.coulomb[0]", 1.0, 0.0, 1e6), 0.0, False),
        (Parameter("motor.gear_efficiency", 0.9, 9e-5, 1.0, True), 0.94, False),
        (Parameter("motor.gear_efficiency[1]", 0.9, 9e-5, 1.0, True), 1.0, False),
        (Parameter("motor.gear_efficiency", 0.9, 9e-5, 1.0, True), 9e-5, True),
    ],
)
def test_which_ends_are_no_estimates(parameter, value, ended):
    class Of:
        parameters = (parameter,)

    assert [p.name for p in at_the_end(Of, np.array([value]))] == ([parameter.name] if ended else [])


def test_the_log_alone_is_a_fit_of_the_same_log_with_the_file_taken_as_exact():
    """Beside a fit that holds what the file knows, at the value that goes best: the same intervals, to 5 %."""
    log = logged(Case(World(), World(), Setup()), 969)
    robot = robot_of(World())
    key = "body.mass_kg"
    free = identify(
        log, robot.replace(priors={key: Prior(std=0.1, source="scales")}), OutputError(nuisances=())
    ).estimate
    assert key in free.value
    at = robot.replace(body=robot.body.replace(mass=free.value[key]))
    held = identify(log, at, OutputError(nuisances=())).estimate
    assert set(free.log_alone) == set(held.value)
    for name, (low, high) in free.log_alone.items():
        assert high - low == pytest.approx(np.diff(held.ci95[name])[0], rel=0.05), name
        assert high - low <= np.diff(free.ci95[name])[0] * (1.0 + 1e-9)
    assert held.log_alone == {}
    assert free.to_dict()["from_the_log_alone"] == {name: list(each) for name, each in free.log_alone.items()}


HELD = {"wheels.robot_radius_m": 0.03, "motor.gear_ratio": 0.02, "body.mass_kg": 0.04}  # shares they may be off by


@pytest.mark.parametrize("asked", [{"free": "friction"}, {"fixed": tuple(HELD)}])
def test_a_number_that_is_not_fitted_counts_with_its_std(asked):
    """Against fits of the same log with the number moved in the file; and the log alone stays beside it."""
    run, plain = logged(Case(World(), World()), 971), robot_of(World())
    size = {key: float(Key.parse(expand(key, plain)[0]).get(plain)) for key in HELD}
    priors = {key: Prior(std=share * size[key], origin="measured") for key, share in HELD.items()}
    told = identify(run, plain.replace(priors=priors), OutputError(**asked, nuisances=())).estimate
    alone = identify(run, plain, OutputError(free="friction", nuisances=())).estimate
    assert told.value == pytest.approx(alone.value, rel=1e-6)
    variance = {name: std**2 for name, std in alone.std.items()}
    for key, share in HELD.items():
        other = identify(
            run, scaled(plain, key, 1.0 + 0.2 * share), OutputError(free="friction", nuisances=())
        ).estimate
        for name in variance:
            variance[name] += ((other.value[name] - alone.value[name]) / 0.2) ** 2
    assert np.sqrt(list(variance.values())) == pytest.approx([told.std[name] for name in variance], rel=0.05)
    assert max(told.std[name] / alone.std[name] for name in variance) > 3.0
    for name, (low, high) in told.log_alone.items():
        if name in alone.ci95:
            assert (low, high) == pytest.approx(alone.ci95[name], rel=1e-6)
    assert "from the log alone" in told.summary()
    assert not alone.log_alone


@pytest.mark.parametrize("more", [{"profile": ("friction.axes.viscous[0]",)}, {"bootstrap": 20}])
def test_it_counts_in_a_profile_and_a_bootstrap_too(more):
    """No likelihood and no draw of the logs sees it: in squares it is what the std of the fit has for it."""
    plain, key = robot_of(World()), "friction.axes.viscous[0]"
    gear = Prior(std=0.005 * float(plain.motor.gear_ratio), origin="measured")
    runs = [logged(Case(World(), World()), 960 + k) for k in range(1 if "profile" in more else 5)]
    fits = []
    for asked in ({}, more):
        for robot in (plain, plain.replace(priors={"motor.gear_ratio": gear})):
            fits.append(identify(runs, robot, OutputError(free="friction", nuisances=(), **asked)).estimate)
    bare, told, alone, both = fits
    moved = np.sqrt(told.std[key] ** 2 - bare.std[key] ** 2)
    assert moved > bare.std[key]
    reach, wider = ([abs(end - each.value[key]) for end in each.ci95[key]] for each in (alone, both))
    assert wider == pytest.approx(np.hypot(reach, 1.96 * moved), rel=0.03)
    assert both.std[key] == pytest.approx(np.hypot(alone.std[key], moved), rel=0.03)


def test_a_number_that_is_not_fitted_and_is_off_is_in_the_interval():
    """Worlds whose gear ratio is off the file's by what the file says of it: coverage of
    viscous friction, which that moves by several of its other standard errors, far from its bound at 0."""
    held, alone, share = [], [], 0.005
    for k, seed in enumerate(range(975, 987)):
        off = 1.0 + share * float(ndtri((k + 0.5) / 12))
        world = World(gear_ratio=off * World().gear_ratio)
        std = share * World().gear_ratio
        told = robot_of(World()).replace(priors={"motor.gear_ratio": Prior(std=std, origin="datasheet")})
        fit = identify(logged(Case(world, World()), seed), told, OutputError(free="friction", nuisances=())).estimate
        for axis in range(2):
            name = f"friction.axes.viscous[{axis}]"
            for found, (low, high) in ((held, fit.ci95[name]), (alone, fit.log_alone[name])):
                found.append(low <= world.viscous[axis] <= high)
    assert np.mean(held) >= 0.9
    assert np.mean(alone) < 0.7
