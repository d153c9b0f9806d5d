"""The lines of a text file, block by block: any end of line, UTF-8, UTF-16 or Latin-1, hashed on the way.

Memory is bounded by the block, never by the file. A line is UTF-8, or Latin-1 where it cannot be UTF-8.
"""

from __future__ import annotations

import codecs
import hashlib
import os
from collections.abc import Iterator
from typing import NamedTuple

from omnidyn.errors import InputError
from omnidyn.files import empty, file_format, growth, open_regular, text_format, too_large
from omnidyn.progress import Progress, Report, silent
from omnidyn.statement import WARNING, Statement

BLOCK_BYTES = 2**20
SHOWN_BYTES = 8  # of a file that is no text
START_BYTES = 256  # enough to tell a format and an encoding
MAX_LINE_BYTES = 4 * 2**20
MOST_CONTROLS = 0.01  # of the bytes of a file that is damaged text
MOST_ODD = 0.3  # of the bytes of a text in an encoding of its own; three in five of mere noise are odd
_NO_CONTROLS = bytes([0, 9, 10, 12, 13, *range(32, 127), *range(128, 256)])  # zero is judged by itself
TOO_LARGE_REMEDY = "cut it, allow more with `max_bytes`, or read it in pieces with iter_tables"
FILE_CUT_SHORT = "file_cut_short"


def cut_short(text: str) -> Statement:
    """What a reader notes of a file that ends too early, in words."""
    return Statement(FILE_CUT_SHORT, WARNING, numbers={"text": text})


class TextBlock(NamedTuple):
    """Lines of a file, without their ends; `first` is the number of the first one, counted from 1."""

    first: int
    lines: list[str]


class TextFile:
    """A text file, read once, in order, by `blocks`. Afterwards `sha256` and `notes` are complete.

    progress: hears after every block how many bytes are done, of how many. max_bytes: refuse a longer file.
    Raises InputError when the file is missing, no file, empty, too large or not text.
    """

    def __init__(self, path: str | os.PathLike, progress: Progress = silent, max_bytes: int | None = None):
        self.path, self.source = path, str(path)
        self.notes: list[Statement | str] = []
        self._progress, self._max_bytes, self._hash = progress, max_bytes, hashlib.sha256()
        self._latin_line = 0
        self._start = b""  # what the file begins with
        self.last = 0  # number of the last line, once it was given out
        self.ends_open = False  # whether that one lacks its line end

    @property
    def sha256(self) -> str:
        """Hexadecimal SHA-256 of what was read so far."""
        return self._hash.hexdigest()

    def blocks(self, rows: int) -> Iterator[TextBlock]:
        """All lines, at most `rows` of them at once."""
        first, pending = 1, []
        self.ends_open = False
        for block in self._whole_lines():
            pending += self._decoded(block, first + len(pending)).split("\n")
            while len(pending) > rows:
                yield TextBlock(first, pending[:rows])
                first, pending = first + rows, pending[rows:]
        if pending:
            self.last = first + len(pending) - 1
            yield TextBlock(first, pending)

    def _whole_lines(self) -> Iterator[bytes]:
        """Blocks that end where a line ends, the last line end of each cut off; every line end is \n."""
        rest = b""
        for block in self._utf8(self._blocks()):
            rest += block
            if b"\r" in rest:
                half = b"\r" * rest.endswith(b"\r")  # \r\n may be cut by the end of a block
                rest = rest.removesuffix(half).replace(b"\r\n", b"\n").replace(b"\r", b"\n") + half
            end = rest.rfind(b"\n")
            if end >= 0:
                yield rest[:end]
                rest = rest[end + 1 :]
            if len(rest) > MAX_LINE_BYTES:
                raise InputError(
                    "this is not a table",
                    got=f"a line of more than {MAX_LINE_BYTES} bytes",
                    expected="lines of cells",
                    where=self.source,
                )
        if rest.endswith(b"\r"):
            yield rest[:-1]
        elif rest:
            self.ends_open = True
            yield rest

    def _blocks(self) -> Iterator[bytes]:
        with open_regular(self.path) as stream:
            total = os.fstat(stream.fileno()).st_size
            read_bytes = 0
            if self._max_bytes is not None and total > self._max_bytes:
                raise too_large(self.path, self._max_bytes, TOO_LARGE_REMEDY)
            while block := stream.read(
                min(total - read_bytes, BLOCK_BYTES if read_bytes else max(BLOCK_BYTES, START_BYTES))
            ):
                if not read_bytes:
                    kind = file_format(block)
                    problem = "this is not a text file" if kind else "this is not a table"
                    kind = kind or text_format(block)
                    if kind is not None:
                        raise InputError(
                            problem,
                            got=kind.words,
                            expected="text with a row for each moment",
                            remedy=kind.remedy,
                            where=self.source,
                        )
                    self._start = block[:SHOWN_BYTES]
                self._hash.update(block)
                read_bytes += len(block)
                yield block
                self._progress(Report("reading", read_bytes, total))
            self.notes += growth(stream, total)
        if not read_bytes:
            raise empty(self.source)

    def _utf8(self, blocks: Iterator[bytes]) -> Iterator[bytes]:
        """The same text without a byte order mark, UTF-16 turned into UTF-8.

        Zero bytes at the end are left out; raises InputError for others.
        """
        decoder, zeros = None, False
        for k, block in enumerate(blocks):
            if k == 0:
                block, encoding = _begin(block)
                if encoding:
                    self.notes.append(f"the encoding is {encoding}")
                    decoder = codecs.getincrementaldecoder(encoding)() if encoding.startswith("UTF-16") else None
            if decoder is not None:
                block = self._from_utf16(decoder, block)
            text = block.rstrip(b"\0")
            if (b"\0" in text and _is_binary(text)) or (k == 0 and decoder is None and _is_noise(text)):
                begins = f" (it begins with {self._start.hex(' ')})"
                raise InputError(
                    "this is not a text file",
                    got=f"bytes that are no text{begins}",
                    expected="text with a row for each moment, such as CSV, or Parquet",
                    remedy="give the file that the logger wrote, or export it as CSV",
                    where=self.source,
                )
            if b"\0" in text or (zeros and text):
                raise InputError(
                    "this is not a text file",
                    got="zero bytes in it",
                    expected="text",
                    remedy="a recorder that lost its power leaves them: tr -d '\\000' < LOG > NEW takes them out",
                    where=self.source,
                )
            if len(text) < len(block) and not zeros:
                zeros = True
                self.notes.append(
                    cut_short("zero bytes at the end, as a recorder leaves that lost its power, were left out")
                )
            if text:
                yield text
        if decoder is not None:
            self._from_utf16(decoder, b"", final=True)

    def _from_utf16(self, decoder: codecs.IncrementalDecoder, block: bytes, final: bool = False) -> bytes:
        try:
            return decoder.decode(block, final).encode()
        except UnicodeError:
            raise InputError(
                "this is not a text file",
                got="no valid UTF-16 after its byte order mark",
                expected="text",
                remedy="save it as UTF-8",
                where=self.source,
            ) from None

    def _decoded(self, block: bytes, first: int) -> str:
        try:
            return block.decode()
        except UnicodeDecodeError:
            return "\n".join(self._line(line, first + k) for k, line in enumerate(block.split(b"\n")))

    def _line(self, line: bytes, number: int) -> str:
        try:
            return line.decode()
        except UnicodeDecodeError:
            if not self._latin_line:
                self._latin_line = number
                self.notes.append(f"line {number} is not UTF-8: read as Latin-1")
            return line.decode("latin-1")


def _is_binary(block: bytes) -> bool:
    """Whether a part of a file with zero bytes holds much else that stands in no text: other control characters."""
    controls = block[:BLOCK_BYTES].translate(None, _NO_CONTROLS)
    return len(controls) > MOST_CONTROLS * len(block[:BLOCK_BYTES])


def _is_noise(block: bytes) -> bool:
    """Whether a block without zero bytes is no text in any encoding: control characters, and much that is not UTF-8.

    Text in an encoding of its own (Shift JIS, GBK) may hold as many bytes that are not UTF-8, and has no controls.
    """
    controls = len(block.translate(None, _NO_CONTROLS))
    if not controls:
        return False
    try:
        codecs.getincrementaldecoder("utf-8")().decode(block)  # the block may end within a character
    except UnicodeDecodeError:
        high = len(block) - len(block.translate(None, bytes(range(128, 256))))
        return controls + high > MOST_ODD * len(block)
    return controls > MOST_ODD * len(block)


def _begin(block: bytes) -> tuple[bytes, str]:
    """The first block without its byte order mark, and the encoding where it is not plain UTF-8."""
    if block.startswith(codecs.BOM_UTF8):
        return block[len(codecs.BOM_UTF8) :], "UTF-8 with a byte order mark"
    if block.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return block, "UTF-16"
    start = block[:64]
    if len(start) > 7 and not any(start[1::2]) and all(start[::2]):
        return block, "UTF-16-LE"
    if len(start) > 7 and not any(start[::2]) and all(start[1::2]):
        return block, "UTF-16-BE"
    return block, ""
