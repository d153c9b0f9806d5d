"""What stands above the names of the columns: settings of an oscilloscope, the greeting of a board."""

import pytest

from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.table.preamble import preamble

ROWS = "-0.1,6,4\n-0.09,6,3.5\n-0.08,5,3\n-0.07,5,2.5\n"


@pytest.mark.parametrize(
    ("above", "names"),
    [
        ("Model,TBS1052B\nFirmware,1.2\nSample Interval,0.01\n\n", "TIME,CH1,CH2\n"),
        ("Kiwi v1.2 ready\ncalibrating...\n", "t_s,u,i\n"),
        ("Device: scope; serial 7\n", "TIME,CH1,CH2\n(s),(V),(A)\n"),
    ],
)
def test_what_an_instrument_says_of_itself_is_left_out(write, above, names):
    table = read_table(write(above + names + ROWS))
    assert table.numbers(table.names[0]).tolist() == [-0.1, -0.09, -0.08, -0.07]
    assert table.numbers(table.names[2]).tolist() == [4.0, 3.5, 3.0, 2.5]
    assert "what stands above it was left out" in table.notes[0]


@pytest.mark.parametrize(
    "texts",
    [
        ["t,u,w", "0,1,2", "1,1,2", "2,1,2"],
        ["t,u,w", "0,1", "1,1", "2,1"],  # a header too long
        ["t,u,w", "0,1,2", "hello", "t,u,w", "1,1,2", "2,1,2", "3,1,2"],  # a restart soon after the start
        ["0,1,2", "1,1,2", "2,1,2"],
        ["Model,X", "TIME,CH1", "0,1", "1,2", "2,3"],  # as many cells: which is the header cannot be told
        [],
    ],
)
def test_a_plain_header_has_nothing_above_it(texts):
    assert preamble(texts) == 0
