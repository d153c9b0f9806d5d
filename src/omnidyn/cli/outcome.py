"""How a command ends: each way of ending is one exit code and at most one line on stderr."""

from __future__ import annotations

import _thread
import contextlib
import errno
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from types import FrameType

import typer

from omnidyn.cli.terminal import session
from omnidyn.cli.terminal.flags import of_place
from omnidyn.cli.terminal.streams import prepare, say, say_trace, silence
from omnidyn.errors import INTERRUPTS, OmnidynError, Terminated, printable, told_by

BUG, USAGE, BAD_INPUT, INTERRUPTED, TERMINATED = 1, 2, 3, 130, 143


def run_guarded(run: Callable[[list[str]], int | None], arguments: list[str]) -> int:
    """Run the command line, `run`, and turn whatever happens into an exit code."""
    prepare()
    debug, arguments = _take_debug(arguments)
    session.begin(arguments)
    try:
        with _sigterm_unwinds(), _interrupts_come_again():
            code = run(arguments) or 0
            if code == INTERRUPTED:  # typer's word for Ctrl-C
                raise KeyboardInterrupt
            if sys.stdout is not None:
                sys.stdout.flush()
            return code
    except BaseException as error:
        if debug and not isinstance(error, SystemExit):
            say_trace(traceback.format_exc())
        return _code_of(told_by(error), debug)


def _code_of(error: BaseException, debug: bool) -> int:
    if isinstance(error, OmnidynError):
        say(f"omnidyn: error: {_with_flag(error)}")
        return error.exit_code
    if isinstance(error, typer.TyperException):
        return _usage(error)
    if isinstance(error, KeyboardInterrupt):
        say("omnidyn: interrupted")
        return INTERRUPTED
    if isinstance(error, Terminated):
        say("omnidyn: terminated")
        return TERMINATED
    if _is_closed_pipe(error):
        silence(sys.__stdout__)
        return 0
    if isinstance(error, SystemExit):
        return error.code if isinstance(error.code, int) else BUG
    return _unforeseen(error, debug)


def _with_flag(error: OmnidynError) -> str:
    """The message, with the place as the command line names it."""
    return of_place(error.where) + str(error)[len(printable(error.where)) :]


def _unforeseen(error: BaseException, debug: bool) -> int:
    if isinstance(error, MemoryError):
        say("omnidyn: error: not enough memory; use fewer rows")
        return BAD_INPUT
    if isinstance(error, OSError):
        place = f"{str(error.filename)[:80]}: " if error.filename else ""
        say(f"omnidyn: error: {place}the system refuses; got {error.strerror or error}")
        silence(sys.__stdout__)
        return BAD_INPUT
    say(f"omnidyn: bug: {type(error).__name__}: {' '.join(str(error).split())}")
    if not debug:
        say("omnidyn: please report it, with what the same command says under --debug")
    return BUG


def _usage(error: typer.TyperException) -> int:
    """Wrong words on the command line: what is wrong, and where to look."""
    context = getattr(error, "ctx", None)
    path = context.command_path if context is not None else "omnidyn"
    say(f"omnidyn: error: {error.format_message()} Try: {path} --help")
    return USAGE


def _take_debug(arguments: list[str]) -> tuple[bool, list[str]]:
    """--debug may stand anywhere before a bare --."""
    end = arguments.index("--") if "--" in arguments else len(arguments)
    words = [word for word in arguments[:end] if word != "--debug"]
    return len(words) < end, words + arguments[end:]


def _is_closed_pipe(error: BaseException) -> bool:
    """typer turns a closed pipe into an exit; what it saw hangs on it."""
    cause = error.__context__ if isinstance(error, SystemExit) else error
    return isinstance(cause, OSError) and cause.errno == errno.EPIPE


@contextlib.contextmanager
def _interrupts_come_again() -> Iterator[None]:
    """While it holds, an interrupt that Python swallows, as in the callback of a weak reference, comes once more."""
    before = sys.unraisablehook

    def swallowed(unraisable: sys.UnraisableHookArgs) -> None:
        if not isinstance(unraisable.exc_value, INTERRUPTS):
            before(unraisable)
            return
        number = signal.SIGTERM if isinstance(unraisable.exc_value, Terminated) else signal.SIGINT
        again = threading.Timer(0.01, _thread.interrupt_main, (number,))  # not at once: it would be swallowed again
        again.daemon = True
        again.start()

    sys.unraisablehook = swallowed
    try:
        yield
    finally:
        sys.unraisablehook = before


@contextlib.contextmanager
def _sigterm_unwinds():
    """While it holds, SIGTERM raises Terminated. Only the main thread may set a handler."""

    def raise_terminated(number: int, frame: FrameType | None) -> None:
        raise Terminated

    try:
        before = signal.signal(signal.SIGTERM, raise_terminated)
    except ValueError:
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
