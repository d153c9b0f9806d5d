"""A text file that is still being written: whole rows only, whatever else it holds."""

import numpy as np
import pytest

import omnidyn
from omnidyn.logs.growing import FIRST_ROWS, GrowingTable
from omnidyn.logs.read_log import LogOptions

HEAD = "t_s,u1_V,u2_V,u3_V,x_m,y_m,heading_rad\n"


def row(k, heading=0.0):
    return f"{0.01 * k:.2f},1.0,-1.0,{0.1 * (k % 7):.1f},{0.001 * k:.4f},0.0,{heading:.4f}\n"


def joined(runs):
    return np.concatenate([run.t for run in runs])


@pytest.fixture
def table(axebot):
    return GrowingTable("log.csv", axebot)


def test_rows_come_once_whole_however_they_are_cut(table):
    text = HEAD + "".join(map(row, range(300)))
    runs = [run for first in range(0, len(text), 97) for run in table.feed(text[first : first + 97])] + table.end()
    assert joined(runs).tolist() == pytest.approx((0.01 * np.arange(300)).tolist())
    assert runs[-1].voltage[-1].tolist() == [1.0, -1.0, pytest.approx(0.5)]


def test_half_lines_headers_and_words_are_left_out_and_counted(table):
    rows = [*map(row, range(150))]
    rows[120] = "1.20,1.0,-1\n"
    rows[130] = HEAD
    rows[140] = "Guru meditation\n"
    runs = table.feed(HEAD + "".join(rows)) + table.feed("1.60,1.0,")
    assert len(joined(runs)) == 147
    assert table.bad_rows == 2
    assert table.end() == []


def test_what_stands_above_the_header_belongs_to_all_rows(table):
    rows = [*map(row, range(300))]
    for above in ("# made by a logger\n", "My robot\n\n"):
        table.begin_anew()
        runs = table.feed(above + HEAD + "".join(rows[:150])) + table.feed("".join(rows[150:]))
        assert len(joined(runs)) == 300
    assert table.bad_rows == 0


def test_rows_without_numbers_binary_ones_and_one_that_does_not_end_are_survived(table):
    rows = [*map(row, range(300))]
    runs = table.feed("\0\n" + HEAD + "".join(rows[:150]))  # a packet of somebody else
    runs += table.feed("".join(f"{0.01 * k:.2f}{',nan' * 6}\n" for k in range(150, 170)))  # a sensor hub is out
    runs += table.feed("".join(rows[170:180]) + "\0" * 50 + "\n" + "".join(rows[180:200]))  # power was lost
    runs += table.feed("1," * (1 << 20)) + table.feed("1\n" + rows[200])
    runs += table.feed(rows[203] + rows[202] + rows[201])  # times in disorder
    assert joined(runs)[-4:] == pytest.approx([2.0, 2.01, 2.02, 2.03])
    assert len(joined(runs)) == 184
    assert table.bad_rows == 23


@pytest.mark.parametrize("block", [1, 2, 7, 50, 250])
def test_two_rows_that_are_exchanged_in_a_later_block_cost_no_other_row(table, block):
    """Sorted where both are in one block; else the later one is left out, and counted."""
    rows = [*map(row, range(400))]
    rows[230], rows[231] = rows[231], rows[230]
    runs = table.feed(HEAD + "".join(rows[:150]))
    for first in range(150, 400, block):
        runs += table.feed("".join(rows[first : first + block]))
    kept = np.round(100.0 * joined(runs)).astype(int).tolist()
    one_block = (230 - 150) // block == (231 - 150) // block
    assert kept == [k for k in range(400) if k != 230 or one_block]
    assert table.bad_rows == (0 if one_block else 1)
    assert joined(runs)[230:232] == pytest.approx([2.30 if one_block else 2.31, 2.31 if one_block else 2.32])
    live = omnidyn.Live(table.robot)
    for run in runs:
        live.add(run)
    assert live._rows.restarts == 0


def test_a_clock_that_begins_anew_begins_a_run_of_its_own(table):
    runs = table.feed(HEAD + "".join(map(row, range(150))))
    live = omnidyn.Live(table.robot)
    for run in [*runs, *table.feed("".join(map(row, range(120))))]:
        live.add(run)
    assert live._rows.total == 270
    assert live._rows.last > 2.6


def test_headings_go_on_over_whole_turns(table):
    angle = 0.05 * np.arange(300)
    wrapped = (angle + np.pi) % (2.0 * np.pi) - np.pi
    rows = [row(k, wrapped[k]) for k in range(300)]
    runs = table.feed(HEAD + "".join(rows[:150])) + [run for text in rows[150:] for run in table.feed(text)]
    assert np.concatenate([run.pose[:, 2] for run in runs]) == pytest.approx(angle, abs=1e-3)


def test_what_is_no_table_is_refused(table):
    with pytest.raises(omnidyn.OmnidynError, match=r"log\.csv"):
        table.feed("".join(f"hello {k}\n" for k in range(FIRST_ROWS + 5)))
    with pytest.raises(omnidyn.OmnidynError, match=r"a line does not end; got .*; expected rows of text"):
        GrowingTable("pipe").feed("1" * (2 << 20))


@pytest.mark.parametrize("rows", [1, 7, 40])
@pytest.mark.parametrize(
    ("reading", "resets", "slack"),
    [
        (lambda count, k: (count + 32768) % 65536 - 32768, 0, 1e-6),
        (lambda count, k: count - 25_357 * (k > 205), 1, 30.0),
    ],
    ids=["two bytes", "set to zero"],
)
@pytest.mark.some(2)
def test_counters_go_on_from_block_to_block(axebot, reading, resets, slack, rows):
    """Wheels at 40 rad/s and more: the angle that was turned, however few rows come at once."""
    count = np.floor(np.outer(np.arange(400) ** 1.05, [200.0, 260.0, -230.0])).astype(int)
    head = "t_s,u1_V,u2_V,u3_V,a1,a2,a3\n"
    lines = [
        f"{0.01 * k:.2f},1,2,{0.1 * (k % 7):.1f}," + ",".join(str(reading(c, k)) for c in counts) + "\n"
        for k, counts in enumerate(count.tolist())
    ]
    table = GrowingTable("log.csv", axebot, LogOptions(assume={"a": "ticks/4096"}))
    runs = table.feed(head + "".join(lines[: FIRST_ROWS + 1]))
    for first in range(FIRST_ROWS + 1, len(lines), rows):
        runs += table.feed("".join(lines[first : first + rows]))
    turned = np.concatenate([run.wheel_angle for run in runs]) * 4096.0 / (2.0 * np.pi)
    kept = np.round(100.0 * joined(runs)).astype(int)  # beside a counter that was set, rows may be left out
    assert len(kept) > 390
    assert np.abs(turned - turned[0] - (count[kept] - count[0])).max() < slack
    assert table.resets == resets
