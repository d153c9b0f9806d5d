"""Job of a log that is still recorded: what it tells, each second of it."""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping
from typing import Any

from omnidyn.document import plain, sentence
from omnidyn.identification.live.live import Live
from omnidyn.identification.live.status import LiveStatus
from omnidyn.logs.growing import GrowingTable, growth_of
from omnidyn.model.keys import in_words, unit
from omnidyn.studio.job import INTERVAL, Tell, options_of, robot_of


def watch(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """Tell what a file tells while it grows, as `omnidyn watch` does, until a command comes; the last of it.

    request: "path", "name", "map", "unsigned" of the log, "robot", "within": half an interval, as a share of its
    number, that is enough.
    """
    robot = robot_of(request)
    assert robot is not None
    live, table = Live(robot, within=request["within"]), GrowingTable(request["name"], robot, options_of(request))
    last = 0.0
    tell("live", shown(live.status))
    for data in growth_of(request["path"]):
        if not commands.empty():
            break
        if data is None:
            table.begin_anew()
            continue
        for run in table.feed(data.decode("utf-8", errors="replace")):
            for status in live.answers(run):
                if time.monotonic() - last > INTERVAL:
                    last = time.monotonic()
                    tell("live", shown(status))
            tell("live", shown(live.status))
    return shown(live.status)


def shown(status: LiveStatus, expected: Collection[str] = ()) -> dict[str, Any]:
    """What a page shows of an answer: verdict, what is said beside it, and the numbers that must be known.

    expected: codes of what need not be said.
    """
    numbers = [
        {
            "key": key,
            "name": in_words(key),
            "unit": unit(key),
            "value": number.value,
            "half": None if number.is_unknown else number.half,
            "within": number.within,
            "reached": number.is_reached,
        }
        for key, number in status.numbers.items()
        if number.within
    ]
    verdict = status.verdict
    return plain(
        {
            "verdict": sentence(f"{verdict}"),
            "severity": verdict.severity,
            "enough": status.is_enough,
            "said": [[said.severity, str(said)] for said in status.statements() if said.code not in expected],
            "seconds": status.seconds,
            "numbers": numbers,
        }
    )
