"""omnidyn warm: what it compiles, what it finds, what it drops; and who is told of it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import omnidyn
from omnidyn.cli import main
from omnidyn.compiled.kernel import kept, kernel
from omnidyn.compiled.listeners import told
from omnidyn.identification.first_runs import first_runs
from omnidyn.progress import Report
from tests.support.outputs import hear

SOURCE = str(Path(omnidyn.__file__).resolve().parents[1])


def half(x):
    return 0.5 * x


@pytest.fixture
def few(monkeypatch, tmp_path):
    """One kernel, with a run that needs it, instead of all."""
    compiled = kernel(half)
    compiled._cache.flush()
    monkeypatch.setattr("omnidyn.compiled.warmed.place", lambda: tmp_path / "warmed.json")
    monkeypatch.setattr("omnidyn.identification.first_runs.first_runs", lambda: [("halves", lambda: compiled(1.0))])
    monkeypatch.setattr("omnidyn.control.first_runs.first_runs", list)
    monkeypatch.setattr("omnidyn.compiled.kernel.kept", lambda: [compiled._cache])
    yield compiled
    compiled._cache.flush()


def warm(capsys, *arguments):
    assert main(["warm", *arguments]) == 0
    return capsys.readouterr()


def test_it_says_what_it_compiled_and_where_that_lies(few, capsys):
    out, err = warm(capsys)
    assert "omnidyn: 1 of 1, halves: half 0." in err
    assert out.startswith("1 compiled in ")
    assert f"1 entries, 0.0 MB, in {few._cache.cache_path}\n" in out
    out, err = warm(capsys)
    assert err == ""
    assert out.startswith("all is there (")


def test_where_all_is_there_nothing_is_run(few, capsys, monkeypatch):
    first = json.loads(warm(capsys, "--json").out)
    monkeypatch.delattr("omnidyn.identification.first_runs.first_runs")
    again = json.loads(warm(capsys, "--json").out)
    assert again == first | {"compiled": [], "provenance": again["provenance"]}


def test_what_was_dropped_meanwhile_is_made_again(few, capsys, monkeypatch):
    warm(capsys)
    few._cache.flush()
    monkeypatch.setattr("omnidyn.identification.first_runs.first_runs", lambda: [("halves", lambda: kernel(half)(1.0))])
    assert warm(capsys).out.startswith("1 compiled in ")
    assert warm(capsys).out.startswith("all is there (")


def test_for_machines(few, capsys):
    first = json.loads(warm(capsys, "--json").out)
    assert [each["kernel"] for each in first["compiled"]] == ["half"]
    assert first["compiled"][0]["seconds"] > 0.0
    again = json.loads(warm(capsys, "--json").out)
    assert (again["compiled"], again["entries"], again["folders"]) == ([], 1, [few._cache.cache_path])
    assert again["bytes"] > 5000
    assert again["provenance"]["omnidyn"] == omnidyn.__version__


def test_without_a_writable_folder_it_says_so(few, capsys, monkeypatch):
    monkeypatch.setattr("omnidyn.compiled.kernel.kept", list)
    out, err = warm(capsys)
    assert "no folder is writable" in err
    assert "NUMBA_CACHE_DIR" in err
    assert "entries" not in out


def test_who_waits_for_the_compiler_is_told_of_it_once(capsys, monkeypatch):
    from omnidyn.cli.terminal.progress import shown_progress

    for name in ("SILENT_S", "NEW_S", "BEAT_S"):
        monkeypatch.setattr(f"omnidyn.cli.terminal.progress.{name}", 0.03)
    with shown_progress("walking") as progress, told("a kernel"):
        err = hear(capsys, "walking")
        progress(Report("running"))
        err = hear(capsys, "running", err)
    assert err.count("`omnidyn warm` compiles for all commands, once") == 1
    assert err.index("omnidyn warm") < err.index("walking") < err.index("running")
    with shown_progress("walking"):
        assert "warm" not in hear(capsys, "walking")


# ---- that it is enough -----------------------------------------------------------------------------------

# Types of arguments with which each kernel is called, by name: by the first runs alone, or by commands.
ASKED = """
import json, sys
from omnidyn.compiled.entries import Entries
asked, load = {}, Entries.load_overload
def noted(self, sig, context):
    asked.setdefault(self._stem, []).append(str(sig))
    return load(self, sig, context)
Entries.load_overload = noted
if len(sys.argv) == 1:
    from omnidyn.compiled.kernel import kept
    from omnidyn.control import first_runs as of_control
    from omnidyn.identification import first_runs as of_identification
    for _, make in [*of_identification.first_runs(), *of_control.first_runs()]:
        make()
    assert {cache._stem for cache in kept()} == set(asked), "a kernel that no first run needs"
else:
    from omnidyn.cli import main
    for line in sys.argv[1:]:
        assert main(line.split()) == 0, line
with open("asked.json", "w") as file:
    json.dump(asked, file)
"""


def asked(folder, *commands):
    subprocess.run(
        [sys.executable, "-c", ASKED, *commands],
        cwd=folder,
        check=True,
        stdout=subprocess.DEVNULL,
        env=os.environ | {"PYTHONPATH": SOURCE},
    )
    return json.loads((folder / "asked.json").read_text())


@pytest.mark.long
def test_the_first_runs_need_what_commands_need(tmp_path):
    """The whole of every signature: a kernel for other types would be compiled in the first run of the command."""
    voltage = np.repeat(np.random.default_rng(0).uniform(-8.0, 8.0, (15, 3)), 40, axis=0)
    voltage[:40] = 0.0
    rows = np.column_stack([np.arange(len(voltage)) * 0.01, voltage])
    np.savetxt(tmp_path / "u.csv", rows, delimiter=",", header="t_s,u1_V,u2_V,u3_V", comments="", fmt="%.4f")
    enough = asked(tmp_path)
    needed = asked(
        tmp_path,
        "simulate axebot u.csv -o run.csv",
        "simulate robotino u.csv",
        "check run.csv --robot axebot",
        "compare run.csv --robot axebot",
        "identify run.csv --robot axebot --report fit.html -o fit.toml",
        "track axebot --path eight --controller mpc --duration 1",
    )
    assert len(enough) >= 15
    assert len(needed) >= 5
    for name, signatures in needed.items():
        assert set(signatures) <= set(enough[name]), name


def test_every_kernel_of_the_package_is_kept_once():
    assert first_runs()
    stamps = [cache.stamp for cache in kept()]
    assert len(stamps) == len(set(stamps)) >= 15


def test_nothing_slow_is_imported_for_what_most_logs_do_not_need():
    """scipy.signal takes as long as all the rest together; only repeats in a column of wheel speeds need it."""
    told = "import sys; import omnidyn.identification.first_runs; print('scipy.signal' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", told],
        check=True,
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": SOURCE},
    )
    assert done.stdout.strip() == "False"
