"""omnidyn sweep: what it writes and says, how it goes on, and its exit codes."""

import json

import pytest

SPEC = """
schema = 1
name = "tolerance"
robot = "mine.toml"
samples = 6
shard_rows = 2

[vary]
"friction" = { factor = [0.5, 1.5] }

[track]
path = "circle"
duration_s = 0.2
"""


@pytest.fixture
def spec(here):
    """A spec and its robot in the folder of the test."""
    from omnidyn.model.robot_file import load_robot, save_robot

    save_robot(load_robot("axebot"), "mine.toml")
    (here / "spec.toml").write_text(SPEC)
    return here


def test_a_campaign_from_its_spec_to_its_picture(spec, call):
    code, out, err = call("sweep", "spec.toml", "-o", "out", "--workers", "1", "--limit", "0.01")
    assert code == 0
    assert out.startswith("The campaign tolerance is complete: 6 samples in 3 shards.")
    assert "100 % of the samples have worst_position_m of at most 0.01" in out
    assert "omnidyn sweep merge out" in err
    (spec / "other.toml").write_text(SPEC.replace("0.2", "0.4"))
    code, _, err = call("sweep", "other.toml", "-o", "out")
    assert code == 3
    assert "track.duration_s: 0.2 -> 0.4" in err
    (spec / "mine.toml").unlink()  # a folder holds all that its campaign needs
    (spec / "out" / "shards" / "00001.parquet").unlink()
    code, out, _ = call("sweep", "status", "out", "--json")
    assert (code, json.loads(out)["verdict_code"]) == (0, "campaign_open")
    code, _, err = call("sweep", "merge", "out")
    assert code == 4
    assert "2 of 3" in err
    assert call("sweep", "resume", "out", "--workers", "1")[0] == 0
    assert call("sweep", "merge", "out")[0] == 0
    assert (spec / "out" / "merged.parquet").exists()
    assert call("sweep", "plot", "out", "-o", "picture.png", "--limit", "0.01")[0] == 0
    assert (spec / "picture.png").read_bytes()[:4] == b"\x89PNG"


def test_a_damaged_shard_is_named_with_a_command_that_mends_it(spec, call):
    call("sweep", "spec.toml", "-o", "out", "--workers", "1")
    shard = spec / "out" / "shards" / "00001.parquet"
    whole = shard.read_bytes()
    shard.write_bytes(whole + b"x")
    code, _, err = call("sweep", "resume", "out", "--workers", "1")
    assert code == 3
    assert "00001.parquet" in err
    assert "make it again with --repair: omnidyn sweep resume out" in err
    assert call("sweep", "resume", "out", "--workers", "1", "--repair")[0] == 0
    assert shard.read_bytes() == whole
    assert call("sweep", "status", "out", "--repair")[0] == 2


def test_a_shard_that_failed_ends_with_4(spec, call):
    (spec / "spec.toml").write_text(
        SPEC.replace('"friction" = { factor', '"body.mass_kg" = { std = 2.0 }\n"friction" = { factor')
    )
    code, out, err = call("sweep", "spec.toml", "-o", "out", "--workers", "1")
    assert code == 4
    assert "failed shards" in out + err
    assert "mass_kg" in out


@pytest.mark.parametrize(
    "arguments, exit_code, words",
    [
        (("spec.toml",), 2, "needs -o FOLDER"),
        (("status",), 2, "status needs a FOLDER"),
        (("status", "nowhere"), 3, "no campaign"),
        (("spec.toml", "-o", "out", "--shard", "5/4"), 3, "no such part"),
        (("spec.toml", "-o", "out", "--shard", "half"), 3, "--shard"),
        (("absent.toml", "-o", "out"), 3, "no such file"),
    ],
)
def test_what_cannot_be_done_is_said(spec, call, arguments, exit_code, words):
    code, _, err = call("sweep", *arguments)
    assert code == exit_code
    assert words in err
    assert not (spec / "out").exists()
