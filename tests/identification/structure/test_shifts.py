"""Which numbers differ between parts of the logs: against fits of those parts, and against worlds that are known.

The worlds are those of the benchmark, whose simulator shares no code with ours; the seeds are others.
"""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.wrong_worlds.log import AR, SPEEDS, TICKS, logged, right_case, robot_of
from benchmarks.wrong_worlds.remedies import FRICTION, before
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.run import CHANNELS, Run

CHANGED = 17.3  # [s]
COULOMB = "friction.axes.coulomb[0]"


def floor(seed, factor, sensor=SPEEDS):
    """(case, log) of a robot that comes onto another floor."""
    case = right_case(seed).setup_but(sensor=sensor, memory=0.0).both_but(frame=False)
    return case, logged(case.world_but(change=CHANGED, after_friction=factor), seed)


def after(run, t):
    """The rows of a log from a time on, which starts anew."""
    kept = run.t >= t
    own = {name: getattr(run, name) for name in CHANNELS}
    return Run(run.t[kept] - t, **{name: values[kept] for name, values in own.items() if values is not None})


@pytest.mark.parametrize(
    ("sensor", "memory", "seed"),
    [(SPEEDS, 0.0, 7101), (AR, 0.95, 7101), (TICKS, 0.0, 7101)],
)
def test_a_right_world_is_stable(sensor, memory, seed):
    case = right_case(seed).setup_but(sensor=sensor, memory=memory, rate=50.0)
    fit = identify(logged(case, seed), robot_of(case.told), OutputError(free=FRICTION)).estimate
    assert not fit.stability.found
    assert not fit.stability.parts()


@pytest.mark.parametrize("seed", [7204])
def test_a_change_of_floor_is_found_with_its_time_and_both_levels(seed):
    case, run = floor(seed, 1.15)
    found = identify(run, robot_of(case.told), OutputError(free=FRICTION)).stability
    split = found.splits[0]
    assert split.between[0] <= CHANGED <= split.between[1]
    assert split.at == pytest.approx(CHANGED, abs=0.05 * 30.0)
    shift = next(each for each in split.shifts if each.key == COULOMB)
    first, then = shift.levels
    assert first.value == pytest.approx(case.world.coulomb[0], abs=4.0 * first.std)
    assert then.value == pytest.approx(1.15 * case.world.coulomb[0], abs=4.0 * then.std)
    assert first.ci95[1] < then.ci95[0]
    assert "Coulomb friction forward" in str(found.statements()[0])


def test_the_levels_are_those_of_fits_of_the_parts():
    case, run = floor(7207, 1.1)
    robot = robot_of(case.told)
    split = identify(run, robot, OutputError(free=FRICTION, nuisances=())).stability.splits[0]
    parts = [before(run, split.at), after(run, split.at)]
    alone = [identify(part, robot, OutputError(free=FRICTION, nuisances=())).estimate for part in parts]
    for shift in split.shifts:
        for level, fit in zip(shift.levels, alone, strict=True):
            assert level.value == pytest.approx(fit.value[shift.key], abs=0.35 * fit.std[shift.key])
            assert level.std == pytest.approx(fit.std[shift.key], rel=0.25)


def test_logs_of_two_floors_differ_and_the_log_is_named():
    case = right_case(7301).setup_but(seconds=20.0)
    robot = robot_of(case.told)
    rough = case.world_but(coulomb=tuple(1.12 * c for c in case.world.coulomb))
    runs = [logged(each, seed) for seed, each in enumerate((case, case, rough), 7301)]
    runs = [run.replace(source=name) for run, name in zip(runs, ("one", "two", "rough"), strict=True)]
    found = identify(runs, robot, OutputError(free=FRICTION))
    split = next(each for each in found.fits["all"].stability.splits if each.by == "logs")
    shift = next(each for each in split.shifts if each.key == COULOMB)
    level = {each.part: each for each in shift.levels}
    assert level["rough"].value == pytest.approx(rough.world.coulomb[0], abs=4.0 * level["rough"].std)
    assert level["rough"].ci95[0] > level["one"].ci95[1]
    document = found.document()
    assert "differ from log to log" in document.to_text()
    assert document.data["stability"]["found"]


def test_logs_of_one_floor_do_not_differ():
    case = right_case(7401).setup_but(seconds=15.0, rate=50.0)
    robot = robot_of(case.told)
    runs = [logged(case, seed).replace(source=f"log {seed}") for seed in (7401, 7402, 7403)]
    document = identify(runs, robot, OutputError(free=FRICTION)).document()
    assert "not stable" not in document.to_text()
    assert not document.data["stability"]["found"]
    assert set(document.data["stability"]["tested"]) == {"time", "logs"}


def test_a_number_at_a_bound_and_one_that_a_prior_holds_are_not_compared():
    case = right_case(7501).both_but(viscous=(0.0, 1.2, 0.012), frame=False)
    fit = identify(
        logged(case, 7501), robot_of(replace(case.told, viscous=(1.0, 1.2, 0.012))), OutputError(free=FRICTION)
    ).estimate
    assert not fit.stability.found
    assert np.isfinite(fit.stability.tested["time"])
