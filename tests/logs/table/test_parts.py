"""The parts that read a table, each by itself: cells, names, rows, decimals, the value and the lines of a file."""

import codecs

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.logs.readers.read_table import iter_tables, read_table
from omnidyn.logs.table import dialect
from omnidyn.logs.table.header import FileLine, check_name, find_layout, split_units
from omnidyn.logs.table.preamble import preamble
from omnidyn.logs.table.rows import RowParser, column_of, skip_note
from omnidyn.logs.table.table import FileTable, join
from omnidyn.logs.table.text_file import TextFile

# ---- cells ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "cell, is_number, looks, decimal_point, comma",
    [
        ("0", True, True, False, False),
        ("-1.5e3", True, True, True, False),
        (".5", True, True, True, False),
        ("5.", True, True, True, False),
        ("1.500", True, True, False, False),  # perhaps 1500
        ("-12.500", True, True, False, False),
        ("1.5000", True, True, True, False),
        ("0.500", True, True, True, False),
        ("1234.500", True, True, True, False),
        ("1,5", False, True, False, True),
        (",5", False, True, False, True),
        ("1,500", False, True, False, True),
        ("1,500,000", False, False, False, True),
        ("1,5,0", False, False, False, False),
        ("nan", True, True, False, False),
        ("-NaN(0x1)", True, True, False, False),
        ("+Infinity", True, True, False, False),
        ("inf", True, True, False, False),
        ("", True, False, False, False),
        ("1e", False, False, False, False),
        (".", False, False, False, False),
        ("w1", False, False, False, False),
        ("1 000", False, False, False, False),
    ],
)
def test_what_a_cell_is(cell, is_number, looks, decimal_point, comma):
    assert dialect.is_number_or_missing(cell) == is_number
    assert dialect.looks_like_number(cell) == looks
    assert dialect.is_decimal_point(cell) == decimal_point
    assert dialect.is_comma_number(cell) == comma


def test_a_column_is_floats_or_words():
    assert column_of(["1", "", "nan", "-2e1"]) == pytest.approx([1.0, np.nan, np.nan, -20.0], nan_ok=True)
    assert column_of(["1", "off"]) == ("1", "off")


@pytest.mark.parametrize(
    "line, is_comment",
    [
        ("# a", True),
        ("  % a", True),
        ("#", True),
        ("%", True),
        ("% ", True),
        ("#,V", False),  # a unit
        ("%;V", False),
        ("% ,V", False),
        ("#N/A,1", False),
        ("#DIV/0!", False),
        ("t,#", False),
        ("t,u", False),
    ],
)
def test_what_a_comment_is(line, is_comment):
    assert dialect.is_comment(line) == is_comment


@pytest.mark.parametrize(
    "line, is_data",
    [("1,2", True), ("1;;2", True), ('"1"\t"2"', True), ("nan", True), ("", False), (",,", False), ("1,a", False)],
)
def test_a_line_of_numbers(line, is_data):
    assert dialect.looks_like_data(line) == is_data


@pytest.mark.parametrize(
    "line, separator, counts",
    [
        ("a,b,c", ",", (3, 3)),
        ("a,b,", ",", (3, 2)),
        ("a,,", ",", (3, 2)),
        ("a", ",", (1, 1)),
        ("", ",", (1, 1)),
        ('"a,b",c', ",", (2, 2)),
        ('"a,b', ",", (-1, -1)),
        ("a;b", ",", (1, 1)),
    ],
)
def test_the_number_of_cells(line, separator, counts):
    assert dialect.counts(line, separator) == counts


def test_cells_keep_what_stands_in_quotes():
    assert dialect.split_cells('a , "b,c","d ""e"""', ",", "") == ["a", "b,c", 'd "e"']
    assert dialect.split_cells("a ; b", ";", "") == ["a", "b"]


@pytest.mark.parametrize(
    "header, rows, separator",
    [
        ("t,u", ["0,1"], ","),
        ("t;u", ["0;1,5"], ";"),
        ("t\tu", ["0\t1"], "\t"),
        ("t,u;w", ["0,1;2", "1,2;3"], None),  # both would do
        ("t,u;w", ["0;1", "1;2"], ";"),  # a comma in a name
        ("speed", ["1", "2"], ","),
        ("speed", ["1;2"], None),
        ("speed", ["1 2"], None),
        ("t;u;", ["0;1", "1;2"], ";"),  # a header that ends with it
        ("t,u", ["0,1,", "1,2,"], ","),  # rows that do
    ],
)
def test_the_separator_is_the_one_that_fits(header, rows, separator):
    if separator is None:
        with pytest.raises(InputError, match="cannot tell what separates the columns"):
            dialect.find_separator(header, rows, "")
    else:
        assert dialect.find_separator(header, rows, "") == separator


def test_fifty_rows_vote_on_the_separator():
    late = ["0,1;2"] * 49
    with pytest.raises(InputError, match="cannot tell"):
        dialect.find_separator("t,u;w", [*late, "1,2;3", "0;1"], "")  # the fifty-first is not asked
    assert dialect.find_separator("t,u;w", [*late, "0;1"], "") == ";"


@pytest.mark.parametrize(
    "cells, is_units",
    [
        (["s", "V"], True),
        (["s", ""], True),
        (["", ""], False),
        (["[s]", "[foo]"], True),  # in brackets, one of them known
        (["[foo]", "[bar]"], False),
        (["s", "foo"], False),
        (["[s]", "foo"], False),
        (["s", "V", "A", "foo"], True),  # most of three or more are known
        (["s", "V", "A", "foo", "bar"], True),
        (["s", "V", "A", "foo", "bar", "x1"], False),
        (["s", "V", "foo"], False),  # two known
        (["s", "1"], False),
        (["(s)", "(V)"], True),
        (["-", "#"], True),
    ],
)
def test_a_row_of_units(cells, is_units):
    assert dialect.is_units_row(cells) == is_units


def test_brackets():
    assert [dialect.strip_brackets(cell) for cell in ("[m/s]", "( V )", "m/s", "[m", "", "[]")] == [
        "m/s",
        "V",
        "m/s",
        "[m",
        "",
        "",
    ]
    assert [dialect.is_unit(text) for text in ("s", "1/min", "8Hz", "0", "", "px", "volt-ish")] == [
        True,
        True,
        False,
        False,
        False,
        True,
        False,
    ]


def test_a_decimal_comma_seen_in_passing():
    """Within fifty rows, and no point anywhere."""
    assert dialect.is_decimal_comma_plain(["0;1,5", "1;2"], ";")
    assert not dialect.is_decimal_comma_plain(["0;1,500"], ";")
    assert not dialect.is_decimal_comma_plain(["0;1,5", "1;2.5"], ";")
    assert dialect.is_decimal_comma_plain(["0;1"] * 49 + ["0;1,5"], ";")
    assert not dialect.is_decimal_comma_plain(["0;1"] * 50 + ["0;1,5"], ";")


@pytest.mark.parametrize(
    "cell, expected", [("1.050", "1050 or 1.05"), ("2.000", "2000 or 2.0"), ("-12.500", "-12500 or -12.5")]
)
def test_both_readings_of_a_point_are_shown(cell, expected):
    assert str(dialect.ambiguous_point(cell, "log.csv:3")).split("expected ")[1].startswith(expected + ";")


# ---- names --------------------------------------------------------------------------------------------------------


def layout(text, header=True):
    lines = [FileLine(k + 1, line) for k, line in enumerate(text.split("\n")) if line.strip()]
    return find_layout(lines, "log.csv", header)


def test_units_behind_names_are_split_off_where_names_stay_different():
    assert split_units(["t [s]", "w [rad/s]", "w [rpm]", "n"]) == (
        ["t", "w [rad/s]", "w [rpm]", "n"],
        {"t": "s", "w [rad/s]": "rad/s", "w [rpm]": "rpm"},
    )


def test_the_lines_of_a_head():
    """Line numbers are those of the file, blank lines and comments counted."""
    found = layout("# made by hand\n\nt,u\n# of a scope\ns,V\n\n0,1\n1,2")
    assert (found.names, dict(found.units), found.first, found.separator) == (("t", "u"), {"t": "s", "u": "V"}, 7, ",")
    three = layout("Time,Voltage\ns,V\nt,u\n0,1\n1,2")
    assert (three.names, three.first) == (("t", "u"), 4)
    assert dict(three.titles) == {"t": "Time", "u": "Voltage"}
    assert three.notes == ("line 3 gives the names, line 2 the units, line 1 the titles",)
    other = layout("Time,Voltage\nt,u\ns,V\n0,1\n1,2")
    assert (other.names, other.first) == (("t", "u"), 4)
    assert other.notes == ("line 2 gives the names, line 3 the units, line 1 the titles",)
    twice = layout("Time,Voltage\ns,V\nt,t\n0,1\n1,2")  # two alike are no names: a row of words
    assert (twice.names, twice.first, dict(twice.titles)) == (("Time", "Voltage"), 3, {})
    two = layout("t,u\ns,V\n0,1")
    assert (two.names, two.first, two.notes) == (("t", "u"), 3, ())
    words = layout("t,state\n0,off\n1,on\n2,off\n3,on")
    assert (words.names, words.first) == (("t", "state"), 2)


def test_names_in_comments():
    one = layout("# t,u\n0,1\n1,2")
    assert (one.names, one.first, one.notes) == (("t", "u"), 2, ("line 1, a comment, was read as the header",))
    both = layout("# t;u\n# s;V\n0;1\n1;2")
    assert (both.names, dict(both.units), both.first) == (("t", "u"), {"t": "s", "u": "V"}, 3)
    assert both.notes[0] == "line 1, a comment, was read as the header, line 2 as the units"
    for text in (
        "# t,t\n0,1",  # two alike
        "# t,\n0,1",  # one without a name
        "# t,u,w\n0,1",  # too many
        "# t,5\n0,1",  # a number
        "# t\n0",  # one cell alone may be any remark
    ):
        with pytest.raises(InputError, match="the table has no header"):
            layout(text)


def test_columns_without_a_header():
    found = layout("0;15;\n1;25;", header=False)
    assert (found.names, found.separator, found.ending) == (("c1", "c2"), ";", ";")
    assert found.cells("2;3,5;", "") == ["2", "3,5"]
    assert layout("0;1;\n1;2;3", header=False).names == ("c1", "c2", "c3")  # the last one is not always blank
    assert layout("0\n1", header=False).names == ("c1",)
    assert layout("sep=;\n0;1", header=False).first == 2
    assert layout("0,1;\n1,2;", header=False).ending == ";"
    wide = ",".join(["1"] * 1001)
    with pytest.raises(InputError, match="too many columns; got 1001; expected at most 1000"):
        layout(wide, header=False)
    assert len(layout(wide[2:], header=False).names) == 1000


def test_what_ends_every_row():
    """The separator itself, where the header does not have it; another one; a last row may have been cut."""
    assert layout("t,u\n0,1,\n1,2,").ending == ","
    assert layout("t,u,\n0,1,\n1,2,").names == ("t", "u")
    assert layout("t,u\n0,1;\n1,2;\n2,3").ending == ";"
    assert layout("t,u\n0,1;\n1,2\n2,3;").ending == ""
    assert layout("t,u\n0,1").ending == ""
    found = layout("t,u\n0,1;\n1,2;")
    assert found.cells("2,3; ", "") == ["2", "3"]
    assert found.cells("2,3", "") == ["2", "3"]


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_of_a_row_one_separator_too_many_is_its_end_and_nothing_else_is(separator):
    found = layout("t,u\n0,1,\n1,2,".replace(",", separator))
    assert found.ending == separator
    for row, cells in (
        ("2,3,", ["2", "3"]),
        ("2,3", ["2", "3"]),
        ("2,,", ["2", ""]),  # the last cell is blank
        ("2,", ["2", ""]),  # and the row does not end as the others do
        ("2,3,4", ["2", "3", "4"]),  # too many cells: refused where rows are read
        ("2,3,,", ["2", "3", "", ""]),
    ):
        assert found.cells(row.replace(",", separator), "") == cells
    plain = layout("t,u\n0,1\n1,2".replace(",", separator))
    assert (plain.ending, plain.cells(f"2{separator}3{separator}", "")) == ("", ["2", "3", ""])


def test_a_head_need_not_end_as_the_rows_do():
    """Names and units without the semicolon of each row: told where enough rows follow."""
    rows = "".join(f"\n{k},{2 * k};" for k in range(7))
    found = layout("Time,Voltage\nt,u\ns,V" + rows)
    assert (found.names, found.first, found.ending) == (("t", "u"), 4, ";")
    assert found.notes[-1] == "every row ends with a semicolon: it was left out"
    assert layout("t,u\ns,V" + rows).ending == ";"
    assert layout("t,u" + rows).ending == ";"


def test_a_row_index_gets_a_name():
    assert layout(",t\n0,5\n1,6").names == ("index", "t")
    for rows in ("1,5\n2,6", "0,5\n2,6"):
        with pytest.raises(InputError, match="column 1 has no name"):
            layout(",t\n" + rows)


def test_names_are_checked_one_by_one():
    check_name(1, ["t", "w" * 1000], "")
    with pytest.raises(InputError, match="the name of column 2 is too long; got 1001 characters"):
        check_name(1, ["t", "w" * 1001], "")
    with pytest.raises(InputError, match="column 3 has no name; got t,,"):
        check_name(1, ["t", ""], "", got="t,,", number=3)
    with pytest.raises(InputError, match="column 2 has no name"):
        check_name(1, ["t", ""], "")
    with pytest.raises(InputError, match="two columns have the same name; got t"):
        check_name(2, ["t", "u", "t"], "")


@pytest.mark.parametrize(
    "texts, above",
    [
        (["Model,TBS", "t,u,w", "0,1,2", "1,2,3", "2,3,4"], 1),
        (["Model,TBS", "v 1.2", "t,u,w", "s,V,A", "0,1,2", "1,2,3", "2,3,4"], 2),
        (["Model", "t\tu", "0\t1", "1\t2", "2\t3"], 1),
        (["Model", "t,u", "0,1", "1,2"], 0),  # two rows are too few to be sure
        (["Model", "t,u", "0,1", "1,2", "2,3"], 1),
        (["Model", "0,1", "1,2", "2,3"], 0),  # no names
        (["Model", "5,6", "t,u", "0,1", "1,2", "2,3"], 0),  # a line above has as many cells
        (["Model", "t", "0", "1", "2"], 0),  # one column
        (["Model,X,", "t,u,w", "0,1,2", "1,2,3", "2,3,4"], 0),  # a blank cell is one of as many, too
        (["Model", "t,u", "0,1", "1,2,3", "2,3", "3,4", "4,5"], 0),
    ],
)
def test_what_stands_above_the_names(texts, above):
    assert preamble(texts) == above


# ---- rows ---------------------------------------------------------------------------------------------------------


def parse(text, rows, **options):
    """(columns, lines, notes) of rows under a header; line 2 is the first of them."""
    found = layout(text + "\n" + rows[0])
    parser = RowParser(found, "log.csv", sample=rows, **options)
    columns, lines = parser.parse(list(rows), np.arange(2, 2 + len(rows)))
    return {name: list(column) for name, column in columns.items()}, lines.tolist(), parser.notes


def test_plain_rows_and_odd_ones_give_the_same_numbers():
    for rows in (["0,1.5", "1,-2e1"], ["0,1.5", '1,"-2e1"'], [" 0 , 1.5", "1,-20"], ['"0","1.5"', '"1","-20"']):
        assert parse("t,u", rows)[:2] == ({"t": [0.0, 1.0], "u": [1.5, -20.0]}, [2, 3])
    columns, _, _ = parse("t,u,w", ["0,,1", ",2,", ",,"])
    for name, values in (("t", [0, np.nan, np.nan]), ("u", [np.nan, 2, np.nan]), ("w", [1, np.nan, np.nan])):
        np.testing.assert_array_equal(columns[name], values)


def test_a_quoted_cell_may_hold_the_separator():
    assert parse("t,state", ['0,"a, b"', "1,c"])[0] == {"t": [0.0, 1.0], "state": ["a, b", "c"]}
    for cell in ("b,c", "b,c,d", "b,", ",b"):
        assert parse("t,state", [f'"0","{cell}"', '"1","c"'])[0] == {"t": [0.0, 1.0], "state": [cell, "c"]}
    with pytest.raises(InputError, match=r"row 2 has another number of cells than the header; got 2: .*; expected 4"):
        parse("t,a,b,c", ["0,1,2,3", '"0","1,2,3"'])
    assert parse("t,state", ['0,"a"', '1,"c"'])[0] == {"t": [0.0, 1.0], "state": ["a", "c"]}


def test_decimal_commas_once_certain_hold_for_all_rows():
    columns, _, notes = parse("t;u", ["0;1,500", "1;0,25", "2;3"])
    assert columns == {"t": [0.0, 1.0, 2.0], "u": [1.5, 0.25, 3.0]}
    assert "numbers have a decimal comma" in notes
    assert parse("t;u;s", ["0;1,5;a", "1;2,5;b,c"])[0] == {"t": [0.0, 1.0], "u": [1.5, 2.5], "s": ["a", "b,c"]}


@pytest.mark.parametrize("row, count", [("1", 1), ("1,b,c", 3), ("b", 1)])
def test_a_ragged_row_beside_words(write, row, count):
    with pytest.raises(InputError, match=rf"table\.csv:4: row 3 has another number of cells .*; got {count}: {row}; e"):
        list(iter_tables(write(f"t,state\n0,a\n1,b\n{row}\n"), 1))
    with pytest.raises(InputError, match=rf"log\.csv:3: row 2 has another number of cells .*; got {count}: {row}; exp"):
        parse("t,state", ["0,a", row])


@pytest.mark.parametrize(
    "rows, words",
    [
        (["0;1,5", "1;2.5"], r"log\.csv:3: decimal commas and decimal points are mixed; got 1,5 and 2\.5"),
        (["0;2.5", "1;1,5"], r"log\.csv:3: decimal commas and decimal points are mixed; got 1,5 and 2\.5"),
        (["0;2.5", "1;1,500"], r"log\.csv:3: decimal commas and decimal points are mixed; got 1,500 and 2\.5"),
        (["0;1,500", "1;2,500"], r"a comma in a number is ambiguous; got 1,500; expected 1500 or a decimal point"),
        (
            ["0;1", "1;2;3"],
            r"log\.csv:3: row 2 has another number of cells than the header; got 3: 1;2;3; expected 2 c",
        ),
        (["0;1", "1"], r"log\.csv:3: row 2 .*; got 1: 1; expected 2 cells; correct or remove the row"),
        (["0;1", "1;inf", "inf;1"], r"log\.csv:3, column u: not a finite number"),
        (["0;1", "1;1e999", "2;3"], r"log\.csv:3, column u: not a finite number"),
    ],
)
def test_a_fault_is_that_of_the_first_bad_row(rows, words):
    with pytest.raises(InputError, match=words):
        parse("t;u", rows)


def test_rows_that_are_left_out_are_counted_by_reason():
    rows = ["0,1", "1,2,3", "2,x", "3,inf", '4,"5', "5,6", "6", "7,", "8,9", "9,1", "10,2", "11,3"]
    columns, lines, notes = parse("t,u", rows, skip=True)
    assert columns["t"] == [0.0, 5.0, 7.0, 8.0, 9.0, 10.0, 11.0]
    assert lines == [2, 7, 9, 10, 11, 12, 13]
    assert notes == (
        "2 rows were left out for another number of cells (lines 3, 8)",
        "1 row was left out for a broken quote (line 6)",
        "1 row was left out for no number where one is due (line 4)",
        "1 row was left out for an infinite number (line 5)",
    )


def test_the_first_five_lines_of_what_is_left_out_are_shown():
    assert skip_note("x", [3]) == "1 row was left out for x (line 3)"
    assert skip_note("x", [1, 2, 3, 4, 5]) == "5 rows were left out for x (lines 1, 2, 3, 4, 5)"
    assert skip_note("x", [1, 2, 3, 4, 5, 6]) == "6 rows were left out for x (lines 1, 2, 3, 4, 5, ...)"


def test_half_of_the_cells_make_a_column_of_numbers():
    """Then the others are bad rows; where fewer are numbers it is a column of words. Blank cells do not count."""
    assert parse("t,u", ["0,1", "1,x", "2,"], skip=True)[0] == {
        "t": [0.0, 2.0],
        "u": pytest.approx([1, np.nan], nan_ok=True),
    }
    assert parse("t,u", ["0,1", "1,x", "2,y"], skip=True)[0] == {"t": [0.0, 1.0, 2.0], "u": ["1", "x", "y"]}


@pytest.mark.parametrize("rows", [1, 2, 3, 100])
def test_pieces_give_what_the_whole_gives(write, rows):
    """Words that come late, quotes and blank cells; lines are those of the file."""
    content = "t;u;state\n0;1,5;off\n\n1;;on\n# x\n2;2,25;3\n3;4;\n"
    path = write(content)
    parts = list(iter_tables(path, rows))
    whole = join(parts)
    assert whole.lines.tolist() == [2, 4, 6, 7]
    assert whole.columns["state"] == ("off", "on", "3", "")
    np.testing.assert_array_equal(whole.columns["u"], [1.5, np.nan, 2.25, 4.0])
    np.testing.assert_array_equal(whole.columns["u"], read_table(path).columns["u"])


def test_points_between_thousands():
    """A point in three digits beside whole numbers below a thousand; beside larger ones it can be decimal."""
    with pytest.raises(InputError, match=r"log\.csv:3, column u: a point in a number is ambiguous; got 1\.050"):
        parse("t;u", ["0;999", "1;1.050"])
    assert parse("t;u", ["0;1000", "1;1.050"])[0]["u"] == [1000.0, 1.05]
    assert parse("t;u", ["0;999", "1;1.05"])[0]["u"] == [999.0, 1.05]
    _, _, notes = parse("t;u", ["0;1.500", "1;2.500"])
    assert "points were read as decimal: 1.500 is 1.5, not 1500" in notes
    assert parse("t,u", ["0,999", "1,1.050"])[0]["u"] == [999.0, 1.05]


@pytest.mark.parametrize("rows", [1, 2, 100])
def test_commas_that_stay_doubtful_in_all_later_rows_are_refused(write, rows):
    """Whole numbers, words and more such commas make nothing certain; a point shows that they are mixed."""
    with pytest.raises(InputError, match=r"a comma in a number is ambiguous; got 1,500"):
        list(iter_tables(write("t;u\n0;1,500\n1;2\n2;3,250\n"), rows))
    with pytest.raises(InputError, match=r"decimal commas and decimal points are mixed; got 1,500 and 2\.5"):
        list(iter_tables(write("t;u\n0;1,500\n1;7\n2;2.5\n"), rows))
    tables = list(iter_tables(write("t;u\n0;1,500\n1;7\n2;2,5\n"), rows))
    assert np.concatenate([part.columns["u"] for part in tables]).tolist() == [1.5, 7.0, 2.5]


@pytest.mark.parametrize("rows", [1, 2])
def test_points_between_thousands_in_pieces(write, rows):
    """A block of whole numbers says as much as a row of them."""
    assert [part.columns["u"][-1] for part in iter_tables(write("t;u\n0;1000\n1;1.050\n"), rows)][-1] == 1.05
    with pytest.raises(InputError, match="a point in a number is ambiguous"):
        list(iter_tables(write("t;u\n0;999\n1;1.050\n"), rows))


# ---- the value ------------------------------------------------------------------------------------------------------


def table(names=("t", "u"), columns=None, **more):
    columns = columns or {"t": np.array([0.0, 1.0, 2.0]), "u": np.array([1.0, 2.0, 3.0])}
    return FileTable(names, columns, np.array([2, 3, 5])[: len(columns[names[0]])], {}, "log.csv", "ab", **more)


def test_what_a_sensor_may_give():
    """Below 1e-100 a number is 0, beyond 1e20 it is none."""
    sizes = np.array([1e-101, -1e-100, 1e20])
    found = table(columns={"t": sizes.copy(), "u": -10.0 * sizes})
    assert found.measured("t").tolist() == [0.0, -1e-100, 1e20]
    with pytest.raises(
        InputError, match=r"log\.csv:5, column u: no sensor gives such a number; got -1e\+21; expected at"
    ):
        found.measured("u")
    with pytest.raises(InputError, match=r"at most 1e\+20 in size; correct it, or remove the row"):
        found.measured("u")
    assert found.measured("u", skip=True) == pytest.approx([-1e-100, 1e-99, np.nan], nan_ok=True)
    large = table(columns={"t": np.array([1e30, 0.0, np.nan]), "u": np.array([0.5, -1e30, 1e30])})
    with pytest.raises(InputError, match=r"log\.csv:3, .* \(2 of 3 are as large\); leave the cell blank, or use"):
        large.measured("u", missing=True)
    assert large.measured("t", missing=True, skip=True) == pytest.approx([np.nan, 0.0, np.nan], nan_ok=True)
    plain = table()
    assert plain.measured("u") is plain.columns["u"]


def test_cells_that_are_missing():
    found = table(columns={"t": np.array([0.0, np.nan, np.nan]), "u": ("1", "x", "2")})
    with pytest.raises(InputError, match=r"log\.csv:3, column t: a number is missing; .*\(2 of 3 are missing\)"):
        found.numbers("t")
    np.testing.assert_array_equal(found.numbers("t", missing=True), [0.0, np.nan, np.nan])
    with pytest.raises(InputError, match=r"log\.csv:3, column u: not a number; got x"):
        found.numbers("u")
    assert found.text("u") == ("1", "x", "2")
    late = table(columns={"t": np.zeros(3), "u": ("1", "2", "3")})  # a block of a column that began with words
    with pytest.raises(InputError, match=r"log\.csv:2, column u: not a number; got 1;"):
        late.numbers("u")
    with pytest.raises(InputError, match=r"log\.csv:2, column t: not text; got 0\.0; expected text"):
        found.text("t")
    assert not found.own_clocks
    assert found.begins == ()


def test_names_that_cannot_be_shown_get_others():
    """A line end in a name is shown by its escape; two that then look alike are told apart."""
    names = ("a\n", "a\\u000a", "b")
    found = table(names, dict.fromkeys(names, np.zeros(3)), titles={"a\n": "A"})
    assert len(set(found.names)) == 3
    assert all(name.isprintable() for name in found.names)
    assert found.names[1] == f"{found.names[0]} (2)"
    assert list(found.columns) == list(found.names)
    assert found.titles == {found.names[0]: "A"}
    assert table(("b", "ü"), {"b": np.zeros(3), "ü": np.zeros(3)}).names == ("b", "ü")


def test_blocks_are_joined_within_a_limit():
    parts = [table(), table(columns={"t": np.array([3.0]), "u": ("off",)})]
    whole = join(parts)
    assert whole.columns["u"] == ("1.0", "2.0", "3.0", "off")
    assert whole.columns["t"].tolist() == [0.0, 1.0, 2.0, 3.0]
    assert whole.lines.tolist() == [2, 3, 5, 2]
    assert join(parts[:1]) is parts[0]
    rows = 2**20  # 8 bytes for a column and for the lines: 24 MiB; three are more than the 64 MiB that any may have
    block = FileTable(("a", "b"), dict.fromkeys("ab", np.zeros(rows)), np.zeros(rows, int), {}, "log.csv", "")
    assert len(join([block] * 2, max_bytes=1)) == 2 * rows
    with pytest.raises(InputError, match=r"log\.csv: the file is too large; got more than 1 bytes"):
        join([block] * 3, max_bytes=1)
    assert len(join([block] * 3, max_bytes=72 * 2**20)) == 3 * rows


def test_the_nearest_name_is_proposed():
    with pytest.raises(InputError, match=r"unknown column; got u; expected t, voltage; remove the column"):
        table().check_names(["t"], ["voltage"])
    table().check_names(["t"], ["u", "v"])
    table().check_names(["t", "u"])


# ---- lines ----------------------------------------------------------------------------------------------------------


def lines_of(path, rows=1000):
    file = TextFile(path)
    return [(block.first, block.lines) for block in file.blocks(rows)], file


def test_lines_in_blocks(write):
    blocks, file = lines_of(write("a\r\nb\rc\n\nd"), rows=2)
    assert blocks == [(1, ["a", "b"]), (3, ["c", ""]), (5, ["d"])]
    assert (file.last, file.ends_open) == (5, True)
    blocks, file = lines_of(write("a\nb\n"))
    assert (blocks, file.last, file.ends_open) == ([(1, ["a", "b"])], 2, False)
    blocks, file = lines_of(write("a\nb\r"))
    assert (blocks, file.ends_open) == ([(1, ["a", "b"])], False)


def test_lines_that_the_blocks_of_a_file_cut(write):
    """Blocks of a megabyte: an end of line of two bytes, and a letter of two, may stand across."""
    half = "x" * (2**20 - 1)
    assert lines_of(write(half + "\r\nb\n"))[0] == [(1, [half, "b"])]
    assert lines_of(write(half + "µ\nb\n"))[0] == [(1, [half + "µ", "b"])]
    line = "y" * 99
    blocks, file = lines_of(write(f"{line}\n" * 30_000))
    assert sum(len(lines) for _, lines in blocks) == file.last == 30_000
    assert [first for first, _ in blocks] == list(range(1, 30_000, 1000))


def test_a_line_without_end_is_refused(write):
    limit = 4 * 2**20
    assert len(lines_of(write("x" * limit))[0][0][1][0]) == limit
    with pytest.raises(InputError, match=f"this is not a table; got a line of more than {limit} bytes"):
        lines_of(write("x" * (limit + 1)))


def test_an_encoding_without_a_mark_is_told_by_its_zeros(write):
    for encoding in ("utf-16-le", "utf-16-be"):
        blocks, file = lines_of(write("t,ü,w".encode(encoding)))
        assert blocks == [(1, ["t,ü,w"])]
        assert file.notes == [f"the encoding is {encoding.upper()}"]
    blocks, file = lines_of(write(codecs.BOM_UTF8 + b"t,u\n"))
    assert blocks == [(1, ["t,u"])]
    blocks, file = lines_of(write("a\nb\nü\nö\n".encode("latin-1")))
    assert blocks == [(1, ["a", "b", "ü", "ö"])]
    assert file.notes == ["line 3 is not UTF-8: read as Latin-1"]


def test_what_is_no_text(write):
    """Control characters among bytes that are not UTF-8, or with zeros; a text of its own encoding has none."""
    random = np.random.default_rng(0)
    noise = random.integers(1, 256, 3000, dtype=np.uint8).tobytes()
    with pytest.raises(InputError, match=r"this is not a text file; got bytes that are no text \(it begins with "):
        lines_of(write(b"\x02" + noise))
    with pytest.raises(InputError, match="bytes that are no text"):
        lines_of(write(bytes([1, 0, 2, 0, 3]) * 400))
    with pytest.raises(InputError, match="zero bytes in it"):
        lines_of(write(b"t,u\n" + b"1,2\n" * 200 + b"\0" + b"3,4\n"))
    japanese = "速度,電圧\n".encode("shift-jis")
    assert len(lines_of(write(japanese * 50))[0][0][1]) == 50
    bell = b"t,u\n" + b"1,2\n" * 20 + b"\x07\n"
    assert lines_of(write(bell))[1].last == 22
    mostly = b"\x01\x02\x03\x04" * 100 + b"abcdef" * 100  # two in five are controls
    with pytest.raises(InputError, match="bytes that are no text"):
        lines_of(write(mostly))
    assert lines_of(write(b"\x01" * 200 + b"abcdefgh" * 100))[1].last == 1  # one in five


@pytest.mark.parametrize(
    "content, words",
    [
        (b"\0" + b"\1" * 9 + b"a" * 990, "zero bytes in it"),  # less than one in a hundred is a control character
        (b"\0" + b"\1" * 11 + b"a" * 988, "bytes that are no text"),
        (b"\1" * 29 + b"a" * 71, None),  # three in ten
        (b"\1" * 31 + b"a" * 69, "bytes that are no text"),
        (b"\1" + b"\xff" * 28 + b"a" * 71, None),
        (b"\1" + b"\xff" * 30 + b"a" * 69, "bytes that are no text"),
        (b"\xff" * 50 + b"a" * 50, None),  # no control character
        (b"\xff" * 50 + b"a" * 49 + b"\x7f", "bytes that are no text"),
    ],
)
def test_how_much_a_text_may_hold_that_is_none(write, content, words):
    if words is None:
        assert lines_of(write(content))[1].last == 1
    else:
        with pytest.raises(InputError, match=words):
            lines_of(write(content))


def test_the_first_eight_bytes_are_shown(write):
    with pytest.raises(InputError, match=r"\(it begins with 01 02 03 04 05 06 07 08\);"):
        lines_of(write(bytes(range(1, 9)) * 20))


def test_a_file_may_be_as_long_as_its_limit(write):
    path = write("t,u\n0,1\n")
    assert len(list(TextFile(path, max_bytes=8).blocks(10))) == 1
    with pytest.raises(InputError, match="the file is too large; got more than 7 bytes"):
        list(TextFile(path, max_bytes=7).blocks(10))
    with pytest.raises(InputError, match="the file is empty"):
        list(TextFile(write("")).blocks(10))


def test_four_letters_of_two_bytes_tell_an_encoding(write):
    assert lines_of(write("t,ab".encode("utf-16-le")))[1].notes == ["the encoding is UTF-16-LE"]
    assert lines_of(write("t,ab".encode("utf-16-be")))[1].notes == ["the encoding is UTF-16-BE"]
    with pytest.raises(InputError, match="zero bytes in it"):
        lines_of(write("t,a".encode("utf-16-le") + b"b"))


def test_utf_16_that_ends_within_a_letter_is_refused(write):
    whole = "t,u\n0,1".encode("utf-16")
    assert lines_of(write(whole))[0] == [(1, ["t,u", "0,1"])]
    with pytest.raises(InputError, match=r"not a text file; got no valid UTF-16"):
        lines_of(write(whole[:-1]))


def test_what_was_read_is_reported(write):
    reports = []
    path = write("x" * 99 + "\n" * 2**20)
    list(TextFile(path, reports.append).blocks(10**9))
    assert [(report.done, report.total) for report in reports] == [(2**20, 2**20 + 99), (2**20 + 99, 2**20 + 99)]
