"""Rows of the benchmark `mpc` beside other people's controllers, in the same run: whole steps and solvers alone.

Their code is that of ../shared/peers/mpc (or of `mpc` in the folder OMNIDYN_PEERS), with its reference `eight`, 10 ms a
step and 20 steps ahead: they build their matrices with NumPy, so the time of their solvers stands beside that of whole
steps. What is not installed is left out, and said.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.table import Table

FOLDER = Path(os.environ.get("OMNIDYN_PEERS", Path(__file__).parents[3] / "shared" / "peers")) / "mpc"
DT, AHEAD = 0.01, 20
# Name -> (packages, how many times as long a whole step may take at least, runs, seconds of each).
PEERS: dict[str, tuple[tuple[str, ...], float, int, float]] = {
    "condensed + DAQP": (("daqp",), 8.0, 3, 3.0),
    "OSQP": (("osqp",), 15.0, 3, 3.0),
    "CasADi, one SQP iteration": (("casadi",), 40.0, 2, 1.0),
    "IPOPT by CasADi": (("casadi",), 200.0, 2, 1.0),
    "do-mpc": (("casadi", "do_mpc"), 500.0, 2, 1.0),
}
SATURATING = ("fast8", "fsquare", "fspin")


def makers() -> dict[str, Callable[[], Any]]:
    """Name -> a controller of the peers. Empty where their folder is not there."""
    if not FOLDER.is_dir():
        return {}
    if str(FOLDER) not in sys.path:
        sys.path.insert(0, str(FOLDER))
    import controllers  # pyright: ignore[reportMissingImports]

    return {
        "condensed + DAQP": lambda: controllers.DAQP(AHEAD, DT, "ref"),
        "OSQP": lambda: controllers.OSQPs(AHEAD, DT, "ref"),
        "CasADi, one SQP iteration": lambda: controllers.CasadiNLP(AHEAD, DT, "sqpmethod", qp="hpipm", maxit=1),
        "IPOPT by CasADi": lambda: controllers.CasadiNLP(AHEAD, DT, "ipopt"),
        "do-mpc": lambda: controllers.DoMPC(AHEAD, DT),
    }


def peer_rows(table: Table, own: float) -> None:
    """Whole steps of others beside ours, `own` [us]: medians of the least time of each step."""
    made = makers()
    if not made:
        table.notes.append("no folder of the peers: set OMNIDYN_PEERS")
        return
    for name, (packages, goal, repeats, seconds) in PEERS.items():
        lacking = [each for each in packages if find_spec(each) is None]
        if lacking:
            table.add(what=f"{name}: not installed", value=0.0, unit="", more=", ".join(lacking))
            continue
        runs = [run_of(made[name](), "eight", DT, seconds) for _ in range(repeats)]
        step, solve = (1e6 * float(np.median(np.min([run[key] for run in runs], axis=0))) for key in ("t", "solve"))
        table.add(
            f">= {goal:g} times",
            step >= goal * own,
            what=f"{name}, a whole step",
            value=step,
            unit="us",
            more=f"{step / own:.1f} times; its solver alone {solve:.0f} us, {solve / own:.1f} times our whole step",
        )


def run_of(controller: Any, name: str, dt: float, seconds: float) -> Any:
    """A run of the peers: their plant, the same model."""
    from problem import simulate  # pyright: ignore[reportMissingImports]

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return simulate(controller, name, dt, T=seconds)


def ipopt_errors() -> dict[str, tuple[float, float]]:
    """Saturating reference -> (position rmse [mm], median of a step [us]) of IPOPT, tanh 0.02, 20 ms a step, 3.2 s."""
    if not makers() or find_spec("casadi") is None:
        return {}
    import controllers  # pyright: ignore[reportMissingImports]

    found = {}
    for name in SATURATING:
        run = run_of(controllers.CasadiNLP(AHEAD, 0.02, "ipopt"), name, 0.02, 3.2)
        found[name] = 1e3 * run["rmse_pos"], 1e6 * float(np.median(run["t"]))
    return found
