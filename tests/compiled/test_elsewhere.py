"""Another process compiles: what it made is taken, and whatever becomes of it, the kernel is compiled all the same."""

import contextlib
import os
import subprocess
import sys

import pytest

from omnidyn.compiled import parallel
from omnidyn.compiled.kernel import kernel
from omnidyn.compiled.parallel import compiled_elsewhere

ALONE = """
from omnidyn.compiled.kernel import kernel
@kernel
def twice(x):
    return 2.0 * x
def needs_it():
    assert twice(2.0) == 4.0
def dies():
    raise SystemExit(3)
def waits():
    import time
    time.sleep(60.0)
"""


@pytest.fixture
def alone(folder, monkeypatch):
    """A module of its own that both processes can import, two processors, and the children that are started."""
    (folder / "alone.py").write_text(ALONE)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(folder), *sys.path]))
    monkeypatch.setattr(parallel, "processors", lambda: 2)
    children, popen = [], subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", lambda *a, **k: children.append(popen(*a, **k)) or children[-1])
    sys.modules.pop("alone", None)
    import alone

    yield alone, children
    sys.modules.pop("alone", None)
    assert all(child.poll() is not None for child in children)


def hits(compiled):
    return len(compiled.stats.cache_hits)


def test_what_the_other_process_compiled_is_taken(alone):
    module, children = alone
    with compiled_elsewhere(module.twice, module.needs_it):
        assert [child.wait(600.0) for child in children] == [0]
    module.needs_it()
    assert hits(module.twice) == 1


def test_nothing_is_started_where_it_is_there(alone):
    module, children = alone
    module.needs_it()
    with compiled_elsewhere(module.twice, module.needs_it):
        assert children == []


def test_one_that_dies_leaves_the_work_to_us(alone):
    module, children = alone
    with compiled_elsewhere(module.twice, module.dies):
        assert children[0].wait(600.0) == 3
        module.needs_it()
    assert hits(module.twice) == 0


@pytest.mark.parametrize("ends", [KeyboardInterrupt, ValueError])
def test_whatever_ends_us_ends_the_other(alone, ends):
    module, children = alone
    with contextlib.suppress(ends), compiled_elsewhere(module.twice, module.waits):
        raise ends
    assert children[0].returncode not in (None, 0)  # 0: it was waited for


def test_it_is_not_waited_for(alone):
    module, children = alone
    with compiled_elsewhere(module.twice, module.waits):
        assert children[0].poll() is None
    assert children[0].returncode not in (None, 0)  # 0: it was waited for


def test_one_processor_shares_nothing(alone, monkeypatch):
    module, children = alone
    monkeypatch.setattr(parallel, "processors", lambda: 1)
    with compiled_elsewhere(module.twice, module.needs_it):
        assert children == []


@pytest.mark.parametrize("broken", ["no Python", "frozen", "not found"])
def test_a_program_that_is_no_python_shares_nothing(alone, monkeypatch, broken):
    module, children = alone
    monkeypatch.setattr(sys, "executable", "" if broken == "no Python" else "/no/such/python")
    monkeypatch.setattr(sys, "frozen", broken == "frozen", raising=False)
    with compiled_elsewhere(module.twice, module.needs_it):
        assert children == []


def test_without_a_folder_nothing_is_shared(alone, monkeypatch):
    module, children = alone

    def refuses(function):
        raise RuntimeError

    monkeypatch.setattr("omnidyn.compiled.entries.Entries", refuses)
    with compiled_elsewhere(kernel(module.twice.py_func), module.needs_it):
        assert children == []
