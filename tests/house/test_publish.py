"""Tables of benchmarks go between their marks in the documentation, and nothing else of a page changes."""

import pytest

from benchmarks.publish import DOCS, begin, end, page_of, publish
from benchmarks.table import Table


def table_of(value):
    table = Table("some: words", ["what", "value"])
    table.add("<= 2", value <= 2, what="a number", value=value)
    return table


@pytest.fixture
def docs(tmp_path):
    (tmp_path / "identify-figures.md").write_text(f"# Page\n\nabove\n\n{begin('some')}old{end('some')}\n\nbelow\n")
    return tmp_path


def test_a_table_replaces_the_last_one(docs):
    page = docs / "identify-figures.md"
    publish("some", table_of(3.0), docs)
    once = page.read_text()
    assert once.startswith("# Page\n\nabove\n\n<!-- begin: benchmarks.some -->\n\n| what")
    assert once.endswith("<!-- end: benchmarks.some -->\n\nbelow\n")
    assert "old" not in once
    assert "| a number |     3 | <= 2 | MISS |" in once
    publish("some", table_of(1.0), docs)
    again = page.read_text()
    assert "| a number |     1 | <= 2 | pass |" in again
    assert "MISS" not in again
    assert len(again.splitlines()) == len(once.splitlines())


def test_pictures_go_into_the_folder_of_images(docs):
    table = table_of(1.0)
    table.pictures["some.png"] = lambda: b"drawn"
    publish("some", table, docs)
    assert (docs / "images" / "some.png").read_bytes() == b"drawn"


def test_one_of_the_family_makes_its_own_section(docs):
    page = docs / "identify-figures.md"
    before = page.read_text()
    publish("identify_loop", table_of(1.0), docs)
    text = page.read_text()
    assert text.startswith(before.rstrip() + "\n\n## some: words\n\n<!-- begin: benchmarks.identify_loop -->\n")
    publish("identify_loop", table_of(3.0), docs)
    assert page.read_text().count("benchmarks.identify_loop") == 2
    assert page.read_text().count("## some: words") == 1


def test_a_benchmark_without_a_page_is_refused(docs):
    with pytest.raises(LookupError, match=r"has <!-- begin: benchmarks\.rest -->"):
        publish("rest", table_of(1.0), docs)


def test_the_page_of_identify_is_there():
    assert page_of("identify") == DOCS / "identify-figures.md"
    assert page_of("nothing") is None
