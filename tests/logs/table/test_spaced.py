"""Tables between runs of spaces or tabs: read where nothing else separates; text with spaces stays one column."""

import io

import numpy as np
import pytest

from omnidyn.cli.identify_logs import STEADY_TABLE, LogFiles, table_kind
from omnidyn.errors import InputError
from omnidyn.logs.readers.read_table import iter_tables, read_table
from omnidyn.logs.readers.spaced_text import NOTE, cells, is_spaced, tabbed

VALUES = {"t": [0.0, 0.1, 0.2], "w1": [1.0, -2.5, 3e-3], "u": [0.0, 6.0, -6.0]}


@pytest.fixture
def write(write):
    return lambda content, name="table.txt": write(content, name)


def numbers(table):
    return {name: table.columns[name].tolist() for name in table.names}


@pytest.mark.parametrize(
    "content",
    [
        "t w1 u\n0 1 0\n0.1 -2.5 6\n0.2 3e-3 -6\n",
        "  t      w1    u\n  0.0   1.0   0\n  0.1  -2.5   6\n  0.2   3e-3 -6\n",  # aligned, leading blanks
        "t w1 u   \n0 1 0 \n0.1 -2.5 6\t\n0.2 3e-3 -6\n",  # blanks at the end
        "t\tw1 u\n0 \t1   0\n0.1\t-2.5 6\n0.2 3e-3\t-6\n",  # tabs and blanks
        "t w1 u\r\n0 1 0\r\n0.1 -2.5 6\r\n0.2 3e-3 -6\r\n",
        "# a log\nt w1 u\n# of mine\n0 1 0\n\n0.1 -2.5 6\n0.2 3e-3 -6\n",
        "# t w1 u\n0 1 0\n0.1 -2.5 6\n0.2 3e-3 -6\n",  # numpy.savetxt
        "t w1 u\n0 1 0\n0,1 -2,5 6\n0,2 3e-3 -6\n",  # decimal commas
        '"t" "w1" u\n0 1 0\n0.1 -2.5 6\n0.2 3e-3 -6\n',
    ],
)
def test_it_is_read_and_said(write, content):
    table = read_table(write(content))
    assert numbers(table) == VALUES
    assert NOTE in table.notes


def test_quoted_names_and_words_keep_their_spaces(write):
    table = read_table(write('"the time" "wheel 1" state\n0 1 "all well"\n0.1 2 off\n'))
    assert table.names == ("the time", "wheel 1", "state")
    assert table.text("state") == ("all well", "off")


def test_units_in_a_row_or_in_brackets(write):
    row = read_table(write("t w1\ns rad/s\n0 1\n0.1 2\n0.2 3\n0.3 3\n"))
    behind = read_table(write("t [s]   w1 (rad/s)\n0 1\n0.1 2\n0.2 3\n0.3 3\n", "b.txt"))
    bracketed = read_table(write("t w1\n[s] [rad/s]\n0 1\n0.1 2\n0.2 3\n0.3 3\n", "c.txt"))
    for table in (row, behind, bracketed):
        assert table.names == ("t", "w1")
        assert dict(table.units) == {"t": "s", "w1": "rad/s"}
        assert len(table) == 4


def test_what_numpy_writes_comes_back_bitwise(write):
    """An outside writer: numpy.savetxt with its own separator and header."""
    values, text = np.random.default_rng(0).normal(size=(300, 4)), io.StringIO()
    np.savetxt(text, values, header="t a b c", fmt="%.17g")
    path = write(text.getvalue())
    table = read_table(path)
    assert np.array_equal(np.stack([table.columns[name] for name in ("t", "a", "b", "c")], axis=1), values)
    pieces = list(iter_tables(path, rows=7))
    assert np.array_equal(np.concatenate([piece.columns["b"] for piece in pieces]), values[:, 2])
    assert NOTE in pieces[-1].notes


def test_no_header(write):
    table = read_table(write(" 0 1 2\n 1 2 3\n"), header=False)
    assert numbers(table) == {"c1": [0.0, 1.0], "c2": [1.0, 2.0], "c3": [2.0, 3.0]}
    with pytest.raises(InputError, match=r"the table has no header: its first row is numbers.*`no_header`"):
        read_table(write(" 0 1 2\n 1 2 3\n"))


def test_a_ragged_row_is_refused_or_left_out(write):
    content = "t w\n0 1\n1 2\n2 3 4\n3 4\n"
    with pytest.raises(InputError, match=r"table\.txt:4: row 3 has another number of cells.*; expected 2 cells"):
        read_table(write(content))
    table = read_table(write(content), skip_bad_rows=True)
    assert table.columns["t"].tolist() == [0.0, 1.0, 3.0]


@pytest.mark.parametrize(
    "content, names",
    [
        ("speed\n1\n2\n", ("speed",)),
        ("wheel speed\n1\n2\n", ("wheel speed",)),  # one column whose name has a space
        ("the note\nall well\nvery bad\n", None),  # one column of words: refused, as before
        ("date time\n2024-01-01 12:00:00\n2024-01-01 12:00:01\n", None),  # one date, not two columns
        ("t,wheel speed\n0,1\n1,2\n", ("t", "wheel speed")),
        ("t\twheel speed\n0\t1\n1\t2\n", ("t", "wheel speed")),
        ("t\tv\tw\n0\t\t1\n1\t\t2\n", ("t", "v", "w")),  # blank cells between tabs
        ("t;state\n0;all well\n1;a b\n", ("t", "state")),
    ],
)
def test_other_tables_stay_what_they_are(write, content, names):
    path = write(content)
    if names is None:
        with pytest.raises(InputError, match="cannot tell what separates the columns"):
            read_table(path)
        return
    table = read_table(path)
    assert table.names == names
    assert NOTE not in table.notes


def test_blank_cells_between_tabs_are_never_closed_up(write):
    """A row too short among rows with blank cells: refused, not shifted."""
    content = "t\tv\tw\n" + "0\t\t1\n" * 5 + "1\t2\n" + "0\t1\t1\n" * 5
    with pytest.raises(InputError, match="row 6 has another number of cells"):
        read_table(write(content))


def test_a_steady_table_may_be_spaced(write):
    def kind(content):
        path = str(write(content))
        return table_kind(LogFiles.of([path], [path]).names)

    assert kind("axis speed force\nx 0.3 2.4\nx -0.3 -2.4\n") == STEADY_TABLE
    assert not kind("t_s vx_m_s\n0 1\n")


def test_parts():
    assert cells(' a\t"b c"  d [m/s] ') == ["a", '"b c"', "d [m/s]"]
    assert tabbed("#  t   x") == "# t\tx"
    assert tabbed('0 "1') == '0\t"1'
    assert not is_spaced([])
    assert not is_spaced(["t\\t\\tw", "0\\t1\\t2", "0\\t1\\t2"])  # a column without a name, not tabs to align by
    assert not is_spaced(["", "# only this"])
