"""What is free unless it is said: the friction that the robot has, wherever it acts; and what to do about guesses."""

import numpy as np
import pytest

from omnidyn.identification.advice import advice
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.prepare import expand_keys, free_by_default, guesses
from omnidyn.identification.output_error.problem.parameters import Parameter
from omnidyn.identification.validation import validate
from omnidyn.logs.read_log import read_log
from omnidyn.logs.run_file import write_run
from omnidyn.model.deadzone import push_per_volt
from omnidyn.model.dynamics import damping
from omnidyn.model.first_guess import first_guess
from omnidyn.model.keys import BOX, ROTOR, Key
from omnidyn.model.known.told import known_priors
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation

DIRECTION = (
    "friction.direction.coulomb[0]",
    "friction.direction.coulomb[1]",
    "friction.direction.viscous",
    "friction.direction.yaw_coulomb",
    "friction.direction.yaw_viscous",
)
RESISTANCE = "motor.resistance_ohm"
GUESSES = ("body.inertia_kg_m2", RESISTANCE, "motor.torque_constant_Nm_A", "motor.gear_ratio")
VISCOUS = (DIRECTION[2], DIRECTION[4])


@pytest.fixture(scope="module")
def new():
    """As `init` writes it: its rotors are a guess, too."""
    return first_guess("new", load_robot("axebot").wheels, 1.5)


@pytest.fixture(scope="module")
def robot(new):
    """The same, without rotors: all forces scale with a mass that is known."""
    priors = {key: prior for key, prior in new.priors.items() if key != ROTOR}
    return new.replace(motor=new.motor.replace(rotor_inertia=0.0), priors=priors)


def test_it_is_the_friction_that_the_robot_has(robot):
    assert free_by_default(robot) == DIRECTION
    assert free_by_default(load_robot("axebot")) == BOX
    assert expand_keys(["friction"], robot) == DIRECTION
    assert expand_keys(["friction"], load_robot("axebot")) == BOX
    assert expand_keys(["friction.direction.coulomb"], robot) == DIRECTION[:2]
    off = Key.parse("friction.direction.yaw_coulomb").set(robot, 0.0)  # 0 has no slope: a level that is off stays off
    assert "friction.direction.yaw_coulomb" not in free_by_default(off)


def log_of(robot, resistance):
    """A log of a robot whose friction along x is 2 N, and whose motors have so many times the resistance."""
    true = Key.parse(DIRECTION[0]).set(robot, 2.0)
    true = Key.parse(RESISTANCE).set(true, resistance * true.motor.resistance)
    rng, volts = np.random.default_rng(0), 1.5 * np.vstack([np.zeros((10, 3)), excitation(6.0, 25.0)])
    run = simulate(true, np.clip(volts, -6.0, 6.0), 0.04)
    noisy = run.twist + 0.005 * rng.standard_normal(run.twist.shape)
    return run.replace(twist=noisy, wheel_speed=None, current=None, pose=None), true


@pytest.fixture(scope="module")
def wrong(robot):
    """A log of motors of 0.6 times the resistance that `init` guessed, and the fit that follows from `init`."""
    log, true = log_of(robot, 0.6)
    return log, true, identify(log, robot, OutputError(start="rest", nuisances=())).estimate


def test_guesses_are_free_so_that_friction_comes_out_right_beside_a_wrong_motor(wrong):
    _, true, fit = wrong
    assert set(fit.value) == {*DIRECTION, *GUESSES}
    told = set(fit.value) - set(fit.unidentifiable)
    assert {DIRECTION[0], DIRECTION[1], DIRECTION[3], RESISTANCE, "body.inertia_kg_m2"} <= told
    for name in told:
        assert abs(fit.value[name] - Key.parse(name).get(true)) < 4.0 * fit.std[name], name


def test_rotors_that_are_a_guess_are_in_the_intervals(new):
    """They may weigh a tenth of the robot: friction is told to a tenth, and no better."""
    log, true = log_of(new, 0.6)
    fit = identify(log, new, OutputError(start="rest", nuisances=())).estimate
    assert set(fit.value) == {*DIRECTION, *GUESSES, ROTOR}
    assert ROTOR in fit.unidentifiable
    for name in (DIRECTION[0], DIRECTION[1], DIRECTION[3], RESISTANCE):
        assert name not in fit.unidentifiable
        value = Key.parse(name).get(true)
        assert abs(fit.value[name] - value) < 3.0 * fit.std[name]
        assert 0.05 * value < fit.std[name] < 0.2 * value


def test_what_only_the_guess_holds_is_not_determined_and_named(wrong):
    """Of torque constant and gear only the product shows; of viscous friction only the sum with the back-EMF."""
    fit = wrong[2]
    assert {"motor.torque_constant_Nm_A", "motor.gear_ratio", *VISCOUS} <= set(fit.unidentifiable)
    text = fit.summary()
    assert "not determined" in text
    assert " inf" not in text
    own = fit.to_dict()["parameters"]["motor.gear_ratio"]
    assert (own["std"], own["ci95"]) == (None, [None, None])
    assert own["value"] > 0.0
    wide = [each for each in advice(fit, None) if each.code in ("wide_intervals", "wide_by_misfit")]
    assert not any("motor.gear_ratio" in each.numbers["keys"] for each in wide)


def test_what_is_known_together_is_named_with_an_interval(wrong):
    """The sums that the logs determine hold the truth, where their parts are not determined."""
    _, true, fit = wrong
    found = {one.name: one for one in fit.combinations}
    assert set(found) == {f"{kind}.{axis}" for kind in ("damping", "push") for axis in ("x", "y", "yaw")}
    assert [found[f"damping.{axis}"].unit for axis in ("x", "y", "yaw")] == ["N s/m", "N s/m", "N m s"]
    for kind, of in (("damping", damping), ("push", push_per_volt)):
        for axis, value in zip(("x", "y", "yaw"), of(true), strict=True):
            one = found[f"{kind}.{axis}"]
            assert abs(one.value - value) < 4.0 * one.std < 0.2 * value
            assert one.ci95[0] < one.value < one.ci95[1]
    assert "damping.x" in [one["name"] for one in fit.to_dict()["combinations"]]


def test_the_robot_that_is_written_moves_as_the_log_does_and_keeps_its_guesses(wrong, robot):
    """Its values go together; the origin and the width of a guess stay, for its std would count the log twice."""
    _, true, fit = wrong
    assert np.allclose(damping(fit.robot), damping(true), rtol=0.05)
    assert np.allclose(push_per_volt(fit.robot), push_per_volt(true), rtol=0.05)
    gear, before = fit.robot.priors["motor.gear_ratio"], robot.priors["motor.gear_ratio"]
    assert gear.origin == "joint"  # a guess that the fit changed together with others
    assert gear.std / fit.robot.motor.gear_ratio == pytest.approx(before.std / robot.motor.gear_ratio)
    assert fit.robot.priors[RESISTANCE].origin == "identified"
    assert fit.robot.motor.emf_constant == fit.robot.motor.torque_constant


def test_a_guess_that_is_held_is_named_where_the_model_misses_something(wrong, robot):
    log, _, _ = wrong
    fit = identify(log, robot, OutputError(start="rest", nuisances=(), free="friction")).estimate
    told = " ".join(str(one) for one in advice(fit, validate(fit, [log])))
    assert "motor.resistance_ohm" in told
    assert "are guesses of the robot file" in told
    assert "(`free` friction `free` motor.torque_constant_Nm_A `free` motor.resistance_ohm `free` body.inertia" in told
    fixed = identify(log, robot, OutputError(start="rest", nuisances=(), fixed=[RESISTANCE])).estimate
    assert "motor.gear_ratio" in fixed.value
    assert RESISTANCE not in fixed.value


def test_what_is_asked_for_is_doubted_by_the_check_too(robot, tmp_path):
    """A back-EMF that the logs contradict is no fault of theirs where the torque constant is fitted."""
    exact, share = robot.replace(priors={}), 0.3
    magnet = {name: share * getattr(robot.motor, name) for name in ("torque_constant", "emf_constant")}
    run, _ = log_of(robot.replace(motor=robot.motor.replace(**magnet)), share)
    log = read_log(write_run(run, tmp_path / "log.csv"), recorded=True)
    assert "energy" in codes(identify(log, exact, OutputError(start="rest", nuisances=()), quick=True))
    free = ("friction", "motor.torque_constant_Nm_A", RESISTANCE)
    mended = identify(log, exact, OutputError(start="rest", nuisances=(), free=free), quick=True)
    assert "energy" not in codes(mended)


def codes(found):
    """The errors of the logs behind an identification."""
    return {finding.code for verdict in found.verdicts for finding in verdict.findings if finding.severity == "error"}


def test_half_and_twice_of_a_guess_are_equally_far_from_it():
    """The prior of a number that must be positive is one of its logarithm."""
    p = Parameter(RESISTANCE, 3.0, 1e-3, 1e3, True, (3.0, 3.0))
    mean, std = p.inner_prior
    assert std == 1.0
    assert p.inner(6.0) - mean == pytest.approx(mean - p.inner(1.5))
    assert Parameter(DIRECTION[0], 3.0, 0.0, 1e3, prior=(3.0, 2.0)).inner_prior == (3.0, 2.0)


def test_a_setting_or_a_drawing_is_not_free_by_default(robot):
    known = {"wheels.azimuth_deg": Prior(std=1.0), "motor.voltage_limit_V": Prior(std=1.0)}
    assert guesses(robot.replace(priors=known)) == ()
    assert guesses(robot.replace(priors=known), has_loop=True) == ("motor.voltage_limit_V",)
    magnet = {f"motor.{name}": Prior(std=1e-3) for name in ("torque_constant_Nm_A", "emf_constant_Vs_rad")}
    assert guesses(robot.replace(priors=magnet)) == ("motor.torque_constant_Nm_A",)  # the other one follows


def test_what_a_robot_no_longer_has_is_no_guess(robot):
    """A file with a speed loop whose drive was exchanged in Python: the std of its rate is left over."""
    assert known_priors(robot.replace(priors={"drive.rate_Hz": Prior(std=1.0)})) == {}
