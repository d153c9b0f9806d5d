"""Where latencies meet edges, and the step onto one."""

from types import SimpleNamespace

import numpy as np

from omnidyn.identification.output_error.solve.latency_edges import Edges

NAMES = ["motor.resistance_ohm", "latency.wheel_speed", "latency.twist@b", "latency.current"]
NONE = np.zeros(4, bool)


def edges(*names):
    record = SimpleNamespace(step_of=lambda rows: 0.01)
    parameters = [SimpleNamespace(name=name) for name in names]
    return Edges(SimpleNamespace(parameters=parameters, pieces=[SimpleNamespace(record=record, first=3, last=29)]))  # pyright: ignore[reportArgumentType]


def test_currents_first_then_every_latency_then_none():
    found = edges(*NAMES)
    first = found.not_yet(NONE)
    assert first is not None
    assert first.tolist() == [False, False, False, True]
    second = found.not_yet(first)
    assert second is not None
    assert second.tolist() == [False, True, True, True]
    assert found.not_yet(second) is None
    assert edges(NAMES[0]).not_yet(NONE[:1]) is None


def test_a_step_across_rows_ends_on_the_first_one():
    """Rows are 10 ms apart; a current, which has a jump there and no kink, stays where it is."""
    now, then = np.array([1.0, -0.001, 0.023, -0.001]), np.array([2.0, 0.004, 0.001, 0.004])
    np.testing.assert_allclose(edges(*NAMES).onto(now, then, NONE), [0.0, 0.001, -0.003, 0.0], atol=1e-12)


def test_a_step_between_rows_or_of_what_stands_still_is_none():
    now, then = np.array([1.0, 0.0, 0.012, 0.0]), np.array([2.0, 0.004, 0.018, 0.0])
    assert not edges(*NAMES).onto(now, then, NONE).any()
    assert not edges(*NAMES).onto(now, then + 0.1, ~NONE).any()
    assert not edges(NAMES[0]).onto(now[:1], then[:1], NONE[:1]).any()
