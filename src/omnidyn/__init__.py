"""omnidyn: from the logs of an omnidirectional robot to a model one can trust, and to simulation and control.

    import omnidyn
    robot = omnidyn.load_robot("axebot")
    run = omnidyn.simulate(robot, [[0.0, 3.0, -3.0]] * 2000, 1e-3)

Names are imported on first use, so that `import omnidyn` costs nothing.

Each room imports only from those before it. What all stand on: errors, progress, arguments, arrays, files, units,
statistics, clocks; glossary, document, shown, statement and attempts (what results are made of, and what follows a
fit); compiled (machine code). Then sensors, run, model, simulation, logs, findings (`check`), comparison,
identification, control, driving, campaigns; telling (their words), paper, report, export, interop. Skins: cli, studio.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from omnidyn import shown

__version__ = "0.1.0"

# Public name -> where it is defined. The list is tested: a name added here is a promise.
_HOME = {
    "Batch": "omnidyn.simulation.batch.batch",
    "BatchRun": "omnidyn.simulation.batch.result",
    "Campaign": "omnidyn.campaigns.results",
    "Comparison": "omnidyn.comparison.result",
    "DriveProgram": "omnidyn.driving.program",
    "DriveRecord": "omnidyn.driving.record",
    "Estimate": "omnidyn.identification.estimate",
    "Identification": "omnidyn.identification.identification",
    "Live": "omnidyn.identification.live.live",
    "MotorFit": "omnidyn.identification.methods",
    "MotorLine": "omnidyn.identification.methods",
    "OmnidynError": "omnidyn.errors",
    "OutputError": "omnidyn.identification.methods",
    "Robot": "omnidyn.model.robot",
    "RobotConnection": "omnidyn.driving.connection",
    "Run": "omnidyn.run",
    "SimulatedRobot": "omnidyn.driving.simulated",
    "SteadyState": "omnidyn.identification.methods",
    "Tracking": "omnidyn.control.tracking",
    "Tuned": "omnidyn.control.tune",
    "acceleration": "omnidyn.model.dynamics",
    "align": "omnidyn.comparison.align",
    "check": "omnidyn.findings.check",
    "compare": "omnidyn.comparison.compare",
    "confidence_band": "omnidyn.simulation.band",
    "dead_zone": "omnidyn.model.known.dead_zone",
    "drift": "omnidyn.comparison.drift",
    "drive": "omnidyn.driving.drive",
    "feedforward_table": "omnidyn.control.table",
    "identify": "omnidyn.identification.identify",
    "load_campaign": "omnidyn.campaigns.results",
    "load_controller": "omnidyn.control.controllers",
    "load_robot": "omnidyn.model.robot_file",
    "path": "omnidyn.control.paths.path",
    "path_demand": "omnidyn.control.demand",
    "plan": "omnidyn.identification.planning.plan",
    "plan_rig": "omnidyn.identification.planning.rig",
    "preset_names": "omnidyn.model.robot_file",
    "read_commands": "omnidyn.logs.command_file",
    "read_log": "omnidyn.logs.read_log",
    "read_program": "omnidyn.driving.program_file",
    "read_steady_table": "omnidyn.logs.steady_table",
    "read_wheel_table": "omnidyn.logs.wheel_table",
    "sample": "omnidyn.simulation.batch.sample",
    "save_robot": "omnidyn.model.robot_file",
    "simulate": "omnidyn.simulation.simulate",
    "simulate_batch": "omnidyn.simulation.batch.batch",
    "state_space": "omnidyn.model.dynamics",
    "sweep": "omnidyn.campaigns.sweep",
    "track": "omnidyn.control.closed_loop",
    "tune": "omnidyn.control.tune",
    "vary_robot": "omnidyn.model.vary",
    "voltage_for": "omnidyn.control.feedforward",
    "wheel_table": "omnidyn.logs.wheel_table",
    "write_run": "omnidyn.logs.run_file",
}

__all__ = ["__version__", *_HOME]  # pyright: ignore[reportUnsupportedDunderAll]

if TYPE_CHECKING:
    from omnidyn.campaigns.results import Campaign, load_campaign
    from omnidyn.campaigns.sweep import sweep
    from omnidyn.comparison.align import align
    from omnidyn.comparison.compare import compare
    from omnidyn.comparison.drift import drift
    from omnidyn.comparison.result import Comparison
    from omnidyn.control.closed_loop import track
    from omnidyn.control.controllers import load_controller
    from omnidyn.control.demand import path_demand
    from omnidyn.control.feedforward import voltage_for
    from omnidyn.control.paths.path import path
    from omnidyn.control.table import feedforward_table
    from omnidyn.control.tracking import Tracking
    from omnidyn.control.tune import Tuned, tune
    from omnidyn.driving.connection import RobotConnection
    from omnidyn.driving.drive import drive
    from omnidyn.driving.program import DriveProgram
    from omnidyn.driving.program_file import read_program
    from omnidyn.driving.record import DriveRecord
    from omnidyn.driving.simulated import SimulatedRobot
    from omnidyn.errors import OmnidynError
    from omnidyn.findings.check import check
    from omnidyn.identification.estimate import Estimate
    from omnidyn.identification.identification import Identification
    from omnidyn.identification.identify import identify
    from omnidyn.identification.live.live import Live
    from omnidyn.identification.methods import MotorFit, MotorLine, OutputError, SteadyState
    from omnidyn.identification.planning.plan import plan
    from omnidyn.identification.planning.rig import plan_rig
    from omnidyn.logs.command_file import read_commands
    from omnidyn.logs.read_log import read_log
    from omnidyn.logs.run_file import write_run
    from omnidyn.logs.steady_table import read_steady_table
    from omnidyn.logs.wheel_table import read_wheel_table, wheel_table
    from omnidyn.model.dynamics import acceleration, state_space
    from omnidyn.model.known.dead_zone import dead_zone
    from omnidyn.model.robot import Robot
    from omnidyn.model.robot_file import load_robot, preset_names, save_robot
    from omnidyn.model.vary import vary_robot
    from omnidyn.run import Run
    from omnidyn.simulation.band import confidence_band
    from omnidyn.simulation.batch.batch import Batch, simulate_batch
    from omnidyn.simulation.batch.result import BatchRun
    from omnidyn.simulation.batch.sample import sample
    from omnidyn.simulation.simulate import simulate


# What stands above every result is handed down: see shown.py. A table as well: no kernel depends on it.
_MAKERS = {
    shown.HTML: ("omnidyn.report.notebook", "document_html"),
    shown.FIGURE: ("omnidyn.report.plots", "plot"),
    shown.ANIMATION: ("omnidyn.report.figures.moving", "animate"),
    shown.FRAME: ("omnidyn.interop.dataframe", "to_dataframe"),
    shown.DATASET: ("omnidyn.interop.dataset", "to_xarray"),
    shown.RUN: ("omnidyn.interop.runs", "run_of"),
    shown.SYSTEM: ("omnidyn.interop.systems", "linear_system"),
    shown.SENTENCE: ("omnidyn.telling.codes", "sentence"),
    shown.REMEDY: ("omnidyn.telling.codes", "remedy"),
    shown.DOCUMENT: ("omnidyn.telling.log_verdict", "document"),
}


def _maker(module: str, name: str) -> Callable[..., Any]:
    return lambda value, **options: getattr(importlib.import_module(module), name)(value, **options)


shown.made_by(**{maker: _maker(*place) for maker, place in _MAKERS.items()})


# Public rooms: `omnidyn.export.mjcf(robot)`, `omnidyn.interop.linear_system(robot)`.
_ROOMS = ("export", "interop")


def __getattr__(name: str) -> Any:
    if name in _ROOMS:
        return importlib.import_module(f"omnidyn.{name}")
    if name not in _HOME:
        raise AttributeError(f"module 'omnidyn' has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
