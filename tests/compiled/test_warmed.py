"""What was made is remembered, and believed only while nothing that it depends on has changed."""

import json
import os

import numba
import pytest

from omnidyn.compiled import warmed
from omnidyn.compiled.entries import take_stock
from omnidyn.compiled.kernel import kernel


def thrice(x):
    return 3.0 * x


def half(x):
    return 0.5 * x


NOW = "circumstances of today"


@pytest.fixture
def made(folder):
    """Two kernels, one of them for two types."""
    kernels = [kernel(thrice), kernel(half)]
    assert (kernels[0](2.0), kernels[0](1j), kernels[1](2.0)) == (6.0, 3j, 1.0)
    caches = [each._cache for each in kernels]
    warmed.remember(caches, NOW)
    return caches


def test_what_is_recalled_is_what_was_there(folder, made):
    found = warmed.recalled(NOW)
    assert warmed.place().is_relative_to(folder)
    assert [(each.stamp, each.cache_path) for each in found] == [(each.stamp, each.cache_path) for each in made]
    assert [len(each.files) for each in found] == [2, 1]
    assert take_stock(found) == take_stock(made)


def test_nothing_is_recalled_with_other_sources_compilers_or_cpus(made):
    assert warmed.recalled(NOW)
    assert warmed.recalled("others") == []


DAMAGE = {
    "gone": lambda file: file.unlink(),
    "cut off": lambda file: file.write_bytes(file.read_bytes()[:-1]),
    "one bit": lambda file: file.write_bytes(file.read_bytes()[:-1] + bytes([file.read_bytes()[-1] ^ 1])),
    "a folder": lambda file: (file.unlink(), file.mkdir()),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_nothing_is_recalled_where_an_entry_is_no_longer_what_it_was(folder, made, damage):
    DAMAGE[damage](min(made[0].asked))
    assert warmed.recalled(NOW) == []


FOREIGN = ["", "no JSON", "[]", "1", "{}", '{"kernels": [1]}', '{"kernels": [{"stamp": 1}]}']
OF_OTHER_TYPES = json.dumps({"made_with": NOW, "kernels": [{"stamp": "", "cache_path": "", "files": 3}]})


@pytest.mark.parametrize("content", [*FOREIGN, OF_OTHER_TYPES])
def test_a_foreign_file_in_its_place_is_as_good_as_none(folder, made, content):
    warmed.place().write_text(content)
    assert warmed.recalled(NOW) == []
    warmed.remember(made, NOW)
    assert warmed.recalled(NOW)


def test_nothing_is_noted_where_a_disk_refused_an_entry(folder, monkeypatch):
    def refuse(*paths):
        raise OSError("no space left on device")

    compiled = kernel(thrice)
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", refuse)
        assert compiled(2.0) == 6.0
    warmed.remember([compiled._cache], NOW)
    assert not warmed.place().exists()


def test_a_disk_that_refuses_the_note_is_no_trouble(folder, made, monkeypatch):
    warmed.place().unlink()
    warmed.place().mkdir()
    warmed.remember(made, NOW)
    assert warmed.recalled(NOW) == []


def test_circumstances_are_sources_settings_and_presets(tmp_path, monkeypatch):
    package = tmp_path / "package"
    (package / "inner").mkdir(parents=True)
    source, preset = package / "a.py", package / "inner" / "b.toml"
    source.write_text("x = 1")
    preset.write_text("x = 1")
    (package / "a.pyc").write_text("1")
    monkeypatch.setattr(warmed, "PACKAGE", str(package))
    seen = [warmed.circumstances()]
    for file in (source, preset):
        file.write_text("x = 2")
        seen.append(warmed.circumstances())
    source.rename(package / "c.py")
    seen.append(warmed.circumstances())
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 1)
    seen.append(warmed.circumstances())
    monkeypatch.setattr(warmed, "tools", lambda: "numba 99")
    seen.append(warmed.circumstances())
    assert len(set(seen)) == len(seen)
    (package / "a.pyc").write_text("2")
    assert warmed.circumstances() == seen[-1]


def test_without_circumstances_nothing_is_noted(folder, made):
    warmed.place().unlink()
    warmed.remember(made, "")
    assert not warmed.place().exists()


def test_it_is_json_that_names_each_entry(made):
    content = json.loads(warmed.place().read_text())
    assert content["made_with"] == NOW
    assert sorted(file for each in content["kernels"] for file in each["files"]) == sorted(
        str(file) for each in made for file in each.asked
    )
