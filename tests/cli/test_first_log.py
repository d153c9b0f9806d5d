"""docs/first-log.md: its commands, as they stand there, take a student's logs to a robot that is near the truth."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from omnidyn.cli import main
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "first-log.md").read_text("utf-8")
COULOMB = (2.2, 1.6)  # [N]
ROTOR = 4.4e-7  # [kg m^2]
HEAD = "millis,motor1_volts,motor2_volts,motor3_volts,rpm1,rpm2,rpm3,vx,vy,gyro_dps_z"


def commands():
    """The indented lines of the page, as arguments."""
    text = re.sub(r"\\\n\s+", "", "\n".join(re.findall(r"^    (.*)$", PAGE, re.MULTILINE)))
    return [shlex.split(line, comments=True)[1:] for line in text.splitlines() if line]


def write_logs(folder):
    """Three logs of the paper's robot on a floor that takes an ellipse, with names and units of a microcontroller.

    Its motors have rotors of 4.4 g cm^2, 13 % of its mass, of which the page knows nothing.
    """
    robot = load_robot("axebot")
    direction = DirectionFriction(coulomb=COULOMB, viscous=0.9, yaw_coulomb=0.1, yaw_viscous=0.01)
    zero = (0.0, 0.0, 0.0)
    friction = Friction(axes=AxesFriction(viscous=zero, coulomb=zero), direction=direction)
    motor, body = robot.motor.replace(rotor_inertia=ROTOR), robot.body.replace(rotating_frame=True)
    true = robot.replace(friction=friction, body=body, motor=motor)
    rng = np.random.default_rng(0)
    for k in (1, 2, 3):
        run = simulate(true, excitation(8.0, 50.0, seed=k), 0.02)
        speed = (run.wheel_speed + 0.3 * rng.normal(size=(len(run), 3))) * 30.0 / np.pi
        twist = (run.twist + [0.01, 0.01, 0.05] * rng.normal(size=(len(run), 3))) * [1.0, 1.0, 180.0 / np.pi]
        rows = np.column_stack([4123 + np.round(1e3 * run.t), run.voltage, speed, twist])
        np.savetxt(folder / f"drive{k}.csv", rows, delimiter=",", header=HEAD, comments="", fmt="%.5g")
    (folder / "voltages.csv").write_bytes((ROOT / "examples" / "voltages.csv").read_bytes())


def test_the_page_leads_from_a_log_to_a_robot(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_logs(tmp_path)
    said = []
    for arguments in commands():
        assert main(arguments) == 0, (arguments, capsys.readouterr().err)
        said.append(capsys.readouterr().out)
    assert len(said) == 5
    assert re.match(r"Usable for whole logs, .*; no warning\.", said[0])
    assert "as well as the noise allows" in " ".join(said[3].split())
    fit = load_robot(tmp_path / "fit.toml")
    assert fit.friction.direction.coulomb == pytest.approx(COULOMB, rel=0.05)
    assert fit.body.inertia == pytest.approx(load_robot("axebot").body.inertia, rel=0.05)
    python = re.findall(r"^```python\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
    exec("\n".join(python), {})
    told = capsys.readouterr().out
    assert "Usable for whole logs" in told
    assert "friction.direction.coulomb[0]" in told
    assert "rmse" in told
    assert (tmp_path / "friction.png").read_bytes().startswith(b"\x89PNG")
