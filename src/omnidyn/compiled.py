"""The one way to compile a kernel: native code, without the GIL, with a disk cache that is never stale.

numba's disk cache looks only at the file in which a kernel stands: edit a formula that the kernel calls from
another file, and the old machine code is served without a word. Here every cache entry is stamped with a hash of
all sources of the package. Where no folder is writable the kernel is compiled in memory. `parallel=True` is never
used: its thread pools break under fork and under user threads; use threads over blocks instead.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import event
from numba.core.options import DefaultOptions

PACKAGE = Path(__file__).resolve().parent
PIECES_TRIED = (0, 68)  # the newest numba whose insides pieces.py is known to fit
ERROR_MODEL = "numpy"  # a division by zero gives inf or nan, as in NumPy, and needs no branch


@cache
def source_hash() -> str:
    """SHA-256 over the names and contents of all Python files of the package."""
    digest = hashlib.sha256()
    for file in sorted(PACKAGE.rglob("*.py")):
        digest.update(file.relative_to(PACKAGE).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


# numba counts who holds an array: it adds and removes one, atomically, around nearly every call that has a branch. In
# small functions of arithmetic that costs three times as much as the rest. `_nrt` is private to numba: a test watches.
KNOWN = hasattr(DefaultOptions, "_nrt")
COUNTED: dict[str, Any] = {"_nrt": True} if KNOWN else {}
UNCOUNTED: dict[str, Any] = {"_nrt": False} if KNOWN else {}


class _Compiling(event.Listener):
    """Hears of every function that numba compiles, those inside of others too."""

    def __init__(self):
        self.under_way = 0

    def on_start(self, event: Any) -> None:
        self.under_way += 1

    def on_end(self, event: Any) -> None:
        self.under_way -= 1


_compiling = _Compiling()
event.register("numba:compile", _compiling)


def compiling() -> bool:
    """Whether a kernel is being compiled just now, in any thread: what else is waited for then stands still."""
    return _compiling.under_way > 0


def part(function: Callable[..., Any]) -> Callable[..., Any]:
    """A piece of a kernel: compiled into the kernels that call it, never cached by itself.

    It works in arrays that its kernel holds, and does not count who holds them: numba lets it neither make nor return
    one.
    """
    return _piece(function, UNCOUNTED)


def maker(function: Callable[..., Any]) -> Callable[..., Any]:
    """A piece of a kernel that makes arrays, for kernels and other makers: a part would never let go of them."""
    return _piece(function, COUNTED)


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """An entry point: compiled without the GIL; its cache entry belongs to all sources of the package."""
    try:
        compiled = _native(function)
        compiled.enable_caching()
        _stamp(compiled)
    except (RuntimeError, AttributeError):  # no writable folder, or a numba whose cache we do not know
        return _native(function)
    return compiled


@cache
def _piece_class() -> Any:
    """Piece; None with a numba that we do not know: it compiles in its own way, and a first run takes twice as long."""
    if numba.version_info.short > PIECES_TRIED:
        return None
    try:
        from omnidyn.pieces import Piece
    except ImportError:
        return None
    return Piece


def _piece(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """A piece of kernels; where numba is switched off, for debuggers, the function itself."""
    whole = numba.njit(error_model=ERROR_MODEL, **options)(function)
    piece = _piece_class()
    return piece(whole) if piece is not None and whole is not function else whole


def _native(function: Callable[..., Any]) -> Any:
    options: dict[str, Any] = {"nogil": True, "error_model": ERROR_MODEL, "no_cfunc_wrapper": True}
    return numba.njit(**options)(function)


def _stamp(compiled: Any) -> None:
    """Tie the cache entry to `source_hash`. The attribute is private to numba: a test watches over it."""
    index = compiled._cache._cache_file
    index._source_stamp = (index._source_stamp, source_hash())
