"""docs/how-to/drive-a-plan.md: every command of it is run, in its order, and its Python."""

import re
import shlex
from pathlib import Path

import pytest

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "how-to" / "drive-a-plan.md").read_text("utf-8")
STOPS = "--area 1.5x1.5"  # the room that is too small


@pytest.mark.long
def test_every_command(call, here):
    lines = re.findall(r"^    omnidyn (.*)$", PAGE, re.MULTILINE)
    assert len(lines) > 8
    for line in lines:
        code, out, err = call(*shlex.split(line))
        assert code == (4 if STOPS in line else 0), (line, out, err)
        if "--planned" in line:
            assert "planned, got" in out
        if "--dry-run" in line:
            shown = re.search(r"^```text\n(.*?)\n\.\.\.\n", PAGE, re.DOTALL | re.MULTILINE)
            assert shown is not None
            assert [row.split()[:4] for row in out.splitlines()][: len(shown[1].splitlines())] == [
                row.split()[:4] for row in shown[1].splitlines()
            ]


def test_its_python(here, capsys):
    (code,) = re.findall(r"^```python\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
    exec(code, {})
    assert capsys.readouterr().out.splitlines()[0].startswith("forward 0.71 m")
