"""omnidyn doctor: what stands in a report of a bug, and that nothing of the user does."""

import json
import platform
from importlib import metadata
from pathlib import Path

import numpy
import pytest

import omnidyn
from omnidyn.cli import doctor, main


def seen(capsys, *arguments):
    assert main(["doctor", *arguments]) == 0
    return capsys.readouterr().out


def test_versions_compiler_cache_and_extras_are_shown(capsys):
    out = seen(capsys)
    for words in (omnidyn.__version__, platform.python_version(), numpy.__version__, "compiler", "cache", "[rl]"):
        assert words in out
    result = json.loads(seen(capsys, "--json"))
    assert result["packages"]["numpy"] == numpy.__version__
    assert result["compiler"]["state"] == "works"
    assert result["extras"]["rl"].keys() == {"gymnasium"}
    assert {"logs", "arrays", "studio", "control"} <= result["extras"].keys()


def test_the_line_to_paste_has_no_place_of_the_user(capsys):
    line = json.loads(seen(capsys, "--json"))["line"]
    assert line == seen(capsys).splitlines()[-1]
    assert line.startswith(f"omnidyn {omnidyn.__version__}; ")
    assert not any(part in line for part in (str(Path.home()), str(Path(omnidyn.__file__).parent)))


def test_what_is_missing_or_broken_is_said(capsys, monkeypatch):
    def version(name):
        if name == "gymnasium":
            raise metadata.PackageNotFoundError(name)
        return "1"

    def broken(*_):
        raise RuntimeError("LLVM ERROR: no such processor")

    monkeypatch.setattr(doctor.metadata, "version", version)
    monkeypatch.setattr("numba.njit", broken)
    monkeypatch.setattr("omnidyn.compiled.warmed.place", broken)
    out = seen(capsys)
    assert 'gymnasium missing; pip install "omnidyn[rl]"' in out
    assert "fails, RuntimeError: LLVM ERROR: no such processor" in out
    assert "compiler fails; cache not writable; extras " in out


@pytest.mark.parametrize("arguments", [["--version"]])
def test_the_version_alone(capsys, arguments):
    assert main(arguments) == 0
    assert capsys.readouterr().out == f"omnidyn {omnidyn.__version__}\n"
