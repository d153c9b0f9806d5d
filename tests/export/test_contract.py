"""What every kind of export keeps to: names, files written whole or not at all, the table of what is refused."""

import os
import re

import pytest

import omnidyn
from omnidyn.errors import InputError
from omnidyn.export.contract import Export
from omnidyn.export.features import FEATURES, LEAVES_OUT, PARTLY, REFUSES, SAYS, TABLE
from omnidyn.export.kinds import KINDS, maker, python_name
from omnidyn.export.spelling import c_comment, c_number, identifier, java_comment, number, xml_comment

TWO = Export("c-model", "bot", {"a.h": "one\n", "b.c": "two\n"}, folder=True)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_there_by_its_name(kind):
    made = getattr(omnidyn.export, python_name(kind))(omnidyn.load_robot("axebot"))
    assert made.kind == kind
    assert made.files
    assert (len(made.files) == 1) or made.folder


def test_another_kind_is_refused():
    with pytest.raises(InputError, match=r"no such kind of export; got jsno; .*did you mean json"):
        maker("jsno")
    with pytest.raises(AttributeError, match="has no attribute"):
        omnidyn.export.nothing  # noqa: B018


def test_the_table_names_kinds_and_features_that_there_are():
    assert set(TABLE) == set(KINDS)
    for row in TABLE.values():
        assert set(row) <= set(FEATURES)
        for cell in row.values():
            assert cell.does in (SAYS, PARTLY, LEAVES_OUT, REFUSES)
            assert bool(cell.words) == (cell.does != SAYS)


def test_a_folder_is_there_with_all_files_or_not_at_all(tmp_path, monkeypatch):
    from omnidyn.export import contract

    def full(path, content, force=False):
        if path.name == "b.c":
            raise InputError("cannot write it", got="No space left on device", where=str(path))
        path.write_text(content)
        return path

    monkeypatch.setattr(contract, "write_atomic", full)
    with pytest.raises(InputError, match="No space left"):
        TWO.write(tmp_path / "new")
    assert not list(tmp_path.iterdir())


def test_a_folder_that_exists_keeps_its_files_without_force(tmp_path):
    assert [path.name for path in TWO.write(tmp_path / "out")] == ["a.h", "b.c"]
    (tmp_path / "out" / "b.c").write_text("mine")
    (tmp_path / "out" / "a.h").unlink()
    with pytest.raises(InputError, match=r"the file exists already; use `force`"):
        TWO.write(tmp_path / "out")
    assert os.listdir(tmp_path / "out") == ["b.c"]
    TWO.write(tmp_path / "out", force=True)
    assert (tmp_path / "out" / "b.c").read_text() == "two\n"
    with pytest.raises(InputError, match=r"several files; got a file; expected a folder"):
        TWO.write(tmp_path / "out" / "a.h", force=True)
    with pytest.raises(InputError, match="the folder does not exist"):
        TWO.write(tmp_path / "no" / "where")


def test_several_files_are_no_single_text():
    with pytest.raises(InputError, match=r"not a single text.*use write\(path\)"):
        TWO.text  # noqa: B018


@pytest.mark.parametrize("value", [0.1, 1e-300, 1.7976931348623157e308, -2.5, 3.0, 1 / 3])
def test_numbers_keep_every_bit(value):
    assert float(number(value)) == value
    assert float(c_number(value)) == value


@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
def test_numbers_that_are_none_are_refused(value):
    with pytest.raises(InputError, match="not a finite number"):
        number(value)


def test_what_single_precision_cannot_hold_is_refused():
    assert c_number(0.1, True) == "0.1f"
    assert c_number(1 / 3, True) == "0.333333333f"
    assert c_number(3.0, True) == "3.0f"
    assert c_number(0.0, True) == "0.0f"
    for value in (1e39, 1e-39):
        with pytest.raises(InputError, match="does not fit single precision"):
            c_number(value, True)


@pytest.mark.parametrize(
    "name", ["*/ int x; /*", "--> <x>", "a\\", "1st", "", "double", "Größe", "a" * 999, "??/", "--"]
)
def test_names_become_identifiers_and_comments_stay_comments(name):
    assert re.fullmatch(r"[a-z][a-z0-9_]*", identifier(name))
    assert len(identifier(name)) <= 70
    inner = xml_comment([name])[4:-3]
    assert "--" not in inner
    assert not inner.endswith("-")
    assert "*/" not in c_comment([name])[:-2]
    assert not java_comment([name]).replace("\\\\", "").count("\\")
