"""Mutated and random files: only an OmnidynError leaves a reader, and none hangs; the benchmark asks for 2 s too."""

import pytest

from benchmarks.logs import fuzz_readers
from benchmarks.logs.fuzz_readers import FORMATS, READERS, measure

LONG = 1.5  # [s] for a format; bench fuzz_readers takes a minute for each reader


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """A slow machine is no fault."""
    monkeypatch.setenv("OMNIDYN_FUZZ_SLOW", "inf")


def needed():
    for library in ("pyarrow", "h5py", "rosbags", "mcap"):
        pytest.importorskip(library)


def test_every_reader_has_a_share_of_the_minute_of_its_format():
    assert sorted(name for names in FORMATS.values() for name in names) == sorted(READERS)


@pytest.mark.long
@pytest.mark.parametrize("name", list(FORMATS))
def test_whatever_a_file_holds_only_our_errors_leave_a_reader(name):
    needed()
    share = LONG / len(FORMATS[name])
    table = measure(share, FORMATS[name], seed=11)
    assert not table.missed, table.as_text()


@pytest.mark.parametrize("reader", [name for name in READERS if name.startswith("read_log, ") or name == "info"])
@pytest.mark.some(4)
def test_half_a_second_of_it(reader):
    needed()
    table = measure(0.5, [reader], seed=12)
    assert not table.missed, table.as_text()


def test_a_reader_that_hangs_is_ended_and_said(monkeypatch, tmp_path):
    """The watch is a thread of C: a loop that never comes back to Python is ended as well."""
    monkeypatch.setenv("OMNIDYN_FUZZ_HANG", "1")
    table = measure(0.5, [fuzz_readers.HANGS], seed=1)
    assert table.missed
    assert "the process died" in table.as_text()
    assert "Timeout" in table.as_text()
