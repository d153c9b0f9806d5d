"""Reading and writing files so that a bad one never hurts: bounded reads, atomic writes."""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
import tempfile
import time
from pathlib import Path

from omnidyn.errors import InputError

MAX_TEXT_BYTES = 64 * 2**20
STALE_TEMPORARY_S = 3600.0
TEMPORARY_PREFIX = ".tmp-omnidyn-"

# Files that people hand over by mistake, told by their first bytes.
_MAGIC = {
    b"PAR1": "a Parquet file",
    b"PK\x03\x04": "a zip archive (also .npz, .xlsx)",
    b"\x93NUMPY": "a NumPy .npy file",
    b"\x89MCAP0\r\n": "an MCAP recording",
    b"SQLite format 3\x00": "an SQLite database (a ROS 2 .db3 bag)",
    b"\x89HDF\r\n\x1a\n": "an HDF5 file (also MATLAB v7.3)",
    b"MATLAB 5.0 MAT-file": "a MATLAB .mat file",
    b"\x1f\x8b": "a gzip archive",
    b"\x80\x04\x95": "a Python pickle",
    b"#ROSBAG V": "a ROS 1 bag",
    b"WPILOG": "a WPILib data log",
}


def read_bytes(path: str | os.PathLike, max_bytes: int = MAX_TEXT_BYTES) -> bytes:
    """The content of a regular file of at most `max_bytes`.

    Raises InputError when the path is missing, a folder, a pipe or device, unreadable, empty or too large.
    """
    path = Path(path)
    try:
        with open(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)), "rb") as stream:
            mode = os.fstat(stream.fileno()).st_mode
            if not stat.S_ISREG(mode):
                kind = "a folder" if stat.S_ISDIR(mode) else "not a regular file (a pipe or a device)"
                raise InputError("cannot read it", got=kind, expected="a file", where=str(path))
            content = stream.read(max_bytes + 1)
    except FileNotFoundError:
        raise InputError("no such file", remedy="check the spelling and the folder", where=str(path)) from None
    except IsADirectoryError:
        raise InputError("cannot read it", got="a folder", expected="a file", where=str(path)) from None
    except (PermissionError, NotADirectoryError) as error:
        raise InputError("cannot read it", got=error.strerror, where=str(path)) from None
    except (OSError, ValueError) as error:
        raise InputError("cannot open it", got=str(error), expected="a file name", where=str(path)[:80]) from None
    if not content:
        raise InputError("the file is empty", got="0 bytes", where=str(path))
    if len(content) > max_bytes:
        raise InputError(
            "the file is too large",
            got=f"more than {max_bytes} bytes",
            expected=f"at most {max_bytes} bytes",
            where=str(path),
        )
    return content


def read_text(path: str | os.PathLike, max_bytes: int = MAX_TEXT_BYTES) -> str:
    """The text of a UTF-8 (a byte order mark is fine) or Latin-1 file; refuses binary files by what they are."""
    content = read_bytes(path, max_bytes)
    for magic, kind in _MAGIC.items():
        if content.startswith(magic):
            raise InputError("this is not a text file", got=kind, expected="text", where=str(path))
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


def check_output(path: str | os.PathLike, force: bool = False) -> Path:
    """Refuse, before any work is done, a place where the result could not be written in the end."""
    path = Path(path)
    try:
        os.stat(path)
    except (OSError, ValueError) as error:  # a name that is too long, or that holds a zero byte
        if not isinstance(error, FileNotFoundError | PermissionError | NotADirectoryError):
            raise InputError("not a file name", got=str(path), expected="a shorter name", where=str(error)) from None
    if path.is_dir():
        raise InputError("cannot write the result there", got="a folder", expected="a file name", where=str(path))
    if path.exists() and not force:
        raise InputError("the file exists already", remedy="use --force to replace it", where=str(path))
    folder = path.parent
    if not folder.is_dir():
        raise InputError("the folder does not exist", got=str(folder), remedy=f"mkdir -p {folder}", where=str(path))
    if not os.access(folder, os.W_OK):
        raise InputError("the folder is not writable", got=str(folder), where=str(path))
    return path


def write_atomic(path: str | os.PathLike, content: str | bytes, force: bool = False) -> Path:
    """Write a file whole or not at all: a temporary file beside it, flushed to disk, then renamed.

    Raises InputError when it exists (unless `force`), its folder is missing or not writable, or the disk is full.
    """
    path = check_output(path, force)
    _remove_stale(path.parent)
    data = content.encode("utf-8") if isinstance(content, str) else content
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(prefix=TEMPORARY_PREFIX, dir=path.parent)
        with open(handle, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(temporary, 0o666 & ~_umask())
        if force:
            os.replace(temporary, path)
        else:
            _rename_new(temporary, path)
    except FileExistsError:
        raise InputError(
            "the file exists already",
            got="another process made it meanwhile",
            remedy="use --force to replace it",
            where=str(path),
        ) from None
    except OSError as error:
        raise InputError("cannot write it", got=error.strerror or str(error), where=str(path)) from None
    finally:
        if temporary is not None:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
    return path


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


def _remove_stale(folder: Path) -> None:
    """Clean up what a killed process left behind; a young file may belong to a process still at work."""
    for leftover in folder.glob(TEMPORARY_PREFIX + "*"):
        with contextlib.suppress(OSError):
            if time.time() - leftover.stat().st_mtime > STALE_TEMPORARY_S:
                leftover.unlink()


def sha256(content: bytes | str) -> str:
    """Hexadecimal SHA-256 of a file's content, for the record of what a result was made from."""
    return hashlib.sha256(content.encode("utf-8") if isinstance(content, str) else content).hexdigest()
