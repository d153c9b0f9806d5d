"""What two processes compile before a fit is what the fit then takes."""

import contextlib

import numpy as np
import pytest

from omnidyn.compiled.kernel import kept
from omnidyn.identification import first_runs
from omnidyn.identification.identify import identify
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run

SHARED = {"_march", "_accelerations", "count_far", "_put_at_motors", "row_terms", "row_squares", "_burg"}


def signatures(names):
    return {each.stamp: set(each.asked) for each in kept() if each._stem.rpartition(".")[2] in names}


def test_a_fit_needs_no_other_entries_of_these_kernels(monkeypatch):
    monkeypatch.setattr(
        first_runs, "compiled_elsewhere", lambda kernel, caller: contextlib.nullcontext(caller() or True)
    )
    first_runs.share_out(load_robot("mecanum"))
    before = signatures({*SHARED, "march_with_derivatives"})
    assert len(before) >= len(SHARED) + 1
    run = first_runs._run(load_robot("mecanum"))
    noise = 0.1 * np.random.default_rng(4).standard_normal(run.wheel_speed.shape)
    log = Run(t=run.t, voltage=run.voltage, wheel_speed=run.wheel_speed + noise)  # what most robots record
    identify(log, load_robot("mecanum"), method="output-error")
    assert signatures({*SHARED, "march_with_derivatives"}) == before


@pytest.mark.parametrize("name", ["axebot", "robotino"])
def test_nothing_is_compiled_for_robots_of_other_engines(monkeypatch, name):
    """The exact engine, and a speed loop."""
    monkeypatch.delattr(first_runs, "compiled_elsewhere")
    first_runs.share_out(load_robot(name))
