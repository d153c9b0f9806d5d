"""The parts of dev.py that can be judged without installing anything."""

import ast
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

import dev

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """dev.py made to work on an empty checkout, with a venv that is only a file called python."""
    (tmp_path / "dev.py").write_text("# dev")
    (tmp_path / "pyproject.toml").write_text("# project")
    locks = {level: tmp_path / f"{level}.txt" for level in dev.LOCKS}
    for level, path in locks.items():
        path.write_text(level)
    venv = tmp_path / ".venv"
    venv.mkdir()
    places = {"ROOT": tmp_path, "VENV": venv, "LOCKS": locks, "GUARD": tmp_path / "guard"}
    places |= {"PYTHON": venv / "python", "STAMP": venv / "complete"}
    for name, value in places.items():
        monkeypatch.setattr(dev, name, value)
    dev.PYTHON.write_text("")
    return tmp_path


def stamp(level):
    dev.STAMP.write_text(f"{level} {dev.fingerprint(level)}\n")


# ---- an old Python is told that it is old ---------------------------------------------------------------


def test_an_old_python_can_parse_it():
    newer = (ast.JoinedStr, ast.NamedExpr, ast.AnnAssign, ast.Match, ast.AsyncFunctionDef, ast.Starred)
    tree = ast.parse((ROOT / "dev.py").read_text("ascii"))
    assert not [node for node in ast.walk(tree) if isinstance(node, newer) and not in_a_call(node, tree)]
    for node in ast.walk(tree):
        marks = ("annotation", "returns", "kwonlyargs", "posonlyargs")
        assert not [mark for mark in marks if getattr(node, mark, None)]


def in_a_call(node, tree):
    """f(*args) is as old as Python."""
    return any(isinstance(call, ast.Call) and node in call.args for call in ast.walk(tree))


def test_the_version_is_checked_before_any_other_import():
    body = ast.parse((ROOT / "dev.py").read_text()).body
    kinds = [type(node).__name__ for node in body[:4]]
    assert kinds == ["Expr", "Import", "If", "Import"]


# ---- the fingerprint and the stamp ----------------------------------------------------------------------


@pytest.mark.parametrize("name", ["core.txt", "pyproject.toml", "dev.py"])
def test_the_fingerprint_changes_with_each_file(checkout, name):
    before = dev.fingerprint("core")
    assert dev.fingerprint("core") == before
    (checkout / name).write_text("changed")
    assert dev.fingerprint("core") != before


def test_the_fingerprint_changes_with_python_and_folder(checkout, monkeypatch):
    prints = {dev.fingerprint("core")}
    monkeypatch.setattr(dev.sys, "base_prefix", "elsewhere")
    prints.add(dev.fingerprint("core"))
    monkeypatch.setattr(dev, "ROOT", checkout / ".venv" / "..")  # the same files by another name
    prints.add(dev.fingerprint("core"))
    assert len(prints) == 3


@pytest.mark.parametrize(
    "held, asked, answer",
    [
        ("core", "core", True),
        ("core", "everything", False),
        ("everything", "core", True),
        ("everything", "everything", True),
        ("", "core", False),
        ("unknown", "core", False),
    ],
)
def test_everything_serves_core_but_not_the_other_way(checkout, held, asked, answer):
    if held in dev.LOCKS:
        stamp(held)
    elif held:
        dev.STAMP.write_text(f"{held} 0")
    assert dev.ready(asked) is answer


def test_a_venv_without_python_is_not_ready(checkout):
    stamp("core")
    dev.PYTHON.unlink()
    assert not dev.ready("core")


def test_a_venv_from_which_a_package_was_deleted_is_made_anew(installers):
    site = Path(dev.sysconfig.get_path("purelib", "venv", {"base": str(dev.VENV), "platbase": str(dev.VENV)}))
    (site / "numpy").mkdir(parents=True)
    (site / "numpy-2.0.dist-info").mkdir()
    dev.ensure("core", {})
    assert dev.ready("core")
    (site / "own").mkdir()  # what the user puts there himself is no matter
    assert dev.ready("core")
    (site / "numpy").rmdir()
    assert not dev.ready("core")
    installers[0].clear()
    dev.ensure("core", {})
    assert "--clear" in installers[0][0]


@pytest.mark.parametrize("target", ["another", "nowhere"])
def test_a_venv_that_is_a_link_is_left_alone(installers, tmp_path, target):
    """A work tree often shares the .venv of another checkout: to set it up would empty that."""
    another = tmp_path / "another"
    another.mkdir()
    (another / "complete").write_text(f"everything {dev.fingerprint('everything')} of another folder\n")
    shutil.rmtree(dev.VENV)
    dev.VENV.symlink_to(tmp_path / target)
    with pytest.raises(SystemExit, match=rf"^dev\.py: .*\.venv is a link to .*{target}, which would be emptied"):
        dev.ensure("core", {})
    assert installers[0] == []
    assert (another / "complete").exists()


def test_a_venv_that_is_no_folder_is_told_in_one_line(checkout):
    shutil.rmtree(dev.VENV)
    dev.VENV.write_text("")
    with pytest.raises(SystemExit, match=r"^dev\.py: .*\.venv is no folder; remove it, then call again$"):
        dev.ensure("core", {})


def test_a_lock_that_is_a_folder_is_told_in_one_line(checkout):
    dev.GUARD.mkdir()
    with pytest.raises(SystemExit, match=r"^dev\.py: cannot write .*guard: Is a directory; remove it"):
        dev.ensure("core", {})


def test_docs_says_where_they_are(monkeypatch, capfd):
    monkeypatch.setattr(sys, "stderr", sys.__stderr__)
    monkeypatch.setattr(dev, "ensure", lambda level, env: None)
    monkeypatch.setattr(dev, "run_all", lambda calls, env, there: 0)
    assert dev.run("docs", [], {}) == 0
    assert f"wrote {ROOT / 'docs' / '_build' / 'html' / 'index.html'}" in capfd.readouterr().err
    monkeypatch.setattr(dev, "run_all", lambda calls, env, there: 2)
    assert dev.run("docs", [], {}) == 2
    assert "wrote" not in capfd.readouterr().err


# ---- the environment ------------------------------------------------------------------------------------


def test_what_leads_astray_is_dropped_and_where_packages_come_from_is_kept():
    astray = "PYTHONPATH PYTHONHOME PIP_TARGET PIP_PREFIX PIP_USER PIP_CONSTRAINT UV_TARGET UV_PYTHON"
    astray += " PYTHONDONTWRITEBYTECODE"
    kept = "PATH HOME PIP_INDEX_URL PIP_FIND_LINKS PIP_CERT PIP_NO_INDEX UV_INDEX_URL UV_DEFAULT_INDEX"
    kept += " SSL_CERT_FILE HTTPS_PROXY PIP_PROXY PIP_TRUSTED_HOST PIP_CACHE_DIR UV_CACHE_DIR PIP_CONFIG_FILE"
    env = dev.clean_env(dict.fromkeys((astray + " " + kept).split(), "set"))
    assert {name for name, value in env.items() if value == "set"} == set(kept.split())
    assert env["PIP_USER"] == "0"


def test_uv_trusts_the_certificates_of_the_system_unless_told_otherwise():
    assert dev.clean_env({})["UV_SYSTEM_CERTS"] == dev.clean_env({})["UV_NATIVE_TLS"] == "1"
    assert "UV_SYSTEM_CERTS" not in dev.clean_env({"UV_NATIVE_TLS": "0"})


# ---- the installers -------------------------------------------------------------------------------------


def found(uv, modules):
    return list(dev.ways("lock", which=lambda name: uv, has=lambda name: name in modules))


def test_uv_comes_first_then_the_venvs_pip_then_the_systems():
    names = [way.name for way in found("/bin/uv", ["ensurepip", "pip"])]
    assert names == ["uv", "the venv's own pip", "the system's pip"]


def test_without_ensurepip_the_venv_is_made_without_pip():
    (way,) = found(None, ["pip"])
    assert way.venv_flags == ["--without-pip"]
    assert way.install[:5] == [dev.BASE, "-m", "pip", "--python", str(dev.PYTHON)]


@pytest.mark.parametrize("way", found("/bin/uv", ["ensurepip", "pip"]), ids=lambda way: way.name)
def test_every_way_installs_wheels_by_hash_and_nothing_else(way):
    assert {"--require-hashes", "--no-deps", "--only-binary", ":all:"} <= set(way.install)
    assert way.install[-2:] == ["-r", "lock"]


def test_no_installer_is_told_in_one_line():
    words = dev.no_way([], which=lambda tool: tool == "apt-get")
    assert words.endswith("sudo apt-get install python3-venv")
    assert "\n" not in words
    assert "install uv or pip" in dev.no_way([], which=lambda tool: None)


def test_installers_that_failed_are_named():
    assert "uv or the venv's own pip" in dev.no_way(["uv", "the venv's own pip"])


@pytest.fixture
def installers(checkout, monkeypatch):
    """Two ways that do nothing; returns the calls and the set of ways that fail."""
    calls, failing = [], set()
    ways = [dev.Way("first", [], ["first"]), dev.Way("second", [], ["second"])]
    monkeypatch.setattr(dev, "ways", lambda lock: ways)
    monkeypatch.setattr(dev, "link", lambda env: calls.append("link"))
    monkeypatch.setattr(dev, "attend", lambda call, env: calls.append(call) or int(call[0] in failing))
    return calls, failing


def test_the_next_way_is_tried_from_scratch_when_one_fails(installers):
    calls, failing = installers
    failing.add("first")
    dev.ensure("core", {})
    assert [call for call in calls if call[0] in ("first", "second")] == [["first"], ["second"]]
    assert all("--clear" in call for call in calls if "venv" in call)
    assert dev.ready("core")


def test_a_complete_core_is_added_to(installers):
    stamp("core")
    dev.ensure("everything", {})
    assert "--clear" not in installers[0][0]
    assert dev.ready("everything")


def test_a_complete_venv_costs_no_call(installers):
    stamp("everything")
    dev.ensure("core", {})
    assert installers[0] == []


def test_when_every_way_fails_there_is_no_stamp(installers):
    stamp("core")
    installers[1].update(["first", "second"])
    with pytest.raises(SystemExit, match=r"could not make \.venv with first or second"):
        dev.ensure("everything", {})
    assert not dev.STAMP.exists()


def test_an_interrupted_installer_leaves_no_stamp(installers, monkeypatch):
    def interrupted(call, env):
        raise KeyboardInterrupt

    monkeypatch.setattr(dev, "attend", interrupted)
    stamp("core")
    with pytest.raises(KeyboardInterrupt):
        dev.ensure("everything", {})
    assert not dev.ready("core")


def test_a_silent_installer_has_a_heartbeat(monkeypatch, capfd):
    monkeypatch.setattr(dev, "BEAT", 0.05)
    monkeypatch.setattr(sys, "stdout", sys.__stdout__)
    monkeypatch.setattr(sys, "stderr", sys.__stderr__)
    assert dev.attend([sys.executable, "-c", "import time; time.sleep(0.3); exit(7)"], os.environ) == 7
    assert "still installing" in capfd.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("name, code", [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
def test_a_signal_ends_the_installer_and_says_so_in_the_exit_code(tmp_path, name, code):
    shutil.copy(ROOT / "dev.py", tmp_path)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    shutil.copytree(ROOT / "locks", tmp_path / "locks")
    uv = tmp_path / "uv"  # an installer that never ends, with a child of its own
    uv.write_text(f"#!/bin/sh\n(echo $$ > {tmp_path}/pid; sleep 60) & wait\n")
    uv.chmod(0o755)
    env = {"PATH": f"{tmp_path}:/usr/bin:/bin"}
    with subprocess.Popen([dev.BASE, tmp_path / "dev.py", "setup"], env=env, stderr=subprocess.PIPE) as door:
        while not (tmp_path / "pid").exists() or not (tmp_path / "pid").read_text().strip():
            time.sleep(0.02)
        door.send_signal(getattr(signal, name))
        _, talk = door.communicate(timeout=200)  # returns only when the child has let go of stderr too
    assert door.returncode == code
    assert b"Traceback" not in talk
    assert not (tmp_path / ".venv" / "complete").exists()


def test_only_one_dev_py_makes_the_venv(checkout):
    with open(dev.GUARD, "w") as one, open(dev.GUARD, "w") as other:
        assert dev.seize(one)
        assert not dev.seize(other)


# ---- the start script -----------------------------------------------------------------------------------


def test_the_start_script_runs_the_package_from_src(tmp_path, monkeypatch):
    root = tmp_path / "robots é"  # a space and an accent
    (root / "src" / "omnidyn").mkdir(parents=True)
    (root / "src" / "omnidyn" / "cli.py").write_text("import sys\ndef main():\n    print(sys.argv)\n    return 5\n")
    folder = root / ".venv" / dev.BIN.name
    for name, value in {"ROOT": root, "BIN": folder, "PYTHON": folder / dev.PYTHON.name}.items():
        monkeypatch.setattr(dev, name, value)
    subprocess.run([dev.BASE, "-m", "venv", "--without-pip", str(root / ".venv")], check=True)
    dev.link(dict(os.environ))
    script = folder / ("omnidyn.cmd" if os.name == "nt" else "omnidyn")
    done = subprocess.run([str(script), "demo", "a b"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (5, "['omnidyn', 'demo', 'a b']\n"), done.stderr


# ---- the door -------------------------------------------------------------------------------------------


def call(*arguments):
    return subprocess.run([sys.executable, str(ROOT / "dev.py"), *arguments], capture_output=True, text=True)


def test_no_command_and_a_wrong_one_are_usage_errors():
    assert call().returncode == 2
    wrong = call("tset")
    assert wrong.returncode == 2
    assert "no command tset; there are demo, test" in wrong.stderr
    assert call("--help").returncode == 0


def test_a_command_that_takes_no_arguments_says_so():
    with pytest.raises(SystemExit, match="check takes no arguments, got -k x"):
        dev.run("check", ["-k", "x"], {})


@pytest.mark.parametrize("name", ["demo", "test", "bench"])
def test_arguments_go_through(name, monkeypatch):
    ran = []
    monkeypatch.setattr(dev, "ensure", lambda level, env: None)
    monkeypatch.setattr(dev, "run_last", lambda command, env, there: ran.append(command) or 3)
    assert dev.run(name, ["--x", "a b"], {}) == 3
    assert ran[0][-2:] == ["--x", "a b"]


def test_check_runs_every_step_and_returns_the_first_failure():
    steps = [[sys.executable, "-c", f"raise SystemExit({code})"] for code in (0, 4, 3)]
    assert dev.run_all(steps, dict(os.environ), None) == 4


def test_no_long_study_is_begun_late(request, monkeypatch):
    conftest = request.config.pluginmanager.get_plugin(str(ROOT / "tests" / "conftest.py"))
    long, short = (SimpleNamespace(get_closest_marker=lambda name, own=own: own) for own in ("long", None))
    monkeypatch.setattr(conftest, "BEGUN", time.monotonic())
    conftest.pytest_runtest_setup(long)
    monkeypatch.setattr(conftest, "BEGUN", time.monotonic() - 60.0 * conftest.LAST_LONG - 1.0)
    conftest.pytest_runtest_setup(short)
    with pytest.raises(pytest.skip.Exception, match="a long study, and 45 minutes have passed"):
        conftest.pytest_runtest_setup(long)
