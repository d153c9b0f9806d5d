"""fmu: valid under fmpy, and the engine to 1e-9 wherever the step is exact; no Python in it."""

import shutil
import zipfile
from functools import cache

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.export.code.fmu import OUTPUTS, fmu
from omnidyn.model.deadzone import breakaway_voltage
from tests.support.exported import exact_robot, init_robot, program
from tests.support.friction_shapes import implicit

fmpy = pytest.importorskip("fmpy")
pytestmark = [
    pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]
ROBOT = omnidyn.load_robot("axebot")
ROBOTS = {"axebot": ROBOT, "inductance": exact_robot(3), "dead band": exact_robot(2), "of init": init_robot(4)}


@cache
def unit_of(name):
    """The unit of a robot, compiled once."""
    return fmu(ROBOTS[name])


def simulated(name, folder, volts, dt, start=None):
    """Outputs at the end of each step, by fmpy. Shape (rows, 6)."""
    path = unit_of(name).write(folder / "robot.fmu", force=True)[0]
    t = np.arange(len(volts)) * dt
    kinds = [("time", float), *((f"u{k + 1}_V", float) for k in range(volts.shape[1]))]
    given = np.array([(now, *row) for now, row in zip(t, volts, strict=True)], dtype=kinds)
    values = {f"start_{name}": value for name, value in (start or {}).items()}
    found = fmpy.simulate_fmu(
        str(path), stop_time=len(volts) * dt, step_size=dt, output_interval=dt, input=given, start_values=values
    )
    return np.stack([found[name] for name in OUTPUTS], axis=1)


@pytest.mark.parametrize("name", ROBOTS)
def test_it_is_the_engine(name, tmp_path):
    from fmpy.validation import validate_fmu

    robot, dt = ROBOTS[name], 2.0**-9
    volts = program(robot, 5, 300) * robot.motor.voltage_limit / 6.0
    run = omnidyn.simulate(implicit(robot) if name == "of init" else robot, volts, dt)  # the engine that C has
    found = simulated(name, tmp_path, volts, dt)
    assert validate_fmu(str(tmp_path / "robot.fmu")) == []
    assert len(found) == len(run)
    np.testing.assert_allclose(found, np.hstack([run.twist, run.pose]), rtol=0, atol=1e-9)


def test_at_rest_for_a_minute_it_is_exactly_at_rest(tmp_path):
    volts = np.tile([0.0, 0.5, -0.5], (960, 1)) * breakaway_voltage(ROBOT, [0.0, 1.0, -1.0])
    assert not simulated("axebot", tmp_path, volts, 2.0**-4).any()


def test_it_starts_where_it_is_told(tmp_path):
    start = dict(zip(OUTPUTS, (0.3, -0.2, 1.0, 1.0, 2.0, 0.5), strict=True))
    dt, volts = 2.0**-7, np.zeros((20, 3))
    run = omnidyn.simulate(ROBOT, volts, dt, twist=(0.3, -0.2, 1.0), pose=(1.0, 2.0, 0.5))
    found = simulated("axebot", tmp_path, volts, dt, start)
    np.testing.assert_allclose(found, np.hstack([run.twist, run.pose]), rtol=0, atol=1e-12)


@pytest.mark.parametrize("start", [1e10, 1001.0, float("nan")])
def test_a_start_that_no_robot_has_is_refused(start, tmp_path):
    with pytest.raises(Exception, match=r"fmi2SetReal.*status"):
        simulated("axebot", tmp_path, np.zeros((5, 3)), 0.01, {"omega_rad_s": start})


def test_a_step_that_would_take_hours_is_refused(tmp_path):
    volts = np.array([[3.0, 5.0, 6.0]])
    with pytest.raises(Exception, match=r"fmi2DoStep.*status"):
        simulated("axebot", tmp_path, volts, 1e5)
    assert np.isfinite(simulated("axebot", tmp_path, volts, 1.0)).all()


def test_the_same_robot_gives_the_same_bytes():
    assert fmu(ROBOT).files == unit_of("axebot").files


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


@pytest.mark.parametrize("name", ["inductance", "of init"])
def test_a_state_is_got_set_and_serialised(name, tmp_path):
    """A run goes on from its middle as it went on the first time, to the last bit; in another unit from bytes."""
    robot, path = ROBOTS[name], str(unit_of(name).write(tmp_path / "robot.fmu")[0])
    about, place = fmpy.read_model_description(path), fmpy.extract(path, str(tmp_path / "unit"))
    assert about.coSimulation.canGetAndSetFMUstate
    assert about.coSimulation.canSerializeFMUstate
    volts, dt = program(robot, 5, 80) * robot.motor.voltage_limit / 6.0, 2.0**-9
    unit, other = (begun_unit(about, place) for _ in range(2))
    driven(unit, volts[:40], 0, dt)
    state = unit.getFMUState()
    end = driven(unit, volts[40:], 40, dt)
    unit.setFMUState(state)
    assert np.array_equal(driven(unit, volts[40:], 40, dt), end)
    copied = other.deserializeFMUState(unit.serializeFMUState(state))
    other.setFMUState(copied)
    assert np.array_equal(driven(other, volts[40:], 40, dt), end)
    with pytest.raises(Exception, match="fmi2DeSerializeFMUstate"):
        other.deserializeFMUState(unit.serializeFMUState(state)[:-8])
    for one, kept in ((unit, state), (other, copied)):
        one.freeFMUState(kept)
        one.terminate()
        one.freeInstance()


def begun_unit(about, place):
    """A unit at the begin of its run."""
    from fmpy.fmi2 import FMU2Slave

    name = about.coSimulation.modelIdentifier
    unit = FMU2Slave(guid=about.guid, unzipDirectory=place, instanceName="unit", modelIdentifier=name)
    unit.instantiate()
    unit.setupExperiment(startTime=0.0)
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    return unit


def driven(unit, volts, first, dt):
    """Outputs of a unit at the end of rows of volts. Shape (6,)."""
    wheels = volts.shape[1]
    for k, row in enumerate(volts, start=first):
        unit.setReal(list(range(wheels)), row.tolist())
        unit.doStep(currentCommunicationPoint=k * dt, communicationStepSize=dt)
    return np.array(unit.getReal(list(range(wheels, wheels + 6))))


def test_fmi_3_is_the_engine_too(tmp_path):
    """Valid, the same outputs, a state that goes back, time as a variable."""
    from fmpy.fmi3 import FMU3Slave
    from fmpy.validation import validate_fmu

    path = str(fmu(ROBOT, fmi=3).write(tmp_path / "robot.fmu")[0])
    assert validate_fmu(path) == []
    about, place = fmpy.read_model_description(path), fmpy.extract(path, str(tmp_path / "unit"))
    unit = FMU3Slave(
        guid=about.guid,
        unzipDirectory=place,
        instanceName="unit",
        modelIdentifier=about.coSimulation.modelIdentifier,
    )
    unit.instantiate()
    unit.enterInitializationMode(startTime=0.0)
    unit.setFloat64([9], [0.5])
    unit.exitInitializationMode()
    volts, dt = program(ROBOT, 5, 60), 2.0**-9
    run = omnidyn.simulate(ROBOT, volts, dt, twist=(0.5, 0.0, 0.0))
    state = None
    for k, row in enumerate(volts):
        if k == 50:
            state = unit.serializeFMUState(unit.getFMUState())
        unit.setFloat64([0, 1, 2], row.tolist())
        unit.doStep(k * dt, dt)
    np.testing.assert_allclose(unit.getFloat64(range(3, 6)), run.twist[-1], rtol=0, atol=1e-12)
    assert unit.getFloat64([15]) == [60 * dt]
    unit.setFMUState(unit.deserializeFMUState(state))
    np.testing.assert_allclose(unit.getFloat64(range(3, 6)), run.twist[50], rtol=0, atol=1e-12)
    with pytest.raises(Exception, match="fmi3GetInt32"):
        unit.getInt32([0])
    with pytest.raises(InputError, match="no such version of FMI; got 1"):
        fmu(ROBOT, fmi=1)


def test_other_robots_are_refused_by_name():
    with pytest.raises(UnsupportedError, match=r"fmu cannot be exported for axebot.*wheels that may slip"):
        fmu(ROBOT.replace(wheels=ROBOT.wheels.replace(traction_mu=0.5)))
