"""omnidyn tune: what it prints, writes and refuses, and its exit codes."""

import json

import pytest

from omnidyn.cli import main


@pytest.fixture
def call(tmp_path, monkeypatch, capsys):
    """Run a command in a folder of its own: (exit code, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        code = main([*arguments])
        return code, *capsys.readouterr()

    return run


QUICK = ("--path", "eight", "--duration", "1.2", "--evaluations", "3", "--draws", "1")


def test_what_it_writes_track_reads(call):
    code, out, _ = call("tune", "axebot", *QUICK, "-o", "own.toml", "--json", "--sensors", "encoder:2048")
    told = json.loads(out)
    assert code == 0
    assert told["output"] == "own.toml"
    assert set(told["options"]) >= {"faster", "integral"}
    assert told["after"]["cost"] <= told["before"]["cost"]
    assert told["sensors"] == "encoder:2048"
    assert call("track", "axebot", "--path", "eight", "--controller", "own.toml", "--duration", "1")[0] == 0
    assert call("tune", "axebot", *QUICK, "-o", "own.toml")[0] == 3
    code, out, _ = call("tune", "axebot", *QUICK, "--controller", "own.toml", "-o", "own.toml", "--force")
    assert code == 3  # an input is never replaced


@pytest.mark.parametrize(
    "arguments, code, words",
    [
        (("axebot", "--path", "eigt"), 3, "did you mean eight"),
        (("axebot", "--sensors", "encodr"), 3, "--sensors: cannot read these sensors; got encodr"),
        (("axebot", "--path", "eight", "--controller", "feedforward"), 3, "has no gains"),
        (("axebot", "--path", "eight", "--draws", "0"), 3, "--draws"),
        (("axebot", "--path", "eight", "-o", "own.csv"), 3, "ends in .toml"),
    ],
)
def test_what_it_refuses(call, arguments, code, words):
    found, out, err = call("tune", *arguments)
    assert (found, out) == (code, "")
    assert words in err
