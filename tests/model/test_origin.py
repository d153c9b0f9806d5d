"""The origin of a number: a value of the robot file. Files from before there were origins are read as they were."""

import re
import tomllib
from collections import Counter
from pathlib import Path
from typing import get_args

import pytest

from omnidyn.model.first_guess import first_guess, guessed, reasons
from omnidyn.model.keys import DIRECTION, EMF, TORQUE, all_keys
from omnidyn.model.known.told import known_priors
from omnidyn.model.robot import Origin, Prior
from omnidyn.model.robot_file import load_robot, parse_robot, preset_names, robot_to_toml

OLD = Path(__file__).with_name("old_files")  # as init and identify wrote them before there were origins, and by hand
GUESSED = ["inertia", "resistance", "torque constant", "emf constant", "gear ratio", "voltage limit", "friction"]
SMALLEST = (OLD / "init.toml").read_text("utf-8")


def old(name):
    return load_robot(OLD / f"{name}.toml")


def origins(robot):
    return Counter(prior.origin for prior in robot.priors.values())


@pytest.mark.parametrize("name", ["init", "init_like", "identify", "by_hand"])
def test_old_files_are_read_and_written_with_origins(name):
    robot = old(name)
    text = robot_to_toml(robot)
    assert parse_robot(text) == robot
    assert "origin" not in (OLD / f"{name}.toml").read_text("utf-8")
    assert text.count("origin = ") == len(robot.priors)
    assert len(all_keys(robot)) >= 14


def test_guesses_of_an_old_file():
    robot = old("init")
    assert guessed(robot) == GUESSED
    assert len(reasons(robot)) == 10
    assert origins(robot) == {"given": 4, "guess": 11}
    assert robot.priors["body.mass_kg"] == Prior(source="given", origin="given")
    assert robot.priors[TORQUE] == Prior(std=0.01, source="guess", origin="guess")
    assert set(known_priors(robot)) == {key for key, prior in robot.priors.items() if prior.std}


def test_what_an_old_file_took_from_another_robot_is_no_guess():
    robot = old("init_like")
    assert guessed(robot) == []
    assert origins(robot) == {"given": len(robot.priors)}
    assert robot.priors["motor.gear_ratio"] == Prior(std=4.8, source="like robotino", origin="given")


def test_what_was_identified_in_an_old_file():
    """Its std are of a log, and no prior of the next fit."""
    robot = old("identify")
    fitted = {TORQUE, EMF, f"{DIRECTION}.coulomb[0]", f"{DIRECTION}.coulomb[1]", f"{DIRECTION}.yaw_coulomb"}
    assert {key for key, prior in robot.priors.items() if prior.origin == "identified"} == fitted
    assert robot.priors[TORQUE].source == "identified: output error, drive.csv, 601 rows"
    assert set(known_priors(robot)) == {key for key, prior in robot.priors.items() if prior.std} - fitted
    assert "torque constant" not in guessed(robot)


def test_words_by_hand():
    robot = old("by_hand")
    assert {key: prior.origin for key, prior in robot.priors.items() if prior.origin != "given"} == {
        "body.inertia_kg_m2": "guess",
        EMF: "guess",
        "friction.axes.viscous[2]": "identified",
    }
    assert robot.priors["body.inertia_kg_m2"].source == "guess: a disc"
    assert robot.priors["motor.resistance_ohm"] == Prior(std=0.1, source="datasheet")
    assert robot.priors["wheels.robot_radius_m"] == Prior(std=0.002)
    assert known_priors(robot)["motor.resistance_ohm[2]"] == (2.1, 0.1)


@pytest.mark.parametrize("origin", get_args(Origin))
@pytest.mark.parametrize("source", ["", "guess", "identified: a log", "maxon 118746"])
def test_an_origin_that_is_given_counts_whatever_the_words(origin, source):
    told = f'mass_kg = {{ value = 8.0, std = 0.1, source = "{source}", origin = "{origin}" }}'
    robot = parse_robot(SMALLEST.replace('mass_kg = { value = 8.0, source = "given" }', told))
    assert robot.priors["body.mass_kg"] == Prior(std=0.1, source=source, origin=origin)
    assert tomllib.loads(robot_to_toml(robot))["body"]["mass_kg"]["origin"] == origin
    assert ("body.mass_kg" in known_priors(robot)) == (origin != "identified")
    assert ("mass" in guessed(robot)) == (origin in ("guess", "joint"))


GUESSED_OF = {
    "robotino": ["inertia", "voltage limit", "kp of the speed loop", "rate", "friction"],
    "lekiwi": [
        "mass",
        "inertia",
        "voltage limit",
        "rotor inertia",
        "kp of the speed loop",
        "ki of the speed loop",
        "rate",
        "friction",
    ],
}


@pytest.mark.parametrize("name", preset_names())
def test_the_guesses_of_a_preset_are_marked(name):
    assert guessed(load_robot(name)) == GUESSED_OF.get(name, [])


def test_a_guess_without_a_std_is_as_wide_as_that_of_a_new_robot():
    """A guess is never exact: a fit must be free to leave it, as it leaves those of `init`."""
    robot = first_guess("new", load_robot("four-wheel").wheels, 8.0)
    bare = re.sub(r", std = [^,}]*", "", robot_to_toml(robot))
    assert "std" not in bare
    assert parse_robot(bare).priors == robot.priors


def test_a_guess_that_has_no_width_stays_as_it_is():
    """A drawing, nothing, and words."""
    text = robot_to_toml(load_robot("four-wheel").replace(priors={}))
    told = re.sub(r'kind = ("\w+")', r'kind = { value = \1, origin = "guess" }', text)
    told = re.sub(r"(azimuth_deg|rotor_inertia_kg_m2) = ([^#\n]+)", r'\1 = { value = \2, origin = "guess" }', told)
    robot = parse_robot(told)
    assert robot.priors
    assert all(prior.std is None for key, prior in robot.priors.items() if "rotor" not in key)


def test_a_supply_that_is_a_guess_is_as_wide_as_the_limit_of_the_voltage():
    """As of a battery: from 1 to 100 V, as a friction is, none is."""
    text = robot_to_toml(load_robot("four-wheel").replace(priors={}))
    text = re.sub(r"\[drive\]\n(?:[^\[\n].*\n)*", "", text)
    robot = parse_robot(
        text + '\n[drive]\nkind = "duty"\nsupply_V = { value = 12.0, origin = "guess" }\n',
    )
    assert robot.priors["drive.supply_V"].std == 6.0
