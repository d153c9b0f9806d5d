"""The recipe of conda says what pyproject.toml says; its version is tested with the others in test_release.py.

Nothing is built here: RELEASING.md has the command.
"""

import re
import tomllib
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
RECIPE = yaml.safe_load((ROOT / "recipe" / "recipe.yaml").read_text("utf-8"))
TOML = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PROJECT = TOML["project"]
CONDA_NAMES = {"matplotlib": "matplotlib-base"}  # without the toolkits of windows, which omnidyn does not use


def as_conda(requirement):
    """ "numpy>=2.0" as conda writes it: "numpy >=2.0"."""
    name, bound = re.fullmatch(r"([\w-]+)(.*)", requirement).groups()
    return f"{CONDA_NAMES.get(name, name)} {bound}"


def test_it_is_the_same_package():
    assert RECIPE["package"] == {"name": PROJECT["name"], "version": "${{ version }}"}
    about = RECIPE["about"]
    assert (about["license"], about["summary"]) == (PROJECT["license"], PROJECT["description"])
    assert [about["license_file"]] == PROJECT["license-files"]
    assert (ROOT / about["license_file"]).is_file()


def test_it_needs_the_same():
    python = f"python {PROJECT['requires-python']}"
    run, host = RECIPE["requirements"]["run"], RECIPE["requirements"]["host"]
    assert run == [python, *map(as_conda, PROJECT["dependencies"])]
    assert host == [python, "pip", *map(as_conda, TOML["build-system"]["requires"])]


def test_it_has_the_same_commands():
    assert RECIPE["build"]["python"]["entry_points"] == [f"{a} = {b}" for a, b in PROJECT["scripts"].items()]
    assert {line.split()[0] for test in RECIPE["tests"] for line in test.get("script", ())} == set(PROJECT["scripts"])
