"""The command line as a process: signals, pipes, locales, time."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from omnidyn.progress import Report
from tests.support.outputs import hear

SOURCES = Path(__file__).resolve().parents[2] / "src"
DROPPED = ("PYTHONUNBUFFERED", "LC_", "LANG", "NO_COLOR", "COLUMNS")
CLEAN = {name: value for name, value in os.environ.items() if not name.startswith(DROPPED)}
posix = pytest.mark.skipif(os.name != "posix", reason="signals and pipes of POSIX")
VOLTAGES = "t_s,u1_V,u2_V,u3_V\n" + "".join(f"{k / 1000},0,3,-3\n" for k in range(5000))

# A command that stops at a place of ours, says so, and waits to be ended.
WAITING = """
import sys, time
import {module} as module
def wait(*_, **__):
    print("ready", file=sys.stderr, flush=True)
    time.sleep(60)
module.{name} = wait
from omnidyn.cli import main
sys.exit(main({arguments!r}))
"""


def environment(**more):
    return {**CLEAN, "PYTHONPATH": str(SOURCES), **more}


def omnidyn(*arguments, cwd, **more):
    command = [sys.executable, "-m", "omnidyn", *arguments]
    return subprocess.run(command, cwd=cwd, env=environment(**more), capture_output=True, text=True, timeout=120)


def waiting(module, name, *arguments, cwd, stdout=None):
    """A process that waits inside `module.name`. stdout: a file for its result."""
    script = WAITING.format(module=module, name=name, arguments=list(arguments))
    command = [sys.executable, "-c", script]
    process = subprocess.Popen(command, cwd=cwd, env=environment(), stdout=stdout, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    for line in process.stderr:
        if line == "ready\n":
            return process
    raise AssertionError(f"ended with {process.wait()}")


def ended(process, number):
    """Exit code and stderr after a signal."""
    process.send_signal(number)
    _, err = process.communicate(timeout=300)
    return process.returncode, err


@posix
@pytest.mark.parametrize(
    "number, code, words",
    [(signal.SIGINT, 130, "omnidyn: interrupted\n"), (signal.SIGTERM, 143, "omnidyn: terminated\n")],
)
def test_a_signal_ends_it_without_a_traceback(tmp_path, number, code, words):
    process = waiting("omnidyn.model.robot_file", "load_robot", "deadzone", "axebot", cwd=tmp_path)
    assert ended(process, number) == (code, words)


SWALLOWING = """
import os, sys, time, weakref
import omnidyn.model.robot_file as module
def load_robot(*_, **__):
    class Mark: pass
    mark = Mark()
    def gone(_):
        os.kill(os.getpid(), {number})
        time.sleep(1.0)
    kept = weakref.ref(mark, gone)
    del mark
    time.sleep(5.0)
module.load_robot = load_robot
from omnidyn.cli import main
sys.exit(main(["deadzone", "axebot"]))
"""


@posix
@pytest.mark.parametrize("number, code", [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_that_python_swallows_ends_it_all_the_same(tmp_path, number, code):
    command = [sys.executable, "-c", SWALLOWING.format(number=int(number))]
    found = subprocess.run(command, cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=600)
    assert (found.returncode, "Traceback" in found.stderr) == (code, False)


@posix
@pytest.mark.parametrize("number, code", [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_while_writing_leaves_nothing_behind(tmp_path, number, code):
    (tmp_path / "u.csv").write_text(VOLTAGES)
    process = waiting("os", "fsync", "simulate", "axebot", "u.csv", "-o", "run.csv", cwd=tmp_path)
    assert len(list(tmp_path.iterdir())) == 2  # the temporary file is there
    assert ended(process, number)[0] == code
    assert [file.name for file in tmp_path.iterdir()] == ["u.csv"]


@posix
@pytest.mark.parametrize("arguments", [["robots"], ["--help"], ["simulate", "axebot", "u.csv", "-o", "-"]])
def test_a_closed_pipe_is_no_error(tmp_path, arguments):
    (tmp_path / "u.csv").write_text(VOLTAGES)
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "omnidyn", *arguments]
    result = subprocess.run(
        command,
        cwd=tmp_path,
        env=environment(),
        stdout=writing,
        stderr=subprocess.PIPE,
        text=True,
        timeout=120,
    )
    os.close(writing)
    assert result.returncode == 0
    assert "Traceback" not in result.stderr
    assert "Exception" not in result.stderr


@posix
@pytest.mark.parametrize("arguments, code", [(["--version"], 0), (["deadzone", "axbot"], 3), ([], 2)])
def test_streams_that_are_not_there_change_nothing(tmp_path, arguments, code):
    command = [sys.executable, "-m", "omnidyn", *arguments]
    for closed in (">&-", "2>&-", ">&- 2>&-"):
        script = f'exec "$@" {closed}'
        result = subprocess.run(
            ["sh", "-c", script, "sh", *command],
            cwd=tmp_path,
            env=environment(),
            capture_output=True,
            text=True,
            timeout=600,
        )
        assert result.returncode == code
        assert "Traceback" not in result.stdout + result.stderr
        assert "omnidyn: " not in result.stdout


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_behind_stdout_is_said(tmp_path):
    with open("/dev/full", "w") as full:
        result = subprocess.run(
            [sys.executable, "-m", "omnidyn", "robots"],
            cwd=tmp_path,
            env=environment(),
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=120,
            check=False,
        )
    assert result.returncode == 3
    assert "No space left on device" in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="needs /proc, where nobody may write")
def test_a_place_where_nobody_may_write_is_refused(tmp_path):
    (tmp_path / "u.csv").write_text(VOLTAGES)
    result = omnidyn("simulate", "axebot", "u.csv", "-o", "/proc/run.csv", cwd=tmp_path)
    assert result.returncode == 3
    assert "Traceback" not in result.stderr


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_refused(tmp_path):
    (tmp_path / "u.csv").write_text(VOLTAGES)
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    for arguments in (["simulate", "axebot", "u.csv", "-o", "locked/run.csv"], ["demo", "--out", "locked/demo"]):
        result = omnidyn(*arguments, cwd=tmp_path)
        assert result.returncode == 3
        assert "the folder is not writable" in result.stderr


@pytest.mark.parametrize(
    "more",
    [
        {"LC_ALL": "C"},
        {"LC_ALL": "POSIX", "COLUMNS": "20"},
        {"LC_ALL": "C", "NO_COLOR": "1", "TERM": "dumb"},
        {"PYTHONIOENCODING": "ascii"},
    ],
)
def test_a_plain_terminal_gets_plain_text(tmp_path, more):
    result = omnidyn("check", "Größe \N{SNOWMAN}.csv", cwd=tmp_path, **more)
    assert result.returncode == 3
    assert "no such file" in result.stderr
    assert result.stderr.isascii()
    assert omnidyn("--help", cwd=tmp_path, **more).stdout.isascii()


def test_an_error_has_no_colour_codes(tmp_path):
    result = omnidyn("robots", cwd=tmp_path, FORCE_COLOR="1")
    assert "\x1b" not in result.stdout


@pytest.mark.parametrize("command", ["simulate axebot u.csv", "track axebot --path circle --controller pid"])
def test_commands_that_fit_nothing_load_no_optimiser(tmp_path, command):
    """It takes a tenth of a second to load."""
    (tmp_path / "u.csv").write_text("t_s,u1_V,u2_V,u3_V\n0,0,3,-3\n0.1,0,3,-3\n0.2,0,3,-3\n")
    script = (
        f"import sys\nfrom omnidyn.cli import main\ncode = main({command.split()!r})\n"
        "heavy = {'scipy.optimize', 'scipy.signal', 'matplotlib'}\n"
        "print(code, sorted(heavy & set(sys.modules)), file=sys.stderr)"
    )
    result = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=600
    )
    assert result.stderr.splitlines()[-1] == "0 []"


def test_help_is_quick(tmp_path):
    """It imports nothing heavy, and little at all: a count, for seconds depend on the machine."""
    script = (
        "import sys\nfrom omnidyn.cli import main\nmain(['--help'])\n"
        "heavy = {'click', 'numpy', 'numba', 'scipy', 'pydantic', 'matplotlib', 'rich'}\n"
        "print(sorted(heavy & set(sys.modules)), len(sys.modules) < 300, file=sys.stderr)"
    )
    result = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=600,
        check=True,
    )
    assert result.stderr == "[] True\n"


def test_work_past_two_seconds_shows_progress(capsys, monkeypatch):
    monkeypatch.setattr("omnidyn.cli.terminal.progress.SILENT_S", 0.05)
    monkeypatch.setattr("omnidyn.cli.terminal.progress.NEW_S", 0.05)
    monkeypatch.setattr("omnidyn.cli.terminal.progress.BEAT_S", 0.05)
    from omnidyn.cli.terminal.progress import shown_progress

    with shown_progress("walking") as progress:
        hear(capsys, "omnidyn: walking ... ")
        progress(Report("running"))
        hear(capsys, "omnidyn: running ... ")


def test_a_new_step_is_told_sooner_than_one_that_lasts(capsys, monkeypatch):
    for name, seconds in (("SILENT_S", 0.02), ("NEW_S", 0.1), ("BEAT_S", 600.0)):
        monkeypatch.setattr(f"omnidyn.cli.terminal.progress.{name}", seconds)
    from omnidyn.cli.terminal.progress import shown_progress

    with shown_progress("walking") as progress:
        err = hear(capsys, "walking")
        progress(Report("running"))
        err = hear(capsys, "running", err)
        time.sleep(0.5)
    err += capsys.readouterr().err
    assert (err.count("walking"), err.count("running")) == (1, 1)


def test_progress_says_where_a_kernel_is_compiled(capsys, monkeypatch):
    from omnidyn.cli.terminal.progress import shown_progress
    from omnidyn.compiled.listeners import told

    monkeypatch.setattr("omnidyn.cli.terminal.progress.SILENT_S", 0.05)
    with shown_progress("walking"), told("a kernel"):
        hear(capsys, "omnidyn: walking (a kernel is being compiled: once, the first time) ... ")


def test_quick_work_is_silent(capsys):
    from omnidyn.cli.terminal.progress import shown_progress

    with shown_progress("walking"):
        pass
    assert capsys.readouterr() == ("", "")
