"""Where the level falls with the speed, breakaway and the Stribeck speed are fitted; held, an answer rests on them."""

import numpy as np
import pytest

import omnidyn
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.prepare import guesses
from omnidyn.identification.output_error.problem.parameters import Parameter
from omnidyn.identification.output_error.problem.problem import FitProblem
from omnidyn.identification.output_error.solve.steps import Order
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.keys import Key
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.sensitivity.derivatives import derivatives
from tests.reference.modes import reference
from tests.support.codes import codes

AXEBOT = load_robot("axebot")
KEYS = tuple(f"friction.axes.{name}[0]" for name in ("viscous", "coulomb", "breakaway", "stribeck_speed"))
TRUE = (0.94, 2.2, 2.8, 0.05)
HELD = KEYS[2]


def robot_with(viscous=0.94, coulomb=2.2, breakaway=2.8, speed=0.05):
    axes = AxesFriction(
        viscous=(viscous, 0.96, 0.01),
        coulomb=(coulomb, 1.5, 0.099),
        breakaway=(breakaway, 1.9, 0.13),
        stribeck_speed=(speed, 0.05, 0.4),
    )
    return AXEBOT.replace(friction=Friction(axes=axes))


def ramps():
    """Ramps along x to levels below and above what it takes to move, both ways."""
    pushes = [np.linspace(0.2, (1.6, 2.5, 4.0)[k % 3], 20) * (-1) ** (k // 3) for k in range(12)]
    return np.outer(np.concatenate(pushes), [0.0, 1.0, -1.0])


@pytest.fixture(scope="module")
def truth():
    return reference(robot_with(), ramps(), 0.02)


def log_of(truth, seed):
    """A log of the reference integrator, with noise."""
    noise = np.random.default_rng(seed).normal(size=truth.twist.shape) * [0.005, 0.005, 0.02]
    voltage = np.concatenate([ramps(), ramps()[-1:]])
    return Run(t=np.linspace(0.0, 0.02 * (len(voltage) - 1), len(voltage)), voltage=voltage, twist=truth.twist + noise)


DIRECTED = Friction(
    direction=DirectionFriction(coulomb=(2.0, 1.6), breakaway=(2.6, 2.1), stribeck_speed=0.05, viscous=0.9)
)
ROLLING = Friction(wheels=WheelFriction(coulomb=0.7, breakaway=1.0, stribeck_speed=0.05, viscous=0.3))


@pytest.mark.parametrize(
    ("robot", "keys"),
    [
        (robot_with(), KEYS),
        (AXEBOT.replace(friction=DIRECTED), ("friction.direction.breakaway[0]", "friction.direction.stribeck_speed")),
        (AXEBOT.replace(friction=ROLLING), ("friction.wheels.breakaway", "friction.wheels.stribeck_speed")),
    ],
    ids=["axes", "direction", "wheels"],
)
def test_derivatives_are_differences_of_an_integrator_that_shares_nothing(robot, keys):
    """Within what `derivatives` promises after a release."""
    found = derivatives(robot, ramps()[:60], 0.02, keys, tol=1e-7)
    for k, key in enumerate(keys):
        value = Key.parse(key).get(robot)
        step = 1e-4 * value
        up, down = (
            reference(Key.parse(key).set(robot, value + by), ramps()[:60], 0.02).twist[:, 0] for by in (step, -step)
        )
        expected = (up - down) / (2.0 * step)
        assert np.abs(found.twist[:, 0, k] - expected).max() <= 5e-5 * np.abs(expected).max()


def test_breakaway_is_found_with_the_speed_over_which_it_falls(truth):
    """Four logs: of sixteen numbers none is further off than 3.5 standard errors, and few beyond 1.96."""
    beyond = 0
    for seed in range(4):
        fit = omnidyn.identify(
            [log_of(truth, seed)], robot_with(1.2, 2.0, 2.5, 0.03), omnidyn.OutputError(free=KEYS)
        ).estimate
        off = [abs(fit.value[key] - value) / fit.std[key] for key, value in zip(KEYS, TRUE, strict=True)]
        assert max(off) <= 3.5
        beyond += sum(each > 1.96 for each in off)
        assert fit.std[HELD] < 0.03
        assert fit.std[KEYS[3]] < 0.005
    assert beyond <= 3


def test_the_answer_rests_on_a_breakaway_that_is_held(truth):
    """What it says of 1 % more is what a fit with 1 % more finds."""
    free = tuple(key for key in KEYS if key != HELD)
    one, other = (
        omnidyn.identify([log_of(truth, 1)], robot_with(breakaway=s), omnidyn.OutputError(free=free)).estimate
        for s in (2.8, 2.8 * 1.01)
    )
    assert isinstance(one, OutputErrorEstimate)
    for key in free:
        said = one.rests_on[key][HELD]
        assert said == pytest.approx(other.value[key] / one.value[key] - 1.0, rel=0.2)
    assert abs(one.rests_on[KEYS[3]][HELD]) > 0.03


def test_what_is_guessed_is_free_by_itself(truth):
    guessed = {HELD: Prior(std=0.5, origin="guess"), KEYS[3]: Prior(std=0.02, origin="guess")}
    robot = robot_with(1.2, 2.0, 2.5, 0.03).replace(priors=guessed)
    assert guesses(robot) == (HELD, KEYS[3])
    fit = omnidyn.identify([log_of(truth, 1)], robot).estimate
    assert {HELD, KEYS[3]} <= fit.value.keys()
    assert abs(fit.value[HELD] - 2.8) <= 3.0 * fit.std[HELD]


class Some(FitProblem):
    def __init__(self, *names):
        self.parameters, self.pieces = tuple(Parameter(name, 1.0, 0.0, 10.0) for name in names), ()


def test_breakaway_is_never_below_coulomb_and_goes_with_it_where_it_stands_there():
    order = Order(Some(KEYS[0], KEYS[1], KEYS[2], f"{KEYS[2]}@wet", f"{KEYS[1]}@wet"))
    assert order.pairs == [(2, 1), (3, 4)]
    inner = order.kept(np.array([1.0, 2.0, 1.5, 3.0, 2.0]))
    assert inner.tolist() == pytest.approx([1.0, 2.0, 2.002, 3.0, 2.0])
    assert order.at_bound(inner, np.full(5, -1.0)).tolist() == [False, False, True, False, False]
    assert not order.at_bound(inner, np.full(5, 1.0)).any()
    fold = order.together(inner, np.array([False, False, True, False, False]))
    assert (fold @ np.array([0.0, 1.0, 0.0, 0.0, 0.0])).tolist() == pytest.approx([0.0, 1.0, 1.001, 0.0, 0.0])


@pytest.mark.parametrize("seed", [1, 2])
def test_without_a_fall_there_is_no_stribeck_speed(seed):
    """What is told of breakaway is what the robot held: at least Coulomb friction, below the 2.8 N that it is not."""
    plain = AXEBOT.replace(friction=Friction(axes=AxesFriction(viscous=(0.94, 0.96, 0.01), coulomb=(2.2, 1.5, 0.099))))
    log = log_of(reference(plain, ramps(), 0.02), seed)
    fit = omnidyn.identify([log], robot_with(1.2, 2.0, 2.5, 0.03), omnidyn.OutputError(free=KEYS)).estimate
    low, high = fit.ci95[HELD]
    assert fit.ci95[KEYS[1]][0] <= low <= 2.2 <= high <= 2.7
    assert fit.value[HELD] >= fit.value[KEYS[1]]
    assert KEYS[3] in fit.unidentifiable  # how fast nothing falls
    assert "not known: Stribeck speed" in fit.verdict
    assert "no_fall" in codes(fit.warnings)


def test_a_breakaway_that_only_holds_is_within_what_held():
    """It falls within less than the log shows: the speed is no estimate, the level is between the drives of the log."""
    holds = AXEBOT.replace(
        friction=Friction(
            axes=AxesFriction(viscous=(0.94, 0.96, 0.01), coulomb=(2.2, 1.5, 0.099), breakaway=(2.8, 1.5, 0.099))
        )
    )
    fit = omnidyn.identify(
        [log_of(reference(holds, ramps(), 0.02), 2)], robot_with(1.2, 2.0, 2.5, 0.03), omnidyn.OutputError(free=KEYS)
    ).estimate
    low, high = fit.ci95[HELD]
    assert fit.ci95[KEYS[1]][0] <= low <= 2.8 <= high <= 3.6
