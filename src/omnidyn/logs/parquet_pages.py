"""How large the pages of a Parquet file say they are, read from their headers alone.

A page is unpacked into a buffer of the size that its header declares, whatever the metadata of the file say: so that is
the number to check before anything is read. A header is a struct in Thrift's compact protocol whose fields 2 and 3 are
the sizes unpacked and packed (parquet-format, PageHeader).
"""

from __future__ import annotations

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


def declared_bytes(stream: BinaryIO, metadata: Any) -> int:
    """The sum of what all pages declare to unpack to [bytes]. Raises ValueError for a header that cannot be right."""
    total = 0
    for k in range(metadata.num_row_groups):
        group = metadata.row_group(k)
        for j in range(group.num_columns):
            column = group.column(j)
            starts = [column.data_page_offset, column.dictionary_page_offset]
            start = min(offset for offset in starts if offset)
            total += _chunk_bytes(stream, start, start + column.total_compressed_size)
    return total


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
    sizes: dict[int, int] = {}
    place = field = 0
    while True:
        field, kind, place = _field(content, place, field)
        if kind == _STOP:
            break
        if field in (2, 3) and kind in _VARINTS:
            number, place = _varint(content, place)
            sizes[field] = (number >> 1) ^ -(number & 1)
        else:
            place = _skip(content, place, kind, 0)
    if sizes.keys() != {2, 3}:
        raise ValueError("a page header without sizes")
    return PageHeader(place, sizes[2], sizes[3])


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


def _skip(content: bytes, place: int, kind: int, depth: int) -> int:
    """Where the value of a kind ends."""
    if depth > MAX_DEPTH:
        raise ValueError("a page header is nested too deep")
    if kind in (_TRUE, _FALSE):
        return place
    if kind == _BYTE:
        return place + 1
    if kind in _VARINTS:
        return _varint(content, place)[1]
    if kind == _DOUBLE:
        return place + 8
    if kind == _BINARY:
        length, place = _varint(content, place)
        return place + length
    if kind in (_LIST, _SET):
        count, item = content[place] >> 4, content[place] & 15
        place += 1
        if count == 15:
            count, place = _varint(content, place)
        for _ in range(count):
            place = _skip(content, place, item if item not in (_TRUE, _FALSE) else _BYTE, depth + 1)
            if place > len(content):
                raise IndexError("beyond the end")
        return place
    if kind == _STRUCT:
        field = 0
        while True:
            field, inner, place = _field(content, place, field)
            if inner == _STOP:
                return place
            place = _skip(content, place, inner, depth + 1)
    raise ValueError("an unknown kind of value in a page header")
