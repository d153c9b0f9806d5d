"""Lists of the robot file: the torque and EMF constant of a wheel are one number, what is known of a list is known of
its entries."""

import numpy as np

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.problem.parameters import robot_parameters
from omnidyn.model.keys import BOX, EMF, TORQUE, Key, expand
from omnidyn.model.known.told import known_priors
from omnidyn.model.robot import Prior
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

RESISTANCE = "motor.resistance_ohm"
SHEET = Prior(std=0.05, source="datasheet")
NOISE = np.array([0.005, 0.005, 0.02])  # [m/s, m/s, rad/s]


def with_motor(robot, **changes):
    """The robot in a turning frame, which the implicit engine fits, with other motors."""
    return robot.replace(body=robot.body.replace(rotating_frame=True), motor=robot.motor.replace(**changes))


def driven(robot, seconds=8.0, seed=3):
    """A log of this robot under steps of random voltages."""
    rng = np.random.default_rng(seed)
    steps = rng.uniform(-6.0, 6.0, (int(4 * seconds), robot.wheels.count))
    run = simulate(robot, np.repeat(steps, 25, axis=0), 0.01)
    assert run.twist is not None
    return Run(t=run.t, voltage=run.voltage, twist=run.twist + rng.normal(0.0, NOISE, run.twist.shape))


def also_of(robot, *keys):
    """Key -> keys that follow it and their ratios, where these keys are free."""
    return {p.name: dict(p.tied_numbers) for p in robot_parameters(robot, keys, {})}


def test_a_motor_that_is_weaker_is_found(axebot):
    """Its magnet is 10 % weaker: less torque, and less back-EMF, which lets it turn faster."""
    constants = (0.0059, 0.0053, 0.0059)
    start = with_motor(axebot, torque_constant=(0.0059,) * 3, emf_constant=(0.0059,) * 3)
    log = driven(with_motor(axebot, torque_constant=constants, emf_constant=constants))
    fit = identify(log, start, OutputError(free=["friction", TORQUE], nuisances=(), start="rest")).estimate
    for key, true in zip(expand(TORQUE, start), constants, strict=True):
        assert abs(fit.value[key] - true) < 4.0 * fit.std[key], key
        assert fit.std[key] < 0.01 * true
    np.testing.assert_allclose(fit.robot.motor.emf_constant, fit.robot.motor.torque_constant, rtol=1e-12)
    for wheel in range(3):
        torque, emf = (fit.robot.priors[f"{name}[{wheel}]"] for name in (TORQUE, EMF))
        assert emf == torque


def test_the_emf_constant_follows_wheel_by_wheel(axebot):
    k = 0.0059
    each = with_motor(axebot, torque_constant=(k, k, 2.0 * k), emf_constant=(k, 2.0 * k, k))
    assert also_of(axebot, TORQUE) == {TORQUE: {EMF: 1.0}}
    assert also_of(axebot, f"{TORQUE}[1]") == {f"{TORQUE}[1]": {f"{EMF}[1]": 1.0}}
    assert also_of(each, f"{TORQUE}[1]", f"{TORQUE}[2]") == {
        f"{TORQUE}[1]": {f"{EMF}[1]": 2.0},
        f"{TORQUE}[2]": {f"{EMF}[2]": 0.5},
    }
    one = with_motor(axebot, emf_constant=(k, 2.0 * k, k))
    assert also_of(one, TORQUE) == {TORQUE: {f"{EMF}[0]": 1.0, f"{EMF}[1]": 2.0, f"{EMF}[2]": 1.0}}


def test_an_emf_constant_that_is_free_itself_does_not_follow(axebot):
    assert also_of(axebot, TORQUE, EMF) == {TORQUE: {}, EMF: {}}
    assert also_of(axebot, f"{TORQUE}[0]", EMF) == {f"{TORQUE}[0]": {}, EMF: {}}
    assert also_of(axebot, f"{TORQUE}[0]", f"{EMF}[0]")[f"{TORQUE}[0]"] == {}
    assert also_of(axebot, TORQUE, f"{EMF}[1]")[TORQUE] == {f"{EMF}[0]": 1.0, f"{EMF}[2]": 1.0}
    assert also_of(axebot, f"{TORQUE}[0]", f"{EMF}[1]")[f"{TORQUE}[0]"] == {f"{EMF}[0]": 1.0}


def test_what_is_known_of_a_list_is_known_of_its_entries(four_wheel):
    robot = with_motor(four_wheel, resistance=(1.6, 1.7, 1.8, 1.9)).replace(priors={RESISTANCE: SHEET})
    assert known_priors(robot) == {f"{RESISTANCE}[{k}]": (ohm, 0.05) for k, ohm in enumerate((1.6, 1.7, 1.8, 1.9))}
    assert known_priors(four_wheel.replace(priors={RESISTANCE: SHEET})) == {RESISTANCE: (1.69, 0.05)}


def test_a_prior_of_four_resistances(four_wheel):
    """It holds each of them, and what is known of those that were not free stays in the file."""
    robot = with_motor(four_wheel, resistance=(1.6, 1.7, 1.8, 1.9)).replace(priors={RESISTANCE: SHEET})
    first = f"{RESISTANCE}[0]"
    fit = identify(driven(robot), robot, OutputError(free=["friction", first], nuisances=(), start="rest")).estimate
    assert fit.std[first] <= 0.05
    assert abs(fit.value[first] - 1.6) < 4.0 * fit.std[first]
    assert RESISTANCE not in fit.robot.priors
    assert [fit.robot.priors[f"{RESISTANCE}[{wheel}]"] for wheel in range(1, 4)] == [SHEET] * 3
    assert fit.robot.priors[first].origin == "identified"
    assert Key.parse(first).get(fit.robot) == fit.value[first]


def test_python_takes_names_that_stand_for_several(axebot):
    """As the command line does: "friction" for all that the robot has, a list for its entries."""
    log, plain, coulomb = driven(axebot), {"nuisances": (), "start": "rest"}, "friction.axes.coulomb"
    every = identify(log, axebot, OutputError(free="friction", profile=coulomb, **plain)).estimate
    assert tuple(every.value) == BOX
    assert tuple(identify(log, axebot, OutputError(free=[coulomb, TORQUE], **plain)).value) == (*BOX[3:], TORQUE)
    held = identify(log, axebot, OutputError(fixed=coulomb, **plain)).estimate
    assert tuple(held.value) == BOX[:3]
    alone = identify(log, axebot, OutputError(**plain)).estimate
    assert [key for key in BOX if every.ci95[key] != alone.ci95[key]] == [*BOX[3:]]
