"""omnidyn drive --wheel-table: what goes over the line, and what is refused with nothing written."""

import json
import os
import select
import subprocess
import sys

import numpy as np
import pytest

import omnidyn
from omnidyn.driving.wire import body, line
from tests.support.wire_robot import command_of
from tests.support.worn_lekiwi import ROWS, corrected, program, table_of


@pytest.fixture
def planned(here):
    """A program of LeKiwi and the table of its wheels, as files."""
    omnidyn.write_run(program().commands(), "rows.csv")
    table_of().write("wheels.csv")
    return ["drive", "rows.csv", "--robot", "lekiwi", "--wheel-table", "wheels.csv"]


def test_the_commands_of_the_command_line_are_those_of_the_table(planned, here):
    """By `--to -`: a robot at the other end that answers each command at once."""
    process = subprocess.Popen(
        [sys.executable, "-m", "omnidyn", *planned, "--to", "-", "-o", "log.csv", "--dead-man", "10"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    sent, rest = [], b""
    try:
        while select.select([process.stdout], [], [], 120.0)[0] and (data := os.read(process.stdout.fileno(), 1 << 16)):
            *lines, rest = (rest + data).split(b"\n")
            for command in filter(None, (command_of(body(one)) for one in lines)):
                sent.append(command.inputs)
                answer = f"M,{round(command.sent * 1e6) % 2**32},{command.session},{command.number}"
                os.write(process.stdin.fileno(), line(answer))
        process.wait(60.0)
    finally:
        process.kill()
        process.communicate()
    wanted = {tuple(np.round(row, 5)) for row in corrected(ROWS)}
    assert {tuple(np.round(row, 5)) for row in sent} <= wanted
    assert any(np.any(row) for row in sent)


def test_it_is_named_among_the_inputs(planned, call, here):
    code, out, _ = call(*planned, "--to", "udp:127.0.0.1:9", "-o", "log.csv", "--dry-run", "--json")
    assert code == 0
    assert {"role": "wheel_table", "name": "wheels.csv"}.items() <= json.loads(out)["provenance"]["inputs"][-1].items()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--to", "sim"], "--wheel-table: a table of wheels is for a robot that is driven from here; got --to sim"),
        (["--to", "csv"], "got --to csv"),
        (["--to", "-", "-o", "l.csv", "--wheel-table", "none.csv"], "none.csv: no such file"),
        (["--to", "-", "-o", "l.csv", "--wheel-table", "rows.csv"], "rows.csv"),
        (["--to", "-", "-o", "wheels.csv", "--force"], "wheels.csv"),
        (["--to", "-", "-o", "l.csv", "--wheel-table", "four.csv"], "--wheel-table: the table of another robot; got 4"),
    ],
)
def test_what_the_command_line_refuses(planned, call, here, more, words):
    table_of(np.ones((2, 4)), np.zeros((2, 4))).write("four.csv")
    before = (here / "wheels.csv").read_text()
    code, out, err = call(*planned, *more)
    assert (code, out) == (3, "")
    assert words in err
    assert not (here / "l.csv").exists()
    assert (here / "wheels.csv").read_text() == before
