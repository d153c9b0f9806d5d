"""Pieces of a file: a boundary never changes a number, a line, a note or an error; memory is bounded by the piece."""

import hashlib
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from omnidyn.errors import InputError
from omnidyn.logs.readers.read_table import iter_tables, read_table
from omnidyn.logs.table import text_file


def pieces_of(path, rows, **options):
    """Names, columns and lines as `read_table` would have them, put together here, not by the package."""
    pieces = list(iter_tables(path, rows, **options))
    assert all(0 < len(piece) <= rows for piece in pieces)
    columns = {name: [cell for piece in pieces for cell in list(piece.columns[name])] for name in pieces[0].names}
    return pieces, columns, [line for piece in pieces for line in piece.lines.tolist()]


def same_cells(a, b):
    return len(a) == len(b) and all(x == y or (x != x and y != y) for x, y in zip(a, b, strict=True))


def compare(path, rows, **options):
    """Both ways of reading a file: the same table, or the same error."""
    whole = error = None
    try:
        whole = read_table(path, **options)
    except InputError as refused:
        error = str(refused)
    if whole is None:
        with pytest.raises(InputError) as seen:
            list(iter_tables(path, rows, **options))
        assert str(seen.value) == error
        return
    pieces, columns, lines = pieces_of(path, rows, **options)
    assert lines == whole.lines.tolist()
    assert pieces[-1].sha256 == whole.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert pieces[-1].notes == whole.notes
    assert all((p.names, p.units, p.titles) == (whole.names, whole.units, whole.titles) for p in pieces)
    for name in whole.names:
        column = whole.columns[name]
        if isinstance(column, tuple):  # pieces before the first word are numbers
            early = [
                cell for piece in pieces if not isinstance(piece.columns[name], tuple) for cell in piece.columns[name]
            ]
            assert same_cells(early, [float(cell or "nan") for cell in column[: len(early)]])
            assert tuple(columns[name][len(early) :]) == column[len(early) :]
        else:
            assert same_cells(columns[name], column.tolist())


# ---- random tables --------------------------------------------------------------------------------------

SMALL = st.floats(-1e6, 1e6).map(lambda value: repr(round(value, 3)))
NUMBERS = st.one_of(st.floats(allow_nan=False, allow_infinity=False).map(repr), st.integers(-9, 2000).map(str))


@st.composite
def tables(draw):
    """The text of a table, with one fault in some of them."""
    columns = draw(st.integers(1, 4))
    separator = draw(st.sampled_from([",", ";", "\t"]))
    comma = separator != "," and draw(st.booleans())
    rows = draw(st.lists(st.lists(NUMBERS, min_size=columns, max_size=columns), min_size=1, max_size=30))
    if comma:
        grouped = draw(st.integers(0, len(rows)))  # so many rows leave open what a comma means
        rows = [["1,500" if k < grouped else cell.replace(".", ",") for cell in row] for k, row in enumerate(rows)]
    for _ in range(draw(st.integers(0, 4))):
        row, column = draw(st.integers(0, len(rows) - 1)), draw(st.integers(0, columns - 1))
        odd = st.sampled_from(["", "nan", "-nan", f'"{rows[row][column]}"', " 1 ", "word", "inf", "1.5", "2,5", "#N/A"])
        rows[row][column] = draw(odd) if columns > 1 else "7"
    if draw(st.booleans()):  # a column of words
        rows = [[*row[:-1], draw(st.sampled_from(["go", "stop", '"go"', "1"]))] for row in rows]
    if draw(st.booleans()):
        rows = [[f'"{cell}"' if '"' not in cell else cell for cell in row] for row in rows]
    lines = [separator.join(row) for row in rows]
    end = draw(st.sampled_from(["", separator])) if columns > 1 else ""
    lines = [line + end for line in lines]
    if draw(st.booleans()):
        place = draw(st.integers(0, len(lines)))
        lines.insert(
            place, draw(st.sampled_from(["# said by hand", "", "   ", "% so", separator.join("1" * (columns + 2))]))
        )
    head = [separator.join(f"c{k}" for k in range(columns)) + end]
    if draw(st.booleans()):
        head.append(separator.join(["[m/s]"] * columns))
    newline = draw(st.sampled_from(["\n", "\r\n", "\r"]))
    return newline.join(head + lines) + draw(st.sampled_from(["", newline]))


@settings(max_examples=300)
@given(text=tables(), rows=st.integers(1, 40), block=st.integers(1, 50), skip=st.booleans())
@example(text="a;b\n1;1,500\n2;3\n3;0,5", rows=1, block=7, skip=False)
@example(text="a;b\n1;1,500\n2;3\n3;0.5", rows=1, block=7, skip=False)
@example(text="a;b\n1;2\n2;3\n3;1,500", rows=2, block=3, skip=False)
@example(text="a,b\r\n1,2\r\n3,4", rows=1, block=1, skip=False)
@example(text="a,b\n,0.0\nword,0.0", rows=2, block=1, skip=False)
@example(text="a,b\n7,0.0\nword,0.0", rows=2, block=1, skip=False)
def test_a_boundary_changes_nothing(tmp_path_factory, text, rows, block, skip):
    path = tmp_path_factory.mktemp("table") / "table.csv"
    path.write_bytes(text.encode())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(text_file, "BLOCK_BYTES", block)
        patch.setattr(text_file, "START_BYTES", 4)
        compare(path, rows, skip_bad_rows=skip)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "latin-1"])
@pytest.mark.parametrize("block", [1, 2, 3, 64])
def test_a_block_may_end_inside_a_character(tmp_path, monkeypatch, encoding, block):
    monkeypatch.setattr(text_file, "BLOCK_BYTES", block)
    monkeypatch.setattr(text_file, "START_BYTES", 8)
    (tmp_path / "t.csv").write_bytes("t_s,µ [°/s]\r\n0,1\r\n# é\r\n1,2\r\n".encode(encoding))
    table = read_table(tmp_path / "t.csv")
    assert table.names == ("t_s", "µ")
    assert table.numbers("µ").tolist() == [1.0, 2.0]
    assert table.lines.tolist() == [2, 4]


CELLS = st.one_of(
    NUMBERS,
    st.sampled_from(
        [
            "",
            "nan",
            "-NaN",
            "inf",
            "Infinity",
            "1e400",
            "1_0",
            "0x1",
            "1d5",
            "+.5",
            "5.",
            ".",
            "1e",
            "--1",
            "1 2",
            "٣",
            "1,5",
        ]
    ),
    st.text(st.sampled_from("0123456789+-.eE_xnaif \u00a0\u2009\x0b"), max_size=6),
)


@settings(max_examples=400)
@given(
    rows=st.lists(st.tuples(CELLS, CELLS), min_size=1, max_size=4),
    separator=st.sampled_from(",;"),
    end=st.sampled_from(["", ";"]),
)
def test_the_fast_and_the_careful_way_agree(tmp_path_factory, rows, separator, end):
    """A column of words beside them makes the reader look at every cell: the numbers must be the same."""
    rows = [("1", "2"), *rows]
    folder = tmp_path_factory.mktemp("ways")
    plain, worded = folder / "plain.csv", folder / "worded.csv"
    plain.write_text(separator.join("ab") + end + "\n" + "".join(separator.join(row) + end + "\n" for row in rows))
    lines = (separator.join(["word", *row]) + end + "\n" for row in rows)
    worded.write_text(separator.join("wab") + end + "\n" + "".join(lines))
    outcomes = []
    for path in (plain, worded):
        try:
            table = read_table(path)
            outcomes.append([list(table.columns[name]) for name in "ab"])
        except InputError as error:
            outcomes.append(error.what)
    if any(not "".join(row).strip() for row in rows):
        return  # a blank row is no row without the word
    a, b = outcomes
    assert a == b if isinstance(a, str) or isinstance(b, str) else all(map(same_cells, a, b))


# ---- faults far from the start --------------------------------------------------------------------------


@pytest.mark.parametrize(
    "row, words",
    [
        ("7;8;9", r"long\.csv:903: row 900 has another number of cells than the header; got 3: 7;8;9"),
        ('7;"8', r"long\.csv:903: a quote is not closed"),
        ("7;1e999", r"long\.csv:903, column u: not a finite number"),
        ("7;8.5", r"long\.csv:903: decimal commas and decimal points are mixed; got 0,5 and 8\.5"),
    ],
)
@pytest.mark.parametrize("rows", [1, 100, 899, 900, 10**6])
def test_a_late_fault_has_its_line(tmp_path, row, words, rows):
    path = tmp_path / "long.csv"
    path.write_text("t;u\n# a comment\ns;V\n" + "1;0,5\n" * 899 + row + "\n" + "1;2\n" * 99)
    with pytest.raises(InputError, match=words):
        list(iter_tables(path, rows))


def test_tables_come_before_the_fault(tmp_path):
    path = tmp_path / "long.csv"
    path.write_text("t,u\n" + "1,2\n" * 100 + "1,2,3\n")
    pieces = iter_tables(path, 10)
    assert [len(next(pieces)) for _ in range(9)] == [9] + [10] * 8  # the header was in the first


def test_bad_rows_are_counted_over_all_pieces(tmp_path):
    path = tmp_path / "long.csv"
    path.write_text("t,u\n" + ("1,2\n" * 9 + "1\n") * 10)
    last = list(iter_tables(path, 7, skip_bad_rows=True))[-1]
    assert last.notes == ("10 rows were left out for another number of cells (lines 11, 21, 31, 41, 51, ...)",)


@pytest.mark.parametrize("rows", [0, -1])
def test_a_piece_has_rows(tmp_path, rows):
    (tmp_path / "t.csv").write_text("t,u\n1,2\n")
    with pytest.raises(InputError, match="no rows in a piece"):
        list(iter_tables(tmp_path / "t.csv", rows))


# ---- size -----------------------------------------------------------------------------------------------


def test_progress_goes_from_nothing_to_all(tmp_path):
    path = tmp_path / "long.csv"
    path.write_text("t,u\n" + "1,2\n" * 500_000)
    told = []
    list(iter_tables(path, progress=lambda report: told.append((report.done, report.total))))
    size = path.stat().st_size
    assert [total for _, total in told] == [size] * len(told)
    done = [done for done, _ in told]
    assert done == sorted(done)
    assert done[-1] == size


def test_a_file_beyond_max_bytes_is_streamed_but_not_held(tmp_path):  # 36, 40
    path = tmp_path / "long.csv"
    path.write_text("t,u\n" + "1,2\n" * 1000)
    with pytest.raises(InputError, match=r"long\.csv: the file is too large; got more than 1000 bytes; .*iter_tables"):
        read_table(path, max_bytes=1000)
    assert sum(map(len, iter_tables(path, 10))) == 1000


def test_numbers_beyond_max_bytes_are_not_held(tmp_path):  # 40: short cells become 8 bytes each
    path = tmp_path / "long.csv"
    path.write_bytes(b"a,b\n" + b"1,2\n" * 4_000_000)
    with pytest.raises(InputError, match="the file is too large; got more than 20000000 bytes"):
        read_table(path, max_bytes=20_000_000)


def test_a_line_without_end_is_refused(tmp_path):
    path = tmp_path / "noise.csv"
    path.write_bytes(b"1" * 10_000_000)
    with pytest.raises(InputError, match="this is not a table; got a line of more than 4194304 bytes"):
        list(iter_tables(path))


LIMITED = """
import resource, sys
import numpy as np
from omnidyn.logs.readers.read_table import iter_tables
if sys.argv[1].endswith("parquet"):
    import pyarrow.parquet
pages = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (pages + 96 * 2**20,) * 2)
print(sum(len(table) for table in iter_tables(sys.argv[1], 50_000)))
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of Linux")
@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_memory_is_bounded_by_the_piece(tmp_path, ending):  # 40
    """A file whose numbers take 104 MB, twice over what the process may take beyond its start."""
    rows, values = 1_000_000, np.random.default_rng(0).normal(size=(1000, 13)).round(4)
    path = tmp_path / f"long.{ending}"
    if ending == "csv":
        block = "".join(",".join(map(repr, row)) + "\n" for row in values.tolist())
        path.write_text(",".join(f"c{k}" for k in range(13)) + "\n" + block * (rows // 1000))
    else:
        pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
        columns = {f"c{k}": np.tile(values[:, k], rows // 1000) for k in range(13)}
        parquet.write_table(pa.table(columns), path, use_dictionary=False)
    run = subprocess.run([sys.executable, "-c", LIMITED, str(path)], capture_output=True, text=True)
    assert run.stdout == f"{rows}\n", run.stderr[-2000:]


# ---- much of nothing ------------------------------------------------------------------------------------

ROWS_OF_HEAD = "".join(f"{k / 10},{k}\n" for k in range(200))
NOTHING = {"blank": "\n", "spaces": "   \n", "comments": "# a logger says so and so\n", "both": "#\n\n% x\n"}


@pytest.mark.parametrize("nothing", NOTHING.values(), ids=NOTHING)
@pytest.mark.parametrize("place", ["first", "under the header", "among the rows", "last"])
@pytest.mark.some(5)
def test_megabytes_of_nothing_are_passed_over(tmp_path, nothing, place):
    size = 5 * 2**20 // len(nothing)
    head, rows = "t_s,x_m\n", ROWS_OF_HEAD
    half = rows.index("10.0,100\n")
    some, more = rows[:half], rows[half:]
    text = {
        "first": nothing * size + head + rows,
        "under the header": head + nothing * size + rows,
        "among the rows": head + some + nothing * size + more,
        "last": head + rows + nothing * size,
    }[place]
    path = tmp_path / "log.csv"
    path.write_text(text)
    table = read_table(path)
    assert len(table) == 200
    assert table.numbers("x_m").tolist() == list(range(200))
    above = text[: text.index("\n0.0,0\n")].count("\n") + 2
    assert table.lines[0] == above


def test_names_in_the_last_of_many_comments_are_found(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("# so and so\n" * 300_000 + "# t_s,x_m\n# s,m\n" + ROWS_OF_HEAD)
    table = read_table(path)
    assert table.names == ("t_s", "x_m")
    assert table.units == {"t_s": "s", "x_m": "m"}
    assert len(table) == 200
