"""The CSV reader: what it takes, what it refuses, and in which words. Numbers: rows of BAD_INPUTS."""

import hashlib
import os

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.logs.readers.read_table import iter_tables, read_table
from omnidyn.logs.readers.reader import ReadOptions
from omnidyn.logs.readers.text import text_tables
from tests.support.codes import said
from tests.support.growth import ratio


def numbers(path, missing=False):
    table = read_table(path)
    return {name: table.numbers(name, missing=missing).tolist() for name in table.names}


PLAIN = "t_s,u1_V\n0,1.5\n0.1,-2e-1\n"
VALUES = {"t_s": [0.0, 0.1], "u1_V": [1.5, -0.2]}


# ---- what it takes --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "content",
    [
        PLAIN,
        PLAIN.rstrip("\n"),  # 9
        PLAIN.replace("\n", "\r\n"),  # 9
        PLAIN.replace("\n", "\r"),  # 9
        "\ufeff" + PLAIN,  # 7
        PLAIN.encode("utf-16"),
        "# made by hand\n\n" + PLAIN + "# the end\n\n",  # 12
        "t_s,u1_V\n[s],(V)\n0,1.5\n0.1,-2e-1\n",  # 12
        "t_s,u1_V\ns,V\n# really\n0,1.5\n0.1,-2e-1\n",
        '"t_s","u1_V"\n"0","1.5"\n0.1,"-2e-1"\n',
        " t_s , u1_V \n 0 , 1.5 \n 0.1 , -.2 \n",
        "t_s;u1_V\n0;1.5\n0.1;-0.2\n",
        "t_s;u1_V\n0;1,5\n0,1;-2e-1\n",  # 6
        "t_s\tu1_V\n0\t1,5\n0,1\t-0,2\n",  # 6
        '"t_s";"u1_V"\n"0";"1,5"\n"0,1";"-0,2"\n',
    ],
)
def test_it_reads(write, content):
    assert numbers(write(content)) == VALUES


def test_a_comma_that_is_certain_only_late_is_read(write):
    rows = "".join(f"{k};1,500\n" for k in range(100))
    assert read_table(write("t;u\n" + rows + "100;0,25\n")).numbers("u")[[0, -1]].tolist() == [1.5, 0.25]


def test_a_late_point_among_commas_is_refused(write):
    rows = "".join(f"{k};1,5\n" for k in range(100))
    with pytest.raises(InputError, match=r"decimal commas and decimal points are mixed; got 1,5 and 0\.25"):
        read_table(write("t;u\n" + rows + "100;0.25\n"))


def test_a_point_between_thousands_is_refused(write):
    match = (
        r"table\.csv:3, column n: a point in a number is ambiguous; got 1\.050 among whole numbers; expected 1050 or "
    )
    with pytest.raises(InputError, match=match + r"1\.05; write thousands without a point, or decimal numbers with"):
        read_table(write("t;n\n0;950\n10;1.050\n20;1.100\n"))


@pytest.mark.parametrize("rows", [1, 2, 500])
def test_a_point_between_thousands_is_found_in_pieces(write, rows):
    path = write("t;n\n" + "".join(f"{k};{k}\n" for k in range(200)) + "200;-1.000\n")
    with pytest.raises(
        InputError, match=r"table\.csv:202, column n: a point in a number is ambiguous; got -1\.000 among"
    ):
        list(iter_tables(path, rows))


def test_three_digits_after_every_point_are_decimal_and_noted(write):
    table = read_table(write("t;n\n0;1.500\n10;-12.000\n"))
    assert table.numbers("n").tolist() == [1.5, -12.0]
    assert "points were read as decimal: 1.500 is 1.5, not 1500" in table.notes


@pytest.mark.parametrize("rows", [1, 500])
def test_one_certain_point_settles_all(write, rows):
    """0.5 can be nothing else, and no table has two kinds of points."""
    path = write("t;n\n0;950\n10;1.050\n20;7\n30;0.5\n")
    tables = list(iter_tables(path, rows))
    assert np.concatenate([each.numbers("n") for each in tables]).tolist() == [950.0, 1.05, 7.0, 0.5]
    assert tables[-1].notes == ("columns are separated by a semicolon",)


def test_a_latin_1_header_is_read(write):  # 8
    table = read_table(write("t_s,Drehmoment [N·m]\n0,1\n".encode("latin-1")))
    assert table.names == ("t_s", "Drehmoment")
    assert dict(table.units) == {"Drehmoment": "N·m"}
    assert table.notes == ("line 1 is not UTF-8: read as Latin-1",)


def test_what_it_decided_stands_in_the_notes(write):
    assert read_table(write(PLAIN)).notes == ()
    assert read_table(write("t;u\n0;1,5\n")).notes == (
        "columns are separated by a semicolon",
        "numbers have a decimal comma",
    )


def test_a_header_of_savetxt_is_read_and_noted(write):
    table = read_table(write("# run 7\n# t_s,u1_V\n0,1.5\n0.1,-0.2\n"))
    assert table.names == ("t_s", "u1_V")
    assert table.notes == ("line 2, a comment, was read as the header",)
    assert table.lines.tolist() == [3, 4]


def test_units_lines_and_hash_are_kept(write):
    path = write("# one\nt_s,u1_V\ns,[V]\n0,1\n\n# two\n1,2\n")
    table = read_table(path)
    assert dict(table.units) == {"t_s": "s", "u1_V": "V"}
    assert table.lines.tolist() == [4, 7]
    assert table.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert len(table) == 2


def test_every_bit_of_a_float_is_kept(write):
    values = np.random.default_rng(1).standard_normal(200) * 10.0 ** np.arange(-100, 100)
    careful = "a,b\n" + "".join(f"{value!r},x\n" for value in values.tolist())  # a word makes it read cell by cell
    plain = "a\n" + "".join(f"{value!r}\n" for value in values.tolist())
    for content in (plain, careful):
        assert read_table(write(content)).numbers("a").tolist() == values.tolist()


def test_columns_cannot_be_changed(write):
    column = read_table(write(PLAIN)).numbers("t_s")
    with pytest.raises(ValueError, match="read-only"):
        column[0] = 1.0


def test_missing_cells_are_nan_where_they_may_be(write):  # 13
    assert np.isnan(numbers(write("a,b\n1,\n2,nan\n"), missing=True)["b"]).all()


def test_words_are_words(write):
    table = read_table(write("axis,v\nx,1\nyaw,2\n"))
    assert table.text("axis") == ("x", "yaw")
    with pytest.raises(InputError, match=r"table\.csv:2, column v: not text; got 1\.0; expected x or y"):
        table.text("v", "x or y")


# ---- logs as programs write them ------------------------------------------------------------------------


def test_titles_units_and_names_in_three_lines(write):
    content = "Time;Speed of wheel 1;\nms;rad/s;\nt;w1;\n0;1,5;\n10;2,5;\n"
    table = read_table(write(content))
    assert table.names == ("t", "w1")
    assert dict(table.units) == {"t": "ms", "w1": "rad/s"}
    assert dict(table.titles) == {"t": "Time", "w1": "Speed of wheel 1"}
    assert table.numbers("w1").tolist() == [1.5, 2.5]
    assert table.notes == (
        "line 3 gives the names, line 2 the units, line 1 the titles",
        "columns are separated by a semicolon",
        "every row ends with a semicolon: the blank last column was left out",
        "numbers have a decimal comma",
    )


def test_titles_above_names_above_units(write):
    table = read_table(write("Time,Speed\nt,w1\ns,rpm\n0,1\n"))
    assert table.names == ("t", "w1")
    assert dict(table.units) == {"t": "s", "w1": "rpm"}
    assert dict(table.titles) == {"t": "Time", "w1": "Speed"}


@pytest.mark.parametrize("end", ["", ","])
def test_rows_may_end_with_a_separator(write, end):
    table = read_table(write(f"t,u{end}\n0,1,\n1,2,\n2,,\n3,4\n"))
    assert table.names == ("t", "u")
    assert np.array_equal(table.numbers("u", missing=True), [1.0, 2.0, np.nan, 4.0], equal_nan=True)


def test_a_last_column_that_is_blank_is_kept_where_it_has_a_name(write):
    table = read_table(write("t,u\n0,\n1,\n"))
    assert table.names == ("t", "u")
    assert np.isnan(table.numbers("u", missing=True)).all()


def test_rows_may_end_with_another_separator(write):
    table = read_table(write("t,u\n0,1;\n1,2;\n2,3"))
    assert table.numbers("u").tolist() == [1.0, 2.0, 3.0]
    assert table.notes == ("every row ends with a semicolon: it was left out",)


def test_header_and_units_may_stand_in_percent_comments(write):
    table = read_table(write("%Motor data\r\n\r\n%Date:,29/04/2021\r\n%t,u\r\n%[#],[V]\r\n0,1;\r\nnan,nan;\r\n"))
    assert table.names == ("t", "u")
    assert dict(table.units) == {"t": "#", "u": "V"}
    assert table.lines.tolist() == [6, 7]


def test_a_comment_above_a_header_is_no_header(write):
    assert read_table(write("# one, two\nt,u\n0,1\n")).names == ("t", "u")


def test_a_percent_sign_may_be_a_unit(write):
    table = read_table(write("d1,u1\n%,V\n10,1\n"))
    assert dict(table.units) == {"d1": "%", "u1": "V"}
    assert len(table) == 1


@pytest.mark.parametrize(
    "cell, name, unit",
    [
        ("w1 [rad/s]", "w1", "rad/s"),
        ("w1 (rpm)", "w1", "rpm"),
        ("time(ms)", "time", "ms"),
        ("Drehzahl [1/min]", "Drehzahl", "1/min"),
        ("pos [ticks/2000]", "pos", "ticks/2000"),
        ("yaw rate [°/s]", "yaw rate", "°/s"),
        ("timestep (8Hz)", "timestep (8Hz)", None),
        ("joint[0]", "joint[0]", None),
        ("u1_V", "u1_V", None),
        ("speed (measured)", "speed (measured)", None),
    ],
)
def test_units_behind_names(write, cell, name, unit):
    table = read_table(write(f"t;{cell}\n0;1\n"))
    assert table.names == ("t", name)
    assert table.units.get(name) == unit


def test_names_stay_whole_where_units_alone_tell_them_apart(write):
    table = read_table(write("w [rad/s],w [rpm]\n0,1\n"))
    assert table.names == ("w [rad/s]", "w [rpm]")
    assert dict(table.units) == {"w [rad/s]": "rad/s", "w [rpm]": "rpm"}


def test_two_units_for_one_column_are_refused(write):
    with pytest.raises(InputError, match=r"table\.csv:1, column w: name and row of units .*; got rad/s and rpm"):
        read_table(write("t,w [rad/s]\ns,rpm\n0,1\n"))


def test_the_first_line_of_excel_is_taken(write):
    assert numbers(write("sep=;\nt_s;u1_V\n0;1,5\n0,1;-0,2\n")) == VALUES


@pytest.mark.parametrize("cell", ["nan", "-nan", "NaN", "+nan", "nan(ind)", "-nan(ind)"])
def test_every_nan_of_a_c_program_is_a_missing_value(write, cell):
    assert np.isnan(numbers(write(f"a,b\n1,{cell}\n"), missing=True)["b"]).all()


# ---- encodings ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "encoding, note",
    [
        ("utf-8", None),
        ("utf-8-sig", "the encoding is UTF-8 with a byte order mark"),
        ("utf-16", "the encoding is UTF-16"),
        ("utf-16-le", "the encoding is UTF-16-LE"),
        ("utf-16-be", "the encoding is UTF-16-BE"),
        ("latin-1", "line 1 is not UTF-8: read as Latin-1"),
    ],
)
def test_the_encoding_is_told_and_said(write, encoding, note):
    table = read_table(write("time_s,µ [°/s]\n0,1\n".encode(encoding)))
    assert table.names == ("time_s", "µ")
    assert table.notes == ((note,) if note else ())


@pytest.mark.parametrize("zeros", [1, 4096, 3_000_000])
def test_zero_bytes_at_the_end_are_left_out_and_said(write, zeros):
    table = read_table(write(b"t_s,u1_V\n0,1\n0.1,2\n" + bytes(zeros)))
    np.testing.assert_array_equal(table.columns["u1_V"], [1.0, 2.0])
    assert "zero bytes at the end, as a recorder leaves that lost its power, were left out" in said(table.notes)


def test_broken_utf_16_is_refused(write):
    with pytest.raises(InputError, match=r"not a text file; got no valid UTF-16 .*; save it as UTF-8"):
        read_table(write(b"\xff\xfet\x00,\x00u\x00\n\x00\x00\xd8\n\x00"))


# ---- what one may ask for -------------------------------------------------------------------------------


def test_no_header(write):  # 5
    table = read_table(write("# made by hand\n0,1.5\n0.1,2\n"), header=False)
    assert table.names == ("c1", "c2")
    assert table.numbers("c2").tolist() == [1.5, 2.0]
    assert table.notes == ("no header: the columns are called c1 to c2",)


def test_no_header_and_a_separator_at_the_end(write):
    table = read_table(write("0;1,5;\n0,1;2,5;\n"), header=False)
    assert table.names == ("c1", "c2")
    assert table.numbers("c2").tolist() == [1.5, 2.5]


def test_bad_rows_are_left_out_and_counted(write):  # 10, 15, 16
    rows = ["0,1", "1,2,3", "2", "3,fast", "4,1e400", '5,"6', "6,7", "inf,8", "8,"]
    table = read_table(write("t,u\n" + "\n".join(rows) + "\n"), skip_bad_rows=True)
    assert table.numbers("t").tolist() == [0.0, 6.0, 8.0]
    assert table.lines.tolist() == [2, 8, 10]
    assert table.notes == (
        "2 rows were left out for another number of cells (lines 3, 4)",
        "1 row was left out for a broken quote (line 7)",
        "1 row was left out for no number where one is due (line 5)",
        "2 rows were left out for an infinite number (lines 6, 9)",
    )


def test_words_are_no_bad_rows_where_a_column_holds_words(write):
    table = read_table(write("axis,v\nx,1\n2,3\nyaw,2\n"), skip_bad_rows=True)
    assert table.text("axis") == ("x", "2", "yaw")


def test_nothing_left_is_refused(write):
    with pytest.raises(InputError, match="no rows; got 0 samples"):
        read_table(write("t,u\n0,inf\n"), skip_bad_rows=True)


# ---- what it refuses ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "content, words",
    [
        ("", r"table\.csv: the file is empty; got 0 bytes"),  # 2
        ("\n\n# nothing\n", r"no table in the file; got only blank lines and comments"),
        ("t_s,u1_V\n", r"table\.csv: no rows; got 0 samples; expected at least one row"),  # 3
        ("t_s,u1_V\ns,V\n", r"no rows; got 0 samples"),
        (
            "0,1.5\n0.1,2\n",
            r"table\.csv:1: the table has no header.*; got 0,1\.5; expected column names.*; add a first line",
        ),  # 5
        ("# 3,4\n0,1.5\n", r"table\.csv:2: the table has no header"),
        ("t_s,1.5\n0,1\n", r"table\.csv:1: the table has no header: a number stands.*; got 1\.5"),
        ("t_s,,u\n1,2,3\n", r"table\.csv:1: column 2 has no name"),
        ("t_s,u,\n1,2,3\n", r"table\.csv:1: column 3 has no name"),
        (
            "t,u\n0,1\n1,2,3\n",
            r"table\.csv:3: row 2 has another number of cells.*; got 3: 1,2,3; expected 2 cells",
        ),  # 10
        ("t,u\n0,1\n1\n", r"table\.csv:3: row 2 has .*; got 1: 1; expected 2 cells"),
        (
            "t,u\n0,1,5\n1,2,5\n",
            r"table\.csv:2: row 1 has .*; a decimal comma\? then separate the columns by semicolons",
        ),
        ('t,u\n0,"1\n1,2\n', r'table\.csv:2: a quote is not closed on its line; got 0,"1'),  # 11
        ('"t,u\n0,1\n', r"table\.csv:1: a quote is not closed|cannot tell what separates"),
        ('t,u\n0,"1"2\n', r"table\.csv:2: a quote is not closed"),
        (
            "t,u\n0,inf\n",
            r"table\.csv:2, column u: not a finite number; got inf.*; expected a finite number; correct or",
        ),  # 15
        ("t,u\n0,1\n-1e400,2\n", r"table\.csv:3, column t: not a finite number"),  # 15
        ("t,u,w\n0,1,x\n-1e400,2,y\n", r"table\.csv:3, column t: not a finite number"),
        (
            "t;u\n0;1,500\n",
            r"table\.csv: a comma in a number is ambiguous; got 1,500; expected 1500 or a decimal point",
        ),  # 6
        ("t;u\n0.5;1,5\n", r"decimal commas and decimal points are mixed; got 1,5 and 0\.5"),  # 6
        ("t;u,v\n0;1,5\n", r"table\.csv:1: cannot tell what separates the columns"),  # 6
        ("v\n1,5\n", r"table\.csv:1: cannot tell what separates the columns; got 1,5"),  # 6
        (
            "t u\n0 1 2\n",
            r"cannot tell what separates the columns; got 0 1 2; expected comma, semicolon or tab .*between spaces",
        ),
        (b"PAR1\x00\x01", r"the Parquet file is damaged or cut short; got .*smaller than the minimum"),  # 37
        (b"PK\x03\x04\x00", r"this is not a text file; got a zip archive"),  # 37
        (b"t,u\n1,\x00\n", r"this is not a text file; got zero bytes in it; .*lost its power leaves them: tr -d"),
        (b"t,u\n1,2\n" + bytes(3_000_000) + b"2,3\n", r"this is not a text file; got zero bytes in it"),
        (bytes(5000), r"no table in the file"),
        ("a" + ",a" * 2000 + "\n1\n", r"too many columns; got 2001; expected at most 1000"),
    ],
)
def test_it_refuses_a_file(write, content, words):
    with pytest.raises(InputError, match=words):
        read_table(write(content))


@pytest.mark.parametrize(
    "cell, words",
    [
        (
            "fast",
            r"table\.csv:3, column u: not a number; got fast; expected a number such as .*; correct or remove the row",
        ),  # 16
        ("1_000", r"table\.csv:3, column u: not a number; got 1_000; .*write plain decimal digits"),  # 16
        ("0x10", r"table\.csv:3, column u: not a number; got 0x10; .*write plain decimal digits"),  # 16
        ("#N/A", r"table\.csv:3, column u: not a number; got #N/A; .*an error value of a spreadsheet"),  # 16
        ("1 000", r"column u: not a number; got 1 000"),
        ("٣", r"column u: not a number"),
        ("1d5", r"column u: not a number; got 1d5"),
        ("True", r"column u: not a number; got True"),
        ("--", r"column u: not a number; got --"),
        ("", r"table\.csv:3, column u: a number is missing; got a blank cell or nan; .*\(1 of 2 are missing\)"),  # 13
        ("NaN", r"table\.csv:3, column u: a number is missing"),  # 14
        ('"1,500"', r"column u: not a number; got 1,500; .*write a decimal point, and no separator of thousands"),
    ],
)
def test_it_refuses_a_cell_where_a_number_is_needed(write, cell, words):
    table = read_table(write(f"t,u\n0,1\n1,{cell}\n"))
    with pytest.raises(InputError, match=words):
        table.numbers("u")
    assert table.numbers("t").tolist() == [0.0, 1.0]


def test_an_error_value_at_the_start_of_a_row_is_no_comment(write):
    table = read_table(write("t,u\n0,1\n#N/A,2\n#DIV/0!,3\n"))
    assert len(table) == 3
    with pytest.raises(InputError, match=r"table\.csv:3, column t: not a number; got #N/A"):
        table.numbers("t")


def test_a_row_under_the_header_that_is_not_clearly_units_is_data(write):
    table = read_table(write("t,u\nfirst,volt\n0,1\n"))
    with pytest.raises(InputError, match=r"table\.csv:2, column t: not a number; got first"):
        table.numbers("t")


def test_it_refuses_what_is_no_file(tmp_path):  # 1
    with pytest.raises(InputError, match=r"nothing\.csv: no such file"):
        read_table(tmp_path / "nothing.csv")
    with pytest.raises(InputError, match=r"cannot read it; got a folder; expected a file"):
        read_table(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes of POSIX")
def test_it_refuses_a_pipe_at_once(tmp_path):  # 1
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(InputError, match="a pipe or a device"):
        read_table(tmp_path / "pipe.csv")


def test_it_refuses_a_file_beyond_the_limit(write):
    with pytest.raises(InputError, match="the file is too large; got more than 10 bytes"):
        read_table(write(PLAIN), max_bytes=10)


def test_check_names_tells_the_nearest(write):
    table = read_table(write("axis,speed,forse\nx,1,2\n"))
    with pytest.raises(InputError, match=r"unknown column; got forse; .*did you mean force\?"):
        table.check_names(["axis", "speed", "force"])
    with pytest.raises(InputError, match=r"a column is missing; got axis, speed, forse; .*; add t"):
        table.check_names(["axis", "speed", "forse", "t"])


@pytest.mark.long
@pytest.mark.parametrize("separator", [",", ";"])
def test_a_million_rows_take_no_longer_than_python_takes_for_them(write, separator):
    """Ten times what `float` takes for each cell, one after the other: not a look at each cell in Python."""
    comma = separator == ";"
    rows = (
        f"{k * 1e-3:.3f}{separator}{k % 7 - 3.25}{separator}1.5".replace(".", "," if comma else ".")
        for k in range(10**6)
    )
    path = write(f"a{separator}b{separator}c\n" + "\n".join(rows))

    def cell_by_cell():
        with path.open(encoding="utf-8") as file:
            next(file)
            return [[float(cell.replace(",", ".")) for cell in line.split(separator)] for line in file]

    assert ratio(cell_by_cell, lambda: read_table(path), enough=10.0) <= 10.0
    table = read_table(path)
    assert table.numbers("a")[-1] == 999.999
    assert table.numbers("b")[:4].tolist() == [-3.25, -2.25, -1.25, -0.25]


def test_the_reader_of_text_refuses_another_format_by_its_name(write):
    with pytest.raises(InputError, match="this is not a text file; got a Parquet file"):  # 37
        list(text_tables(write(b"PAR1\x00\x01"), 10, ReadOptions()))


MEGABYTE = 2**20


@pytest.mark.parametrize(
    "name",
    [
        "w" * MEGABYTE,
        "w_" * (MEGABYTE // 2),
        " (" * (MEGABYTE // 2),
        "1" * MEGABYTE + "w",
        "w1 [rad/s" * (MEGABYTE // 9),
    ],
)
def test_a_very_long_name_of_a_column_is_refused_at_once(tmp_path, name):
    """Taking such a name apart took minutes."""
    path = tmp_path / "log.csv"
    path.write_text(f"t,{name},x\n" + "".join(f"{0.01 * k:g},1,2\n" for k in range(60)))
    words = (
        r"log.csv:1: the name of column 2 is too long; got \d{6,7} characters, .{40}\.\.\.; expected at most 1000; give"
    )
    with pytest.raises(InputError, match=words) as refused:
        read_table(path)
    assert len(str(refused.value)) < 400


def test_a_name_of_a_thousand_characters_is_a_name(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(f"t,{'w' * 1000}\n0,1\n1,2\n")
    assert read_table(path).names == ("t", "w" * 1000)


def test_two_columns_of_one_name_are_told_apart(write):
    table = read_table(write("t_s,speed,speed,speed\n0,1,2,3\n1,4,5,6\n"))
    assert table.names == ("t_s", "speed", "speed~2", "speed~3")
    assert table.numbers("speed~3").tolist() == [3.0, 6.0]
    assert "speed is the name of two columns: the later one is called speed~2" in table.notes


def test_the_index_that_pandas_writes_has_a_name(write):
    table = read_table(write(",t_s,u1_V\n0,0.0,5\n1,0.1,6\n2,0.2,7\n"))
    assert table.names == ("index", "t_s", "u1_V")
    assert table.numbers("u1_V").tolist() == [5.0, 6.0, 7.0]
    with pytest.raises(InputError, match="column 1 has no name"):
        read_table(write(",t_s,u1_V\n3,0.0,5\n1,0.1,6\n"))


def test_numbers_may_be_names_over_a_row_of_units(write):
    table = read_table(write("x-axis,1,2\nsecond,Volt,Ampere\n-1E-1,6,4\n0,5,3\n"))
    assert table.names == ("x-axis", "1", "2")
    assert dict(table.units) == {"x-axis": "second", "1": "Volt", "2": "Ampere"}
    with pytest.raises(InputError, match="a number stands where a name should; got 1"):
        read_table(write("x-axis,1,2\n-1E-1,6,4\n0,5,3\n"))
