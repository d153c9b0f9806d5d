"""Documents: columns that are aligned, words that are wrapped, points, and what is looked up by name."""

import math

import pytest

from omnidyn.document import (
    WIDTH,
    Document,
    Points,
    Table,
    Words,
    cell,
    chance_cell,
    interval_cell,
    short,
)

LONG = "the wheels work against each other " * 8


def text(*parts, **how):
    return Document(parts).to_text(**how)


def test_columns_are_as_wide_as_their_widest_cell_the_first_to_the_left():
    table = Table(("shape", "N"), [("disc", "1.25"), ("a long name", "10")])
    assert text(table).split("\n") == ["shape           N", "disc         1.25", "a long name    10"]


def test_each_column_has_its_side_and_the_last_letter_is_that_of_the_rest():
    table = Table(("a", "b", "c"), [("one", "two", "three")], align="><")
    assert text(table).split("\n") == ["  a  b    c", "one  two  three"]


def test_a_column_keeps_its_least_width_and_may_be_wider():
    table = Table(("a", "b"), [("x", "123456")], least=(4, 4))
    assert text(table).split("\n") == ["a          b", "x     123456"]


def test_lines_of_a_table_end_in_no_spaces_and_are_never_wrapped():
    table = Table(("name", "mark"), [("w1", ""), ("w2", "x" * 300)], align="<")
    first, second, third = text(table, width=20).split("\n")
    assert (first, second) == ("name  mark", "w1")
    assert len(third) == 306


def test_without_a_head_there_are_rows_only_and_rows_may_be_short():
    assert text(Table((), [("a", "1"), ("b",)], least=(3,))) == "a    1\nb"


@pytest.mark.parametrize(("head", "lines"), [(("a", "b"), "a  b"), ((), "")])
def test_a_table_without_rows_is_its_head(head, lines):
    assert text(Table(head, [])) == lines


def test_braces_and_percent_signs_in_cells_are_text():
    assert text(Table(("{0}", "%s"), [("{x!r}", "100 %")])) == "{0}       %s\n{x!r}  100 %"


def test_characters_are_counted_whatever_they_look_like():
    lines = text(Table(("Größe", "N"), [("車輪", "1"), ("e", "22")])).split("\n")
    assert len({len(line) for line in lines}) == 1


def test_words_are_wrapped_behind_what_stands_before_them():
    lines = text(Words(LONG, "  warn  ", "        "), width=40).split("\n")
    assert max(map(len, lines)) <= 40
    assert lines[0].startswith("  warn  the wheels")
    assert all(line.startswith(" " * 8 + "") and line[8] != " " for line in lines[1:])
    assert " ".join(" ".join(lines).split()) == f"warn {LONG}".strip()


def test_no_words_are_no_line():
    assert text("before", Words(""), Points(()), "after") == "before\nafter"


def test_a_point_hangs_behind_its_mark():
    lines = text(Points([LONG, "short"], "warning:")).split("\n")
    assert lines[0].startswith("warning: the wheels")
    assert all(line.startswith("  ") for line in lines[1:-1])
    assert max(map(len, lines)) <= WIDTH
    assert lines[-1] == "warning: short"


def test_a_word_longer_than_the_line_is_broken():
    assert max(map(len, text(Points(["x" * 250])).split("\n"))) <= WIDTH


def test_plain_text_is_a_line_as_it_stands():
    assert text("a" * 200, "", "  b") == "a" * 200 + "\n\n  b"


def test_only_the_sign_of_words_is_painted_and_the_painting_takes_no_room():
    words = Words(f"fatal and {LONG}", "  FATAL  ", " " * 9, tone="fatal")
    bare = text(words, width=40)
    painted = text(words, width=40, paint=lambda word, tone: f"<{tone}>{word}</>")
    assert painted == bare.replace("FATAL", "<fatal>FATAL</>")


def test_points_and_tables_are_found_by_their_name():
    points, table = Points(["x"], name="next"), Table(("a",), [], name="levels")
    document = Document([Words("y"), points, "", table])
    assert document["next"] is points
    assert document["levels"] is table
    with pytest.raises(KeyError, match="doubts"):
        document["doubts"]


def test_characters_beyond_ascii_stay_or_are_escaped():
    assert Document(["µ 車"]).to_text() == "µ 車"
    assert Document(["µ 車"], ascii=True).to_text() == "\\xb5 \\u8eca"


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (cell(None, ".3f"), "-"),
        (cell(0.0, "+.3f"), "+0.000"),
        (cell(math.nan, ".1f"), "nan"),
        (chance_cell(None), "-"),
        (chance_cell(0.0), "<0.001"),
        (chance_cell(0.001), "0.001"),
        (chance_cell(0.25), "0.250"),
        (interval_cell((-1.0, 2e-5)), "[-1, 2e-05]"),
        (interval_cell((1.23456, math.inf), ".3g"), "[1.23, inf]"),
    ],
)
def test_numbers_of_tables(found, expected):
    assert found == expected


@pytest.mark.parametrize(
    "value, form, words",
    [
        (0.0123, ".2g", "0.012"),
        (99.4, ".2g", "99"),
        (123.4, ".2g", "120"),
        (-101.0, "+.2g", "-100"),
        (3600.0, ".3g", "3600"),
        (2.5e7, ".2g", "2.5e+07"),
        (math.nan, ".2g", "nan"),
    ],
)
def test_a_number_of_a_sentence_has_no_exponent_that_people_need_not_read(value, form, words):
    assert short(value, form) == words
