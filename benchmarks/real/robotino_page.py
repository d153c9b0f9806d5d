"""python -m benchmarks.real.robotino_page: the answer and the picture in docs/robotino.md, from the real logs."""

from __future__ import annotations

import contextlib
import io
import sys
import tempfile
from pathlib import Path

from omnidyn.cli import main as omnidyn
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import SteadyState
from omnidyn.model.robot_file import load_robot
from omnidyn.report.figures.shapes import draw_polar
from tests.support import real_logs as logs

DOCS = Path(__file__).resolve().parents[2] / "docs"
BEGIN, END = "<!-- begin: made by python -m benchmarks.real.robotino_page -->", "<!-- end -->"


def answer(data: Path) -> str:
    """What the command of the page prints."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = [
            "identify",
            str(data / "robotino" / "one_surface_type"),
            "--robot",
            "robotino",
            "--current-unsigned",
            "--assume",
            "a=ticks/2000",
            "--group",
            "gray=gray_surface",
            "--group",
            "green=green_surface",
            "-o",
            str(Path(folder) / "robotino.toml"),
        ]
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(io.StringIO()):
            code = omnidyn(arguments)
    if code:
        sys.exit(f"omnidyn identify ended with exit code {code}")
    return printed.getvalue().rstrip()


def publish() -> None:
    data = logs.folder()
    if not (data / "robotino").is_dir():
        sys.exit(f"no real logs in {data}: set OMNIDYN_DATA")
    page = DOCS / "robotino.md"
    before, _, rest = page.read_text("utf-8").partition(BEGIN)
    after = rest.partition(END)[2]
    page.write_text(f"{before}{BEGIN}\n\n```text\n{answer(data)}\n```\n\n{END}{after}", "utf-8")
    named = [(group.split()[0], run) for group, runs in logs.robotino_groups(data).items() for run in runs]
    study = identify(
        [run for _, run in named], load_robot("robotino"), SteadyState(), groups=[floor for floor, _ in named]
    ).study
    (DOCS / "images" / "robotino_force.png").write_bytes(draw_polar(study).png)


if __name__ == "__main__":
    publish()
