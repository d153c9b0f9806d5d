"""The command line: `omnidyn`, `python -m omnidyn`. A skin: no formula lives here.

Exit codes: 0 ok, 1 our bug, 2 usage, 3 bad input, 4 the data cannot answer, 5 a threshold is exceeded,
6 an extra is missing, 130 interrupted, 143 terminated; a closed pipe is 0.

app has all commands. One file for each, or for those that belong together: init (the robot itself in init_robot),
check, plan, drive, watch, identify (its logs in identify_logs, what it writes in identify_show, for motors in
identify_motors), compare, simulate, loops (`track`, `tune`), sweep, at_rest (`deadzone`), friction, exchange (`import`,
`export`), logs (`convert`), info (`info`, `align`), demo, warm, doctor.
What they share: log_options, outcome (how a command ends), terminal/.
demo_folder: the folder of the demo.
identify_brief: the result on one screen.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Sequence

# New objects before garbage is looked for, ..: loading makes many, and none of them is garbage.
RARELY = (200_000, 20, 50)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code; `arguments` without the name of the program."""
    if "numpy" not in sys.modules:  # our matrices are small: threads cost more than they give, most where others work
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        gc.set_threshold(*RARELY)
    from omnidyn.cli.outcome import run_guarded

    return run_guarded(_run, list(sys.argv[1:] if arguments is None else arguments))


def _run(arguments: list[str]) -> int | None:
    """The exit code of the command that these arguments call. Imported here: slow to load, and guarded."""
    from omnidyn.cli.app import app

    return app(arguments, prog_name="omnidyn", standalone_mode=False)
