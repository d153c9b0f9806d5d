"""export json, and back: the robot to the last bit, what is known of it included; the published schema."""

import json
from pathlib import Path

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError
from omnidyn.export.robot_json import SCHEMA_FILE, json_schema, robot_json
from omnidyn.interop.robot_json import robot_of_json
from omnidyn.model.known.told import with_correlation
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import preset_names
from tests.support.mixed_robots import random_robot, with_spin

DOCS = Path(__file__).resolve().parents[2] / "docs"


def known_robot():
    robot = omnidyn.load_robot("axebot")
    stds = {"friction.axes.coulomb[0]": 0.1, "friction.axes.viscous[0]": 0.05, "motor.resistance_ohm": 0.02}
    robot = robot.replace(
        priors={key: Prior(std=std, source='a "bench" \\ test', origin="measured") for key, std in stds.items()}
    )
    return with_correlation(robot, ["friction.axes.coulomb[0]", "friction.axes.viscous[0]"], [[1.0, -0.7], [-0.7, 1.0]])


@pytest.mark.parametrize("robot", [*map(omnidyn.load_robot, preset_names()), known_robot()], ids=lambda r: r.name)
def test_the_robot_comes_back(robot):
    assert robot_of_json(robot_json(robot).text) == robot


@pytest.mark.parametrize("seed", range(30))
def test_thirty_random_robots_come_back(seed):
    robot = with_spin(random_robot(seed), seed)
    assert robot_of_json(robot_json(robot).text) == robot


def test_the_covariance_is_std_and_correlation_multiplied_out():
    found = json.loads(robot_json(known_robot()).text)["covariance"]
    cov = dict(zip(found["keys"], np.array(found["matrix"]), strict=True))
    at = found["keys"].index("friction.axes.viscous[0]")
    assert cov["friction.axes.coulomb[0]"][at] == pytest.approx(-0.7 * 0.1 * 0.05, rel=1e-12)
    assert cov["friction.axes.viscous[0]"][at] == pytest.approx(0.05**2, rel=1e-12)
    assert found["units"][at] == "N s/m"


@pytest.mark.parametrize("name", ["\u202eevil", 'a"b\\c\n{}', "Größe 速度", "</robot>", "a" * 400])
def test_names_of_any_kind(name):
    robot = omnidyn.load_robot("axebot").replace(name=name)
    assert robot_of_json(robot_json(robot).text) == robot


def test_the_published_schema_is_that_of_the_model():
    published = json.loads((DOCS / SCHEMA_FILE).read_text("utf-8"))
    assert published == json_schema(), f"write docs/{SCHEMA_FILE} again: python docs/robot_keys.py"


@pytest.mark.parametrize("robot", [known_robot(), with_spin(random_robot(4), 4)], ids=["known", "mixed"])
def test_what_is_written_follows_the_schema(robot):
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.validate(json.loads(robot_json(robot).text), json_schema())
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({**json.loads(robot_json(robot).text), "more": 1}, json_schema())


GOOD = robot_json(omnidyn.load_robot("axebot")).text


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "not valid JSON"),
        ("[1, 2]", "not a robot exported by omnidyn"),
        ("[" * 100_000, "nested too deeply"),
        (GOOD.replace("1.69", "NaN"), "not a finite number; got NaN"),
        (GOOD.replace("1.69", "1e999"), "cannot use this value"),
        (GOOD.replace('"version": 1', '"version": 2'), "unknown version of the format; got 2"),
        (GOOD.replace('"version": 1', '"version": true'), "unknown version"),
        (GOOD.replace('"mass_kg": 1.5', '"mass_kg": 1.5, "mass_kg": 2'), "a key stands twice; got mass_kg"),
        (GOOD.replace('"mass_kg"', '"mas_kg"'), "unknown key"),
        (GOOD.replace("1.5", "9" * 5000), "not valid JSON|cannot use this value"),
        (GOOD.replace('"version": 1,', '"version": 1, "more": 2,'), "not the schema"),
    ],
)
def test_bad_files_are_refused_in_words(text, words):
    with pytest.raises(InputError, match=words):
        robot_of_json(text)
