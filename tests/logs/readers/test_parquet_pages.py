"""Sizes of pages from their headers, held against what pyarrow says, and files that lie about them."""

import io
import subprocess
import sys

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.logs.readers import parquet_pages
from omnidyn.logs.readers.parquet_pages import declared_bytes, page_header
from omnidyn.logs.readers.read_table import read_table

pa = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")

TABLE = {"v": np.random.default_rng(0).normal(size=5000), "word": [f"w{k % 7}" for k in range(5000)]}


footer = parquet_pages._footer


def without_totals(fields):
    return {4: [{1: group[1]} for group in fields[4]]}


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"compression": "zstd", "row_group_size": 300},
        {"use_dictionary": False, "compression": "none", "data_page_size": 1000},
        {"data_page_version": "2.0", "compression": "gzip", "write_page_checksum": True},
        {"use_dictionary": False, "compression": "snappy", "write_statistics": True, "write_page_index": True},
    ],
)
def test_the_pages_add_up_to_what_the_metadata_say(options, monkeypatch):
    """The metadata count the headers of the pages too: some 50 bytes each."""
    sink = io.BytesIO()
    parquet.write_table(pa.table(TABLE), sink, **options)
    metadata = parquet.ParquetFile(sink).metadata
    groups = [metadata.row_group(k) for k in range(metadata.num_row_groups)]
    said = sum(group.total_byte_size for group in groups)
    assert declared_bytes(sink) == said
    monkeypatch.setattr(parquet_pages, "_footer", lambda stream: without_totals(footer(stream)))
    assert 0.85 * said < declared_bytes(sink) <= said


def zigzag(number):
    number, out = 2 * number, bytearray()
    while number >= 128:
        out.append(number & 127 | 128)
        number >>= 7
    return bytes([*out, number])


def test_a_header_made_by_hand():
    inside = bytes([0x1C, 0x15, 0x02, 0x00])  # field 4: a struct with one number
    header = page_header(b"\x15\x00\x15" + zigzag(123_456) + b"\x15" + zigzag(99) + inside + b"\x00rest")
    assert header.unpacked == 123_456
    assert header.packed == 99
    assert header.length == 2 + 4 + 3 + 4 + 1


@pytest.mark.parametrize(
    "content, error",
    [
        (b"", IndexError),
        (b"\x15", IndexError),
        (b"\x00", ValueError),
        (b"\x1c" * 50, ValueError),
        (b"\x1f", ValueError),
    ],
)
def test_a_broken_header(content, error):
    with pytest.raises(error):
        page_header(content)


@pytest.mark.parametrize(
    "which, words",
    [
        ("unpacked", r"liar\.parquet: the file would grow too much; got 2147483647 bytes"),
        ("packed", r"liar\.parquet: the Parquet file is damaged .*; got a page reaches beyond its column"),
    ],
)
def test_a_page_that_claims_gigabytes_is_refused(tmp_path, which, words):
    """The metadata say 40 kB, the header of the page 2 GB: pyarrow would take 2 GB before it looks."""
    path = tmp_path / "liar.parquet"
    parquet.write_table(pa.table({"v": TABLE["v"]}), path, use_dictionary=False, compression="zstd")
    content = path.read_bytes()
    size = zigzag(getattr(page_header(content[4:]), which))
    start = content.index(size, 4)
    # The header grows by what the page loses: all other places stay.
    grown = content[:start] + zigzag(2**31 - 1) + content[start + len(size) :]
    cut = len(grown) - len(content)
    middle = len(grown) // 2
    path.write_bytes(grown[:middle] + grown[middle + cut :])
    with pytest.raises(InputError, match=words):
        read_table(path)


EVERY_BYTE = """
import io, sys
import pyarrow as pa, pyarrow.parquet
from omnidyn.errors import OmnidynError
from omnidyn.logs.readers.read_table import read_table
sink = io.BytesIO()
pyarrow.parquet.write_table(pa.table({"v": [1.0, None, 3.0], "w": ["a", "b", "a"]}), sink, store_schema=False)
content = sink.getvalue()
footer = len(content) - 8 - int.from_bytes(content[-8:-4], "little")
for place in range(footer, len(content)):
    for byte in (content[place] ^ 1, 255):
        with open(sys.argv[1], "wb") as file:
            file.write(content[:place] + bytes([byte]) + content[place + 1 :])
        try:
            read_table(sys.argv[1])
        except OmnidynError:
            pass
print("alive")
"""


def test_no_byte_of_a_footer_ends_the_process(tmp_path):
    """pyarrow ends it where it is asked for a column whose statistics make no sense."""
    arguments = [sys.executable, "-c", EVERY_BYTE, str(tmp_path / "broken.parquet")]
    run = subprocess.run(arguments, capture_output=True, text=True)
    assert run.stdout == "alive\n", run.stderr[-1000:]
