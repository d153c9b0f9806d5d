"""Parts of kernels: compiled once, in their kernels; with a numba that nobody tried, in numba's own way."""

import re
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.caching import NullCache

from omnidyn.compiled import kernel as compiled
from omnidyn.compiled import private
from omnidyn.compiled.kernel import Linked

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.usefixtures("folder")


def thrice_at(x, k):
    return 3.0 * x[k]


@pytest.fixture
def piece():
    """A part with a kernel that calls it with a constant and with a variable, and two parts between them."""
    inner = compiled.part(thrice_at)
    first, second = compiled.part(lambda x: inner(x, 0)), compiled.part(lambda x, k: inner(x, k))
    outer = compiled.kernel(lambda x: first(x) + second(x, len(x) - 1))
    return inner, first, second, outer


def test_a_piece_has_no_machine_code_of_its_own(piece):
    """If this fails, numba compiles every formula again for each function above it: time a first run."""
    inner, first, second, outer = piece
    assert outer(np.array([1.0, 5.0, 10.0])) == 33.0
    for part in (inner, first, second):
        (result,) = part.overloads.values()
        library, name = result.library, result.fndesc.mangled_name
        assert not library.codegen._engine.is_symbol_defined(name)
        assert library.get_llvm_str().count("define ") == 1, "nothing of what it calls, and no wrapper"
    assert inner.overloads.keys() == second.overloads.keys(), "a constant is an argument like others"


def test_a_piece_that_is_called_from_python_is_compiled_for_itself(piece):
    inner = piece[0]
    assert inner(np.array([1.0, 5.0]), 1) == inner(np.array([1.0, 5.0]), k=1) == 15.0
    assert not inner.overloads
    assert len(inner.whole.overloads) == 1


def test_an_unknown_numba_compiles_pieces_in_its_own_way(monkeypatch):
    """With a version that nobody tried, older or newer: no Linked, no private option."""
    monkeypatch.setattr(private, "TRIED", frozenset())
    inner = compiled.part(thrice_at)
    assert type(inner) is type(numba.njit(thrice_at))
    assert "_nrt" not in inner.targetoptions
    assert "_nrt" not in compiled.maker(thrice_at).targetoptions
    assert compiled.kernel(lambda x, inner=inner: inner(x, 1))(np.array([1.0, 5.0])) == 15.0


def test_the_switch_leaves_nothing_private(monkeypatch):
    monkeypatch.setenv(private.SWITCH, "1")
    inner = compiled.part(thrice_at)
    assert type(inner) is type(numba.njit(thrice_at))
    assert "_nrt" not in inner.targetoptions
    for make in (compiled.kernel, compiled.branching_kernel):
        outer = make(lambda x: inner(x, 1))
        assert isinstance(outer._cache, NullCache)
        assert outer(np.array([1.0, 5.0])) == 15.0


def test_this_numba_was_tried():
    """If this fails, another numba is installed: run tests/compiled, time a first run, and enter it in TRIED."""
    assert numba.version_info.short in private.TRIED
    assert isinstance(compiled.part(thrice_at), Linked)


@pytest.mark.parametrize("lock", ["core", "everything"])
def test_the_locked_numba_was_tried(lock):
    text = (ROOT / "locks" / f"{lock}.txt").read_text(encoding="utf-8")
    (version,) = re.findall(r"^numba==(\d+)\.(\d+)", text, re.MULTILINE)
    assert tuple(map(int, version)) in private.TRIED


def test_the_oldest_numba_that_is_admitted_was_tried():
    (version,) = re.findall(r'"numba>=(\d+)\.(\d+)"', (ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert tuple(map(int, version)) == min(private.TRIED)


def test_a_piece_under_two_kernels_gives_both_its_code():
    inner = compiled.part(thrice_at)
    between = compiled.part(lambda x: inner(x, 1) + inner(x, 0))
    for factor in (1.0, 2.0):
        outer = compiled.kernel(lambda x, by=factor: by * between(x) + inner(x, 0))
        assert outer(np.array([1.0, 5.0])) == factor * 18.0 + 3.0


def test_a_kernel_of_branches_gives_the_same_numbers_and_is_kept(folder):
    def turned(x, out):
        for k in range(len(x)):
            out[k] = np.sin(x[k]) if x[k] > 0.5 else x[k] / 3.0 - 1.0

    x = np.linspace(-1.0, 2.0, 101)
    results = []
    for make in (compiled.kernel, compiled.branching_kernel, compiled.branching_kernel):
        results.append(np.zeros_like(x))
        make(turned)(x, results[-1])
    assert results[0].tobytes() == results[1].tobytes() == results[2].tobytes()
