"""fmu: valid under fmpy, and the engine to 1e-9 wherever the step is exact; no Python in it."""

import shutil
import zipfile

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import UnsupportedError
from omnidyn.export.code.fmu import OUTPUTS, fmu
from tests.support.exported import exact_robot, program

fmpy = pytest.importorskip("fmpy")
pytestmark = [
    pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]
ROBOT = omnidyn.load_robot("axebot")


def simulated(robot, folder, volts, dt, start=None):
    """Outputs at the end of each step, by fmpy. Shape (rows, 6)."""
    path = fmu(robot).write(folder / "robot.fmu", force=True)[0]
    t = np.arange(len(volts)) * dt
    kinds = [("time", float), *((f"u{k + 1}_V", float) for k in range(volts.shape[1]))]
    given = np.array([(now, *row) for now, row in zip(t, volts, strict=True)], dtype=kinds)
    values = {f"start_{name}": value for name, value in (start or {}).items()}
    found = fmpy.simulate_fmu(
        str(path), stop_time=len(volts) * dt, step_size=dt, output_interval=dt, input=given, start_values=values
    )
    return np.stack([found[name] for name in OUTPUTS], axis=1)


@pytest.mark.parametrize("robot", [ROBOT, exact_robot(3), exact_robot(2)], ids=["axebot", "inductance", "dead band"])
def test_it_is_the_engine(robot, tmp_path):
    from fmpy.validation import validate_fmu

    dt, volts = 2.0**-9, program(robot, 5, 300)
    run = omnidyn.simulate(robot, volts, dt)
    found = simulated(robot, tmp_path, volts, dt)
    assert validate_fmu(str(tmp_path / "robot.fmu")) == []
    assert len(found) == len(run)
    np.testing.assert_allclose(found, np.hstack([run.twist, run.pose]), rtol=0, atol=1e-9)


def test_at_rest_for_a_minute_it_is_exactly_at_rest(tmp_path):
    volts = np.tile([0.0, 0.5, -0.5], (960, 1)) * omnidyn.breakaway_voltage(ROBOT, [0.0, 1.0, -1.0])
    assert not simulated(ROBOT, tmp_path, volts, 2.0**-4).any()


def test_it_starts_where_it_is_told(tmp_path):
    start = dict(zip(OUTPUTS, (0.3, -0.2, 1.0, 1.0, 2.0, 0.5), strict=True))
    dt, volts = 2.0**-7, np.zeros((20, 3))
    run = omnidyn.simulate(ROBOT, volts, dt, twist=(0.3, -0.2, 1.0), pose=(1.0, 2.0, 0.5))
    found = simulated(ROBOT, tmp_path, volts, dt, start)
    np.testing.assert_allclose(found, np.hstack([run.twist, run.pose]), rtol=0, atol=1e-12)


@pytest.mark.parametrize("start", [1e10, 1001.0, float("nan")])
def test_a_start_that_no_robot_has_is_refused(start, tmp_path):
    with pytest.raises(Exception, match=r"fmi2SetReal.*status"):
        simulated(ROBOT, tmp_path, np.zeros((5, 3)), 0.01, {"omega_rad_s": start})


def test_a_step_that_would_take_hours_is_refused(tmp_path):
    volts = np.array([[3.0, 5.0, 6.0]])
    with pytest.raises(Exception, match=r"fmi2DoStep.*status"):
        simulated(ROBOT, tmp_path, volts, 1e5)
    assert np.isfinite(simulated(ROBOT, tmp_path, volts, 1.0)).all()


def test_the_same_robot_gives_the_same_bytes():
    assert fmu(ROBOT).files == fmu(ROBOT).files


def test_without_a_library_the_sources_compile_alone(tmp_path):
    path = fmu(ROBOT, compiled=False).write(tmp_path / "robot.fmu")[0]
    with zipfile.ZipFile(path) as archive:
        assert archive.namelist() == ["modelDescription.xml", "sources/axebot.c"]
    made = fmu(ROBOT, compiled=False)
    assert any("sources only (not asked for)" in note for note in made.notes)


@pytest.mark.parametrize("name", ['<&"evil">', "速度", "a--b", "class"])
def test_whatever_the_robot_is_called(name, tmp_path):
    path = fmu(ROBOT.replace(name=name)).write(tmp_path / "robot.fmu")[0]
    assert fmpy.read_model_description(str(path)).modelName == name


def test_other_robots_are_refused_by_name():
    with pytest.raises(UnsupportedError, match=r"fmu cannot be exported for axebot.*a current limit"):
        fmu(ROBOT.replace(motor=ROBOT.motor.replace(current_limit=2.0)))
