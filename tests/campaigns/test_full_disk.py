"""A campaign into a disk that is really full: said, nothing half-written, and gone on with when there is room."""

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from omnidyn.campaigns.sweep import sweep
from omnidyn.files import sha256
from tests.campaigns.test_sweep import SPEC
from tests.support.campaign_tasks import product

ROOT = Path(__file__).parents[2]
MOUNT = 'mount -t tmpfs -o size=100k campaign "$0" && exec "$@"'

SCRIPT = """
import subprocess, sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from pyarrow.parquet import read_table
from omnidyn.campaigns.folder import Folder
from omnidyn.campaigns.sweep import sweep
from omnidyn.errors import InputError
from omnidyn.files import sha256
from tests.campaigns.test_sweep import SPEC
from tests.support.campaign_tasks import product

disk = Path(sys.argv[1])
home = disk / "out"


def refused(call):
    try:
        call()
    except InputError as error:
        print(error)
    else:
        raise AssertionError("it was not full")
    assert not [path for path in disk.rglob("*") if path.name.startswith(".tmp")], "half-written"


with ThreadPoolExecutor(1) as thread:
    refused(lambda: sweep(SPEC, home, task=product, executor=thread))
    status = Folder(home).status()
    assert 0 < len(status.done) < status.shards and not status.failed
    for shard in status.done:  # what is there is whole
        assert len(read_table(Folder(home).shard_path(shard))) == 5
    subprocess.run(["mount", "-o", "remount,size=1m", disk], check=True)
    campaign = sweep(None, home, task=product, executor=thread)
    assert campaign.status.complete
    filler = disk / "filler"
    try:
        filler.write_bytes(bytes(2**20))
    except OSError:
        pass  # all that was left
    refused(campaign.folder.merge)
    assert not (home / "merged.parquet").exists()
    filler.unlink()
    print(sha256(campaign.folder.merge().read_bytes()))
"""


def mounted(folder, *command):
    """What a command says in a name space of its own, where a small disk stands at `folder`."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    call = ["unshare", "-rm", "sh", "-c", MOUNT, str(folder), *command]
    return subprocess.run(call, capture_output=True, text=True, cwd=ROOT, env=environment)


@pytest.mark.skipif(not shutil.which("unshare"), reason="no unshare, which makes name spaces")
def test_a_disk_that_is_full_is_said_and_gone_on_with(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    tried = mounted(disk, "true")
    if tried.returncode:
        pytest.skip(f"this machine mounts no disk for us: {tried.stderr.strip()}")
    run = mounted(disk, sys.executable, "-c", SCRIPT, str(disk))
    assert run.returncode == 0, run.stderr
    first, second, found = run.stdout.splitlines()
    assert "No space left on device; make room there, then go on: omnidyn sweep resume" in first
    assert "No space left on device" in second
    with ThreadPoolExecutor(1) as thread:
        whole = sweep(SPEC, tmp_path / "undisturbed", task=product, executor=thread)
    assert found == sha256(whole.folder.merge().read_bytes())
