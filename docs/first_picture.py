"""The first picture of the README: a drive that no fit saw, over the model before and after.

python docs/first_picture.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

import omnidyn
from omnidyn.cli import main as command
from omnidyn.report.style import BLUE, GREY, INK, ORANGE, WIDTH, look, new_figure, thin_out
from omnidyn.run import Run

DOCS = Path(__file__).parent
DRIVES = [str(DOCS.parent / "examples" / "my_robot" / f"drive{k}.csv") for k in (1, 2, 3)]
TICKS = {"a": "ticks/2048"}
SIZES = "--wheels 4 --azimuth 45,135,225,315 --wheel-radius 0.04 --robot-radius 0.17 --mass 4.2 --voltage-limit 12"
SHOWN = (4.0, 13.0)  # [s]
WINDOW = 5  # rows over which counts are differenced


def main() -> None:
    """Draw it anew."""
    with tempfile.TemporaryDirectory() as folder:
        guess, fit = str(Path(folder, "guess.toml")), str(Path(folder, "fit.toml"))
        command(["init", "my_robot", *SIZES.split(), "--gear-ratio", "30", "-o", guess])
        command(["identify", *DRIVES[:2], "--robot", guess, "--assume", "a=ticks/2048", "-o", fit])
        before, after = omnidyn.load_robot(guess), omnidyn.load_robot(fit)
    drive = omnidyn.read_log(DRIVES[2], before, assume=TICKS)
    found = omnidyn.compare(before, drive, after)
    runs = dict(
        zip(("model from sizes", "fitted to two drives"), (found.simulated[k][0] for k in found.robots), strict=True)
    )
    with look():
        figure = new_figure(WIDTH, 3.6)
        top, bottom = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": (2, 1)})
        figure.subplots_adjust(left=0.1, right=0.985, top=0.9, bottom=0.14, hspace=0.12)
        t, measured = _speed(drive)
        top.plot(t, measured, color=INK, lw=3.0, alpha=0.35, label="measured: 2048 counts a turn")
        for (name, run), colour, width in zip(runs.items(), (ORANGE, BLUE), (1.4, 1.6), strict=True):
            speed = _speed(run)[1]
            top.plot(t, speed, color=colour, lw=width, label=name)
            bottom.plot(t, speed - measured, color=colour, lw=1.2)
        top.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False, borderaxespad=0.1)
        top.set_ylabel("wheel 2, rad/s")
        bottom.set_ylabel("error")
        bottom.axhline(0.0, color=GREY, lw=0.8)
        bottom.set_xlabel("time of a drive that the fit did not see, s")
        bottom.set_xlim(*SHOWN)
        thin_out(bottom, y=4)
        figure.savefig(DOCS / "images" / "first.png", dpi=120, metadata={"Software": None})


def _speed(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Time and mean speed of a wheel over a few rows [rad/s]."""
    angle = run.wheel_angle[:, 1]
    span = run.t[WINDOW:] - run.t[:-WINDOW]
    return run.t[WINDOW:], (angle[WINDOW:] - angle[:-WINDOW]) / span


if __name__ == "__main__":
    main()
