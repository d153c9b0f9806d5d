"""docs/robot-file.md: every key of the model is on it as it is, and every example loads."""

import re
from pathlib import Path

import pytest

from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot, parse_robot, preset_names
from omnidyn.model.variations import Variations
from tests.support.robot_keys import KEYS, MADE

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "robot-file.md").read_text("utf-8")
EXAMPLES = re.findall(r"<!-- example(?: in ([a-z.]+))? -->\n```toml\n(.*?)```", PAGE, re.DOTALL)
SMALLEST = EXAMPLES[0][1]


def test_the_tables_are_those_of_the_model():
    assert MADE.filled(PAGE) == PAGE, "write them again: python docs/robot_keys.py"


def test_there_are_as_many_keys_as_numbers_in_the_model():
    def count(model):
        inner = [field.annotation for field in model.model_fields.values()]
        return sum(count(each) if hasattr(each, "model_fields") else 1 for each in inner)

    others = len({"name", "source", "priors", "correlation", "log", "sensors"}) + count(Variations)
    assert len(KEYS) == count(Robot) - others


def test_no_key_is_explained_that_is_not_there():
    assert list(MADE.MEANING) == [f"{each.table}.{each.key}" for each in KEYS]


@pytest.mark.parametrize("key", KEYS, ids=lambda key: f"{key.table}.{key.key}")
def test_every_key_is_listed_with_what_it_means(key):
    assert f"<!-- keys of {key.table} -->" in PAGE
    assert f"| `{key.key}` | {key.unit} |" in PAGE
    assert f"| {key.meaning} | {key.default} | {key.allowed} |" in PAGE
    assert key.allowed
    assert key.unit or '"' in key.allowed or "true" in key.allowed or "points" in key.allowed


@pytest.mark.parametrize(
    "table, key, unit, default, allowed",
    [
        ("body", "mass_kg", "kg", "needed", "0.0001 to 100000"),
        ("body", "rotating_frame", "", "false", "true, false"),
        ("wheels", "azimuth_deg", "degree", "needed", "3 to 16 × -360 to 360"),
        ("motor", "gear_ratio", "1", "needed", "0.001 to 100000; or one per wheel"),
        ("motor", "current_limit_A", "A", "none", "1e-06 to 1e+06; or one per wheel"),
        ("drive", "off", "", '"brake"', '"brake", "coast"'),
        ("drive", "kp_V_s_rad", "V s/rad", "0", "0 to 1e+06; or one per wheel"),
        ("friction.axes", "coulomb", "N, N, N m", "needed", "3 × 0 to 1e+06"),
        ("friction.direction", "coulomb", "N", "[0, 0]", "2 × 0 to 1e+06"),
    ],
)
def test_some_keys_by_hand(table, key, unit, default, allowed):
    (found,) = [each for each in KEYS if (each.table, each.key) == (table, key)]
    assert (found.unit, found.default, found.allowed) == (unit, default, allowed)


@pytest.mark.parametrize("table, text", EXAMPLES)
def test_every_example_loads_in_its_table_and_does_something(table, text):
    """Its keys take the place of those of the smallest file."""
    assert parse_robot(SMALLEST).name == "smallest"
    if not table:
        return
    keys = re.findall(r"^(\w+) =", text, re.MULTILINE)
    kept = re.sub(rf"^({'|'.join(keys)}) = .*\n", "", SMALLEST, flags=re.MULTILINE)
    head = f"[{table}]\n"
    file = kept.replace(head, head + text) if head in kept else f"{kept}\n{head}{text}"
    robot = parse_robot(file)
    assert robot != parse_robot(SMALLEST) or "kind" in keys


def test_every_drive_and_every_friction_key_has_an_example():
    shown = {(table, key) for table, text in EXAMPLES for key in re.findall(r"^(\w+) =", text, re.MULTILINE)}
    wanted = {(each.table, each.key) for each in KEYS if each.table.startswith(("drive", "friction"))}
    assert wanted <= shown
    for kind in ("voltage", "duty", "speed"):
        assert f'kind = "{kind}"' in PAGE


def test_what_is_preset_is_named():
    listed = re.findall(r"^\| `([a-z0-9-]+)` \| [^|]+ \|$", PAGE, re.MULTILINE)
    assert sorted(listed) == preset_names()
    assert load_robot("robotino").name in listed
