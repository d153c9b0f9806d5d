"""The public names of omnidyn, as a list: adding or losing one is a decision, made here."""

from types import ModuleType

import omnidyn

PUBLIC = [
    "Batch",
    "BatchRun",
    "Campaign",
    "Comparison",
    "DriveProgram",
    "DriveRecord",
    "Estimate",
    "Identification",
    "Live",
    "MotorFit",
    "MotorLine",
    "OmnidynError",
    "OutputError",
    "Robot",
    "RobotConnection",
    "Run",
    "SimulatedRobot",
    "SteadyState",
    "Tracking",
    "Tuned",
    "__version__",
    "acceleration",
    "align",
    "check",
    "compare",
    "confidence_band",
    "dead_zone",
    "drift",
    "drive",
    "feedforward_table",
    "identify",
    "load_campaign",
    "load_controller",
    "load_robot",
    "path",
    "path_demand",
    "plan",
    "plan_rig",
    "preset_names",
    "read_commands",
    "read_log",
    "read_program",
    "read_steady_table",
    "read_wheel_table",
    "sample",
    "save_robot",
    "simulate",
    "simulate_batch",
    "state_space",
    "sweep",
    "track",
    "tune",
    "vary_robot",
    "voltage_for",
    "wheel_table",
    "write_run",
]


def test_all_is_the_list():
    assert sorted(omnidyn.__all__) == sorted(PUBLIC)


def test_dir_shows_nothing_else():
    # Submodules become attributes when they are imported; they are no part of the promise.
    shown = {name for name in dir(omnidyn) if not name.startswith("_")}
    shown = {name for name in shown if not isinstance(getattr(omnidyn, name), ModuleType)}
    assert shown == {name for name in PUBLIC if not name.startswith("_")}


def test_every_name_is_there():
    missing = [name for name in PUBLIC if not hasattr(omnidyn, name)]
    assert not missing


def test_every_name_says_what_it_is():
    silent = [name for name in PUBLIC if not name.startswith("_") and not getattr(omnidyn, name).__doc__]
    assert not silent
