"""How large the pages of a Parquet file say they are, read from their headers alone.

A page is unpacked into a buffer of the size that its header declares, whatever the metadata of the file say: so that
is the number to check before anything is read. A header is a struct in Thrift's compact protocol whose fields 2 and 3
are the sizes unpacked and packed (parquet-format, PageHeader). pyarrow 26 shows no page headers: a file of 0.3 MB
whose metadata say 300 bytes takes it 1 GB; here it is refused, for 5 ms in a file of 34 MB.
"""

from __future__ import annotations

import os
from typing import Any, BinaryIO, NamedTuple

HEADER_BYTES, MAX_HEADER_BYTES = 4096, 2**20
MAX_DEPTH = 16
SLACK_BYTES = 100  # old writers left the header of the dictionary out of the size of a column (PARQUET-816)

_STOP, _TRUE, _FALSE, _BYTE, _DOUBLE, _BINARY, _LIST, _SET, _STRUCT = 0, 1, 2, 3, 7, 8, 9, 10, 12
_VARINTS = (4, 5, 6)


class PageHeader(NamedTuple):
    """Sizes [bytes]: of the header itself, of the page unpacked, and as it stands in the file."""

    length: int
    unpacked: int
    packed: int


def declared_bytes(stream: BinaryIO) -> int:
    """What all pages declare to unpack to, or the row groups where they declare more [bytes].

    Raises ValueError for a footer or a header that cannot be right. The footer is parsed here, as pyarrow 26 ends the
    process when it is asked for the places of the columns of some broken files.
    """
    try:
        groups = _footer(stream).get(4, [])
        pages = sum(_column_bytes(stream, column) for group in groups for column in group.get(1, []))
        return max(pages, sum(group.get(2, 0) for group in groups))
    except (IndexError, KeyError, AttributeError, TypeError):  # a field is missing, or of another kind
        raise ValueError("the footer cannot be read") from None


def _footer(stream: BinaryIO) -> dict[int, Any]:
    """FileMetaData: its fields by number."""
    end = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, end - 8))
    length = int.from_bytes(stream.read(4), "little")
    if length > end - 12:
        raise ValueError("the footer is longer than the file")
    stream.seek(end - 8 - length)
    return _struct(stream.read(length), 0, 0)[0]


def _column_bytes(stream: BinaryIO, column: Any) -> int:
    """What the pages of a ColumnChunk declare: its field 3 is ColumnMetaData."""
    described = column[3]
    start = min(place for place in (described[9], described.get(11, 0)) if place > 0)
    return _chunk_bytes(stream, start, start + described[7])


def _chunk_bytes(stream: BinaryIO, place: int, end: int) -> int:
    total = 0
    while place < end:
        header = _header(stream, place)
        if header.unpacked < 0 or header.packed < 0:
            raise ValueError("a page of negative size")
        total += header.unpacked
        place += header.length + header.packed
        if place > end + SLACK_BYTES:
            raise ValueError("a page reaches beyond its column")
    return total


def _header(stream: BinaryIO, place: int) -> PageHeader:
    """The header at a place. Statistics in it can make it long."""
    for size in (HEADER_BYTES, MAX_HEADER_BYTES):
        stream.seek(place)
        content = stream.read(size)
        try:
            return page_header(content)
        except IndexError:
            if len(content) < size:
                break
    raise ValueError("a page header does not end")


def page_header(content: bytes) -> PageHeader:
    """The header at the start of `content`. Raises IndexError when it does not end there, ValueError for nonsense."""
    fields, length = _struct(content, 0, 0)
    if not isinstance(fields.get(2), int) or not isinstance(fields.get(3), int):
        raise ValueError("a page header without sizes")
    return PageHeader(length, fields[2], fields[3])


def _struct(content: bytes, place: int, depth: int) -> tuple[dict[int, Any], int]:
    """The fields of a struct by number, and where it ends."""
    fields: dict[int, Any] = {}
    number = 0
    while True:
        number, kind, place = _field(content, place, number)
        if kind == _STOP:
            return fields, place
        fields[number], place = _value(content, place, kind, depth + 1)


def _field(content: bytes, place: int, before: int) -> tuple[int, int, int]:
    """Number and kind of the next field of a struct, and where its value begins."""
    first = content[place]
    place += 1
    if first == _STOP:
        return before, _STOP, place
    if first >> 4:
        return before + (first >> 4), first & 15, place
    number, place = _varint(content, place)
    return (number >> 1) ^ -(number & 1), first & 15, place


def _varint(content: bytes, place: int) -> tuple[int, int]:
    number = 0
    for shift in range(0, 70, 7):
        byte = content[place]
        place += 1
        number |= (byte & 127) << shift
        if byte < 128:
            return number, place
    raise ValueError("a number in a page header does not end")


def _value(content: bytes, place: int, kind: int, depth: int) -> tuple[Any, int]:
    """The value of a kind, and where it ends; None for what nobody asks for here."""
    if depth > MAX_DEPTH:
        raise ValueError("nested too deep")
    if kind in (_TRUE, _FALSE):
        return None, place
    if kind in _VARINTS:
        number, place = _varint(content, place)
        return (number >> 1) ^ -(number & 1), place
    if kind == _STRUCT:
        return _struct(content, place, depth)
    if kind in (_LIST, _SET):
        return _list(content, place, depth)
    if kind == _BINARY:
        length, place = _varint(content, place)
    elif kind in (_BYTE, _DOUBLE):
        length = 1 if kind == _BYTE else 8
    else:
        raise ValueError("an unknown kind of value")
    if place + length > len(content):
        raise IndexError("beyond the end")
    return None, place + length


def _list(content: bytes, place: int, depth: int) -> tuple[list[Any], int]:
    count, kind = content[place] >> 4, content[place] & 15
    place += 1
    if count == 15:
        count, place = _varint(content, place)
    if kind == _STOP or count > len(content):  # every item takes a byte or more
        raise ValueError("a list that cannot be")
    items = []
    for _ in range(count):
        item, place = _value(content, place, kind if kind not in (_TRUE, _FALSE) else _BYTE, depth + 1)
        items.append(item)
    return items, place
