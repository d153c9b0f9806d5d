"""omnidyn compare: what it prints, writes and refuses, and its exit codes."""

import json
import struct

import numpy as np
import pytest

import omnidyn
from omnidyn.cli import main
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot, robot_to_toml
from omnidyn.run import Run
from tests.support.compared_logs import clean_log, coulomb_times, noisy

AXEBOT = load_robot("axebot")


@pytest.fixture
def call(tmp_path, monkeypatch, capsys):
    """Run a command in an own folder with two logs and a robot file: (exit code, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)
    omnidyn.write_run(noisy(clean_log(AXEBOT, 1), 1), "run.csv")
    cut = noisy(clean_log(AXEBOT, 2), 2)
    kept = np.r_[0:200, 240:401]
    omnidyn.write_run(cut.replace(t=cut.t[kept], **{k: v[kept] for k, v in cut.channels.items()}), "gap.csv")
    omnidyn.save_robot(coulomb_times(AXEBOT, 1.3), "wrong.toml")

    def run(*arguments):
        code = main(["compare", *arguments])
        return code, *capsys.readouterr()

    return run


def test_one_robot_one_log(call):
    code, out, err = call("run.csv", "--robot", "axebot")
    assert code == 0
    assert out.startswith("The model follows speed over the ground within 2 %, ")
    assert "\n\naxebot against run.csv: 1 free run," in out
    assert "applied: the logged voltage" in out
    rows = {line.split()[0]: line.split() for line in out.splitlines() if line.startswith(("vx ", "w3 ", "heading "))}
    assert float(rows["vx"][3]) == pytest.approx(0.01, rel=0.15)
    assert float(rows["w3"][3]) == pytest.approx(0.3, rel=0.15)
    assert float(rows["vx"][6]) > 94.0
    assert "columns of run.csv" in err


def test_a_band_in_words_and_values(call):
    known = AXEBOT.replace(name="known", priors={"friction.axes.coulomb[0]": Prior(std=0.1, origin="guess")})
    omnidyn.save_robot(known, "known.toml")
    code, out, _ = call("run.csv", "--robot", "known.toml", "--band", "--full", "--picture", "band.svg")
    assert code == 0
    assert "95 % band of known, from the std of its file" in out
    assert "warning: the band of known rests on guesses: friction.axes.coulomb[0]" in out
    with open("band.svg", encoding="utf-8") as file:
        assert "fill-opacity: 0.25" in file.read()
    told = json.loads(call("run.csv", "--robot", "known.toml", "--band", "--json")[1])["bands"]["known"]
    assert told["half_width"]["vx"] > 10.0 * told["half_width"]["vy"] >= 0.0
    assert told["guesses"] == ["friction.axes.coulomb[0]"]
    code, out, _ = call("run.csv", "--robot", "axebot", "--band")
    assert code == 0
    assert "warning: axebot has no band: no number of its file has a std" in out


@pytest.mark.parametrize("others", [(), ("--band",), ("--robot", "wrong.toml")], ids=["one", "band", "two"])
def test_prints_one_screen(call, others):
    code, out, _ = call("run.csv", "gap.csv", "--robot", "axebot", *others)
    assert code == 0
    assert len(out.splitlines()) <= 25
    assert "warning: gap.csv: 1 gap in time" in out
    whole = call("run.csv", "gap.csv", "--robot", "axebot", *others, "--full")[1]
    assert len(whole.splitlines()) > len(out.splitlines())


def test_for_machines(call):
    code, out, _ = call("run.csv", "gap.csv", "--robot", "axebot", "--robot", "wrong.toml", "--json")
    assert code == 0
    result = json.loads(out)
    assert list(result["robots"]) == ["axebot", "coulomb x 1.3"]
    assert result["difference"]["vx"]["better"] == "axebot"
    assert [segment["log"] for segment in result["segments"]] == [0, 1, 1]
    inputs = result["provenance"]["inputs"]
    assert [(each["role"], each["name"]) for each in inputs] == [
        ("robot", "axebot"),
        ("robot", "wrong.toml"),
        ("log", "run.csv"),
        ("log", "gap.csv"),
    ]
    assert all(len(each["sha256"]) == 64 for each in inputs)
    assert "restarts_at_gaps" in [warning["code"] for warning in result["warnings"]]


def test_a_folder_is_its_logs_and_segments_can_be_shown(call):
    code, out, _ = call(".", "--robot", "axebot", "--segments")
    assert code == 0
    assert "axebot against 2 logs, first gap.csv: 3 free runs" in out
    assert "segment 2: log 1, rows 200 to 360" in out


def test_fail_if_is_exit_5_with_the_numbers_and_the_result(call):
    code, out, err = call("run.csv", "--robot", "wrong.toml", "--fail-if", "vx.rmse>0.02", "--fail-if", "vx.vaf<1")
    assert code == 5
    assert "coulomb x 1.3 against run.csv" in out
    assert "1 of 2 rules of --fail-if hold for coulomb x 1.3: vx.rmse = 0.0" in err
    assert call("run.csv", "--robot", "axebot", "--fail-if", "vx.rmse>0.02")[0] == 0
    assert call("run.csv", "--robot", "axebot", "--robot", "wrong.toml", "--fail-if", "vx.rmse>0.02")[0] == 0


def test_a_model_that_follows_nothing_ends_with_4_and_is_shown(call):
    """Mirrored wheels and twist: it was exit 0. A model that follows badly is a result."""
    run = noisy(clean_log(AXEBOT, 1), 1)
    wrong = Run(t=run.t, voltage=run.voltage, wheel_speed=-np.asarray(run.wheel_speed), twist=-np.asarray(run.twist))
    omnidyn.write_run(wrong, "mirrored.csv")
    code, out, err = call("mirrored.csv", "--robot", "axebot")
    assert code == 4
    assert out.startswith("The model does not follow.")
    assert "axebot against mirrored.csv: 1 free run" in out
    assert err.splitlines()[-1].startswith("omnidyn: The model does not follow: ")
    code, out, _ = call("mirrored.csv", "--robot", "axebot", "--robot", "wrong.toml", "--json")
    assert (code, json.loads(out)["ok"]) == (4, False)
    assert call("mirrored.csv", "--robot", "axebot", "--fail-if", "vx.rmse>0.02")[0] == 5
    code, out, _ = call("run.csv", "--robot", "wrong.toml", "--json")
    assert (code, json.loads(out)["ok"]) == (0, True)


@pytest.mark.parametrize(
    "arguments, code, words",
    [
        (("run.csv", "--robot", "axebot", "--fail-if", "vx.rmsee>1"), 3, "did you mean rmse?"),
        (("run.csv", "--robot", "axebot", "--fail-if", "w7.rmse>1"), 3, "cannot judge this component; got w7"),
        (("run.csv", "--robot", "axebot", "--fail-if", "rm -rf"), 3, "cannot read this threshold"),
        (("none.csv", "--robot", "axebot"), 3, "no such file"),
        (("run.csv", "--robot", "axebott"), 3, "axebott"),
        (("run.csv", "--robot", "four-wheel"), 3, "fewer wheels than the robot; got 3 wheels; expected 4"),
        (("run.csv", "--robot", "axebot", "--apply", "duty"), 3, "does not hold this input; got duty"),
        (("run.csv", "--robot", "axebot", "--picture", "p.pdf"), 3, "cannot tell the kind of picture"),
        (("run.csv", "--robot", "axebot", "--picture", "no/p.png"), 3, "the folder does not exist"),
        (("run.csv", "--robot", "axebot", "--picture", "p.png", "--show", "i1"), 3, "--show: .*got i1"),
        (("run.csv",), 2, "--robot"),
        (("run.csv", *["--robot", "axebot"] * 3), 2, "once or twice"),
        (("--robot", "axebot"), 2, "Missing argument"),
    ],
)
def test_what_is_refused(call, arguments, code, words):
    given, out, err = call(*arguments)
    assert (given, out) == (code, "")
    assert [line for line in err.splitlines() if line.startswith("omnidyn: error: ")] == [err.splitlines()[-1]]
    import re

    assert re.search(words, err), err


def test_names_are_refused_before_anything_is_simulated(call, monkeypatch):
    import omnidyn.comparison.replay as replay

    monkeypatch.setattr(replay, "simulate_seen", lambda *_, **__: pytest.fail("simulated"))
    assert call("run.csv", "--robot", "axebot", "--fail-if", "i1.rmse>1")[0] == 3


def test_a_picture_is_written_and_not_replaced_without_force(call, tmp_path):
    code, _, err = call("gap.csv", "--robot", "axebot", "--picture", "p.png", "--show", "vx,w1")
    assert (code, "omnidyn: wrote p.png" in err) == (0, True)
    assert struct.unpack(">II", (tmp_path / "p.png").read_bytes()[16:24])[0] == 1200
    assert call("gap.csv", "--robot", "axebot", "--picture", "p.png")[0] == 3
    assert call("gap.csv", "--robot", "axebot", "--picture", "p.png", "--force")[0] == 0
    assert call("gap.csv", "--robot", "axebot", "--picture", "p.svg")[0] == 0


def test_columns_can_be_named(call, tmp_path):
    """The options of logs reach the reader: a column under another name and unit."""
    text = (tmp_path / "run.csv").read_text().replace("u1_V", "left").replace("u2_V", "front").replace("u3_V", "rear")
    (tmp_path / "own.csv").write_text(text)
    named = [f"--column={u}={name}:V" for u, name in (("u1", "left"), ("u2", "front"), ("u3", "rear"))]
    code, out, _ = call("own.csv", "--robot", "axebot", *named)
    assert (code, "applied: the logged voltage" in out) == (0, True)


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.05, -0.03)])
def test_with_the_load_of_the_log(call, tmp_path, offset):
    """In the middle; and beside it, in a turning frame, where its mass and inertia alone would not do."""
    turns = AXEBOT.replace(body=AXEBOT.body.replace(rotating_frame=any(offset)))
    load = f"mass_kg = 1\ninertia_kg_m2 = 0.01\noffset_m = {list(offset)}\n"
    file = robot_to_toml(turns) + f"\n[variations.payload.crate]\n{load}"
    (tmp_path / "own.toml").write_text(file, "utf-8")
    loaded = omnidyn.vary_robot(load_robot("own.toml"), payload="crate")
    omnidyn.write_run(noisy(clean_log(loaded, 1), 1), "loaded.csv")
    found = {}
    for name, more in (("with", ("--with", "payload=crate")), ("without", ())):
        code, out, _ = call("loaded.csv", "--robot", "own.toml", *more, "--json")
        assert code == 0
        (robot,) = json.loads(out)["robots"].values()
        found[name] = robot["overall"]["vx"]["rmse"]
    assert found["with"] == pytest.approx(0.01, rel=0.15)
    assert found["without"] > 2.0 * found["with"]


def test_two_robots_of_one_name_are_told_apart_by_their_files(call, tmp_path):
    text = (tmp_path / "wrong.toml").read_text()
    for name in ("before", "after"):
        (tmp_path / f"{name}.toml").write_text(text)
    code, out, _ = call("run.csv", "--robot", "before.toml", "--robot", "after.toml", "--json")
    assert code == 0
    assert set(json.loads(out)["robots"]) == {"before", "after"}
