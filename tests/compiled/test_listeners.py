"""Who listens hears of kernels that are compiled; nobody else does, and nothing stays behind."""

import threading

import pytest
from numba.core.caching import NullCache
from numba.core.errors import NumbaError

from omnidyn.compiled import listeners
from omnidyn.compiled.kernel import kernel
from omnidyn.compiled.listeners import heard, told


def test_who_waits_can_see_that_a_kernel_is_being_compiled(monkeypatch, folder):
    seen = []

    @kernel
    def twice(x):
        return 2.0 * x

    @kernel
    def wrong(x):
        return x.no_such_thing

    twice._cache = NullCache()  # else a second run of the tests would find it compiled
    with heard() as compiling:
        monkeypatch.setattr(compiling, "under_way", Noted(seen))
        assert twice(1.0) == 2.0
        assert twice(2.0) == 4.0  # there by now
        with pytest.raises(NumbaError):
            wrong(1.0)
    assert [name.rpartition(".")[2] for name in seen] == ["twice", "wrong"]
    ((name, seconds),) = compiling.done
    assert name.endswith("twice")
    assert seconds > 0.0
    assert compiling.under_way == []


class Noted(list):
    """Notes what was ever put in."""

    def __init__(self, seen):
        super().__init__()
        self.seen = seen

    def append(self, name):
        self.seen.append(name)
        super().append(name)


def test_one_hears_what_other_threads_compile_and_only_while_one_listens():
    with heard() as outer:
        with heard() as inner:
            left_open = told("a")
            thread = threading.Thread(target=left_open.__enter__)
            thread.start()
            thread.join()
            assert outer.under_way == inner.under_way == ["a"]
        with told("b"):
            assert outer.under_way == ["a", "b"]
        assert (inner.under_way, inner.done) == (["a"], [])
    assert [name for name, _ in outer.done] == ["b"]
    assert listeners._listeners == []
