"""omnidyn watch SOURCE: what a log tells while it grows."""

from __future__ import annotations

import os
import select
import socket
import sys
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

import omnidyn
from omnidyn.cli.log_options import NO_FLAGS, LogFlags, reads_logs
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.streams import say, show, show_line
from omnidyn.cli.terminal.telling import end_failed, tell
from omnidyn.document import sentence
from omnidyn.errors import InputError

if TYPE_CHECKING:
    from omnidyn.identification.live.live import Live
    from omnidyn.identification.live.status import LiveStatus
    from omnidyn.logs.growing import GrowingTable
    from omnidyn.run import Run

STDIN, UDP = "-", "udp:"
PAUSE = 0.1  # [s] between two looks at a source
MOST_BYTES = 1 << 20  # read at once


@reads_logs("sort", "rate", "var", "skip_bad_rows", "latency")
def watch(
    source: str = typer.Argument(
        metavar="SOURCE", help="A text file that grows, - for standard input, or udp:PORT, udp:ADDRESS:PORT."
    ),
    robot: str = typer.Option(..., "--robot", metavar="ROBOT", help="A preset (see: omnidyn robots) or a robot file."),
    free: Annotated[
        list[str] | None,
        typer.Option("--free", metavar="KEY", help="What is to be learnt; default: friction and resistance."),
    ] = None,
    within: float = typer.Option(10.0, metavar="%", help="Half an interval that is enough, of each number."),
    reference: str = typer.Option("", metavar="FIT", help="A fit before: say what differs, as floor, payload, wear."),
    idle: float = typer.Option(0.0, metavar="S", help="End after so long without a row; default: wait for more."),
    until_enough: bool = typer.Option(False, "--until-enough", help="End as soon as it is enough."),
    flags: LogFlags = NO_FLAGS,
    json: bool = typer.Option(False, "--json", help="A line of JSON each second."),
) -> None:
    """Say each second what a log tells while it grows: numbers, intervals, and whether that is enough.

    Ctrl-C, the end of the input or --idle end it; then all rows are fitted once more and all numbers shown. Gaps,
    restarts and lines that are no rows are survived, and said. Exit code 4 where it ends before it is enough.
    """
    from omnidyn.identification.live.live import Live
    from omnidyn.identification.methods import OutputError
    from omnidyn.logs.growing import GrowingTable

    _refuse_range("--within", within, "%")
    _refuse_range("--idle", idle or 1.0, "s")
    given, maps = omnidyn.load_robot(robot), flags.maps(force=False)
    before = omnidyn.load_robot(reference) if reference else None
    method = OutputError(free=tuple(free), nuisances=("latency", "push")) if free else None
    live = Live(given, method, within=within / 100.0, reference=before)
    table, told_bad, told_resets = GrowingTable(source, given, flags.options()), 0, 0

    def is_over(runs: list[Run]) -> bool:
        """Take runs, and tell each second of them; whether that is enough, and all that was asked for."""
        for run in runs:
            for status in live.answers(run):
                _tell(status, json)
                if until_enough and status.is_enough:
                    return True
        return False

    try:
        for text in _texts(source, idle):
            if text is None:
                say(f"omnidyn: warning: {source} was written anew: read from its start")
                table.begin_anew()
                continue
            is_first, runs = table.columns is None, table.feed(text)
            if is_first and table.columns is not None:
                maps.show(source, table.columns)
            if table.resets > told_resets:
                told_resets = table.resets
                say(f"omnidyn: warning: an encoder was set to another value, {told_resets} times so far: it goes on")
            if table.bad_rows > 2 * told_bad:
                told_bad = _tell_bad(table)
            if is_over(runs):
                break
        else:
            is_over(table.end())
    except KeyboardInterrupt:
        say("omnidyn: ended")
    except InputError:  # what was learnt before it is shown
        if live.status.numbers and not json:
            tell(live.status.document(), False, provenance([robot_input(robot)]))
        raise
    if table.bad_rows > told_bad:
        _tell_bad(table)
    status = live.status if until_enough and live.status.is_enough else _finished(live)
    if json:
        _tell(status, json)
    else:
        tell(status.document(), False, provenance([robot_input(robot)]))
    if not status.is_enough:
        end_failed(status.verdict)


def _finished(live: Live) -> LiveStatus:
    """The last answer, after a whole fit; Ctrl-C once more goes without it."""
    try:
        return live.finish()
    except KeyboardInterrupt:
        return live.status


def _tell_bad(table: GrowingTable) -> int:
    """How many lines could not be used so far."""
    say(f"omnidyn: warning: lines that hold no usable row, left out so far: {table.bad_rows}")
    return table.bad_rows


def _tell(status: LiveStatus, json: bool) -> None:
    """The answer of a second, on a line."""
    if json:
        show_line(status.to_dict() | {"verdict": sentence(str(status.verdict))})
        return
    show(f"{status.seconds:6.0f} s  {sentence(str(status.verdict))}")
    for doubt in status.doubts:
        show(f"{'':10s}{sentence(str(doubt))}")


def _texts(source: str, idle: float) -> Iterator[str | None]:
    """What comes, as text, "" where nothing does; None where a file was written anew. Ends with its source, or after
    `idle` seconds of silence."""
    last = time.monotonic()
    for data in _bytes(source):
        if data == b"" and idle and time.monotonic() - last > idle:
            return
        yield data if data is None else data.decode("utf-8", errors="replace")
        last = last if data == b"" else time.monotonic()  # what was done with it is no silence


def _bytes(source: str) -> Iterator[bytes | None]:
    from omnidyn.logs.growing import growth_of  # imported lazily: slow to load

    if source == STDIN:
        return _of_stdin()
    return _of_socket(source) if source.startswith(UDP) else growth_of(source)


def _of_stdin() -> Iterator[bytes]:
    if sys.stdin is None:
        raise InputError("standard input is closed", expected="rows of text", remedy="pipe them in", where=STDIN)
    number = sys.stdin.fileno()
    while data := os.read(number, MOST_BYTES):
        yield data


def _of_socket(source: str) -> Iterator[bytes]:
    """Datagrams with one or more lines each."""
    address, _, port = source[len(UDP) :].rpartition(":")
    if not port.isdigit() or not 0 < int(port) < 65536:
        raise InputError("not a port", got=source, expected="udp:PORT or udp:ADDRESS:PORT", where="SOURCE")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        try:
            receiver.bind((address or "127.0.0.1", int(port)))
        except OSError as error:
            raise InputError(
                "cannot listen", got=f"{source}: {error.strerror or error}", expected="a free port of this machine",
                remedy="take another port, or the address of this machine that the robot sends to", where="SOURCE",
            ) from None  # fmt: skip
        say(f"omnidyn: listening at {':'.join(map(str, receiver.getsockname()))}")
        while True:
            ready, _, _ = select.select([receiver], [], [], PAUSE)
            data = receiver.recv(65536) if ready else b""
            yield data if not data or data.endswith(b"\n") else data + b"\n"


def _refuse_range(option: str, value: float, unit: str) -> None:
    if not 0.0 < value < 1e6:
        raise InputError("out of range", got=f"{value:g}", expected=f"above 0 {unit}", where=option)
