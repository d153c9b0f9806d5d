"""What to do next after a fit to whole logs: nothing that would undo something else that is asked for."""

from pathlib import Path

import numpy as np

from omnidyn.identification.advice import advice
from omnidyn.identification.estimate import Correlation
from omnidyn.identification.lack_of_fit import Diagnosis, LackOfFit, Remedy
from omnidyn.identification.output_error.answer import Nuisance, OutputErrorEstimate
from omnidyn.identification.output_error.prepare import guesses
from omnidyn.identification.stability import Stability
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot, parse_robot
from omnidyn.statement import quoted

DISC = Remedy("friction.direction", quoted("friction along the direction of travel"), 0.5, 0.1, share=0.95, chi2=1000.0)
WHEELS = Remedy("friction.wheels", quoted("friction at each wheel"), 0.4, 0.1, share=0.9, chi2=900.0)
MASS = Remedy("body.mass_kg", quoted("another mass, 2.1 kg"), 0.5, 0.1, ("gain",), share=0.95, chi2=1000.0)
GAIN = Remedy("gain", quoted("voltages 0.8 times those logged"), 0.5, 0.1, ("body.mass_kg",), share=0.95, chi2=999.0)
FADE = Remedy("fade", quoted("a voltage that fades by 8 %"), 0.6, 0.1, share=0.99, chi2=1200.0)
SAG = Remedy("sag", quoted("a supply that sags under load"), 0.6, 0.1, share=0.99, offered=False, chi2=1200.0)


def missing(*remedies, nuisances=()):
    """What is advised where these would mend the model. nuisances: names of what was fitted beside the robot."""
    lack = LackOfFit(True, {"vx": 0.5}, {"vx": 0.1}, (), remedies, {})
    fit = OutputErrorEstimate(
        robot=load_robot("axebot"),
        value={},
        std={},
        ci95={},
        correlation=Correlation((), np.eye(0)),
        degrees_of_freedom={},
        nuisances={name: Nuisance(0.01, 0.001, (0.008, 0.012), "s") for name in nuisances},
        study=lambda: Diagnosis(lack, {}, Stability({}, ())),
    )
    return [each for each in advice(fit, None) if each.code == "missing_cause"]


def held(robot, missed=("a3",), value=()):
    """What is advised to be fitted too, of a fit that misses outputs."""
    fit = OutputErrorEstimate(
        robot=robot,
        value=dict.fromkeys(value, 1.0),
        std=dict.fromkeys(value, 0.01),
        ci95=dict.fromkeys(value, (0.98, 1.02)),
        correlation=Correlation((), np.eye(0)),
        degrees_of_freedom={},
        not_followed=dict.fromkeys(missed, 50.0),
        study=lambda: Diagnosis(LackOfFit(True, {}, {}, (), (DISC,), {}), {}, Stability({}, ())),
    )
    return [each for each in advice(fit, None) if each.code in ("held_numbers", "try_ladder")]


def test_numbers_that_a_file_gives_as_exact_are_doubted_where_the_model_does_not_follow():
    """Copied from elsewhere they are wrong, and no friction makes up for that; the ladder looks elsewhere."""
    robot = load_robot("axebot").replace(priors={})
    (one,) = held(robot)
    assert str(one) == (
        "the fit holds motor.torque_constant_Nm_A, motor.resistance_ohm, body.inertia_kg_m2, which the robot file "
        "gives as exact: fit them too (`free` friction `free` motor.torque_constant_Nm_A `free` motor.resistance_ohm "
        "`free` body.inertia_kg_m2)"
    )
    (two,) = held(robot.replace(priors={"body.inertia_kg_m2": Prior(std=0.1)}), value=["motor.resistance_ohm"])
    assert two.numbers["keys"] == ("motor.torque_constant_Nm_A",)
    assert not any(each.code == "held_numbers" for each in held(robot, missed=()))


def test_a_nuisance_is_asked_for_beside_those_that_are_fitted():
    """An option that names one leaves out the others: without its latency the next fit had a wrong rotor."""
    (one,) = missing(FADE, nuisances=["latency.twist", "gain"])
    assert str(one).endswith("fit it (`nuisances` latency.twist `nuisances` gain `nuisances` fade)")
    (alone,) = missing(FADE)
    assert str(alone).endswith("fit it (`nuisances` fade)")


def test_of_remedies_that_explain_the_same_only_the_first_is_advised():
    """Two shapes of friction, each of which explains what is missing: both together would be one too many."""
    assert [*map(str, missing(DISC, WHEELS))] == [
        "friction along the direction of travel would explain what the model leaves out: put friction.direction into "
        "the robot file, and fit again"
    ]


def test_a_limit_becomes_a_guess_of_the_file_so_that_its_other_guesses_stay_free():
    """With `free` the guesses of the file would be held: friction of 0 for 5.6 N on a robot of `init`."""
    limit = Remedy("motor.current_limit_A", quoted("a current limit of about 2.8 A"), 0.5, 0.1, share=0.9, chi2=900.0)
    (words,) = map(str, missing(limit))
    how = 'current_limit_A = { value = .., origin = "guess" }'
    assert words.endswith(f"put about that value into the robot file, {how}, and fit again")
    text = (Path(__file__).parents[2] / "src/omnidyn/model/presets/axebot.toml").read_text("utf-8")
    robot = parse_robot(text.replace("[motor]", '[motor]\ncurrent_limit_A = { value = 2.8, origin = "guess" }'))
    assert guesses(robot) == ("motor.current_limit_A",)


def test_what_the_logs_cannot_tell_apart_is_one_advice():
    words = str(*missing(MASS, GAIN, DISC))
    assert "cannot tell it from voltages 0.8 times those logged" in words
    assert "weigh the robot" in words


def test_what_explains_much_less_than_the_first_is_not_advised():
    weak = Remedy("friction.wheels", quoted("friction at each wheel"), 0.4, 0.1, share=0.75, chi2=600.0)
    assert missing(SAG, weak) == []
    assert len(missing(SAG, DISC)) == 1


def together(std):
    """What is advised where two numbers of value 2, with this standard error, have a correlation of 0.97."""
    names = ("friction.axes.coulomb[0]", "friction.axes.coulomb[1]")
    fit = OutputErrorEstimate(
        robot=load_robot("axebot"),
        value=dict.fromkeys(names, 2.0),
        std=dict.fromkeys(names, std),
        ci95=dict.fromkeys(names, (2.0 - 2.0 * std, 2.0 + 2.0 * std)),
        correlation=Correlation(names, np.array([[1.0, 0.97], [0.97, 1.0]])),
        degrees_of_freedom={},
    )
    return [each for each in advice(fit, None) if each.code == "correlated_numbers"]


def test_numbers_that_move_together_are_named_where_that_widens_them():
    """Known within 0.01 % each, they were to be "measured otherwise"."""
    assert together(0.0002) == []
    assert len(together(0.3)) == 1
