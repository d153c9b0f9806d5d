#!/usr/bin/env python3
"""One door to the project. Needs Python 3.11 or newer, and nothing installed.

    python3 dev.py demo [ARGS]        the paper, end to end; ARGS go to `omnidyn demo`
    python3 dev.py test [ARGS]        the tests, a process per core; ARGS go to pytest: -k WORD, -n0, --long
    python3 dev.py check              ruff, pyright and the tests of the house rules
    python3 dev.py bench [NAME ARGS]  the benchmarks
    python3 dev.py docs               the documentation, into docs/_build/html; says where
    python3 dev.py setup [core]       only make .venv, with everything or with what `demo` needs
    python3 dev.py lock [--upgrade]   resolve the two lock files again
    python3 dev.py release            build twice, compare, look inside, try the wheel; refuses a tree with changes

The first call makes .venv from a hash-locked file; a later call finds it complete and starts at once.
Nothing is installed anywhere else.
"""

import sys

# Checked before anything an old Python cannot import; for the same reason this file has no f-string and
# no annotation: an old Python must be able to parse it to be told that it is old.
if sys.version_info < (3, 11):
    sys.exit("dev.py needs Python 3.11 or newer, this is " + sys.version.split()[0])

import contextlib
import hashlib
import os
import shlex
import shutil
import signal
import subprocess
import sysconfig
import tempfile
import time
from collections import namedtuple
from pathlib import Path

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
BIN = VENV / ("Scripts" if os.name == "nt" else "bin")
PYTHON = BIN / ("python.exe" if os.name == "nt" else "python")
STAMP = VENV / "complete"  # written last: "level fingerprint"
GUARD = ROOT / ".venv.lock"  # held while .venv is made; outside it, because .venv is emptied
LOCKS = {"core": ROOT / "locks" / "core.txt", "everything": ROOT / "locks" / "everything.txt"}
CONSTRAINTS = ROOT / "locks" / "constraints.txt"
# The Python that .venv is made from. Not sys.executable: that may be the one in .venv, soon to be deleted.
BASE = getattr(sys, "_base_executable", None) or sys.executable
BEAT = 5.0  # seconds between signs of life while an installer is silent

SPHINX = ["-m", "sphinx", "-q", "-W", "--keep-going", "docs", "docs/_build/html"]  # -W: a warning is an error

# A process for each core; each takes tests that follow one another, so that few fixtures are made twice. -n0 is one
# process; --pdb is one too.
TESTS = ["-m", "pytest", "-n", "auto", "--dist", "worksteal"]

# level: what must be installed; there: the working directory, None = where the user stands;
# steps: what Python is called with; open: whether arguments are passed on; made: what it writes, said at its end.
Command = namedtuple("Command", "level there steps open made", defaults=[None])
COMMANDS = {
    # -P: a file of the user's called numpy.py must not be imported by the demo.
    "demo": Command("core", None, [["-P", "-m", "omnidyn", "demo"]], True),
    "test": Command("everything", ROOT, [TESTS], True),
    "check": Command(
        "everything",
        ROOT,
        [
            ["-m", "ruff", "check", "."],
            ["-m", "ruff", "format", "--check", "."],
            ["-m", "pyright"],
            ["-m", "pytest", "-q", "tests/house"],
        ],
        False,
    ),
    "bench": Command("everything", ROOT, [["-m", "benchmarks"]], True),
    "docs": Command("everything", ROOT, [SPHINX], False, ROOT / "docs" / "_build" / "html" / "index.html"),
}


def say(words):
    """Talk goes to stderr; stdout belongs to the command."""
    sys.stderr.write("dev.py: " + words + "\n")
    sys.stderr.flush()


# ---- the environment ------------------------------------------------------------------------------------

DROPPED = ("PYTHONPATH", "PYTHONHOME", "PYTHONSTARTUP", "PYTHONSAFEPATH")
DROPPED += ("VIRTUAL_ENV", "__PYVENV_LAUNCHER__")
DROPPED += ("PYTHONDONTWRITEBYTECODE",)  # every process that a test starts would compile all it imports anew
# Of PIP_* and UV_* these stay: where packages come from, whom to trust, how to get there. The others
# (TARGET, PREFIX, USER, CONSTRAINT, NO_DEPS ...) change what is installed, or where.
KEPT = ("INDEX", "LINKS", "HOST", "CERT", "TLS", "PROXY", "HTTP", "TIMEOUT", "RETRIES")
KEPT += ("KEYRING", "CACHE", "CONFIG", "OFFLINE", "LINK_MODE")


def is_kept(name):
    if name.startswith(("PIP_", "UV_")):
        return any(word in name for word in KEPT)
    return name not in DROPPED


def clean_env(environ):
    """The user's environment without what would lead an installer or Python astray."""
    env = {name: value for name, value in environ.items() if is_kept(name)}
    env["PIP_USER"] = "0"  # a pip.conf with `user = true` would fail in a venv
    if not {"UV_SYSTEM_CERTS", "UV_NATIVE_TLS"} & set(env):
        env.update(UV_SYSTEM_CERTS="1", UV_NATIVE_TLS="1")  # the newer and the older name
    return env


# ---- is .venv complete? ---------------------------------------------------------------------------------


def fingerprint(level):
    """What a complete .venv was made of: this Python, this folder, the lock, pyproject.toml, this file."""
    made_of = hashlib.sha256(repr((sys.version_info[:3], sys.base_prefix, str(ROOT))).encode())
    for path in (LOCKS[level], ROOT / "pyproject.toml", ROOT / "dev.py"):
        made_of.update(path.read_bytes() + b"\0")
    return made_of.hexdigest()


def ready(level):
    """True if .venv holds this level or more, as the files now say it should be."""
    try:
        lines = STAMP.read_text("utf-8").splitlines()
        held, made_of = lines[0].split()
    except (OSError, ValueError, IndexError):
        return False
    enough = held == "everything" or held == level
    whole = enough and held in LOCKS and PYTHON.exists() and made_of == fingerprint(held)
    return whole and set(lines[1:]) <= set(installed())  # somebody may have deleted a package below the stamp


def installed():
    """What lies in the folders of packages of .venv: names, sorted."""
    base = {"base": str(VENV), "platbase": str(VENV)}
    folders = {sysconfig.get_path(kind, "venv", base) for kind in ("purelib", "platlib")}
    return sorted({name for folder in folders if os.path.isdir(folder) for name in os.listdir(folder)})


# ---- making .venv ---------------------------------------------------------------------------------------

Way = namedtuple("Way", "name venv_flags install")


def has_module(name):
    """Asked of the Python that makes .venv, not of this one: they may differ."""
    probe = [BASE, "-I", "-c", "import {}.__main__".format(name)]  # an empty folder of that name is no module
    return subprocess.call(probe, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) == 0


def ways(lock, which=shutil.which, has=has_module):
    """The installers found here, fastest first."""
    flags = ["--require-hashes", "--no-deps", "--only-binary", ":all:", "-r", str(lock)]
    pip = ["install", "-q", "--disable-pip-version-check", "--no-input", "--no-compile"] + flags
    uv, python, bare = which("uv"), str(PYTHON), ["--without-pip"]
    if uv:
        yield Way("uv", bare, [uv, "pip", "install", "-q", "--python", python] + flags)
    if has("ensurepip"):
        yield Way("the venv's own pip", [], [python, "-m", "pip"] + pip)
    if has("pip"):  # Debian leaves ensurepip out, and refuses a bare pip install
        yield Way("the system's pip", bare, [BASE, "-m", "pip", "--python", python] + pip)


REMEDIES = {
    "apt-get": "sudo apt-get install python3-venv",
    "dnf": "sudo dnf install python3-pip",
    "zypper": "sudo zypper install python3-pip",
    "pacman": "sudo pacman -S python-pip",
    "apk": "sudo apk add py3-pip",
}


def no_way(tried, which=shutil.which):
    """What to tell the user when nothing installed the packages."""
    if tried:
        return "could not make .venv with {}; the lines above say why".format(" or ".join(tried))
    remedy = [line for tool, line in REMEDIES.items() if which(tool)] + ["install uv or pip for this Python"]
    return "found no installer (uv, ensurepip or pip). Do this, then call again: " + remedy[0]


def attend(command, env):
    """Run an installer and return its exit code; say now and then that it is still at work."""
    started = time.monotonic()
    # A session of its own: Ctrl-C reaches us alone, and we end the installer with all it started.
    own = {"stdin": subprocess.DEVNULL, "stdout": sys.stderr, "start_new_session": True}
    child = subprocess.Popen(command, env=env, **own)
    try:
        while True:
            try:
                return child.wait(BEAT)
            except subprocess.TimeoutExpired:
                say("  still installing, {:.0f} s".format(time.monotonic() - started))
    except BaseException:  # Ctrl-C, or a signal turned into SystemExit
        stop(child)
        raise


def stop(child):
    """Leave no installer behind: the next call empties the folder it writes to."""
    with contextlib.suppress(OSError):  # it may be gone already
        if os.name == "nt":
            child.terminate()
        else:
            os.killpg(child.pid, signal.SIGKILL)
    child.wait()


def make(way, clear, env):
    """A venv, then its packages, by one installer. True if both went well."""
    venv = [BASE, "-m", "venv"] + clear + way.venv_flags + [str(VENV)]
    try:
        return attend(venv, env) == 0 and attend(way.install, env) == 0
    except OSError as problem:
        say("{}: {}".format(way.name, problem))
        return False


def link(env):
    """The package is used from src: one .pth line and one start script, no build step."""
    ask = [str(PYTHON), "-I", "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    site = subprocess.run(ask, env=env, stdout=subprocess.PIPE, check=True, text=True).stdout.strip()
    # Relative, so that a folder with accents needs no encoding.
    Path(site, "omnidyn.pth").write_text(os.path.relpath(ROOT / "src", site) + "\n")
    call = "import sys; sys.argv[0] = 'omnidyn'; from omnidyn.cli import main; sys.exit(main())"
    if os.name == "nt":
        (BIN / "omnidyn.cmd").write_text('@"%~dp0python.exe" -P -c "{}" %*\n'.format(call))
        return
    script = BIN / "omnidyn"  # through sh: a line with #! can hold no folder with a space
    words = shlex.join([str(PYTHON), "-P", "-c", call])
    script.write_text('#!/bin/sh\nexec {} "$@"\n'.format(words))
    script.chmod(0o755)


def install(level, env):
    """Make .venv by the first way that works. The stamp goes first and comes back last."""
    clear = [] if ready("core") else ["--clear"]  # a complete core is added to, anything else made anew
    STAMP.unlink(missing_ok=True)
    tried = []
    for way in ways(LOCKS[level]):
        started = time.monotonic()
        say("setting up .venv ({}) with {}".format(level, way.name))
        if make(way, clear, env):
            link(env)
            STAMP.write_text("\n".join(["{} {}".format(level, fingerprint(level))] + installed()) + "\n", "utf-8")
            say("ready after {:.1f} s".format(time.monotonic() - started))
            return
        tried.append(way.name)
        clear = ["--clear"]
    sys.exit("dev.py: " + no_way(tried))


def seize(handle):
    """Take the guard if it is free. The system lets go of it when the process ends, however it ends."""
    try:
        if os.name == "nt":
            import msvcrt

            msvcrt.locking(handle.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def guard():
    """The file that is held while .venv is made."""
    try:
        return open(GUARD, "w")
    except OSError as problem:
        sys.exit("dev.py: cannot write {}: {}; remove it, then call again".format(GUARD, problem.strerror))


@contextlib.contextmanager
def alone():
    """One dev.py makes .venv, another waits for it."""
    with guard() as handle:
        waited = 0.0
        while not seize(handle):
            if waited % BEAT == 0:
                say("another dev.py is setting up .venv; waiting, {:.0f} s".format(waited))
            time.sleep(0.5)
            waited += 0.5
        yield


def ensure(level, env):
    """Afterwards .venv holds this level. Costs nothing if it already does."""
    if ready(level):
        return
    if os.path.islink(VENV):  # setting up empties the folder: it may be that of another checkout
        words = "dev.py: {} is a link to {}, which would be emptied; remove the link, then call again"
        sys.exit(words.format(VENV, os.path.realpath(VENV)))
    if os.path.lexists(VENV) and not VENV.is_dir():
        sys.exit("dev.py: {} is no folder; remove it, then call again".format(VENV))
    with alone():
        if not ready(level):  # the one we waited for may have made it
            install(level, env)


# ---- the commands ---------------------------------------------------------------------------------------


def run_last(command, env, there):
    """Hand over to the command: its signals, its exit code."""
    if there:
        os.chdir(there)
    if os.name == "nt":
        return subprocess.call(command, env=env)
    sys.stdout.flush()
    return os.execve(command[0], command, env)


def run_all(commands, env, there):
    """Run every step, so that one failure does not hide the next; the first failure is the exit code."""
    codes = []
    for command in commands:
        say(" ".join(command[1:]))
        codes.append(subprocess.call(command, env=env, cwd=there))
    failed = [code for code in codes if code]
    return failed[0] if failed else 0


def run(name, arguments, env):
    command = COMMANDS[name]
    if arguments and not command.open:
        sys.exit("dev.py: {} takes no arguments, got {}".format(name, " ".join(arguments)))
    ensure(command.level, env)
    calls = [[str(PYTHON)] + step + arguments for step in command.steps]
    if len(calls) == 1 and not command.made:
        return run_last(calls[0], env, command.there)
    code = run_all(calls, env, command.there)
    if command.made and not code:
        say("wrote {}".format(command.made))
    return code


def setup(arguments, env):
    level = arguments[0] if arguments else "everything"
    if level not in LOCKS or len(arguments) > 1:
        sys.exit("dev.py: setup takes core, everything or nothing, got " + " ".join(arguments))
    ensure(level, env)
    return 0


@contextlib.contextmanager
def uv_found(env):
    """uv from PATH, or for the time being from a temporary venv."""
    if shutil.which("uv"):
        yield shutil.which("uv")
        return
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([BASE, "-m", "venv", folder], env=env, check=True)
        here = Path(folder, BIN.name)
        subprocess.run([str(here / PYTHON.name), "-m", "pip", "install", "-q", "uv"], env=env, check=True)
        yield str(here / "uv")


def lock(arguments, env):
    """Resolve both locks from pyproject.toml alone, for every Python and platform, without addresses.

    Pins that still fit are kept; `--upgrade` looks for newer ones. The second lock agrees with the first.
    """
    resolver = {name: value for name, value in env.items() if not name.startswith("UV_")}
    resolver.update(UV_SYSTEM_CERTS="1", UV_NATIVE_TLS="1")
    flags = ["--universal", "--python-version", "3.11", "--generate-hashes", "--no-header", "--no-annotate"]
    flags += ["--only-binary", ":all:", "-q", "-c", str(CONSTRAINTS)] + arguments
    more = ["--all-extras", "--group", "dev", "-c", str(LOCKS["core"])]
    with uv_found(env) as uv:
        for level, extra in (("core", []), ("everything", more)):
            call = [uv, "pip", "compile", "pyproject.toml", "-o", str(LOCKS[level])] + flags + extra
            subprocess.run(call, env=resolver, cwd=ROOT, check=True)
    return 0


def release(arguments, env):
    """Needs no .venv: it makes the environments in which it builds and tries."""
    sys.path.insert(0, str(ROOT))
    import release as made

    return made.main(arguments, env)


OTHERS = {"setup": setup, "lock": lock, "release": release}


def main(arguments):
    name, rest = (arguments or ["help"])[0], arguments[1:]
    env = clean_env(os.environ)
    if name in ("help", "-h", "--help"):
        sys.stdout.write(__doc__)
        return 0 if arguments else 2
    if name in COMMANDS:
        return run(name, rest, env)
    if name in OTHERS:
        return OTHERS[name](rest, env)
    say("no command {}; there are {}, {}".format(name, ", ".join(COMMANDS), ", ".join(OTHERS)))
    return 2


if __name__ == "__main__":
    for name in ("SIGTERM", "SIGHUP"):  # Windows has no SIGHUP
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), lambda number, _: sys.exit(128 + number))
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        say("interrupted; the next call repairs .venv if need be")
        sys.exit(130)
    except subprocess.CalledProcessError as problem:
        sys.exit("dev.py: failed: " + " ".join(map(str, problem.cmd)))
