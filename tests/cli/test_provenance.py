"""What a result says about where it comes from: version, command line, inputs with their hashes; sources of numbers."""

import hashlib
import json
import shlex

import numpy as np
import pytest

import omnidyn
from omnidyn.model.robot_file import load_robot, save_robot

VOLTAGES = "t_s,u1_V,u2_V,u3_V\n0,0,3,-3\n0.5,3,0,-3\n1,0,0,0\n"


@pytest.fixture
def files(here):
    """A robot, its commands, and a log of it with noise."""
    robot = load_robot("axebot")
    save_robot(robot, here / "robot.toml")
    (here / "u.csv").write_text(VOLTAGES)
    rng = np.random.default_rng(3)
    volts = np.repeat(rng.uniform(-5.0, 5.0, (60, 3)), 10, axis=0)
    run = omnidyn.simulate(robot, volts, 0.01)
    rows = np.column_stack([run.t, np.vstack([volts, volts[-1:]]), run.twist + rng.normal(0.0, 0.01, run.twist.shape)])
    header = "t_s,u1_V,u2_V,u3_V,vx_m_s,vy_m_s,omega_rad_s"
    np.savetxt(here / "log.csv", rows, delimiter=",", header=header, comments="", fmt="%.6g")
    return here


@pytest.mark.parametrize(
    "line, inputs",
    [
        ("deadzone robot.toml --json", {"robot.toml"}),
        ("friction robot.toml --json", {"robot.toml"}),
        ("simulate robot.toml u.csv --duration 1.5 --json", {"robot.toml", "u.csv"}),
        ("check log.csv --robot robot.toml --json", {"robot.toml", "log.csv"}),
        ("compare log.csv --robot robot.toml --json", {"robot.toml", "log.csv"}),
        ("identify log.csv --robot robot.toml --quick --json", {"robot.toml", "log.csv"}),
        ("track robot.toml --path circle --controller pid --duration 1 --seed 5 --json", {"robot.toml"}),
    ],
)
def test_results_hold_version_command_and_hashes(call, files, line, inputs):
    code, out, err = call(*shlex.split(line))
    assert code in (0, 4), err
    record = json.loads(out)["provenance"]
    assert record["omnidyn"] == omnidyn.__version__
    assert record["command"] == f"omnidyn {line}"
    hashes = {each["name"].rpartition("/")[2]: each["sha256"] for each in record["inputs"]}
    assert hashes == {name: hashlib.sha256((files / name).read_bytes()).hexdigest() for name in inputs}


def test_a_fitted_number_says_from_which_log(call, files):
    code, _, err = call("identify", "log.csv", "--robot", "robot.toml", "--quick", "-o", "fit.toml")
    assert code == 0, err
    priors = load_robot(files / "fit.toml").priors
    found = [prior for prior in priors.values() if prior.origin == "identified"]
    assert len(found) >= 4
    for prior in found:
        assert prior.std is not None
        assert prior.std > 0.0
        assert "log.csv" in prior.source
