"""Reading and writing files so that a bad one never hurts: bounded reads, atomic writes."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import math
import os
import re
import shlex
import stat
import tempfile
import time
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from omnidyn.errors import InputError

MAX_TEXT_BYTES = 64 * 2**20
STALE_TEMPORARY_S = 3600.0
TEMPORARY_PREFIX = ".tmp-omnidyn-"
PIECE_BYTES = 2**20

MAX_TOML_BYTES = 2**20
MAX_KEY_PARTS = 16
_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_DEEP_KEY = re.compile(rf"(?:^|[{{,\[])[ \t]*+{_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MAX_KEY_PARTS}}}", re.MULTILINE)

CSV_REMEDY = "export it as CSV or Parquet"
LOG_REMEDY = "give it to a command that reads logs, or save it as CSV"
NUMPY_REMEDY = "save it with numpy.savetxt(NAME, array, delimiter=',', header='t_s,...')"


class Format(NamedTuple):
    """A format of files that is no text: its name, and what to do about such a file."""

    name: str
    words: str
    remedy: str = CSV_REMEDY


_ROAD_RUNNER = Format("road-runner", "a log of Road Runner", "open it in AdvantageScope and export it as WPILOG or CSV")
# Told by their first bytes; the first that fits counts.
_MAGIC = {
    b"PAR1": Format("parquet", "a Parquet file", LOG_REMEDY),
    b"PARE": Format("parquet-encrypted", "an encrypted Parquet file", "decrypt it first"),
    b"\x93NUMPY": Format("npy", "a NumPy .npy file", NUMPY_REMEDY),
    b"\x89MCAP0\r\n": Format("mcap", "an MCAP recording", LOG_REMEDY),
    b"SQLite format 3\x00": Format("sqlite", "an SQLite database (a ROS 2 .db3 bag)", LOG_REMEDY),
    b"\x89HDF\r\n\x1a\n": Format("hdf5", "an HDF5 file (also MATLAB v7.3)", LOG_REMEDY),
    b"MATLAB 5.0 MAT-file": Format("mat", "a MATLAB .mat file", LOG_REMEDY),
    b"MATLAB 7.3 MAT-file": Format("mat", "a MATLAB .mat file (7.3)", LOG_REMEDY),
    b"#ROSBAG V": Format("bag", "a ROS 1 bag", LOG_REMEDY),
    b"WPILOG": Format("wpilog", "a WPILib data log", LOG_REMEDY),
    b"\x1f\x8b": Format("gzip", "a gzip archive", "unpack it first: gunzip FILE"),
    b"BZh": Format("bzip2", "a bzip2 archive", "unpack it first: bunzip2 FILE"),
    b"\xfd7zXZ\x00": Format("xz", "an xz archive", "unpack it first: unxz FILE"),
    b"\x28\xb5\x2f\xfd": Format("zstd", "a Zstandard archive", "unpack it first: unzstd FILE"),
    b"7z\xbc\xaf\x27\x1c": Format("7z", "a 7z archive", "unpack it first"),
    b"Rar!\x1a\x07": Format("rar", "a RAR archive", "unpack it first"),
    b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1": Format("ole", "an old Excel (.xls) or Office file"),
    b"ARROW1": Format("arrow", "an Arrow (Feather) file", "save it as Parquet"),
    b"RR\x00\x00": _ROAD_RUNNER,
    b"RR\x00\x01": _ROAD_RUNNER,
    b"ULog\x01\x12\x35": Format("ulog", "a PX4 ULog file", "export it with ulog2csv"),
    b"%PDF-": Format("pdf", "a PDF file"),
    b"\x89PNG\r\n\x1a\n": Format("png", "a PNG picture"),
    b"\x7fELF": Format("elf", "a program"),
}
# A zip archive is what the first file in it says.
_ZIPPED = {
    b"[Content_Types].xml": Format("xlsx", "an Excel workbook (.xlsx)", "save the sheet as CSV"),
    b"_rels/": Format("xlsx", "an Excel workbook (.xlsx)", "save the sheet as CSV"),
    b"xl/": Format("xlsx", "an Excel workbook (.xlsx)", "save the sheet as CSV"),
    b"mimetype": Format("ods", "an OpenDocument file (.ods)", "save the sheet as CSV"),
}
_TEXT_FORMATS = {
    re.compile(rb"\s*(?:\{\s*\"|\[\s*[\[{])"): Format("json", "a JSON file"),
    re.compile(rb"\s*<(?:\?xml|!doctype|html)", re.IGNORECASE): Format("xml", "an XML or HTML page"),
}
_ZIP = Format("zip", "a zip archive", "unpack it first")
_NPZ = Format("npz", "a zip archive of NumPy arrays (.npz)", NUMPY_REMEDY)
_PICKLE = Format("pickle", "a Python pickle", "it is never opened, as it could run any program: export it as CSV")
# Protocols 2 to 5 begin with their number; 0 and 1 with the opcode of what they hold.
_PICKLE_START = re.compile(
    rb"\x80[\x02-\x05]|\((?:lp|dp)\d+\n|c[A-Za-z_][\w.]*\n\w+\n[pq(]|\(I-?\d+\n|[VF][^\n]*\np0\n|[\]}]q\x00|\(K[\x00-\x08]"
)


def file_format(start: bytes) -> Format | None:
    """The format of a file that begins with `start` (64 bytes or more of it); None where it may be text."""
    for magic, kind in _MAGIC.items():
        if start.startswith(magic):
            return kind
    if start.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        inside = start[30:90]
        if b".npy" in inside:
            return _NPZ
        return next((kind for name, kind in _ZIPPED.items() if inside.startswith(name)), _ZIP)
    return _PICKLE if _PICKLE_START.match(start) else None


def text_format(start: bytes) -> Format | None:
    """The format of a text file that is no table: JSON, XML or HTML; None where it may be one."""
    return next((kind for pattern, kind in _TEXT_FORMATS.items() if pattern.match(start)), None)


def format_of(path: str | os.PathLike) -> Format | None:
    """The format of a file by its content; None where it may be text. Raises InputError as `open_regular`."""
    with open_regular(path) as stream:
        return file_format(stream.read(256))


@contextlib.contextmanager
def open_regular(path: str | os.PathLike) -> Iterator[BinaryIO]:
    """A regular file, opened to read bytes.

    Raises InputError when the path is missing, a folder, a pipe or device, or unreadable, now or while it is read.
    """
    path = Path(path)
    try:
        with open(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)), "rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            if not stat.S_ISREG(mode):
                kind = "a folder" if stat.S_ISDIR(mode) else "not a regular file (a pipe or a device)"
                raise InputError("cannot read it", got=kind, expected="a file", where=str(path))
            yield file
    except FileNotFoundError:
        remedy = "check the spelling and the folder"
        if "=" in "".join(path.parts[:1]):  # `--assume d=V a=rad`: one of two
            remedy = "if it is a value of an option, write the option before it too, as before the first one"
        raise InputError("no such file", remedy=remedy, where=str(path)) from None
    except IsADirectoryError:
        raise InputError("cannot read it", got="a folder", expected="a file", where=str(path)) from None
    except (PermissionError, NotADirectoryError) as error:
        raise InputError("cannot read it", got=error.strerror, where=str(path)) from None
    except (OSError, ValueError) as error:
        raise InputError("cannot open it", got=str(error), expected="a file name", where=str(path)[:80]) from None


def pieces(stream: BinaryIO, size: int) -> Iterator[bytes]:
    """The first `size` bytes from where a stream stands, piece by piece: what a file that grows held when opened."""
    while size > 0 and (block := stream.read(min(size, PIECE_BYTES))):
        size -= len(block)
        yield block


def growth(stream: BinaryIO, size: int, owner: str = "") -> tuple[str, ...]:
    """What is to be said of a file that no longer is as long as when it was opened: `size` bytes; else nothing."""
    now = os.fstat(stream.fileno()).st_size
    if now == size:
        return ()
    verb = "grew" if now > size else "shrank"
    return (f"{owner or 'the file'} {verb} while it was read, from {size} to {now} bytes: is it still being written?",)


def read_bytes(path: str | os.PathLike, max_bytes: int = MAX_TEXT_BYTES) -> bytes:
    """The content of a regular file of at most `max_bytes`.

    Raises InputError when the path is missing, a folder, a pipe or device, unreadable, empty or too large.
    """
    with open_regular(path) as stream:
        content = stream.read(max_bytes + 1)
    if not content:
        raise empty(path)
    if len(content) > max_bytes:
        raise too_large(path, max_bytes)
    return content


def empty(path: object) -> InputError:
    """For a file that holds nothing."""
    return InputError(
        "the file is empty",
        got="0 bytes",
        expected="a file with content",
        remedy="copy or make it once more",
        where=str(path),
    )


def too_large(path: str | os.PathLike, max_bytes: int, remedy: str = "") -> InputError:
    """The error of a file beyond a limit."""
    return InputError(
        "the file is too large",
        got=f"more than {max_bytes} bytes",
        expected=f"at most {max_bytes} bytes",
        remedy=remedy,
        where=str(path),
    )


def default_max_bytes() -> int:
    """How much of a file may be held at once: a quarter of the memory that this process may use [bytes]."""
    limits = [2**33]
    with contextlib.suppress(OSError, ValueError, AttributeError):
        limits = [os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")]
    with contextlib.suppress(OSError, ValueError):  # of a container
        limits.append(int(Path("/sys/fs/cgroup/memory.max").read_text()))
    return max(1, min(limits)) // 4


def read_text(path: str | os.PathLike, max_bytes: int = MAX_TEXT_BYTES) -> str:
    """The text of a UTF-8 (a byte order mark is fine) or Latin-1 file; refuses binary files by what they are."""
    content = read_bytes(path, max_bytes)
    kind = file_format(content[:256])
    if kind is not None:
        raise InputError("this is not a text file", got=kind.words, expected="text", where=str(path))
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    elif b"\0" in content:
        raise InputError("this is not a text file", got="zero bytes in it", expected="text", where=str(path))
    else:
        encoding = "utf-8-sig"
    try:
        return content.decode(encoding)
    except UnicodeDecodeError:
        return content.decode("latin-1")


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """The tables of a TOML text. Raises InputError for what is none, and for a dotted key that nests too deeply.

    The parser keeps every beginning of a dotted key: one of 40 kB costs gigabytes, so it is refused before.
    """
    deep = _DEEP_KEY.search(text)
    if deep is not None:
        line = text.count("\n", 0, deep.start() + 1) + 1
        key, expected = deep[0].strip(" \t\n[{,"), f"at most {MAX_KEY_PARTS} parts"
        raise InputError("a key nests too deeply", got=key, expected=expected, where=f"{where}:{line}")
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise InputError("not valid TOML", got=str(error), remedy="correct that line", where=where) from None


def check_output(path: str | os.PathLike, force: bool = False) -> Path:
    """Refuse, before any work is done, a place where the result could not be written in the end."""
    path = Path(path)
    place = _behind_links(path)
    if place.is_dir():
        raise InputError("cannot write the result there", got="a folder", expected="a file name", where=str(path))
    if place.exists() and not place.is_file():
        raise InputError(
            "cannot write the result there",
            got="no regular file (a pipe, a socket or a device)",
            expected="a file name",
            where=str(path),
        )
    if place.exists() and not force:
        raise InputError("the file exists already", remedy="use `force` to replace it", where=str(path))
    folder = place.parent
    if not folder.is_dir():
        raise InputError(
            "the folder does not exist", got=str(folder), remedy=f"mkdir -p {shlex.quote(str(folder))}", where=str(path)
        )
    if not os.access(folder, os.W_OK):
        raise InputError("the folder is not writable", got=str(folder), where=str(path))
    return path


def _behind_links(path: Path) -> Path:
    """The place that a path leads to: what stands behind a symbolic link, be it there or not. Raises InputError."""
    try:
        os.stat(path)
    except (FileNotFoundError, PermissionError, NotADirectoryError):
        pass
    except (OSError, ValueError) as error:  # a name that is too long, or that holds a zero byte; links in a circle
        circle = isinstance(error, OSError) and error.errno == errno.ELOOP
        problem, expected = ("links in a circle", "a file") if circle else ("not a file name", "a shorter name")
        raise InputError(problem, got=str(path), expected=expected, where=str(error)) from None
    return Path(os.path.realpath(path)) if path.is_symlink() else path


def keep_apart(outputs: Iterable[str | os.PathLike], inputs: Iterable[str | os.PathLike] = ()) -> None:
    """Refuse, `force` or not, one file for two outputs, and an output that is an input of the same work.

    The first would lose a result and the second what it was made from. Links are followed. Empty names are none.
    Raises InputError.
    """
    replaced = {_identity(path): ("the result would replace its own input", path) for path in inputs if path}
    for path in (path for path in outputs if path):
        place = _identity(path)
        if place in replaced:
            problem, conflict = replaced[place]
            raise InputError(problem, got=str(conflict), expected="another name", where=str(path))
        replaced[place] = ("two results in one file", path)


def _identity(path: str | os.PathLike) -> object:
    """What two names of one file have in common."""
    with contextlib.suppress(OSError, ValueError):
        status = os.stat(path)
        return (status.st_dev, status.st_ino)
    with contextlib.suppress(OSError, ValueError):
        return os.path.normcase(os.path.realpath(path))
    return os.fspath(path)


def write_atomic(path: str | os.PathLike, content: str | bytes, force: bool = False) -> Path:
    """Write a file whole or not at all: a temporary file beside it, flushed to disk, then renamed.

    A link stays and what it leads to is written; a file that is replaced hands on who may read it. Raises InputError
    when it exists (unless `force`), is no regular file, its folder is missing or not writable, or the disk is full.
    """
    # A name of a file may hold bytes that are no text: they are shown as escapes.
    data = content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content
    with open_atomic(path, force) as stream:
        stream.write(data)
    return Path(path)


@contextlib.contextmanager
def open_atomic(path: str | os.PathLike, force: bool = False) -> Iterator[BinaryIO]:
    """A stream whose content becomes the file at its end, as `write_atomic` does it; nothing where an error leaves it.

    Raises InputError as `write_atomic`, also for an OSError within.
    """
    path = check_output(path, force)
    place = _behind_links(path)
    _remove_stale(place.parent)
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(prefix=TEMPORARY_PREFIX, dir=place.parent)
        with open(handle, "wb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        _hand_on(place, temporary)
        if force:
            os.replace(temporary, place)
        else:
            _rename_new(temporary, place)
    except FileExistsError:
        raise InputError(
            "the file exists already",
            got="another process made it meanwhile",
            remedy="use `force` to replace it",
            where=str(path),
        ) from None
    except OSError as error:
        raise InputError("cannot write it", got=error.strerror or str(error), where=str(path)) from None
    finally:
        if temporary is not None:
            with contextlib.suppress(OSError):
                os.unlink(temporary)


def _hand_on(place: Path, temporary: str) -> None:
    """Give a new file the mode, and where we may the owner, of the one that it replaces; else the usual mode."""
    try:
        before = os.stat(place)
    except FileNotFoundError:
        os.chmod(temporary, 0o666 & ~_umask())
        return
    with contextlib.suppress(OSError, AttributeError):  # not ours to give, or a system without owners
        os.chown(temporary, before.st_uid, before.st_gid)
    os.chmod(temporary, stat.S_IMODE(before.st_mode))


def _rename_new(temporary: str, path: Path) -> None:
    """Give the file its name only where nothing has it; a link does so in one step where links exist."""
    try:
        os.link(temporary, path)
    except FileExistsError:
        raise
    except OSError:
        os.rename(temporary, path) if os.name == "nt" else os.replace(temporary, path)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


_CLEANED: dict[Path, float] = {}  # folder -> when this process cleaned it last: a list of ten thousand files takes time


def _remove_stale(folder: Path) -> None:
    """Clean up what a killed process left behind; a young file may belong to a process still at work."""
    now = time.monotonic()
    if now - _CLEANED.get(folder, -math.inf) < STALE_TEMPORARY_S:
        return
    _CLEANED[folder] = now
    for leftover in folder.glob(TEMPORARY_PREFIX + "*"):
        with contextlib.suppress(OSError):
            if time.time() - leftover.stat().st_mtime > STALE_TEMPORARY_S:
                leftover.unlink()


def sha256(content: bytes | str) -> str:
    """Hexadecimal SHA-256 of a file's content, for the record of what a result was made from."""
    return hashlib.sha256(content.encode("utf-8") if isinstance(content, str) else content).hexdigest()


def file_sha256(path: str | os.PathLike) -> str:
    """Hexadecimal SHA-256 of a regular file of any size."""
    digest = hashlib.sha256()
    with open_regular(path) as stream:
        for piece in pieces(stream, os.path.getsize(path)):
            digest.update(piece)
    return digest.hexdigest()
