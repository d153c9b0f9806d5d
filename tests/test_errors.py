"""How messages are put together."""

import pytest

from omnidyn.attempts import Attempts
from omnidyn.errors import InputError, Terminated, shortened, told_by


def test_words_are_not_cut_in_the_middle():
    text = "identified from whole logs by output error, " * 4
    short = shortened(text, 80)
    assert len(short) <= 80
    assert short.endswith("...")
    assert set(short.removesuffix("...").split()) <= set(text.replace(",", "").split()) | set(text.split())
    assert shortened("a" * 100, 20) == "a" * 17 + "..."
    assert shortened("short", 20) == "short"
    assert "'aaa" in str(InputError("no", got=["a" * 200]))


@pytest.mark.parametrize("interrupt", [KeyboardInterrupt, Terminated])
def test_an_interrupt_in_compiled_code_is_one(interrupt):
    error = SystemError("CPUDispatcher(f) returned a result with an exception set")
    error.__cause__ = SystemError("_numba_unpickle returned a result with an exception set")
    error.__cause__.__cause__ = cause = interrupt()
    assert told_by(error) is cause
    attempts = Attempts()
    assert attempts.make("diagnosis", raises(error)) is None
    assert attempts.interrupt is cause
    assert attempts.make("page", lambda: 1) is None
    with pytest.raises(interrupt):
        Attempts(keep=False).make("diagnosis", raises(error))
    other = SystemError("of another kind")
    assert told_by(other) is other
    assert (Attempts().make("page", raises(other)), told_by(ValueError()).__class__) == (None, ValueError)


def raises(error):
    def make():
        raise error

    return make
