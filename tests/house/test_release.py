"""release.py: what can be judged without building anything. `python3 dev.py release` does all of it."""

import shutil
import tomllib
import zipfile
from pathlib import Path

import pytest

import release

ROOT = Path(__file__).resolve().parents[2]
PLACES = ("pyproject.toml", "src/omnidyn/__init__.py", "CITATION.cff", "recipe/recipe.yaml", "CHANGELOG.md")


def test_the_version_is_the_same_everywhere():
    assert release.disagreements() == []


@pytest.mark.parametrize("place", PLACES[1:])
def test_another_version_is_named(tmp_path, place):
    for each in PLACES:
        (tmp_path / each).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / each, tmp_path / each)
    stated = release.version()
    text = (tmp_path / place).read_text("utf-8")
    (tmp_path / place).write_text(text.replace(stated, "99.9.9"), "utf-8")
    assert release.disagreements(tmp_path) == [f"{place} says 99.9.9, pyproject.toml {stated}"]


def test_a_tree_with_changes_is_refused(monkeypatch):
    monkeypatch.setattr(release, "git", lambda *_: " M README.md")
    with pytest.raises(SystemExit, match=r"the tree has changes; commit or remove them first:\n M README\.md"):
        release.main([], {})


def test_the_sources_hold_what_is_looked_for():
    include = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["hatch"]["build"]["targets"]["sdist"]
    assert [name for name in include["include"] if not (ROOT / name).exists()] == []
    by_itself = {"README.md", "pyproject.toml"}
    for name in release.IN_SOURCES:
        assert (ROOT / name).is_file(), name
        assert name in by_itself or name.partition("/")[0] in include["include"], name


def test_it_sees_what_a_wheel_lacks_and_should_not_hold(tmp_path):
    wheel = tmp_path / "omnidyn-1.0.0-py3-none-any.whl"
    inside = ["omnidyn/py.typed", "omnidyn/x.pyc", "omnidyn-1.0.0.dist-info/licenses/LICENSE"]
    with zipfile.ZipFile(wheel, "w") as file:
        for name in inside:
            file.writestr(name, "")
    names = release.names_in(wheel)
    assert release.lacks(names, ("LICENSE", "omnidyn/py.typed", "omnidyn/more.py")) == [
        "no omnidyn/more.py",
        "has omnidyn/x.pyc",
    ]
