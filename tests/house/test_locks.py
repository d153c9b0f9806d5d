"""The two lock files: pinned, hashed, without addresses, and of one mind."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LEVELS = ("core", "everything")
PIN = re.compile(r"(?P<name>[a-z0-9-]+)==(?P<version>[0-9][^ ;]*)(?: ; (?P<marker>.+))?")


def pins(level: str) -> dict[str, set[str]]:
    """From "name==version ; marker" to its hashes."""
    text = (ROOT / "locks" / f"{level}.txt").read_text()
    entries = [entry.split(" \\\n") for entry in re.split(r"\n(?=\S)", text.strip())]
    return {first.strip(): {line.strip() for line in rest} for first, *rest in entries}


def names(level: str) -> set[str]:
    return {pin.split("==")[0] for pin in pins(level)}


def wanted(requirement: str) -> str:
    return re.match(r"[\w-]+", requirement).group().lower()


@pytest.mark.parametrize("level", LEVELS)
def test_every_line_is_a_pin_with_hashes(level):
    for pin, hashes in pins(level).items():
        assert PIN.fullmatch(pin), pin
        assert hashes, pin
        assert all(re.fullmatch(r"--hash=sha256:[0-9a-f]{64}", one) for one in hashes), pin


def test_everything_holds_the_pins_of_core():
    core, everything = pins("core"), pins("everything")
    assert {pin: everything.get(pin) for pin in core} == core


def test_the_locks_hold_what_pyproject_asks_for():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    core = {wanted(one) for one in project["project"]["dependencies"]}
    groups = [*project["project"]["optional-dependencies"].values(), project["dependency-groups"]["dev"]]
    assert core <= names("core")
    assert core | {wanted(one) for group in groups for one in group} <= names("everything")
