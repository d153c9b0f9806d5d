"""Records of shards: what changed since it was written is named, whatever changed, and its remedy works."""

import json
import random
import re
import shutil
from concurrent.futures import ThreadPoolExecutor

import pytest

from omnidyn.campaigns import folder as folder_module
from omnidyn.campaigns.results import load_campaign
from omnidyn.campaigns.sweep import sweep
from omnidyn.errors import InputError
from omnidyn.files import sha256
from tests.campaigns.test_sweep import SPEC
from tests.support.campaign_tasks import mass, product

SMALL = SPEC | {"samples": 15}
READERS = {
    "merge": lambda folder: load_campaign(folder).folder.merge(),
    "resume": lambda folder: sweep(None, folder, task=product, executor=ThreadPoolExecutor(1)),
    "column": lambda folder: load_campaign(folder).column("product"),
    "document": lambda folder: load_campaign(folder).document(),
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A campaign of three shards that is done, and the hash of its merged file."""
    folder = tmp_path_factory.mktemp("finished") / "c"
    with ThreadPoolExecutor(1) as thread:
        campaign = sweep(SMALL, folder, task=product, executor=thread)
    return folder, sha256(campaign.folder.merge().read_bytes())


@pytest.fixture
def copied(finished, tmp_path):
    """A copy of it without its merged file."""
    shutil.copytree(finished[0], tmp_path / "c")
    (tmp_path / "c" / "merged.parquet").unlink()
    return tmp_path / "c"


def same_record(damaged, whole):
    """Whether a record with a flipped bit says the same: a blank is another one."""
    try:
        return json.loads(damaged) == json.loads(whole)
    except ValueError:
        return False


def followed(error, folder):
    """Do what a remedy says; the hash of what is merged then."""
    assert re.fullmatch(rf"make it( and \d+ more)? again with `repair`: omnidyn sweep resume {folder}", error.remedy)
    with ThreadPoolExecutor(1) as thread:
        campaign = sweep(None, folder, task=product, executor=thread, repair=True)
    return sha256(campaign.folder.merge().read_bytes())


@pytest.mark.parametrize("name", READERS)
def test_a_shard_that_changed_is_named_by_all_who_read_it(copied, finished, name):
    shards = [copied / "shards" / f"{k:05d}.parquet" for k in (0, 2)]
    for shard in shards:
        content = bytearray(shard.read_bytes())
        content[len(content) // 2] ^= 1
        shard.write_bytes(content)
    with pytest.raises(InputError, match=r"has changed since it was written; got SHA-256 .*expected") as caught:
        READERS[name](copied)
    assert caught.value.where == str(shards[0])
    assert not (copied / "merged.parquet").exists()
    assert followed(caught.value, copied) == finished[1]


def test_no_flip_of_a_bit_is_silent(copied, finished):
    """As `bit_flips.py` of the cases: 147 of 200 changed the merged numbers without an error."""
    draw = random.Random(0)
    for ending, count in ((".parquet", 500), (".json", 500)):
        path = copied / "shards" / f"00001{ending}"
        whole = path.read_bytes()
        for _ in range(count):
            damaged = bytearray(whole)
            damaged[draw.randrange(len(damaged))] ^= 1 << draw.randrange(8)
            path.write_bytes(damaged)
            if ending == ".json" and same_record(damaged, whole):
                continue
            with pytest.raises(InputError, match="00001"):
                load_campaign(copied).folder.merge()
        path.write_bytes(whole)
    assert sha256(load_campaign(copied).folder.merge().read_bytes()) == finished[1]


def test_a_shard_that_belongs_elsewhere_is_named(copied, finished, tmp_path):
    shards = copied / "shards"
    for ending, words in (
        (".parquet", "has changed since it was written"),
        (".json", "holds other samples; got 5 to 9"),
    ):
        shutil.copy(shards / f"00001{ending}", shards / f"00002{ending}")
        with pytest.raises(InputError, match=words) as caught:
            load_campaign(copied).folder.merge()
    assert followed(caught.value, copied) == finished[1]
    with ThreadPoolExecutor(1) as thread:
        sweep(SMALL | {"seed": 7}, tmp_path / "other", task=product, executor=thread)
    for ending in (".parquet", ".json"):
        shutil.copy(tmp_path / "other" / "shards" / f"00001{ending}", shards)
    with pytest.raises(InputError, match=r"00001.*this shard belongs to another manifest") as caught:
        load_campaign(copied).folder.merge()
    assert followed(caught.value, copied) == finished[1]


def test_no_swap_of_shards_is_silent(copied, finished, tmp_path):
    """A shard, its record or both in the place of another, of this campaign or of one with another seed."""
    with ThreadPoolExecutor(1) as thread:
        sweep(SMALL | {"seed": 7}, tmp_path / "other", task=product, executor=thread)
    whole = {path.name: path.read_bytes() for path in (copied / "shards").iterdir()}
    strange = {path.name: path.read_bytes() for path in (tmp_path / "other" / "shards").iterdir()}
    draw = random.Random(1)
    for _ in range(100):
        source, (taken, given) = draw.choice((whole, strange)), draw.sample(range(3), 2)
        endings = draw.choice(((".parquet",), (".json",), (".parquet", ".json")))
        for ending in endings:
            (copied / "shards" / f"{taken:05d}{ending}").write_bytes(source[f"{given:05d}{ending}"])
        with pytest.raises(InputError, match=f"{taken:05d}"):
            load_campaign(copied).folder.merge()
        for name, content in whole.items():
            (copied / "shards" / name).write_bytes(content)
    assert sha256(load_campaign(copied).folder.merge().read_bytes()) == finished[1]


def test_an_empty_shard_and_an_empty_record_are_named(copied, finished):
    for ending in (".json", ".parquet"):
        (copied / "shards" / f"00001{ending}").write_bytes(b"")
        with pytest.raises(InputError, match="00001") as caught:
            load_campaign(copied).folder.merge()
    assert followed(caught.value, copied) == finished[1]


def test_a_kill_between_a_shard_and_its_record_leaves_it_not_done(copied, finished, monkeypatch):
    """Whatever stands there then: the shard alone, new or not; or an old record alone."""
    shards = copied / "shards"
    (shards / "00000.json").unlink()
    (shards / "00001.parquet").unlink()
    (shards / "00002.parquet").unlink()
    written, write = [], folder_module.write_atomic

    def killed(path, *rest, **options):
        if path.name == "00002.json":
            raise KeyboardInterrupt
        written.append(path.name)
        return write(path, *rest, **options)

    monkeypatch.setattr(folder_module, "write_atomic", killed)
    with pytest.raises(KeyboardInterrupt), ThreadPoolExecutor(1) as thread:
        sweep(None, copied, task=product, executor=thread)
    monkeypatch.undo()
    assert written == ["00000.parquet", "00000.json", "00001.parquet", "00001.json", "00002.parquet"]
    assert not (shards / "00002.json").exists()
    assert load_campaign(copied).status.done == (0, 1)
    with ThreadPoolExecutor(1) as thread:
        campaign = sweep(None, copied, task=product, executor=thread)
    assert sha256(campaign.folder.merge().read_bytes()) == finished[1]


def test_an_input_that_changed_is_named_whoever_comes_to_it(tmp_path):
    """A robot of another mass, a shard deleted, resumed: it was two robots in one table, with exit 0."""
    folder = tmp_path / "c"
    robot, before = folder / "inputs" / "axebot.toml", {}
    with ThreadPoolExecutor(1) as thread:
        sweep(SMALL, folder, task=mass, executor=thread)
        before[robot] = robot.read_text()
        assert "mass_kg = 1.5" in before[robot]
        robot.write_text(before[robot].replace("mass_kg = 1.5", "mass_kg = 9.9"))
        (folder / "shards" / "00001.parquet").unlink()
        for call in (
            lambda: sweep(None, folder, task=mass, executor=thread),
            lambda: sweep(SMALL, folder, task=mass, executor=thread),
            lambda: load_campaign(folder).document(),
            lambda: load_campaign(folder).folder.merge(),
        ):
            with pytest.raises(InputError, match="an input has changed since the campaign began") as caught:
                call()
            assert caught.value.where == str(robot)
        # its hash changed too, in the manifest: the shards that are there know
        manifest = folder / "manifest.json"
        content = json.loads(manifest.read_text())
        content["inputs"]["inputs/axebot.toml"] = sha256(robot.read_bytes())
        text, other = manifest.read_text(), json.dumps(content)
        manifest.write_text(other)
        with pytest.raises(InputError, match=r"belongs to another manifest"):
            sweep(None, folder, task=mass, executor=thread)
        manifest.write_text(text)
        robot.write_text(before[robot])
        campaign = sweep(None, folder, task=mass, executor=thread)
    assert set(campaign.column("mass")) == {1.5}


def test_an_input_that_changes_while_a_shard_is_made_is_no_shard(tmp_path, monkeypatch):
    from omnidyn.campaigns import sweep as module

    columns = module._columns

    def changing(*arguments):
        robot = tmp_path / "c" / "inputs" / "axebot.toml"
        robot.write_text(robot.read_text().replace("mass_kg = 1.5", "mass_kg = 9.9"))
        return columns(*arguments)

    monkeypatch.setattr(module, "_columns", changing)
    with ThreadPoolExecutor(1) as thread, pytest.raises(InputError, match="an input has changed"):
        sweep(SMALL, tmp_path / "c", task=mass, executor=thread)
    assert not [*(tmp_path / "c" / "shards").iterdir()]
