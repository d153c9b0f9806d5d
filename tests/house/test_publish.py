"""Tables of benchmarks go into benchmarks/results; docs/tested.md has a line for each of them."""

import re
from importlib.util import find_spec

from benchmarks.__main__ import NAMES, module_of
from benchmarks.publish import IMAGES, RESULTS, publish
from benchmarks.table import Table

PAGE = (IMAGES.parent / "tested.md").read_text("utf-8")


def table_of(value):
    table = Table("some: words", ["what", "value"])
    table.add("<= 2", value <= 2, what="a number", value=value)
    return table


def test_a_table_replaces_the_last_one(tmp_path):
    publish("some", table_of(3.0), tmp_path)
    once = (tmp_path / "some.md").read_text()
    assert once.startswith("# some: words\n\n| what")
    assert "| a number |     3 | <= 2 | MISS |" in once
    publish("some", table_of(1.0), tmp_path)
    again = (tmp_path / "some.md").read_text()
    assert "| a number |     1 | <= 2 | pass |" in again
    assert "MISS" not in again
    assert len(again.splitlines()) == len(once.splitlines())


def test_pictures_go_into_the_folder_of_images(tmp_path):
    table = table_of(1.0)
    table.pictures["some.png"] = lambda: b"drawn"
    publish("some", table, tmp_path, tmp_path / "images")
    assert (tmp_path / "images" / "some.png").read_bytes() == b"drawn"


def test_the_page_for_users_has_every_result_and_no_other():
    shown = set(re.findall(r"benchmarks/results/(\w+)\.md", PAGE))
    assert shown == {file.stem for file in RESULTS.glob("*.md")}
    assert shown <= set(NAMES)


def test_every_benchmark_is_a_module_that_measures():
    assert [name for name in NAMES if find_spec(module_of(name)) is None] == []
    assert {module_of(name) for name in ("house", "blind", "tune")} == {
        "benchmarks.house",
        "benchmarks.blind",
        "benchmarks.control.tune",
    }
