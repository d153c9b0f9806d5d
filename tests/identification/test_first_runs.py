"""What another process compiles for a fit is what the fit then takes."""

from contextlib import nullcontext

import numpy as np
import pytest

from omnidyn.compiled.kernel import kept
from omnidyn.identification import first_runs
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run

LATE = {"_march", "row_terms", "row_squares", "_burg"}


def asked():
    return {each.stamp: set(each.asked) for each in kept() if each._stem.rpartition(".")[2] in LATE}


def test_a_fit_needs_no_other_entries_of_these_kernels():
    first_runs.needed_late()
    before = asked()
    run = first_runs._run(load_robot("mecanum"))
    noise = 0.1 * np.random.default_rng(4).standard_normal(run.wheel_speed.shape)
    log = Run(t=run.t, voltage=run.voltage, wheel_speed=run.wheel_speed + noise)  # what most robots record
    identify(log, load_robot("mecanum"), OutputError())
    assert asked() == before


@pytest.mark.parametrize("name, shared", [("axebot", False), ("robotino", False), ("mecanum", True)])
def test_nothing_is_compiled_for_robots_of_other_engines(monkeypatch, name, shared):
    """The exact engine, and a speed loop, have kernels of their own."""
    started = []
    monkeypatch.setattr(first_runs, "compiled_elsewhere", lambda *what: started.append(what) or nullcontext())
    with first_runs.shared_out(load_robot(name)):
        assert bool(started) == shared
