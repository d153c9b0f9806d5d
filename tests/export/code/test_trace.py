"""Functions of arrays as C: what falls away, what is said once, and what cannot be traced."""

import numpy as np
import pytest

from omnidyn.compiled.scalar_function import scalar_function
from omnidyn.compiled.trace import TranslationError, inputs
from omnidyn.export.code.trace import statements


def lines(value, single=False):
    return statements({"y": value}, single)


def test_numbers_are_worked_out_and_zeros_fall_away():
    x = inputs("x", (2,))
    assert lines(np.array([[1.0, 0.0], [0.0, -1.0]]) @ x) == ["y[0] = x[0];", "y[1] = (-x[1]);"]
    assert lines(x * 0.0 + 2.0) == ["y[0] = 2.0;", "y[1] = 2.0;"]
    assert lines(x[0] / 4.0, True) == ["y = (x[0] * 0.25f);"]


def test_what_is_used_twice_is_worked_out_once():
    x = inputs("x", ())
    cos = np.cos(x)
    assert lines(cos * cos + np.cos(x)) == ["const double t1 = cos(x);", "y = ((t1 * t1) + t1);"]


def test_choices_views_and_writing_into_a_part():
    x = inputs("x", (3,))
    chosen = np.where(x > 0.0, x, 1.0)
    chosen[1:] += 1.0
    assert lines(chosen) == [
        "y[0] = ((x[0] > 0.0) ? x[0] : 1.0);",
        "y[1] = (((x[1] > 0.0) ? x[1] : 1.0) + 1.0);",
        "y[2] = (((x[2] > 0.0) ? x[2] : 1.0) + 1.0);",
    ]
    assert np.asanyarray(x, dtype=float) is x
    assert lines(np.max(np.abs(x[:2]), axis=-1, keepdims=True)) == ["y[0] = max_of(fabs(x[0]), fabs(x[1]));"]


def test_a_branch_on_an_input_and_what_c_does_not_have_are_refused():
    x = inputs("x", ())
    with pytest.raises(TranslationError, match="trace both sides"):
        bool(x > 1.0)
    with pytest.raises(TranslationError, match="no formula for"):
        np.arctan(x)


def test_a_function_of_numbers_is_that_of_arrays():
    def law(x, heading):
        cos, far = np.cos(heading), np.where(x[0] > x[1:], x[0], -x[1:])
        return {"y": far * cos + np.exp(x[2]) ** 1.5, "z": np.clip(np.sqrt(np.abs(x)), 0.5, 1.0) - np.sign(x)}

    traced = scalar_function({"x": (3,), "heading": ()}, law)
    assert traced is not None
    for x, heading in (((1.0, -2.0, 0.3), 0.4), ((-0.1, 0.0, 2.0), -3.0)):
        found = law(np.array(x), heading)
        np.testing.assert_allclose(traced(x, heading), np.concatenate([found["y"], found["z"]]), rtol=1e-15)
    assert scalar_function({"x": (3,)}, lambda x: {"y": x if x[0] > 0.0 else -x}) is None
