"""`exact_step` as GPU code: in single precision it must hold no double and no branch. No GPU is needed."""

import re
from types import SimpleNamespace

import pytest

from omnidyn.simulation.exact.step import exact_step


@pytest.fixture(scope="module")
def ptx_of():
    """Compiles exact_step to PTX for one type; skips where the packages of the extra `cuda` are absent.

    numba-cuda asks the card of this machine what to compile the parts of a function for; here it need not have one.
    """
    pytest.importorskip("numba_cuda", reason="numba-cuda is not installed (extra `cuda`, Linux and Windows)")
    from numba import cuda, types

    def compile_(name):
        kind = getattr(types, name)
        text, result = cuda.compile(exact_step.py_func, kind(*[kind] * 7), cc=(9, 0), device=True, output="ptx")
        assert result == kind
        return text

    card = SimpleNamespace(compute_capability=(9, 0))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("numba.cuda.dispatcher.get_current_device", lambda: card)
        yield compile_


def count(pattern, text):
    return len(re.findall(pattern, text))


def test_single_precision_has_no_double_and_no_branch(ptx_of):
    text = ptx_of("float32")
    assert count(r"\.f64", text) == 0
    assert count(r"\bbra\b", text) == 0
    assert count(r"\bselp\b", text) >= 4
    assert count(r"\bdiv\.", text) == 1
    assert ".visible" in text


def test_double_precision_has_doubles(ptx_of):
    """The counter-check: the same search finds them where they must be."""
    text = ptx_of("float64")
    assert count(r"\.f64", text) > 10
    assert count(r"\bbra\b", text) == 0
