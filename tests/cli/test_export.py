"""omnidyn export and omnidyn import: what is written, what is said, what is refused."""

import json
import os

import pytest

import omnidyn


def test_there_and_back(call, here):
    code, out, err = call("export", "json", "axebot", "-o", "robot.json")
    assert code == 0
    assert "axebot as json" in out
    assert "wrote robot.json" in err
    code, out, _ = call("import", "json", "robot.json", "-o", "again.toml")
    assert code == 0
    assert omnidyn.load_robot("again.toml") == omnidyn.load_robot("axebot")


def test_for_machines(call):
    code, out, _ = call("export", "json", "axebot", "-o", "robot.json", "--json")
    assert code == 0
    told = json.loads(out)
    assert told["kind"] == "json"
    assert told["output"] == ["robot.json"]
    assert told["provenance"]["inputs"][0]["name"] == "axebot"
    code, out, _ = call("import", "json", "robot.json", "--json")
    assert (code, json.loads(out)["name"]) == (0, "axebot")


def test_to_stdout(call):
    code, out, _ = call("export", "json", "axebot", "-o", "-")
    assert (code, json.loads(out)["format"]) == (0, "omnidyn robot")


def test_nothing_is_replaced_without_force(call, here):
    (here / "robot.json").write_text("mine")
    assert call("export", "json", "axebot", "-o", "robot.json")[0] == 3
    assert (here / "robot.json").read_text() == "mine"
    assert call("export", "json", "axebot", "-o", "robot.json", "--force")[0] == 0
    code, _, err = call("import", "json", "robot.json", "-o", "robot.json", "--force")
    assert (code, "would replace its own input" in err) == (3, True)


@pytest.mark.parametrize(
    "kind, name, options",
    [
        ("wpilib", "robot_gains.py", []),
        ("c-model", "omnidyn_step.c", ["--precision", "single"]),
        ("ros2-node", "drive_loop.py", []),
    ],
)
def test_a_folder_never_takes_the_place_of_what_the_export_reads(call, here, kind, name, options):
    """A robot file that is called as a file of the export, in the folder that the export writes."""
    (here / "out").mkdir()
    assert call("import", "json", *exported(call, here), "-o", "robot.toml")[0] == 0
    text = (here / "robot.toml").read_bytes()
    (here / "out" / name).write_bytes(text)
    for robot in (f"out/{name}", f"./out/../out/{name}"):
        code, _, err = call("export", kind, robot, *options, "-o", "out", "--force")
        assert (code, "the result would replace its own input" in err) == (3, True)
    (here / "link.toml").symlink_to(here / "out" / name)
    assert call("export", kind, "link.toml", *options, "-o", "out", "--force")[0] == 3
    assert (here / "out" / name).read_bytes() == text
    assert os.listdir(here / "out") == [name]
    assert call("export", kind, "robot.toml", *options, "-o", "out", "--force")[0] == 0


def exported(call, here):
    """The paper's robot as JSON: the arguments that name it."""
    assert call("export", "json", "axebot", "-o", "axebot.json")[0] == 0
    return ["axebot.json"]


def test_a_log_or_a_controller_in_the_folder_stays(call, here):
    import numpy as np

    (here / "out").mkdir()
    run = omnidyn.simulate(omnidyn.load_robot("axebot"), np.tile([0.0, 3.0, -3.0], (100, 1)), 0.01)
    omnidyn.write_run(run.replace(wheel_speed=run.wheel_speed + 0.5), here / "log.csv")
    (here / "out" / "controllers.yaml").write_bytes((here / "log.csv").read_bytes())
    code, _, err = call("export", "ros2-control", "axebot", "--log", "out/controllers.yaml", "-o", "out", "--force")
    assert (code, "the result would replace its own input" in err) == (3, True)
    (here / "loop.toml").write_text('schema = 1\ncontroller = "pid"\n[options]\nfaster = 2.0\n')
    (here / "out" / "omnidyn_control.h").symlink_to(here / "loop.toml")
    code, _, err = call("export", "c-controller", "axebot", "--controller", "loop.toml", "-o", "out", "--force")
    assert (code, "the result would replace its own input" in err) == (3, True)
    assert len(os.listdir(here / "out")) == 2


def test_help_names_every_kind(call):
    from omnidyn.export.kinds import KINDS
    from omnidyn.interop.kinds import READERS

    _, out, _ = call("export", "--help")
    assert not [kind for kind in KINDS if kind not in out]
    _, out, _ = call("import", "--help")
    assert not [kind for kind in READERS if kind not in out]


def test_a_controller_file_becomes_c(call, here):
    (here / "loop.toml").write_text('schema = 1\ncontroller = "pid"\nsource = ""\n\n[options]\nfaster = 2.0\n')
    code, out, _ = call("export", "c-controller", "axebot", "--controller", "loop.toml", "--dt", "0.01", "-o", "loop")
    assert code == 0
    assert "axebot as c-controller: omnidyn_control.h, omnidyn_control.c" in out
    assert "#define OMNIDYN_DT 0.01f" in (here / "loop" / "omnidyn_control.h").read_text()
    (here / "mpc.toml").write_text('schema = 1\ncontroller = "mpc"\nsource = ""\n\n[options]\nspeed = [1, 1, 1]\n')
    code, _, err = call("export", "c-controller", "axebot", "--controller", "mpc.toml", "-o", "mpc")
    assert (code, "no limit of the speed" in err) == (3, True)
    code, _, err = call("export", "c-model", "axebot", "--controller", "pid")
    assert (code, "--controller is not for c-model" in err) == (2, True)


def test_logs_give_the_covariances(call, here):
    import numpy as np

    run = omnidyn.simulate(omnidyn.load_robot("axebot"), np.tile([0.0, 3.0, -3.0], (100, 1)), 0.01)
    omnidyn.write_run(run.replace(wheel_speed=run.wheel_speed + 0.5), here / "log.csv")
    code, out, _ = call("export", "ros2-control", "axebot", "--log", "log.csv", "-o", "ros", "--json")
    assert code == 0
    told = json.loads(out)
    assert "from 1 log, 101 samples" in " ".join(told["notes"])
    assert told["provenance"]["inputs"][1]["name"] == "log.csv"
    assert sorted(path.name for path in (here / "ros").iterdir()) == sorted(told["files"])
    assert call("export", "ros2-control", "axebot", "-o", "ros")[0] == 3
    before = (here / "log.csv").read_bytes()
    code, _, err = call("export", "ros2-control", "axebot", "--log", "log.csv", "-o", "log.csv", "--force")
    assert (code, "the result would replace its own input" in err) == (3, True)
    assert (here / "log.csv").read_bytes() == before
    code, _, err = call("export", "json", "axebot", "--log", "log.csv")
    assert (code, "--log is not for json" in err) == (2, True)


def test_joints_are_called_as_asked_or_as_the_bag_has_them(call, here):
    from tests.support.bags import BagMaker, drive, write_ros2

    write_ros2(drive(BagMaker()), here / "bag")
    for joints, names in (("bag", [f"wheel_{k}_joint" for k in (1, 2, 3)]), ("fl,fr,back", ["fl", "fr", "back"])):
        for kind, file in (("urdf", "robot.urdf"), ("sdf", "robot.sdf"), ("ros2-control", ""), ("ros2-node", "")):
            out = f"{kind}_{names[0]}{file}"
            assert call("export", kind, "axebot", "--joints", joints, "-o", out)[0] == 0
            paths = [here / out] if file else list((here / out).iterdir())
            text = "".join(path.read_text() for path in paths)
            assert all(f'"{name}"' in text for name in names)
            assert "wheel1_joint" not in text
    code, out, _ = call("export", "ros2-control", "axebot", "--log", "bag", "-o", "ros", "--json")
    assert (code, json.loads(out)["provenance"]["inputs"][1]["name"]) == (0, "bag")
    assert "wheel_3_joint" in (here / "ros" / "controllers.yaml").read_text()
    (here / "log.csv").write_text("t_s,w1_rad_s,w2_rad_s,w3_rad_s\n0,1,2,3\n0.1,1,2,3\n")
    code, _, err = call("export", "urdf", "axebot", "--joints", "log.csv")
    assert (code, "does not say which joint is which wheel" in err) == (3, True)


@pytest.mark.parametrize(
    "arguments, code, words",
    [
        (["export", "jason", "axebot"], 3, "no such kind of export"),
        (["export", "json", "nobot"], 3, "nobot"),
        (["export", "json"], 2, "ROBOT"),
        (["export", "json", "axebot", "--height", "1"], 2, "--height is not for json"),
        (["import", "json", "nothing.json"], 3, "no such file"),
        (["import", "jason", "x"], 3, "no such kind of import"),
        (["import", "json", "nothing.json", "--like", "axebot"], 3, "--like|holds a whole robot"),
    ],
)
def test_what_is_refused(call, arguments, code, words):
    import re

    ended, out, err = call(*arguments)
    assert (ended, out) == (code, "")
    assert re.search(words, err)


def test_what_init_writes_is_exported_as_c_and_as_a_unit(call, here):
    wheels = ["--azimuth", "36,108,180,252,324", "--wheel-radius", "0.03", "--robot-radius", "0.1", "--mass", "3"]
    assert call("init", "bot", *wheels, "-o", "bot.toml")[0] == 0
    assert call("export", "c-model", "bot.toml", "--tol", "0", "-o", "fixed")[0] == 0
    assert call("export", "c-model", "bot.toml", "-o", "adaptive")[0] == 0
    fixed, adaptive = ((here / folder / "omnidyn_step.c").read_text() for folder in ("fixed", "adaptive"))
    assert ("fixed_row_of(plant" in fixed, "row_of(plant, stage, bare" in adaptive) == (True, True)
    assert call("export", "fmu", "bot.toml", "--fmi", "3", "-o", "bot.fmu")[0] == 0
    code, _, err = call("export", "fmu", "bot.toml", "--fmi", "1", "-o", "other.fmu")
    assert (code, "no such version of FMI" in err) == (3, True)
    code, _, err = call("export", "c-model", "bot.toml", "--tol", "5", "-o", "other")
    assert (code, "tolerance out of range" in err) == (3, True)
    code, _, err = call("export", "json", "bot.toml", "--tol", "0")
    assert (code, "--tol is not for json" in err) == (2, True)
