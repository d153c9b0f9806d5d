"""Who looks on while a fit goes on: it hears of every phase, and an interrupt leaves the best so far of set speeds."""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import State
from omnidyn.progress import Report
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.codes import codes


@pytest.fixture(scope="module")
def looped(axebot):
    return axebot.replace(name="loop", drive=axebot.drive.replace(kind="speed", kp=0.25, ki=1.0, rate=100.0))


@pytest.fixture(scope="module")
def log(looped):
    """2.5 s of set speeds on all axes, at 100 Hz, with noise."""
    rng, command = np.random.default_rng(5), np.zeros((250, 3))
    command[20:90], command[90:170], command[170:] = (0.5, 0.2, 2.0), (-0.4, 0.5, -3.0), (0.1, -0.6, 1.0)
    fine = simulate(looped, dt=1e-3, twist_command=np.repeat(command, 10, axis=0), tol=1e-6)
    twist = fine.twist[:-1:10] + rng.normal(size=command.shape) * [0.02, 0.02, 0.1]
    current = fine.current[:-1:10] + rng.normal(size=command.shape) * 0.05
    return Run(t=np.arange(250) * 0.01, twist_command=command, twist=twist, current=current, source="log")


class Cut(FitProgress):
    """Interrupts at so many better states, or at the first of these words."""

    def __init__(self, count=0, words=None):
        super().__init__(self.listen)
        self.states, self.heard, self.count, self.until = [], [], count, words

    def listen(self, report):
        if report.state is None:
            self.heard.append(report.phase.removeprefix("fitting: "))
        else:
            self.states.append(report.state)
        if report.state is not None and len(self.states) == self.count:
            raise KeyboardInterrupt
        if self.until and report.phase.startswith(self.until):
            raise KeyboardInterrupt


@pytest.mark.parametrize(
    "cut", [Cut(count=1), Cut(words="trying latency.current"), Cut(words="finding how sure")], ids=["1", "2", "3"]
)
@pytest.mark.some(2)
def test_an_interrupted_fit_of_set_speeds_leaves_the_best_so_far(looped, log, cut):
    """In the first search for a start, between two descents, and after the last one."""
    asked = Fit.of(log, looped, OutputError())
    with pytest.raises(KeyboardInterrupt):
        asked.answer(asked.solve(cut), cut)
    fit = asked.answer(cut.best).estimate
    assert "interrupted" in codes(fit.warnings)
    values = {**fit.value, **{name: own.value for name, own in fit.nuisances.items()}}
    assert list(values.values()) == pytest.approx(list(cut.states[-1].point.values))
    assert "drive.kp_V_s_rad" in fit.value


def test_every_phase_is_told_before_it_begins(looped, log):
    seen = Cut()
    identify(log, looped, OutputError(), progress=seen)
    first = [
        next(k for k, words in enumerate(seen.heard) if words.startswith(phase))
        for phase in (
            "looking for what moved",
            "looking for a start, latencies 1 of 5",
            "looking for a start, friction and gains 1",
            "trying latency.current, 1 of",
            "the same as exactly",
            "finding how sure",
        )
    ]
    assert first == sorted(first)


def test_a_robot_of_the_exact_engine_tells_its_phases_too(axebot):
    run = simulate(axebot, np.repeat([[3.0, -1.0, 2.5], [-4.0, 3.0, 1.0]], 50, axis=0), 0.02)
    seen = Cut()
    identify(Run(t=run.t, voltage=run.voltage, twist=run.twist, source="log"), axebot, OutputError(), progress=seen)
    assert {"looking for what moved", "looking for a start", "finding how sure the numbers are"} < set(seen.heard)


def test_a_search_that_goes_several_ways_shows_only_what_is_better_than_all_before():
    seen = []
    progress = FitProgress(lambda report: seen.append(report.state)).below(10.0)
    states = [State(Point(np.zeros(0), ()), [], objective, np.zeros(0)) for objective in (11.0, 9.0, 9.5, 8.0, 8.0)]
    for state in states:
        progress.better(state)
    assert seen == [states[1], states[3]]


def test_the_states_of_a_fit_beside_become_words():
    reports = []
    progress = FitProgress(reports.append).aside("once more")
    progress.better(State(Point(np.zeros(0), ()), [], -12.5, np.zeros(0)))
    progress.enter("trying")
    assert reports == [Report("once more, -log likelihood -12.5"), Report("trying")]


def test_any_function_may_look_on():
    seen = []
    FitProgress.of(seen.append).enter("trying")
    FitProgress.of(None).enter("trying")
    assert seen == [Report("trying")]


def test_a_search_says_how_long_it_will_take(monkeypatch):
    """From the second one on, where it is worth a word."""
    heard, now = [], iter([0.0, 3.0, 9.0, 0.0, 0.1])
    monkeypatch.setattr("omnidyn.identification.output_error.solve.progress.monotonic", lambda: next(now))
    progress = FitProgress(lambda report: heard.append(str(report)))
    for k in range(3):
        progress.counted("trying", k, 4)
    for k in range(2):
        progress.counted("trying", k, 4)
    assert heard == [
        "trying 1 of 4",
        "trying 2 of 4, about 9 s left",
        "trying 3 of 4, about 9 s left",
        "trying 1 of 4",
        "trying 2 of 4",
    ]
