"""An exported controller in C as a Controller of Python: a program of its own, compiled strictly, behind a pipe."""

from __future__ import annotations

import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import omnidyn
from omnidyn.control.controller import Info
from omnidyn.control.controllers import controller_named
from omnidyn.control.pose_gate import TRUSTED
from omnidyn.model.frames import world_to_body
from tests.support.exported import STRICT

SANITIZERS = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
QUICK, OPTIMISED = "-O0", "-O2"  # the second takes a compiler five times as long behind sanitizers
_MAIN = """
#include "omnidyn_control.h"

#include <stdio.h>

#ifdef OMNIDYN_HORIZON
#define ROWS (OMNIDYN_HORIZON + 1)
#else
#define ROWS 3
#endif

int main(void)
{
    float given[7 + 6 * ROWS], answer[OMNIDYN_WHEELS + 1];
    static omnidyn_control control;
    static omnidyn_motion path[ROWS];
    int k;
    omnidyn_control_reset(&control);
    while (fread(given, sizeof(float), 7 + 6 * ROWS, stdin) == 7 + 6 * ROWS) {
        for (k = 0; k < 3 * ROWS; k++) {
            path[k / 3].pose[k % 3] = given[7 + k];
            path[k / 3].velocity[k % 3] = given[7 + 3 * ROWS + k];
        }
        answer[0] = (float)omnidyn_control_step(&control, given[0], given + 1, given + 4, path, answer + 1);
        if (fwrite(answer, sizeof(float), OMNIDYN_WHEELS + 1, stdout) != OMNIDYN_WHEELS + 1 || fflush(stdout)) {
            return 1;
        }
    }
    return 0;
}
"""


@cache
def sanitizers() -> tuple[str, ...]:
    """The options of the sanitizers, none where this compiler has none."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "a.c").write_text("int main(void) { return 0; }\n")
        made = subprocess.run(["gcc", *SANITIZERS, "-o", "a", "a.c"], cwd=folder, capture_output=True)
        return SANITIZERS if made.returncode == 0 else ()


@cache
def program(sources: tuple[tuple[str, str], ...], level: str) -> bytes:
    """These files and `main.c` as a program, compiled once in a process."""
    with tempfile.TemporaryDirectory() as folder:
        for name, text in (*sources, ("main.c", _MAIN)):
            (Path(folder) / name).write_text(text, "utf-8")
        command = ["gcc", *STRICT, level, *sanitizers(), "-o", "control", "main.c", "omnidyn_control.c", "-lm"]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        return (Path(folder) / "control").read_bytes()


class CController:
    """A controller in C, beside the one of Python from which it was made (`own`). A context."""

    info = Info("in C")
    level = QUICK  # of optimisation; tests/export/conftest.py has another for --long

    def __init__(self, robot, folder: Path, controller: Any = "pid", dt: float = 0.02) -> None:
        made = omnidyn.export.c_controller(robot, controller=controller, dt=dt)
        self.own: Any = controller_named(controller, robot, dt=dt)
        self.own._gate.judge = lambda t, state: TRUSTED  # C takes measurements as they are
        self.name, self.robot = f"{self.own.name}_c", robot
        self.output, self.limit = self.own.output, self.own.limit
        self._program = folder / "control"
        folder.mkdir(parents=True, exist_ok=True)
        self._program.write_bytes(program(tuple(sorted(made.files.items())), self.level))
        self._program.chmod(0o755)
        self._begin()

    def _begin(self) -> None:
        """A program that has just begun has nothing to forget."""
        self._process = subprocess.Popen([self._program], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._t: float | None = None

    def __enter__(self) -> CController:
        return self

    def __exit__(self, *_) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        assert self._process.stdout is not None
        self._process.stdout.close()
        assert self._process.wait() == 0  # 1 where a sanitizer found something

    def call(self, elapsed, pose, twist, places, velocities) -> tuple[int, np.ndarray]:
        """(what it says of the step, its output). All in float32."""
        given = np.concatenate([np.ravel(each) for each in ([elapsed], pose, twist, places, velocities)])
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(given.astype(np.float32).tobytes())
        self._process.stdin.flush()
        answer = np.frombuffer(self._process.stdout.read(4 * (1 + len(self.limit))), np.float32)
        return int(answer[0]), answer[1:].astype(float)

    def reset(self) -> None:
        """Begin anew."""
        if self._t is not None:
            self.__exit__()
            self._begin()

    def step(self, t, pose, twist, path) -> np.ndarray:
        """As a Controller."""
        elapsed, self._t = 0.0 if self._t is None else t - self._t, t
        motion = path.at(t + self._ahead)
        self.says, output = self.call(elapsed, pose, twist, motion.pose, motion.velocity)
        return output

    @property
    def _ahead(self) -> np.ndarray:
        """When the rows of the path are, after now [s]."""
        own = self.own
        if hasattr(own, "horizon"):
            return own.dt * (own.steps_late + np.arange(own.horizon + 1))
        return np.array([0.0, own.late, own.late + own.dt])


class Averaged:
    """Any controller, its twist the mean over the last step, as encoders have it."""

    def __init__(self, controller: Any) -> None:
        self._controller, self._last = controller, None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._controller, name)

    def reset(self) -> None:
        """Forget all steps."""
        self._controller.reset()
        self._last = None

    def step(self, t: float, pose: Any, twist: Any, path: Any) -> Any:
        """The output of the controller."""
        mean = np.zeros(3)
        if self._last is not None:
            moved = pose - self._last
            mean = world_to_body(pose[2] - 0.5 * moved[2]) @ moved / self._controller.dt
        self._last = np.array(pose)
        return self._controller.step(t, pose, mean, path)
