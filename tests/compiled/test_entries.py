"""Entries on disk: taken where they fit, replaced where they do not, whatever has become of them."""

import hashlib
import os
import pickle
import subprocess
import sys
from dataclasses import replace

import numba
import pytest
from numba.core.caching import NullCache

from omnidyn.compiled import entries, stamp
from omnidyn.compiled.kernel import kernel


def thrice(x):
    return 3.0 * x


def half(x):
    return 0.5 * x


def hits(compiled):
    return len(compiled.stats.cache_hits)


def files(folder):
    return sorted(path for path in folder.rglob("*") if path.is_file())


@pytest.fixture
def entry(folder):
    """The file of thrice(float)."""
    assert kernel(thrice)(2.0) == 6.0
    (file,) = files(folder)
    return file


def test_numba_still_asks_our_entries(folder, entry):
    """If this fails, numba has changed how it asks its cache: every process compiles."""
    assert entry.read_bytes()[:64].decode() == stamp.stamp(thrice)
    again = kernel(thrice)
    assert again(3.0) == 9.0
    assert hits(again) == 1
    assert again(1j) == 3j
    assert (hits(again), len(files(folder))) == (1, 2)


DAMAGE = {
    "truncated": lambda whole: whole[: len(whole) // 2],
    "only the head": lambda whole: whole[:96],
    "less than the head": lambda whole: whole[:10],
    "empty": lambda whole: b"",
    "zeroed": lambda whole: bytes(len(whole)),
    "zeroed behind the head": lambda whole: whole[:96] + bytes(len(whole) - 96),
    "one bit": lambda whole: whole[:5000] + bytes([whole[5000] ^ 1]) + whole[5001:],
    "longer": lambda whole: whole + b"x",
    "text": lambda whole: b"not an entry at all\n" * 50,
    "of another stamp": lambda whole: b"0" * 64 + whole[64:],
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_entry_is_compiled_again(folder, entry, damage):
    whole = entry.read_bytes()
    entry.write_bytes(DAMAGE[damage](whole))
    compiled = kernel(thrice)
    assert compiled(2.0) == 6.0
    assert hits(compiled) == 0
    assert files(folder) == [entry]
    mended = kernel(thrice)
    assert mended(2.0) == 6.0
    assert hits(mended) == 1


FOREIGN = {
    "no pickle": b"not a pickle",
    "of a module that is not here": b"cno_such_module\nthing\n.",
    "of another shape": pickle.dumps([1, 2, 3]),
    "nothing": pickle.dumps(None),
}


@pytest.mark.parametrize("content", FOREIGN.values(), ids=FOREIGN)
def test_a_whole_entry_of_something_else_is_compiled_again(folder, entry, content):
    """Stamp and hash are right: what stands behind them is nothing that this numba can take."""
    entry.write_bytes(stamp.stamp(thrice).encode() + hashlib.sha256(content).digest() + content)
    compiled = kernel(thrice)
    assert compiled(2.0) == 6.0
    assert hits(compiled) == 0
    mended = kernel(thrice)
    assert mended(2.0) == 6.0
    assert hits(mended) == 1


def test_an_entry_that_cannot_be_rebuilt_is_compiled_again(folder, entry):
    whole = entry.read_bytes()
    key, _ = pickle.loads(whole[96:])
    content = pickle.dumps((key, ("of", "another", "numba")))
    entry.write_bytes(whole[:64] + hashlib.sha256(content).digest() + content)
    compiled = kernel(thrice)
    assert compiled(2.0) == 6.0
    assert hits(compiled) == 0


def test_an_entry_of_another_kernel_is_not_taken(folder, entry):
    assert kernel(half)(2.0) == 1.0
    (other,) = set(files(folder)) - {entry}
    entry.write_bytes(other.read_bytes())
    compiled = kernel(thrice)
    assert compiled(2.0) == 6.0
    assert hits(compiled) == 0


def test_an_entry_for_other_types_is_not_taken(folder, entry):
    """The head fits: it is the same kernel."""
    assert kernel(thrice)(2.0 + 0j) == 6.0
    (other,) = set(files(folder)) - {entry}
    entry.write_bytes(other.read_bytes())
    compiled = kernel(thrice)
    assert compiled(2.0) == 6.0
    assert type(compiled(2.0)) is float
    assert hits(compiled) == 0


def test_files_of_numbas_own_cache_are_not_looked_at(folder, entry):
    plain = numba.njit(cache=True)(thrice)
    assert plain(2.0) == 6.0
    own = [file for file in files(folder) if file != entry]
    assert {file.suffix for file in own} == {".nbi", ".nbc"}
    for file in own:
        file.write_bytes(b"\0" * 100)
    compiled = kernel(thrice)
    assert compiled(2.0) == 6.0
    assert hits(compiled) == 1


def test_a_folder_in_the_place_of_an_entry_is_no_trouble(folder, entry):
    entry.unlink()
    entry.mkdir()
    (entry / "full").touch()
    compiled = kernel(thrice)
    assert compiled(2.0) == 6.0
    assert files(folder) == [entry / "full"]


def test_a_disk_that_refuses_is_no_trouble(folder, monkeypatch):
    def refuse(*paths):
        raise OSError("no space left on device")

    compiled = kernel(thrice)
    monkeypatch.setattr(os, "replace", refuse)
    assert compiled(2.0) == 6.0
    assert files(folder) == []


def test_entries_of_old_sources_are_replaced(folder, entry, monkeypatch):
    """A cache does not grow with every edit."""
    monkeypatch.setattr(entries, "stamp", lambda function: "1" * 64)
    assert kernel(thrice)(2.0) == 6.0
    assert files(folder) == [entry]
    assert entry.read_bytes()[:64] == b"1" * 64


def test_flush_drops_the_entries_of_one_kernel(folder, entry):
    assert kernel(half)(2.0) == 1.0
    assert kernel(thrice)(1j) == 3j
    assert len(files(folder)) == 3
    kernel(thrice)._cache.flush()
    (left,) = files(folder)
    assert "half" in left.name


@pytest.mark.parametrize("problem", [AttributeError, RuntimeError, OSError, ImportError])
def test_a_cache_that_cannot_be_stamped_is_not_used(monkeypatch, problem):
    """Better compiled in each process than served stale."""

    def refuse(function):
        raise problem

    monkeypatch.setattr(entries, "stamp", refuse)
    compiled = kernel(thrice)
    assert isinstance(compiled._cache, NullCache)
    assert compiled(2.0) == 6.0


def test_two_kernels_of_one_name_are_told_apart(folder):
    first = kernel(lambda x: 2.0 * x)  # of another line: a cache tells them apart by that
    second = kernel(lambda x: 5.0 * x)
    assert (first(1.0), second(1.0), first(2.0)) == (2.0, 5.0, 4.0)


def test_what_no_kernel_would_take_is_dropped(folder, entry):
    """Entries of kernels that have been renamed, or are no more, as far as they lie beside others."""
    kernels = [kernel(thrice), kernel(half)]
    assert kernels[1](2.0) == 1.0
    assert kernels[0](1j) == 3j
    for name in ("gone.f-1.kernel", "test_entries.half-2.kernel"):
        (entry.parent / name).write_bytes(b"1" * 64 + entry.read_bytes()[64:])
    (entry.parent / "gone.f-3.kernel").write_bytes(b"\xff")
    (entry.parent / "other.pyc").touch()
    caches = [each._cache for each in kernels]
    stock = entries.take_stock(caches)
    assert (stock.folders, stock.entries, stock.dropped) == ((str(entry.parent),), 3, 3)
    assert stock.size == sum(file.stat().st_size for file in files(folder))
    assert len(files(folder)) == 4
    assert entries.take_stock(caches) == replace(stock, dropped=0)


def test_what_cannot_be_loaded_our_way_is_loaded_in_numbas(folder, entry, monkeypatch):
    def refuse(context, saved):
        raise AttributeError("another numba")

    monkeypatch.setattr(entries, "loaded", refuse)
    again = kernel(thrice)
    assert again(3.0) == 9.0
    assert hits(again) == 1


@pytest.mark.parametrize("method", ["_key", "_file", "_rebuilt", "_save"])
def test_a_numba_whose_cache_works_otherwise_costs_time_and_not_the_run(folder, entry, monkeypatch, method):
    def refuse(self, *given):
        raise AttributeError("another numba")

    again = kernel(thrice)
    monkeypatch.setattr(type(again._cache), method, refuse, raising=False)
    if method == "_key":  # of the instance, from numba
        again._cache._key = lambda *given: refuse(None)
    assert again(3.0) == 9.0
    assert again(3) == 9.0
    assert hits(again) == (method == "_save")


ASLEEP = """
import sys
import numpy as np
{script}
print(numbers.tolist(), "numba.np.arraymath" in sys.modules)
"""
OF_ITS_OWN = """from omnidyn.compiled.kernel import kernel
@kernel
def twice(values):
    made = np.zeros(len(values))
    for k in range(len(values)):
        made[k] = 2.0 * values[k]
    return made
numbers = twice(np.ones(3))"""
OF_THE_PACKAGE = """from omnidyn.model.robot_file import load_robot
from omnidyn.model.dynamics import acceleration
numbers = acceleration(load_robot("robotino"), np.zeros(3), np.ones(3))"""


@pytest.mark.parametrize(
    "script", [OF_ITS_OWN, pytest.param(OF_THE_PACKAGE, marks=pytest.mark.long)], ids=["own", "of"]
)
def test_a_process_that_compiles_nothing_does_not_wake_the_compiler(tmp_path, script):
    """If this fails, every command waits two seconds more."""
    environment, file = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}, tmp_path / "asleep.py"
    file.write_text(ASLEEP.format(script=script))
    first, again = (
        subprocess.run([sys.executable, file], env=environment, capture_output=True, text=True, check=True)
        for _ in range(2)
    )
    numbers, woken = first.stdout.rsplit(maxsplit=1)
    assert woken == "True"
    assert again.stdout.rsplit(maxsplit=1) == [numbers, "False"]


def test_a_loaded_kernel_can_still_be_called_by_another(folder, entry):
    inner = kernel(thrice)
    assert inner(2.0) == 6.0
    assert hits(inner) == 1
    assert kernel(lambda x: inner(x) + 1.0)(2.0) == 7.0
