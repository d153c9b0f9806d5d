"""Campaigns: the same bytes however they are cut, killed and resumed; nothing lost, nothing computed twice."""

import errno
import logging
import os
import random
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import pytest

from omnidyn import files
from omnidyn.campaigns.executors import Given, _quiet
from omnidyn.campaigns.sweep import sweep
from omnidyn.errors import InputError, InsufficientDataError, OmnidynError
from omnidyn.files import sha256
from tests.support import campaign_tasks
from tests.support.campaign_tasks import MARKS, mass, product, raising
from tests.support.growth import LINEAR, growth

ROOT = Path(__file__).parents[2]
AB = {"task.a": {"range": [0.0, 1.0]}, "task.b": {"range": [1.0, 2.0]}}
SPEC = {"schema": 1, "robot": "axebot", "samples": 200, "sampling": "random", "shard_rows": 5, "vary": AB}


def merged(campaign):
    return sha256(campaign.folder.merge().read_bytes())


@pytest.fixture
def threads():
    """Two threads in place of processes, which take seconds to start."""
    with ThreadPoolExecutor(2) as pool:
        yield pool


@pytest.fixture
def undisturbed(tmp_path, threads):
    """The hash of an undisturbed campaign."""
    return merged(sweep(SPEC, tmp_path / "undisturbed", task=product, executor=threads))


def test_any_cut_gives_the_same_bytes(tmp_path, threads, undisturbed):
    whole = SPEC | {"shard_rows": 64}
    assert merged(sweep(whole, tmp_path / "a", task=product, executor=threads)) == undisturbed
    for k in (4, 2, 1, 3):
        campaign = sweep(SPEC, tmp_path / "b", task=product, executor=threads, shard=(k, 4))
        if k != 3:
            with pytest.raises(InsufficientDataError, match="shards are missing"):
                campaign.folder.merge()
    assert merged(campaign) == undisturbed


SCRIPT = """
from omnidyn.campaigns.sweep import sweep
from tests.campaigns.test_sweep import SPEC
from tests.support.campaign_tasks import product
if __name__ == "__main__":
    sweep(SPEC, {folder!r}, task=product, workers={workers})
"""


def killed_and_resumed(folder, kills, workers, seed):
    """Run a campaign in a process, kill it so many times as it works: samples begun in all."""
    marks, draws = folder.parent / "marks", random.Random(seed)
    marks.mkdir()
    script = folder.parent / "script.py"
    script.write_text(SCRIPT.format(folder=str(folder), workers=workers))
    environment = os.environ | {MARKS: str(marks), "PYTHONPATH": str(ROOT)}
    for kill in range(kills + 1):
        before = len(list(marks.iterdir()))
        process = subprocess.Popen([sys.executable, str(script)], env=environment, cwd=ROOT)
        if kill == kills:
            assert process.wait() == 0
            break
        goal = before + draws.randrange(1, 900 // (kills + 1))  # it is killed anywhere in a shard
        while len(list(marks.iterdir())) < goal and process.poll() is None:
            time.sleep(0.0005)
        process.send_signal(signal.SIGKILL)
        process.wait()
    return [int(mark.name.partition("-")[0]) for mark in marks.iterdir()]


@pytest.mark.skipif(os.name == "nt", reason="no SIGKILL")
@pytest.mark.parametrize("kills, workers", [(2, 1), pytest.param(20, 2, marks=pytest.mark.long)])
def test_kills_lose_nothing_and_repeat_only_what_was_in_flight(tmp_path, undisturbed, kills, workers):
    folder = tmp_path / "killed"
    begun = killed_and_resumed(folder, kills, workers, seed=1)
    assert merged(sweep(SPEC, folder, task=product)) == undisturbed
    assert set(begun) == set(range(200))
    assert len(begun) - 200 <= kills * workers * SPEC["shard_rows"]


def test_what_is_there_is_not_run_again(tmp_path, threads, monkeypatch):
    sweep(SPEC, tmp_path / "c", task=product, executor=threads)
    (tmp_path / "marks").mkdir()
    monkeypatch.setenv(MARKS, str(tmp_path / "marks"))
    (tmp_path / "c" / "shards" / "00007.parquet").unlink()
    campaign = sweep(None, tmp_path / "c", task=product, executor=threads)
    assert campaign.status.complete
    assert sorted(int(mark.name.partition("-")[0]) for mark in (tmp_path / "marks").iterdir()) == [35, 36, 37, 38, 39]


def test_a_task_that_raises_or_ends_its_process_is_marked_and_the_others_go_on(tmp_path):
    spec = SPEC | {"samples": 20, "vary": {"task.a": {"range": [0.0, 1.0]}}}
    campaign = sweep(spec, tmp_path / "d", task=raising, workers=1)
    assert campaign.status.done == (0, 3)
    assert "ValueError: no such wheel" in campaign.status.failed[1]
    assert "in sample 5: task.a = " in campaign.status.failed[1]
    assert "the process that worked on this shard ended" in campaign.status.failed[2]
    assert campaign.verdict.code == "campaign_failed"


class Ended(ThreadPoolExecutor):
    """An executor whose machines are gone after the first call, as those of a Dask scheduler that ended."""

    calls = 0

    def submit(self, *arguments):
        self.calls += 1
        if self.calls > 1:
            future = Future()
            future.cancel()
            future.set_running_or_notify_cancel()
            return future
        return super().submit(*arguments)


def test_a_dead_scheduler_is_one_sentence_and_what_is_done_stays(tmp_path, threads):
    with Ended(1) as pool, pytest.raises(OmnidynError, match="the executor has ended; got CancelledError; start it"):
        sweep(SPEC, tmp_path / "x", task=product, executor=pool)
    assert sweep(None, tmp_path / "x", task=product, executor=threads).status.complete


class Later(Executor):
    """An executor that ends its calls one by one, while others wait for the last one that was asked for."""

    def __init__(self):
        self.futures = []

    def submit(self, function, *arguments):
        self.futures.append(Future())
        return self.futures[-1]


def test_what_a_shard_that_ends_costs_does_not_grow_with_those_that_are_left():
    def run(count, _):
        later = Later()
        ends = Given(later).run(print, ((k, ()) for k in range(count)))
        for k in range(count):
            if not k:  # `run` begins with its first answer: all calls are there then
                threading.Timer(0.01, lambda: later.futures[0].set_result(None)).start()
            else:
                later.futures[k].set_result(None)
            assert next(ends) == (k, "")

    assert growth(run, 4000) < LINEAR


def test_the_library_of_a_cluster_is_quiet_within_it(caplog):
    log = logging.getLogger("distributed.client")
    log.setLevel(logging.WARNING)
    with _quiet("distributed"):
        log.error("a traceback of forty lines")
    assert not caplog.records
    log.error("heard again")
    assert len(caplog.records) == 1


def test_a_full_disk_is_said_and_resumed_from(tmp_path, threads, monkeypatch, undisturbed):
    fsync, calls = os.fsync, []

    def full(handle):
        calls.append(handle)
        if len(calls) > 20:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        fsync(handle)

    monkeypatch.setattr(files.os, "fsync", full)
    with pytest.raises(InputError, match="No space left on device"):
        sweep(SPEC, tmp_path / "e", task=product, executor=threads)
    monkeypatch.undo()
    assert not list((tmp_path / "e").rglob("*tmp*"))
    campaign = sweep(None, tmp_path / "e", task=product, executor=threads)
    assert merged(campaign) == undisturbed


def test_a_second_run_is_refused_and_another_share_is_not(tmp_path, threads):
    campaign = sweep(SPEC, tmp_path / "f", task=product, executor=threads, shard=(1, 2))
    words = "import sys; from pathlib import Path; from omnidyn.campaigns.folder import Folder\n"
    words += "with Folder(Path(sys.argv[1])).locked(0, 20): print('locked', flush=True); sys.stdin.read()"
    command = [sys.executable, "-c", words, str(tmp_path / "f")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=ROOT) as other:
        assert other.stdout.readline() == b"locked\n"
        with pytest.raises(InputError, match="another run works in this folder"):
            sweep(SPEC, tmp_path / "f", task=product, executor=threads)
        sweep(SPEC, tmp_path / "f", task=product, executor=threads, shard=(2, 2))
        other.kill()
        other.wait()
    with campaign.folder.locked(0, 5):  # and within one process
        with pytest.raises(InputError, match="another run works in this folder"), campaign.folder.locked(4, 6):
            pass
        with campaign.folder.locked(5, 6):
            pass


def test_another_campaign_in_the_folder_is_refused_with_what_differs(tmp_path, threads, write):
    sweep(SPEC, tmp_path / "g", task=product, executor=threads)
    other = SPEC | {"samples": 100, "vary": AB | {"task.a": {"range": [0.0, 1.5]}}}
    with pytest.raises(
        InputError, match=r"samples: 200 -> 100.*vary\.task\.a\.range: \[0\.0, 1\.0\] -> \[0\.0, 1\.5\]"
    ):
        sweep(other, tmp_path / "g", task=product, executor=threads)
    with pytest.raises(InputError, match=r"task: .*product.* -> .*mass"):
        sweep(SPEC, tmp_path / "g", task=mass, executor=threads)
    (tmp_path / "h").mkdir()
    (tmp_path / "h" / "thesis.tex").touch()
    with pytest.raises(InputError, match="the folder holds other files"):
        sweep(SPEC, tmp_path / "h", task=product, executor=threads)


def test_a_function_that_other_processes_cannot_find_is_refused(tmp_path):
    with pytest.raises(InputError, match="other processes cannot find this task"):
        sweep(SPEC, tmp_path / "i", task=lambda sample: {"a": 1.0})
    assert campaign_tasks.product is product


TRACK = {
    "schema": 1,
    "robot": "axebot",
    "samples": 24,
    "shard_rows": 4,
    "vary": {"wheels.wheel_radius_m": {"factor": [0.98, 1.02]}, "friction": {"factor": [0.5, 1.5]}},
    "track": {"path": "circle", "controller": "pid", "duration_s": 0.5, "noise_m_s": 0.005},
}


@pytest.mark.parametrize("sampling", ["sobol", "random"])
def test_more_samples_go_on_and_give_the_bytes_of_a_fresh_run(tmp_path, threads, monkeypatch, sampling):
    marks = tmp_path / "marks"
    marks.mkdir()
    monkeypatch.setenv(MARKS, str(marks))
    few, many = (SPEC | {"samples": n, "sampling": sampling} for n in (48, 96))
    grown = sweep(few, tmp_path / "grown", task=product, executor=threads)
    grown.folder.merge()
    for _ in range(2):  # the second finds all of it
        grown = sweep(many, tmp_path / "grown", task=product, executor=threads)
    begun = [int(mark.name.partition("-")[0]) for mark in marks.iterdir()]
    assert sorted(begun) == sorted([*range(96), 45, 46, 47])  # the shard that was not full, again
    fresh = sweep(many | {"shard_rows": 7}, tmp_path / "fresh", task=product, executor=threads)
    assert merged(grown) == merged(fresh)
    assert grown.status.samples == 96
    with pytest.raises(InputError, match="samples: 96 -> 48"):
        sweep(few, tmp_path / "grown", task=product, executor=threads)


def test_loops_that_move_together_grow_to_the_same_bytes(tmp_path, threads):
    for samples in (24, 40):
        grown = sweep(TRACK | {"samples": samples}, tmp_path / "grown", executor=threads)
    assert merged(grown) == merged(sweep(TRACK | {"samples": 40}, tmp_path / "fresh", executor=threads))


def test_a_latin_hypercube_and_a_folder_in_work_do_not_grow(tmp_path, threads):
    latin = SPEC | {"samples": 48, "sampling": "latin"}
    sweep(latin, tmp_path / "latin", task=product, executor=threads)
    with pytest.raises(InputError, match="samples: 48 -> 96"):
        sweep(latin | {"samples": 96}, tmp_path / "latin", task=product, executor=threads)
    campaign = sweep(SPEC, tmp_path / "busy", task=product, executor=threads)
    with campaign.folder.locked(0, 1), pytest.raises(InputError, match="another run works"):
        sweep(SPEC | {"samples": 300}, tmp_path / "busy", task=product, executor=threads)


def test_the_time_left_leaves_out_what_each_worker_does_once(tmp_path, threads, monkeypatch):
    clock = iter(2.0 * k for k in range(100))  # read from the time on when both have ended their first shard
    monkeypatch.setattr("omnidyn.campaigns.sweep.time", SimpleNamespace(monotonic=lambda: next(clock)))
    heard = []
    sweep(SPEC | {"samples": 30}, tmp_path / "t", task=product, executor=threads, progress=heard.append)
    words = [report.phase for report in heard if report.phase.startswith("shard ")]
    assert words[:3] == ["shard 1 of 6", "shard 2 of 6", "shard 3 of 6, about 6 s left"]


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")  # of dask, which are its own
def test_processes_parts_and_dask_give_the_same_bytes_and_a_lost_worker_nothing(tmp_path, threads, undisturbed):
    """Loops that move together, and loops one by one: on one process, two, in four parts, on a cluster."""
    distributed = pytest.importorskip("distributed", reason="needs the extra `cluster`")
    specs = {"together": TRACK, "alone": TRACK | {"track": TRACK["track"] | {"delay": 1}}}
    loops = {
        name: [merged(sweep(spec, tmp_path / f"{name}{k}", workers=k)) for k in (1, 2)] for name, spec in specs.items()
    }
    for name, spec in specs.items():
        parts = [sweep(spec, tmp_path / f"{name}3", executor=threads, shard=(k, 4)) for k in (3, 1, 4, 2)]
        loops[name].append(merged(parts[-1]))
    cluster = {"n_workers": 2, "threads_per_worker": 1, "host": "127.0.0.1", "dashboard_address": None}
    (tmp_path / "marks").mkdir()
    environment = {MARKS: str(tmp_path / "marks")}
    with distributed.LocalCluster(**cluster, env=environment) as local, distributed.Client(local) as client:
        for name, spec in specs.items():
            loops[name].append(merged(sweep(spec, tmp_path / f"{name}4", scheduler=local.scheduler_address)))
        pids = list(client.run(os.getpid).values())
        run = threads.submit(
            sweep, SPEC | {"samples": 2000}, tmp_path / "q", task=product, scheduler=local.scheduler_address
        )
        while len(list((tmp_path / "marks").iterdir())) < 300:
            time.sleep(0.001)
        os.kill(pids[0], signal.SIGKILL)  # its nanny starts another one
        campaign = run.result()
        assert set(client.run(os.getpid).values()) != set(pids)
    assert all(len(hashes) == 4 and len(set(hashes)) == 1 for hashes in loops.values())
    assert loops["together"] != loops["alone"]
    assert campaign.status.complete
    begun = [int(mark.name.partition("-")[0]) for mark in (tmp_path / "marks").iterdir()]
    assert set(begun) == set(range(2000))
    assert len(begun) - 2000 <= SPEC["shard_rows"]  # the shard in flight, and none that was there
    whole = sweep(SPEC | {"samples": 2000}, tmp_path / "r", task=product, executor=threads)
    assert merged(whole) == merged(campaign)
