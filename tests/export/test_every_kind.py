"""Every kind with twenty random robots: written and read back as what it is, or refused as the table says.

What each reader finds in the numbers stands in the tests of each kind; here it is that no robot falls between.
"""

import csv
import io
import json
import shutil
import subprocess
import xml.etree.ElementTree as ET
import zipfile

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.export.features import FEATURES, LEAVES_OUT, PARTLY, REFUSES, cell
from omnidyn.export.kinds import KINDS, maker
from omnidyn.model.drive import Drive
from tests.support.exported import STRICT, exact_robot, sloping
from tests.support.mixed_robots import random_robot, with_centre, with_spin

ROBOTS = [
    *(random_robot(seed) for seed in range(8)),
    *(with_spin(random_robot(seed), seed) for seed in range(14, 17)),
    *(exact_robot(seed) for seed in range(4)),
    sloping(exact_robot(0)),
    sloping(random_robot(0)),
    with_centre(exact_robot(1), 1),
    with_centre(random_robot(3), 3),
    exact_robot(2).replace(drive=Drive(voltage_map=((1.0, 2.0), (5.0, 5.0)))),
]

MORE_ROBOTS = [
    *(random_robot(seed) for seed in range(8, 14)),
    *(with_spin(random_robot(seed), seed) for seed in range(17, 20)),
    *(exact_robot(seed) for seed in range(4, 10)),
]


def read_back(made, folder):
    """What a parser that is not ours says of each file."""
    if made.kind in ("json",):
        json.loads(made.text)
    elif made.kind in ("mjcf", "urdf", "sdf"):
        ET.fromstring(made.text)
    elif made.kind == "fmu":
        (content,) = made.files.values()
        assert zipfile.ZipFile(io.BytesIO(content)).testzip() is None
    elif made.kind == "c-model":
        made.write(folder / "c")
        if shutil.which("gcc"):
            command = ["gcc", *STRICT, "-O0", "-fsyntax-only", "omnidyn_step.c"]
            subprocess.run(command, cwd=folder / "c", check=True)
    elif made.kind == "c-controller":
        made.write(folder / "control")
        if shutil.which("gcc"):
            command = ["gcc", *STRICT, "-O0", "-fsyntax-only", "omnidyn_control.c"]
            subprocess.run(command, cwd=folder / "control", check=True)
    elif made.kind == "wpilib":
        compile(made.files["robot_gains.py"], "robot_gains.py", "exec")
    elif made.kind == "gains":
        assert list(csv.DictReader(line for line in made.text.splitlines() if not line.startswith("#")))
    elif made.kind == "ros2-control":
        ET.fromstring(made.files["robot.urdf"])
    for content in made.files.values():
        if isinstance(content, str):
            assert "nan" not in content.lower().split()
            assert content.endswith("\n")


@pytest.mark.parametrize(
    "robot",
    [*ROBOTS, *MORE_ROBOTS],
    ids=lambda robot: robot.name.replace(" ", "-"),
)
@pytest.mark.some(8)
def test_written_or_refused_as_the_table_says(robot, tmp_path):
    for kind in KINDS:
        has = [name for name, feature in FEATURES.items() if feature.has(robot)]
        refused = [name for name in has if cell(kind, name).does == REFUSES]
        options = {"compiled": False} if kind == "fmu" else {}
        if refused:
            with pytest.raises(UnsupportedError) as caught:
                maker(kind)(robot, **options)
            assert FEATURES[refused[0]].words in str(caught.value)
            continue
        made = maker(kind)(robot, **options)
        read_back(made, tmp_path)
        for name in has:  # what is left out is said, in the result and in the file
            if cell(kind, name).does in (PARTLY, LEAVES_OUT):
                assert any(FEATURES[name].words in words for words in made.missing)
        if kind not in ("json", "fmu"):
            first = next(iter(made.files.values()))
            for words in made.missing:
                assert words[:60].replace("--", "- -") in first


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "change",
    [
        {"body": {"mass_kg": 1e5, "inertia_kg_m2": 1e6}},
        {"body": {"mass_kg": 1e-4, "inertia_kg_m2": 1e-9}},
        {"wheels": {"robot_radius_m": 100.0, "wheel_radius_m": 10.0}},
        {"wheels": {"robot_radius_m": 1e-3, "wheel_radius_m": 1e-3}},
        {"motor": {"resistance_ohm": 1e6, "gear_ratio": 1e-3}},
        {"motor": {"resistance_ohm": 1e-6, "gear_ratio": 1e5}},
        {"friction": {"axes": {"viscous": (0.0, 0.0, 0.0), "coulomb": (0.0, 0.0, 0.0)}}},
        {"friction": {"axes": {"viscous": (1e6, 1e6, 1e6), "coulomb": (1e6, 1e6, 1e6)}}},
        {"friction": {"axes": {"viscous": (0.0, 0.0, 0.0), "coulomb": (1e-300, 5e-324, 0.1)}}},
    ],
)
@pytest.mark.some(30)
def test_huge_and_tiny_numbers_are_written_or_refused_in_words(kind, change, tmp_path):
    plain = omnidyn.load_robot("axebot")
    ((part, values),) = change.items()
    robot = plain.replace(
        **{
            part: type(getattr(plain, part)).model_validate(
                {**getattr(plain, part).model_dump(by_alias=True), **values}
            )
        }
    )
    options = {"compiled": False} if kind == "fmu" else {}
    with np.errstate(all="ignore"):
        try:
            read_back(maker(kind)(robot, **options), tmp_path)
        except InputError as error:
            assert "expected" in str(error)  # noqa: PT017  refused, in words
