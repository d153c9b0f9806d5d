"""Campaigns on other machines: the array of Slurm, the Job of Kubernetes, an executor of joblib."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from omnidyn.campaigns.sweep import sweep
from tests.campaigns.test_sweep import SPEC, merged
from tests.support.campaign_tasks import product

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.skipif(os.name == "nt", reason="a shell of POSIX")


@pytest.fixture
def told(tmp_path):
    """What a script of the shell, under variables of a scheduler, tells omnidyn to do: a stand-in writes it down."""
    stand_in = tmp_path / "omnidyn"
    stand_in.write_text(f'#!/bin/sh\necho "$@" >> {tmp_path}/told\n')
    stand_in.chmod(0o755)

    def call(*command, **variables):
        path = f"{tmp_path}{os.pathsep}{os.environ['PATH']}"
        subprocess.run(command, check=True, env={"PATH": path} | variables)
        return (tmp_path / "told").read_text().splitlines()[-1]

    return call


@pytest.mark.parametrize("tasks", [range(1, 21), range(10), range(5, 51, 5), range(7, 8)])
def test_any_array_of_slurm_runs_every_part_once(told, tasks):
    parts = []
    for task in tasks:
        variables = {
            "SLURM_ARRAY_TASK_ID": str(task),
            "SLURM_ARRAY_TASK_MIN": str(min(tasks)),
            "SLURM_ARRAY_TASK_STEP": str(tasks.step),
            "SLURM_ARRAY_TASK_COUNT": str(len(tasks)),
            "SLURM_CPUS_ON_NODE": "48",
        }
        words = told("sh", str(ROOT / "examples" / "slurm_array.sh"), "spec.toml", "out", **variables)
        head, _, part = words.rpartition(" ")
        assert head == "sweep spec.toml -o out --workers 48 --shard"  # the whole node, by one start
        parts.append(part)
    assert parts == [f"{k}/{len(tasks)}" for k in range(1, len(tasks) + 1)]


def test_a_job_of_kubernetes_runs_every_part_once(told):
    page = (ROOT / "docs" / "how-to" / "kubernetes.md").read_text("utf-8")
    (count,) = re.findall(r"^  completions: (\d+)$", page, re.MULTILINE)
    (line,) = re.findall(r"^ +- (exec omnidyn .*)$", page, re.MULTILINE)
    parts = [told("sh", "-c", line, JOB_COMPLETION_INDEX=str(k)).rpartition(" ")[2] for k in range(int(count))]
    assert parts == [f"{k}/{count}" for k in range(1, int(count) + 1)]


JOBLIB = """
from joblib.externals.loky import get_reusable_executor

from omnidyn.campaigns.sweep import sweep
from tests.campaigns.test_sweep import SPEC
from tests.support.campaign_tasks import product

if __name__ == "__main__":
    sweep(SPEC, {folder!r}, task=product, executor=get_reusable_executor(2))
"""


def test_an_executor_of_joblib_gives_the_same_bytes(tmp_path):
    pytest.importorskip("joblib", reason="needs joblib")
    from concurrent.futures import ThreadPoolExecutor

    script = tmp_path / "script.py"
    script.write_text(JOBLIB.format(folder=str(tmp_path / "joblib")))
    paths = os.pathsep.join([str(ROOT), str(ROOT / "src")])
    subprocess.run([sys.executable, str(script)], check=True, env=os.environ | {"PYTHONPATH": paths})
    with ThreadPoolExecutor(2) as threads:
        assert merged(sweep(None, tmp_path / "joblib", task=product, executor=threads)) == merged(
            sweep(SPEC, tmp_path / "plain", task=product, executor=threads)
        )
